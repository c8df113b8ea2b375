"""Where the objects of a training picture lie, and in which light."""

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from models.tabletop import TABLE_GEOM
from tools.encoder.stage import Stage

_CENTER = (0.5, 0.0)
_AWAY_M = 20.0
_DROP_STEPS = 140
_DROP_GAP_M = 0.045
# Half of the pictures show the light in which scenes are simulated.
_PLAIN_SHARE = 0.5


def scatter(stage: Stage, rng: np.random.Generator) -> mujoco.MjData:
    """Put some of the objects on the table: side by side, or dropped into a heap.

    Args:
        stage: The stage.
        rng: Source of randomness.

    Returns:
        The state, after a forward pass. Objects that are not shown hang high over the cameras.
    """
    data = mujoco.MjData(stage.model)
    count = int(rng.integers(3, 16))
    shown = rng.permutation(len(stage.assets))[:count]
    for index, address in enumerate(stage.qpos_adr):
        data.qpos[address : address + 3] = (0, 0, _AWAY_M + index)
    is_heap = rng.random() < 0.6
    places = _heap_places(rng, count) if is_heap else _free_places(stage, rng, shown)
    height = 0.0
    for index, place in zip(shown, places, strict=False):
        asset, turn = stage.assets[index], _draw_turn(rng)
        z = asset.vertices @ turn.as_matrix()[2]
        address = stage.qpos_adr[index]
        data.qpos[address : address + 3] = (*place, height - z.min() + 0.001)
        data.qpos[address + 3 : address + 7] = turn.as_quat(scalar_first=True)
        height += (_DROP_GAP_M + 0.3 * np.ptp(z)) if is_heap else 0.0
    if is_heap:
        mujoco.mj_step(stage.model, data, _DROP_STEPS)
    mujoco.mj_forward(stage.model, data)
    return data


def _draw_turn(rng: np.random.Generator) -> Rotation:
    """Draw an orientation: upright, lying on a side, or any."""
    yaw = Rotation.from_euler("z", rng.uniform(0, 2 * np.pi))
    kind = rng.random()
    if kind < 0.5:
        return yaw
    if kind < 0.85:
        return (
            yaw
            * Rotation.from_euler("x", np.pi / 2)
            * Rotation.from_euler("z", rng.integers(4) * np.pi / 2)
        )
    return Rotation.random(rng=rng)


def _heap_places(rng: np.random.Generator, count: int) -> np.ndarray:
    spread = rng.uniform(0.05, 0.17)
    return np.clip(rng.normal(_CENTER, spread, (count, 2)), (0.28, -0.22), (0.72, 0.22))


def _free_places(stage: Stage, rng: np.random.Generator, shown: np.ndarray) -> np.ndarray:
    """Draw places for as many objects as find room; larger ones may touch."""
    half = np.array([0.25, 0.3]) * rng.uniform(0.5, 1)
    places: list[np.ndarray] = []
    radii: list[float] = []
    for index in shown:
        radius = 0.4 * float(np.linalg.norm(stage.assets[index].size_m[:2]))
        for _ in range(30):
            place = np.asarray(_CENTER) + rng.uniform(-half, half)
            gaps = [
                np.linalg.norm(place - p) - r - radius for p, r in zip(places, radii, strict=True)
            ]
            if min(gaps, default=1.0) > 0:
                break
        places.append(place)
        radii.append(radius)
    return np.array(places)


class Lighting:
    """Changes light and table colour of a stage, and puts them back."""

    def __init__(self, model: mujoco.MjModel) -> None:
        """Remember a model's light.

        Args:
            model: The model, changed in place later.
        """
        self._model = model
        self._table = int(model.geom(TABLE_GEOM).id)
        self._original = (
            model.light_dir.copy(),
            model.light_diffuse.copy(),
            model.geom_rgba[self._table].copy(),
            model.vis.headlight.ambient.copy(),
            model.vis.headlight.diffuse.copy(),
        )

    def draw(self, rng: np.random.Generator) -> None:
        """Draw a light and a table colour; in half of the cases the model's own."""
        model = self._model
        directions, diffuse, table, ambient, headlight = self._original
        model.light_dir[:], model.light_diffuse[:] = directions, diffuse
        model.geom_rgba[self._table] = table
        model.vis.headlight.ambient[:], model.vis.headlight.diffuse[:] = ambient, headlight
        if rng.random() < _PLAIN_SHARE:
            return
        turned = directions + rng.normal(0, 0.4, directions.shape)
        turned[:, 2] = -np.abs(turned[:, 2])
        model.light_dir[:] = turned / np.linalg.norm(turned, axis=1, keepdims=True)
        tint = 1 + rng.uniform(-0.08, 0.08, 3)
        model.light_diffuse[:] = diffuse * rng.uniform(0.4, 1.7, (len(diffuse), 1)) * tint
        model.vis.headlight.ambient[:] = ambient * rng.uniform(0.6, 1.3) * tint
        model.vis.headlight.diffuse[:] = headlight * rng.uniform(0.3, 2.0)
        shade = rng.uniform(0.05, 1.0) * (1 + rng.uniform(-0.35, 0.35, 3))
        model.geom_rgba[self._table, :3] = np.clip(shade, 0.02, 1)
