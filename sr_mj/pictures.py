"""Pictures of an attempt: the views, where the cloud fits the instruction, the chosen action."""

from pathlib import Path

import numpy as np
from matplotlib import colormaps
from PIL import Image, ImageDraw

from models.cameras import CameraPlacement
from models.gripper_geometry import ROBOTIQ_2F85_CLASS
from perception.cloud import FeatureCloud
from perception.views import CameraView, Intrinsics
from sr_mj.attempt import Attempt

_BACKGROUND = 250
_HELD = (255, 140, 0)
_PANEL_WIDTH = 640
_CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
_EDGES = [(a, b) for a in range(8) for b in range(a + 1, 8) if bin(a ^ b).count("1") == 1]
_VIRTUAL = CameraPlacement(name="virtual", position=(0.95, 0.38, 0.5), target=(0.5, 0.0, 0.04))


def _intrinsics(placement: CameraPlacement) -> Intrinsics:
    sensor = placement.sensor
    return Intrinsics(
        fx=sensor.fx, fy=sensor.fy, cx=sensor.cx, cy=sensor.cy,
        width=sensor.width, height=sensor.height,
    )  # fmt: skip


def _project(
    points: np.ndarray, intrinsics: Intrinsics, T_world_cam_cv: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return pixels (N, 2) and depths (N,) of world points."""
    R, t = T_world_cam_cv[:3, :3], T_world_cam_cv[:3, 3]
    camera = (np.asarray(points, float) - t) @ R
    depth = camera[:, 2]
    uv = camera[:, :2] / np.maximum(depth, 1e-6)[:, None]
    return uv * [intrinsics.fx, intrinsics.fy] + [intrinsics.cx, intrinsics.cy], depth


def _splat(
    canvas: np.ndarray, pixels: np.ndarray, depth: np.ndarray, colors: np.ndarray, radius: int
) -> None:
    """Paint points (N) as squares into canvas (H, W, 3), the nearest on top."""
    height, width = canvas.shape[:2]
    order = np.argsort(-depth)
    columns, rows = np.rint(pixels[order]).astype(int).T
    visible = depth[order] > 0
    for dv in range(-radius, radius + 1):
        for du in range(-radius, radius + 1):
            u, v = columns + du, rows + dv
            inside = visible & (u >= 0) & (u < width) & (v >= 0) & (v < height)
            canvas[v[inside], u[inside]] = colors[order][inside]


def similarity_overlay(view: CameraView, cloud: FeatureCloud) -> np.ndarray:
    """Paint the cloud's similarity over a view.

    Args:
        view: The view.
        cloud: Feature cloud with similarity to the instruction.

    Returns:
        (H, W, 3) uint8: the view in grey, the points from blue (least) to red (most similar).
    """
    grey = view.rgb.mean(axis=2, keepdims=True).repeat(3, axis=2).astype(np.uint8)
    painted = grey.copy()
    low, high = np.percentile(cloud.similarity, [2, 99.5])
    scaled = (cloud.similarity - low) / max(high - low, 1e-6)
    colors = (colormaps["turbo"](np.clip(scaled, 0, 1))[:, :3] * 255).astype(np.uint8)
    pixels, depth = _project(cloud.points, view.intrinsics, view.T_world_cam_cv)
    _splat(painted, pixels, depth, colors, radius=4)
    return (0.35 * grey + 0.65 * painted).astype(np.uint8)


def action_picture(attempt: Attempt) -> np.ndarray:
    """Draw the fused cloud with the candidates' tool points and the chosen gripper.

    Where something is to be placed, it is drawn in the gripper, in orange, as it was seen before
    the grasp.

    Args:
        attempt: An attempt with a percept.

    Returns:
        (720, 1280, 3) uint8.
    """
    assert attempt.percept is not None and attempt.candidates is not None
    intrinsics, pose = _intrinsics(_VIRTUAL), _VIRTUAL.T_world_cam_cv()
    canvas = np.full((intrinsics.height, intrinsics.width, 3), _BACKGROUND, np.uint8)
    cloud = attempt.percept.geometry
    points, colors = cloud.points, (cloud.colors * 255).astype(np.uint8)
    if attempt.held is not None and attempt.plan is not None:
        R, t = attempt.plan.T_world_tool[:3, :3], attempt.plan.T_world_tool[:3, 3]
        held = attempt.held.points_tool @ R.T + t
        points = np.concatenate([points, held])
        colors = np.concatenate([colors, np.full((len(held), 3), _HELD, np.uint8)])
    pixels, depth = _project(points, intrinsics, pose)
    _splat(canvas, pixels, depth, colors, radius=2)
    image = Image.fromarray(canvas)
    draw = ImageDraw.Draw(image)
    if len(attempt.candidates):
        for u, v in _project(attempt.candidates.positions, intrinsics, pose)[0]:
            draw.ellipse((u - 2, v - 2, u + 2, v + 2), fill=(40, 40, 40))
    if attempt.plan is not None:
        width = float(attempt.candidates.width_m[attempt.plan.chosen])
        for center, half in zip(*ROBOTIQ_2F85_CLASS.boxes(min(width + 0.02, 0.085)), strict=True):
            corners = (center + _CORNERS * half) @ attempt.plan.T_world_tool[:3, :3].T
            corners += attempt.plan.T_world_tool[:3, 3]
            uv = _project(corners, intrinsics, pose)[0]
            for a, b in _EDGES:
                draw.line([tuple(uv[a]), tuple(uv[b])], fill=(0, 140, 60), width=3)
    return np.asarray(image)


def _side_by_side(pictures: list[np.ndarray]) -> Image.Image:
    height = round(_PANEL_WIDTH * pictures[0].shape[0] / pictures[0].shape[1])
    sheet = Image.new("RGB", (_PANEL_WIDTH * len(pictures), height))
    for column, picture in enumerate(pictures):
        panel = Image.fromarray(picture).resize((_PANEL_WIDTH, height))
        sheet.paste(panel, (column * _PANEL_WIDTH, 0))
    return sheet


def save_pictures(attempt: Attempt, folder: Path) -> None:
    """Write the pictures of an attempt: `attempt_NN_views|similarity|grasp.png`.

    Those of placing are called `place_NN_views|similarity|place.png`, those of a hand-over
    `hand_over_NN_...`.

    Args:
        attempt: The attempt; without a percept only the views are written.
        folder: An existing folder.
    """
    name = "place" if attempt.kind == "place" else "attempt"
    stem = f"{'hand_over' if attempt.is_hand_over else name}_{attempt.index + 1:02d}"
    _side_by_side([view.rgb for view in attempt.views]).save(folder / f"{stem}_views.png")
    if attempt.percept is None:
        return
    cloud = attempt.percept.features
    overlays = [similarity_overlay(view, cloud) for view in attempt.views]
    _side_by_side(overlays).save(folder / f"{stem}_similarity.png")
    what = "place" if attempt.kind == "place" else "grasp"
    Image.fromarray(action_picture(attempt)).save(folder / f"{stem}_{what}.png")
