"""Named camera presets: where the sensors stand, and their pinhole model.

Presets are data; `models.tabletop` writes them into MJCF and `sr_mj.sensors` renders them.
"""

import difflib
from dataclasses import dataclass

import numpy as np

from models.errors import UnknownNameError

WORKSPACE_CENTER = (0.5, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class PinholeSensor:
    """Image size and pinhole intrinsics of a sensor, in pixels.

    Attributes:
        width: Image width.
        height: Image height.
        fx: Focal length along the image's x axis.
        fy: Focal length along the image's y axis.
        cx: Principal point, x.
        cy: Principal point, y.
        range_m: Nearest and farthest depth that the sensor reports, in metres.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    range_m: tuple[float, float]

    @property
    def fovy_deg(self) -> float:
        """Vertical field of view in degrees, as MuJoCo wants it."""
        return float(np.degrees(2 * np.arctan2(self.height / 2, self.fy)))


# Intel RealSense L515, 1280x720, as simulated in the protocol that the paper follows; a real
# unit calibrates near fx = fy = 907.6, cx = 649.6, cy = 376.1.
L515 = PinholeSensor(
    width=1280, height=720, fx=914.01, fy=914.01, cx=640.0, cy=360.0, range_m=(0.25, 9.0)
)


@dataclass(frozen=True, kw_only=True)
class CameraPlacement:
    """A camera in the world.

    Attributes:
        name: Name of the view.
        position: Optical centre in world coordinates, metres.
        target: A point on the optical axis in world coordinates, metres.
        up: World direction that points up in the image.
        sensor: The pinhole model.
    """

    name: str
    position: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    sensor: PinholeSensor = L515

    def R_world_cam_cv(self) -> np.ndarray:
        """Return the (3, 3) rotation from OpenCV axes (right, down, forward) to the world."""
        forward = np.subtract(self.target, self.position).astype(float)
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(forward, right), forward], axis=1)

    def T_world_cam_cv(self) -> np.ndarray:
        """Return the (4, 4) pose of the camera, OpenCV axes, in the world."""
        pose = np.eye(4)
        pose[:3, :3] = self.R_world_cam_cv()
        pose[:3, 3] = self.position
        return pose


# Looking at (0.5, 0, 0.039) from 0.5 m up tilts the side cameras by exactly 45 degrees.
_SIDE_TARGET = (0.5, 0.0, 0.039)
_TOP_UP = (1.0, 0.0, 0.0)

CAMERA_PRESETS: dict[str, tuple[CameraPlacement, ...]] = {
    # Side cameras at opposite corners: they see into the gaps that the other one cannot.
    "sr": (
        CameraPlacement(name="top", position=(0.5, 0.0, 0.75), target=WORKSPACE_CENTER, up=_TOP_UP),
        CameraPlacement(name="left", position=(0.2, 0.35, 0.5), target=_SIDE_TARGET),
        CameraPlacement(name="right", position=(0.8, -0.35, 0.5), target=_SIDE_TARGET),
    ),
    # Both side cameras on the robot's side, as in the public A2 protocol.
    "a2": (
        CameraPlacement(name="top", position=(0.5, 0.0, 0.7), target=WORKSPACE_CENTER, up=_TOP_UP),
        CameraPlacement(name="left", position=(0.2, 0.35, 0.5), target=_SIDE_TARGET),
        CameraPlacement(name="right", position=(0.2, -0.35, 0.5), target=_SIDE_TARGET),
    ),
}


VIDEO = PinholeSensor(
    width=960, height=720, fx=900.0, fy=900.0, cx=480.0, cy=360.0, range_m=(0.25, 9.0)
)

# Not a sensor: the spectator's view, for videos and pictures.
OVERVIEW = CameraPlacement(
    name="overview", position=(1.25, 0.80, 0.85), target=(0.33, -0.10, 0.10), sensor=VIDEO
)


def camera_preset(name: str) -> tuple[CameraPlacement, ...]:
    """Look up a camera preset by name.

    Args:
        name: One of `CAMERA_PRESETS`.

    Returns:
        The preset's cameras, in the order in which views are returned.

    Raises:
        UnknownNameError: If there is no such preset.
    """
    if name not in CAMERA_PRESETS:
        close = difflib.get_close_matches(name, CAMERA_PRESETS, n=1)
        hint = f" Did you mean {close[0]!r}?" if close else ""
        raise UnknownNameError(
            f"Unknown camera preset {name!r}. Presets: {', '.join(CAMERA_PRESETS)}.{hint}"
        )
    return CAMERA_PRESETS[name]
