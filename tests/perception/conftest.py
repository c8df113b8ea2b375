"""Synthetic views for the tests of perception: ray casting, no simulator."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import open3d as o3d
import pytest
import torch
import torch.nn.functional as F
from jaxtyping import install_import_hook

from perception.encoders.base import TextFeatures
from perception.views import CameraView, Intrinsics

# Shapes in annotations are checked in the modules that compute; the containers check themselves,
# and their own messages are tested.
install_import_hook(
    [f"perception.{name}" for name in ("depth_filter", "similarity", "voxels")],
    "beartype.beartype",
)

INTRINSICS = Intrinsics(fx=457.0, fy=457.0, cx=320.0, cy=180.0, width=640, height=360)


def look_at(
    position: tuple[float, float, float],
    target: tuple[float, float, float],
    up: tuple[float, float, float] = (0.0, 0.0, 1.0),
) -> np.ndarray:
    """Pose of a camera (OpenCV axes) at `position` that looks at `target`."""
    forward = np.subtract(target, position)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, up)
    right = right / np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    pose[:3, 3] = position
    return pose


POSES = {
    "top": look_at((0.5, 0.0, 0.75), (0.5, 0.0, 0.0), up=(1.0, 0.0, 0.0)),
    "left": look_at((0.2, 0.35, 0.5), (0.5, 0.0, 0.04)),
    "right": look_at((0.8, -0.35, 0.5), (0.5, 0.0, 0.04)),
}
# Red ball, green box, blue cylinder, on a grey table.
COLORS = np.array([[128, 128, 128], [200, 30, 30], [30, 160, 60], [40, 70, 200]], np.uint8)
BALL_CENTER, BALL_RADIUS = np.array([0.5, 0.08, 0.04]), 0.04
BOX_MIN, BOX_MAX = np.array([0.4, -0.12, 0.0]), np.array([0.48, -0.06, 0.1])


def table_scene() -> o3d.t.geometry.RaycastingScene:
    ball = o3d.geometry.TriangleMesh.create_sphere(BALL_RADIUS, resolution=60)
    box = o3d.geometry.TriangleMesh.create_box(*(BOX_MAX - BOX_MIN))
    cylinder = o3d.geometry.TriangleMesh.create_cylinder(0.03, 0.06, resolution=60)
    table = o3d.geometry.TriangleMesh.create_box(2.0, 2.0, 0.02)
    scene = o3d.t.geometry.RaycastingScene()
    for mesh, shift in (
        (table, (-0.5, -1.0, -0.02)),
        (ball, BALL_CENTER),
        (box, BOX_MIN),
        (cylinder, (0.6, -0.05, 0.03)),
    ):
        mesh.translate(shift)
        scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))
    return scene


def render_view(
    scene: o3d.t.geometry.RaycastingScene,
    name: str,
    pose: np.ndarray,
    intrinsics: Intrinsics = INTRINSICS,
) -> CameraView:
    """Cast one ray through the centre of every pixel; depth is exact."""
    K = intrinsics
    u, v = np.meshgrid(np.arange(K.width), np.arange(K.height))
    directions = np.stack([(u - K.cx) / K.fx, (v - K.cy) / K.fy, np.ones_like(u, float)], axis=-1)
    in_world = directions @ pose[:3, :3].T
    origins = np.broadcast_to(pose[:3, 3], in_world.shape)
    rays = np.concatenate([origins, in_world], axis=-1).astype(np.float32)
    hits = scene.cast_rays(o3d.core.Tensor(rays))
    depth = hits["t_hit"].numpy()  # directions have z = 1: the ray's parameter is the z depth
    is_hit = np.isfinite(depth)
    ids = np.where(is_hit, hits["geometry_ids"].numpy(), 0)
    return CameraView(
        name=name,
        rgb=COLORS[ids] * is_hit[..., None].astype(np.uint8),
        depth_m=np.where(is_hit, depth, 0.0).astype(np.float32),
        intrinsics=intrinsics,
        T_world_cam_cv=pose,
    )


class ColorEncoder:
    """Text space = RGB: cells hold the mean colour, words the colour they name, others all three."""

    name = "color"
    fingerprint = "color-1"
    fingerprints = ("color-1",)
    feature_dim = 3

    def __init__(self) -> None:
        self.num_images = 0
        self.texts: list[str] = []

    def encode_dense(self, images: Sequence[np.ndarray]) -> torch.Tensor:
        self.num_images += len(images)
        pixels = torch.from_numpy(np.stack(images)).permute(0, 3, 1, 2).float() + 1.0
        return F.normalize(F.avg_pool2d(pixels, 4), dim=1)

    def encode_text(self, text: str) -> TextFeatures:
        self.texts.append(text)
        words = text.split()
        pooled = np.full(3, 1e-3, np.float32)
        for channel, word in enumerate(("red", "green", "blue")):
            pooled[channel] += word in words
        pooled /= np.linalg.norm(pooled)
        return TextFeatures(pooled=pooled, tokens=np.tile(pooled, (len(words), 1)))


@pytest.fixture(scope="session")
def make_color_encoder() -> type[ColorEncoder]:
    """Makes encoders that know three colours and count what they are asked."""
    return ColorEncoder


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> Iterator[None]:
    """The networks here are small; threads that wait for each other only cost time."""
    num_threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(num_threads)


@pytest.fixture(scope="session")
def table_views() -> tuple[CameraView, ...]:
    """Three noise-free views of a ball, a box and a cylinder on a table."""
    scene = table_scene()
    return tuple(render_view(scene, name, pose) for name, pose in POSES.items())


@pytest.fixture(scope="session")
def make_view() -> Callable[..., CameraView]:
    """Make a small valid view in which single fields can be replaced by bad ones."""

    def make(**fields: object) -> CameraView:
        intrinsics = Intrinsics(fx=10.0, fy=10.0, cx=3.5, cy=2.5, width=8, height=6)
        valid: dict[str, object] = {
            "name": "front",
            "rgb": np.zeros((6, 8, 3), np.uint8),
            "depth_m": np.ones((6, 8), np.float32),
            "intrinsics": intrinsics,
            "T_world_cam_cv": np.eye(4),
        }
        return CameraView(**(valid | fields))  # pyright: ignore[reportArgumentType]

    return make
