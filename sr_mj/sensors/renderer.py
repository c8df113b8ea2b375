"""Render colour, depth and segmentation from the named cameras of a compiled model."""

from collections.abc import Sequence
from types import TracebackType
from typing import Self

import mujoco
import numpy as np

from models.camera_mjcf import principal_offset_px
from models.cameras import CameraPlacement
from sr_mj.errors import ConfigError, SceneError, UnknownNameError, unknown_name_message
from sr_mj.sensors.offscreen import OffscreenContext

_NUM_VISUAL_GROUPS = 3
_GL_FROM_CV = np.diag([1.0, -1.0, -1.0])
_DRAWN = mujoco.mjtCatBit.mjCAT_STATIC.value | mujoco.mjtCatBit.mjCAT_DYNAMIC.value
_INTRINSICS_TOLERANCE_PX = 1e-2
_Flag = mujoco.mjtRndFlag
# With shadows and reflections a view of 15 objects takes three times as long in software.
_COSTLY_FLAGS = [_Flag.mjRND_SHADOW.value, _Flag.mjRND_REFLECTION.value, _Flag.mjRND_HAZE.value]
_SKY_FLAGS = [_Flag.mjRND_SKYBOX.value]
_SEGMENTATION_FLAGS = [_Flag.mjRND_SEGMENT.value, _Flag.mjRND_IDCOLOR.value]


class CameraRig:
    """The cameras of a scene, ready to take pictures.

    Shows geoms of groups 0 to 2 (collision geoms are in group 3), no sites, no decoration, no
    shadows and no reflections. One rig serves one compiled model; make a new one after
    recompiling. Not for use from several threads.

    Example:
        with CameraRig(model, camera_preset("sr")) as rig:
            rgb, depth_m = rig.render(data, "top")
    """

    def __init__(self, model: mujoco.MjModel, cameras: Sequence[CameraPlacement]) -> None:
        """Check the model's cameras against their placements and open the renderer.

        Args:
            model: A compiled model that holds every camera under its name, with the sensor's
                intrinsics, as `models.camera_mjcf.add_cameras` writes them.
            cameras: The cameras, in the order in which views are wanted.

        Raises:
            ConfigError: If no camera is given.
            UnknownNameError: If the model has no camera of a given name.
            SceneError: If a camera's intrinsics in the model are not those of its sensor, or if
                the near plane would cut off what the sensor sees.
            RenderError: If no graphics library renders here.
        """
        if not cameras:
            raise ConfigError("Got no cameras, expected at least one.")
        self._model = model
        self._cameras = {camera.name: camera for camera in cameras}
        self._ids = {name: _camera_id(model, name) for name in self._cameras}
        for name, camera in self._cameras.items():
            _check_camera(model, self._ids[name], camera)

        self._scene = mujoco.MjvScene(model, maxgeom=model.ngeom + 100)
        self._scene.flags[_COSTLY_FLAGS + _SKY_FLAGS] = False
        self._has_sky = mujoco.mjtTexture.mjTEXTURE_SKYBOX.value in model.tex_type
        self._visibility = mujoco.MjvOption()
        self._visibility.geomgroup[:] = np.arange(mujoco.mjNGROUP) < _NUM_VISUAL_GROUPS
        self._visibility.sitegroup[:] = False
        self._context = OffscreenContext(
            model,
            max(camera.sensor.width for camera in cameras),
            max(camera.sensor.height for camera in cameras),
        )

    @property
    def cameras(self) -> tuple[CameraPlacement, ...]:
        """Return the cameras in order."""
        return tuple(self._cameras.values())

    def render(self, data: mujoco.MjData, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Take a noise-free picture.

        Args:
            data: State of the rig's model, after `mj_forward` or a step.
            name: Name of the camera.

        Returns:
            rgb (H, W, 3) uint8 and depth_m (H, W) float32: the distance along the optical axis in
            metres, 0 where the ray hits nothing.

        Raises:
            UnknownNameError: If the rig has no such camera.
            RenderError: If the rig is closed.
        """
        sensor = self._aim(data, name).sensor
        rgb = np.empty((sensor.height, sensor.width, 3), np.uint8)
        depth_buffer = np.empty((sensor.height, sensor.width), np.float32)
        self._context.draw(self._scene, sensor.width, sensor.height, rgb=rgb, depth=depth_buffer)
        if self._has_sky and not depth_buffer.all():
            # MuJoCo's skybox writes depth like a solid: draw it only when depth has been read.
            self._draw_with(_SKY_FLAGS, rgb)
        frustum = self._scene.camera[0]
        depth_m = _linear_depth(depth_buffer, frustum.frustum_near, frustum.frustum_far)
        return np.ascontiguousarray(rgb[::-1]), np.ascontiguousarray(depth_m[::-1])

    def render_body_ids(self, data: mujoco.MjData, name: str) -> np.ndarray:
        """Tell which body every pixel shows: ground truth, for the expert and evaluation only.

        Args:
            data: State of the rig's model, after `mj_forward` or a step.
            name: Name of the camera.

        Returns:
            (H, W) int32 ids of bodies in the model; -1 where there is nothing.

        Raises:
            UnknownNameError: If the rig has no such camera.
            RenderError: If the rig is closed.
        """
        sensor = self._aim(data, name).sensor
        colors = np.empty((sensor.height, sensor.width, 3), np.uint8)
        self._draw_with(_SEGMENTATION_FLAGS, colors)
        # MuJoCo writes segid + 1 as a colour, red the lowest byte; black is the background.
        segments = colors[::-1].astype(np.int32) @ np.array([1, 1 << 8, 1 << 16], np.int32)
        return self._body_of_segment()[segments]

    def T_world_cam_cv(self, data: mujoco.MjData, name: str) -> np.ndarray:
        """Return a camera's pose in the world, (4, 4) float64, OpenCV axes, from the model's state.

        Args:
            data: State of the rig's model, after `mj_forward` or a step.
            name: Name of the camera.

        Raises:
            UnknownNameError: If the rig has no such camera.
        """
        camera_id = self._ids[self._camera(name).name]
        pose = np.eye(4)
        pose[:3, :3] = data.cam_xmat[camera_id].reshape(3, 3) @ _GL_FROM_CV
        pose[:3, 3] = data.cam_xpos[camera_id]
        return pose

    def close(self) -> None:
        """Free the renderer; calling it again does nothing."""
        self._context.close()

    def __enter__(self) -> Self:
        """Return the rig itself."""
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Free the renderer."""
        self.close()

    def _camera(self, name: str) -> CameraPlacement:
        if name not in self._cameras:
            raise UnknownNameError(unknown_name_message("camera", name, self._cameras))
        return self._cameras[name]

    def _aim(self, data: mujoco.MjData, name: str) -> CameraPlacement:
        """Fill the abstract scene with what a camera sees."""
        camera = self._camera(name)
        view = mujoco.MjvCamera()
        view.type = mujoco.mjtCamera.mjCAMERA_FIXED
        view.fixedcamid = self._ids[name]
        mujoco.mjv_updateScene(self._model, data, self._visibility, None, view, _DRAWN, self._scene)
        return camera

    def _draw_with(self, flags: list[int], rgb: np.ndarray) -> None:
        """Draw the scene's colours with some of its rendering flags set, for this once."""
        height, width = rgb.shape[:2]
        self._scene.flags[flags] = True
        try:
            self._context.draw(self._scene, width, height, rgb=rgb)
        finally:
            self._scene.flags[flags] = False

    def _body_of_segment(self) -> np.ndarray:
        """Map segment colours (segid + 1) to bodies, -1 for the background."""
        bodies = np.full(self._scene.ngeom + 1, -1, np.int32)
        for geom in self._scene.geoms[: self._scene.ngeom]:
            if geom.segid >= 0 and geom.objtype == mujoco.mjtObj.mjOBJ_GEOM:
                bodies[geom.segid + 1] = self._model.geom_bodyid[geom.objid]
        return bodies


def _linear_depth(depth_buffer: np.ndarray, near_m: float, far_m: float) -> np.ndarray:
    """Turn a reversed depth buffer into metres along the optical axis, 0 for the far plane.

    A perspective projection with reversed z stores b = (n f / z - n) / (f - n). Solved for z, all
    terms are positive, so that float32 loses nothing to cancellation.
    """
    near, far = np.float32(near_m), np.float32(far_m)
    depth_m = near * far / (near + depth_buffer * (far - near))
    depth_m[depth_buffer == 0] = 0
    return depth_m


def _camera_id(model: mujoco.MjModel, name: str) -> int:
    camera_id = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA.value, name)
    if camera_id < 0:
        names = [model.camera(index).name for index in range(model.ncam)]
        raise UnknownNameError(unknown_name_message("camera", name, names))
    return camera_id


def _check_camera(model: mujoco.MjModel, camera_id: int, camera: CameraPlacement) -> None:
    """Refuse a model that would render with another pinhole model than the sensor's."""
    sensor = camera.sensor
    resolution = model.cam_resolution[camera_id]
    size = model.cam_sensorsize[camera_id]
    pixels_per_m = resolution / size if size.all() else np.zeros(2)
    got = model.cam_intrinsic[camera_id] * np.tile(pixels_per_m, 2)
    expected = np.array([sensor.fx, sensor.fy, *principal_offset_px(sensor)])
    if tuple(resolution) != (sensor.width, sensor.height) or not np.allclose(
        got, expected, rtol=0, atol=_INTRINSICS_TOLERANCE_PX
    ):
        raise SceneError(
            f"Camera {camera.name!r} of the model has resolution {resolution.tolist()} and focal "
            f"length and principal offset {got.round(2).tolist()} px, expected "
            f"{[sensor.width, sensor.height]} and {expected.round(2).tolist()}. "
            "Write cameras with models.camera_mjcf.add_cameras."
        )
    near_m = model.vis.map.znear * model.stat.extent
    if near_m > sensor.range_m[0]:
        raise SceneError(
            f"The near plane at {near_m:.3f} m cuts off what camera {camera.name!r} sees from "
            f"{sensor.range_m[0]} m on. Lower visual.map.znear or statistic.extent."
        )
