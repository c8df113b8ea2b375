"""Write camera placements into MJCF, with the exact pinhole model of their sensor.

Pixel convention, for the whole project: the centre of pixel (u, v) lies at the integer coordinates
(u, v), as in OpenCV. MuJoCo's symmetric frustum puts the optical axis on the middle of the image
area, which in this convention is ((width - 1) / 2, (height - 1) / 2), half a pixel away from
cx = width / 2. `add_cameras` shifts the frustum by the difference, so that a rendered image has
exactly the `fx, fy, cx, cy` of its `PinholeSensor`, and nobody downstream adds or takes 0.5.
"""

from collections.abc import Sequence
from typing import Any

from dm_control import mjcf

from models.cameras import CameraPlacement, PinholeSensor

# MuJoCo takes lengths on the sensor. Only ratios matter: any pixel pitch renders the same image.
_PIXEL_PITCH_M = 3e-6


def add_cameras(root: mjcf.RootElement, cameras: Sequence[CameraPlacement]) -> None:
    """Add fixed cameras to a world, and enlarge its offscreen buffer to hold their images.

    Args:
        root: The MJCF model to add to; its `visual.global` is changed as well.
        cameras: The cameras, for example `models.cameras.camera_preset("sr")`.
    """
    worldbody: Any = root.worldbody  # dm_control makes its attributes at run time
    for camera in cameras:
        R_world_cam_cv = camera.R_world_cam_cv()
        right, down = R_world_cam_cv[:, 0], R_world_cam_cv[:, 1]
        worldbody.add(
            "camera",
            name=camera.name,
            pos=camera.position,
            xyaxes=(*right, *-down),  # OpenGL axes: y up, looking along -z
            resolution=(camera.sensor.width, camera.sensor.height),
            sensorsize=(
                camera.sensor.width * _PIXEL_PITCH_M,
                camera.sensor.height * _PIXEL_PITCH_M,
            ),
            focalpixel=(camera.sensor.fx, camera.sensor.fy),
            principalpixel=principal_offset_px(camera.sensor),
        )
    buffer = getattr(root.visual, "global")
    buffer.offwidth = max([buffer.offwidth or 0, *(c.sensor.width for c in cameras)])
    buffer.offheight = max([buffer.offheight or 0, *(c.sensor.height for c in cameras)])


def principal_offset_px(sensor: PinholeSensor) -> tuple[float, float]:
    """Return the offset that MuJoCo's `principalpixel` needs for a sensor's principal point.

    A positive offset moves the principal point towards the image's left and top edges.

    Args:
        sensor: The pinhole model, pixel centres at integer coordinates.

    Returns:
        Offsets along x and y in pixels: (-0.5, -0.5) for cx = width / 2 and cy = height / 2.
    """
    return (sensor.width - 1) / 2 - sensor.cx, (sensor.height - 1) / 2 - sensor.cy
