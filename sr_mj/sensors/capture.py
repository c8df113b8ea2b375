"""Take the views of a scene: render every camera of a rig, then add the sensor's noise."""

import mujoco
import numpy as np

from models.cameras import PinholeSensor
from perception.views import CameraView, Intrinsics
from sr_mj.sensors.l515 import L515NoiseConfig, apply_depth_noise, apply_rgb_noise
from sr_mj.sensors.renderer import CameraRig


def capture_views(
    rig: CameraRig,
    data: mujoco.MjData,
    noise: L515NoiseConfig,
    rng: np.random.Generator,
) -> tuple[CameraView, ...]:
    """Photograph a scene with every camera of a rig.

    Args:
        rig: The cameras, opened on the scene's compiled model.
        data: State of that model, after `mj_forward` or a step. Not changed.
        noise: Sensor noise; `L515NoiseConfig.off()` for perfect images.
        rng: Source of randomness; advances by the same amount whatever is switched on.

    Returns:
        The views in the rig's order, poses taken from the state, intrinsics from the sensor.

    Raises:
        RenderError: If the rig is closed.
    """
    views = []
    for camera in rig.cameras:
        rgb, depth_m = rig.render(data, camera.name)
        views.append(
            CameraView(
                name=camera.name,
                rgb=apply_rgb_noise(rgb, noise, rng),
                depth_m=apply_depth_noise(depth_m, rgb, camera.sensor, noise, rng),
                intrinsics=_intrinsics(camera.sensor),
                T_world_cam_cv=rig.T_world_cam_cv(data, camera.name),
            )
        )
    return tuple(views)


def _intrinsics(sensor: PinholeSensor) -> Intrinsics:
    return Intrinsics(
        fx=sensor.fx,
        fy=sensor.fy,
        cx=sensor.cx,
        cy=sensor.cy,
        width=sensor.width,
        height=sensor.height,
    )
