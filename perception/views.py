"""Camera views: an RGB-D image, its pinhole model and its pose, checked once."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from perception.arrays import checked_array
from perception.errors import InvalidViewError

_RIGID_TOLERANCE = 1e-4


@dataclass(frozen=True, kw_only=True)
class Intrinsics:
    """A pinhole camera without distortion; pixel centres lie at integer coordinates.

    Attributes:
        fx: Focal length along the image's x axis, pixels.
        fy: Focal length along the image's y axis, pixels.
        cx: Principal point, x, pixels.
        cy: Principal point, y, pixels.
        width: Image width, pixels.
        height: Image height, pixels.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name in ("fx", "fy", "width", "height"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InvalidViewError(f"Intrinsics: {name} is {value}, expected more than 0.")
        for name in ("cx", "cy"):
            value = getattr(self, name)
            if not np.isfinite(value):
                raise InvalidViewError(f"Intrinsics: {name} is {value}, expected a finite number.")

    def matrix(self) -> np.ndarray:
        """Return the (3, 3) float64 camera matrix K."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, kw_only=True, eq=False)
class CameraView:
    """What one RGB-D camera saw, and from where.

    Attributes:
        name: Name of the view, unique among the views of a scene.
        rgb: (H, W, 3) uint8.
        depth_m: (H, W) float32, distance along the optical axis in metres; 0 = no return.
        intrinsics: The pinhole model that color and depth share.
        T_world_cam_cv: (4, 4) float64 pose of the camera in the world; OpenCV axes (x right,
            y down, z forward).
    """

    name: str
    rgb: np.ndarray
    depth_m: np.ndarray
    intrinsics: Intrinsics
    T_world_cam_cv: np.ndarray

    def __post_init__(self) -> None:
        """Check the arrays and make them read-only."""
        owner = f"View {self.name!r}"
        size = (self.intrinsics.height, self.intrinsics.width)
        rgb = checked_array(
            owner, "rgb", self.rgb, shape=(*size, 3), dtype=np.uint8, error=InvalidViewError
        )
        depth_m = checked_array(
            owner, "depth_m", self.depth_m, shape=size, dtype=np.float32, error=InvalidViewError
        )
        if depth_m.min() < 0:
            raise InvalidViewError(
                f"{owner}: depth_m goes down to {depth_m.min():g} m; expected 0 (no return) or "
                "more."
            )
        pose = checked_array(
            owner,
            "T_world_cam_cv",
            self.T_world_cam_cv,
            shape=(4, 4),
            dtype=np.float64,
            error=InvalidViewError,
        )
        _check_rigid(owner, pose)
        object.__setattr__(self, "rgb", rgb)
        object.__setattr__(self, "depth_m", depth_m)
        object.__setattr__(self, "T_world_cam_cv", pose)

    @cached_property
    def T_cam_cv_world(self) -> np.ndarray:
        """(4, 4) float64: maps world coordinates into the camera's OpenCV axes."""
        rotation, position = self.T_world_cam_cv[:3, :3], self.T_world_cam_cv[:3, 3]
        inverse = np.eye(4)
        inverse[:3, :3] = rotation.T
        inverse[:3, 3] = -rotation.T @ position
        inverse.flags.writeable = False
        return inverse

    @property
    def position(self) -> np.ndarray:
        """(3,) float64: the optical centre in world coordinates, metres."""
        return self.T_world_cam_cv[:3, 3]

    def project(
        self, points: Float[np.ndarray, "n 3"]
    ) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, " n"]]:
        """Project world points into the image.

        Args:
            points: (N, 3) world coordinates, metres.

        Returns:
            (N, 2) float64 pixel coordinates (u, v), NaN behind the camera, and (N,) float64 depth
            along the optical axis, metres, negative behind the camera.
        """
        T = self.T_cam_cv_world
        in_camera = np.asarray(points, dtype=np.float64) @ T[:3, :3].T + T[:3, 3]
        depth = in_camera[:, 2]
        safe = np.where(depth > 0, depth, np.nan)[:, None]
        K = self.intrinsics
        pixels = in_camera[:, :2] / safe * (K.fx, K.fy) + (K.cx, K.cy)
        return pixels, depth

    def unproject(
        self, pixels: Float[np.ndarray, "n 2"], depth_m: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, "n 3"]:
        """Back-project pixels into the world.

        Args:
            pixels: (N, 2) pixel coordinates (u, v).
            depth_m: (N,) depth along the optical axis, metres.

        Returns:
            (N, 3) world coordinates, metres, in the wider type of the two arrays.
        """
        K = self.intrinsics
        dtype = np.result_type(pixels, depth_m, np.float32)
        in_camera = np.empty((len(pixels), 3), dtype)
        in_camera[:, 0] = (pixels[:, 0] - K.cx) * (1.0 / K.fx) * depth_m
        in_camera[:, 1] = (pixels[:, 1] - K.cy) * (1.0 / K.fy) * depth_m
        in_camera[:, 2] = depth_m
        rotation = self.T_world_cam_cv[:3, :3].astype(dtype)
        return in_camera @ rotation.T + self.position.astype(dtype)


def _check_rigid(owner: str, pose: np.ndarray) -> None:
    rotation = pose[:3, :3]
    off = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
    det = float(np.linalg.det(rotation))
    last_row_ok = np.array_equal(pose[3], [0.0, 0.0, 0.0, 1.0])
    if off > _RIGID_TOLERANCE or det < 0 or not last_row_ok:
        raise InvalidViewError(
            f"{owner}: T_world_cam_cv is not rigid (|R R^T - I| = {off:.2g}, det R = {det:.3g}, "
            f"last row {pose[3].tolist()}); expected a rotation, a translation in metres and the "
            "last row [0, 0, 0, 1]."
        )
