"""Going back to an earlier state of a scene, so that several actions can be tried from it."""

import mujoco

from sr_mj.scene.build import Scene


class SceneState:
    """A copy of everything that the simulation knows: motion, contacts, commands, who sleeps.

    Args:
        scene: The scene whose present state is kept.
    """

    def __init__(self, scene: Scene) -> None:
        """Copy the present state."""
        self._scene = scene
        self._data = mujoco.MjData(scene.model)
        mujoco.mj_copyData(self._data, scene.model, scene.data)

    def restore(self) -> None:
        """Make the scene's state what it was; what happens then is the same as then."""
        mujoco.mj_copyData(self._scene.data, self._scene.model, self._data)
