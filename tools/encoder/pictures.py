"""Renders training pictures: colours at full size, which object is where at a quarter of it."""

import mujoco
import numpy as np
from PIL import Image

from sr_mj.sensors.offscreen import OffscreenContext
from tools.encoder.stage import SENSOR, Stage

WIDTH, HEIGHT = 960, 544
"""Size of a picture: that to which the encoder resizes those of the sensor."""
ID_STEP = 4
"""Pixels of the picture per pixel of the id map, along each side."""
OTHER_ID, TABLE_ID, FIRST_OBJECT_ID = 0, 1, 2

_Flag = mujoco.mjtRndFlag
_COSTLY = [_Flag.mjRND_SHADOW.value, _Flag.mjRND_REFLECTION.value, _Flag.mjRND_HAZE.value]
_SEGMENTATION = [_Flag.mjRND_SEGMENT.value, _Flag.mjRND_IDCOLOR.value]
_DRAWN = mujoco.mjtCatBit.mjCAT_STATIC.value | mujoco.mjtCatBit.mjCAT_DYNAMIC.value


class Photographer:
    """Takes pictures of one stage."""

    def __init__(self, stage: Stage) -> None:
        """Open the renderer.

        Args:
            stage: The stage.
        """
        self._stage = stage
        self._scene = mujoco.MjvScene(stage.model, maxgeom=stage.model.ngeom + 50)
        self._scene.flags[_COSTLY] = False
        self._visibility = mujoco.MjvOption()
        self._visibility.geomgroup[:] = np.arange(mujoco.mjNGROUP) < 3
        self._context = OffscreenContext(stage.model, SENSOR.width, SENSOR.height)
        self._id_of_body = np.full(stage.model.nbody, OTHER_ID, np.uint8)
        self._id_of_body[list(stage.body_ids)] = FIRST_OBJECT_ID + np.arange(len(stage.body_ids))

    def take(self, data: mujoco.MjData, camera: str) -> tuple[np.ndarray, np.ndarray]:
        """Take a picture.

        Args:
            data: State of the stage, after a forward pass.
            camera: Name of the camera.

        Returns:
            rgb (544, 960, 3) uint8, and ids (136, 240) uint8: the index of the object plus
            `FIRST_OBJECT_ID`, or `TABLE_ID` or `OTHER_ID`.
        """
        model, view = self._stage.model, mujoco.MjvCamera()
        view.type = mujoco.mjtCamera.mjCAMERA_FIXED
        view.fixedcamid = model.camera(camera).id
        mujoco.mjv_updateScene(model, data, self._visibility, None, view, _DRAWN, self._scene)
        rgb = np.empty((SENSOR.height, SENSOR.width, 3), np.uint8)
        self._context.draw(self._scene, SENSOR.width, SENSOR.height, rgb=rgb)
        # The filter is the one with which the encoder resizes.
        small = Image.fromarray(rgb[::-1]).resize((WIDTH, HEIGHT), Image.Resampling.BILINEAR)
        colors = np.empty((HEIGHT // ID_STEP, WIDTH // ID_STEP, 3), np.uint8)
        self._scene.flags[_SEGMENTATION] = True
        self._context.draw(self._scene, WIDTH // ID_STEP, HEIGHT // ID_STEP, rgb=colors)
        self._scene.flags[_SEGMENTATION] = False
        segments = colors[::-1].astype(np.int32) @ np.array([1, 1 << 8, 1 << 16], np.int32)
        return np.asarray(small), self._id_of_segment()[segments]

    def close(self) -> None:
        """Free the renderer."""
        self._context.close()

    def _id_of_segment(self) -> np.ndarray:
        """Map segment colours (segid + 1) to ids."""
        table = np.full(self._scene.ngeom + 1, OTHER_ID, np.uint8)
        model = self._stage.model
        for geom in self._scene.geoms[: self._scene.ngeom]:
            if geom.segid >= 0 and geom.objtype == mujoco.mjtObj.mjOBJ_GEOM:
                is_table = model.geom(geom.objid).name == "table"
                body = model.geom_bodyid[geom.objid]
                table[geom.segid + 1] = TABLE_ID if is_table else self._id_of_body[body]
        return table
