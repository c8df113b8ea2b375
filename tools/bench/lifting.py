"""Measure the lifting of features against the usual loop over views with `grid_sample`.

    python -m tools.bench.lifting --threads 1

Everything runs in one process on the same points and maps, in turn; the median counts. CPU time is
printed beside wall time, since other work on the machine disturbs the latter. Prints a markdown
table; docs/fusion.md carries one.
"""

import json
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F
import tyro
from torch import Tensor

from perception.lifting import LiftingConfig, lift_features
from perception.views import CameraView, Intrinsics


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """What to measure.

    Attributes:
        points: Number of points.
        channels: Channels of the feature maps.
        map_size: Height and width of the feature maps.
        repeats: Runs of each variant.
        threads: Threads of torch.
        json: File for the figures.
    """

    points: int = 20_000
    channels: int = 768
    map_size: tuple[int, int] = (72, 128)
    repeats: int = 9
    threads: int = 1
    json: Path | None = None


def make_views() -> list[CameraView]:
    """Make three 1280x720 views of an empty table from above, tilted a little."""
    intrinsics = Intrinsics(fx=914.0, fy=914.0, cx=640.0, cy=360.0, width=1280, height=720)
    v, u = np.mgrid[:720, :1280]
    ray = np.stack([(u - 640.0) / 914.0, (v - 360.0) / 914.0, np.ones_like(u, float)], axis=-1)
    views = []
    for index, tilt in enumerate((-0.25, 0.0, 0.25)):
        pose = np.eye(4)
        cos, sin = np.cos(tilt), np.sin(tilt)
        pose[:3, :3] = [[1, 0, 0], [0, -cos, -sin], [0, sin, -cos]]
        pose[:3, 3] = [0.5, -0.7 * np.tan(tilt), 0.7]
        depth_m = -pose[2, 3] / (ray @ pose[2, :3])  # where the ray meets z = 0
        views.append(
            CameraView(
                name=f"view{index}",
                rgb=np.zeros((720, 1280, 3), np.uint8),
                depth_m=depth_m.astype(np.float32),
                intrinsics=intrinsics,
                T_world_cam_cv=pose,
            )
        )
    return views


def make_points(num_points: int) -> np.ndarray:
    """Return (N, 3) float32 points on the table in the order of a voxel grid, 1 mm of noise."""
    side = int(np.ceil(np.sqrt(num_points)))
    x, y = np.meshgrid(np.linspace(0.28, 0.72, side), np.linspace(-0.22, 0.22, side), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), np.zeros(side**2)], axis=1)[:num_points]
    rng = np.random.default_rng(0)
    return (points + rng.normal(0, 1e-3, points.shape)).astype(np.float32)


def reference(points: Tensor, views: list[CameraView], maps: list[Tensor], mu_m: float) -> Tensor:
    """Lift as it is usually done: view after view, full float32 maps, `grid_sample`.

    Args:
        points: (N, 3) float32.
        views: K views.
        maps: K maps, (C, h, w) float32.
        mu_m: mu of eq. (1), metres.

    Returns:
        (N, C) float32, unit length.
    """
    total = torch.zeros(len(points), maps[0].shape[0])
    weights = torch.zeros(len(points), 1)
    for view, feature_map in zip(views, maps, strict=True):
        K = view.intrinsics
        T = torch.tensor(view.T_cam_cv_world, dtype=torch.float32)
        camera = points @ T[:3, :3].T + T[:3, 3]
        pixels = camera[:, :2] / camera[:, 2:] * torch.tensor([K.fx, K.fy])
        pixels = pixels + torch.tensor([K.cx, K.cy])
        grid = ((pixels + 0.5) / torch.tensor([K.width, K.height]) * 2 - 1)[None, None]
        depth = torch.from_numpy(view.depth_m.copy())[None, None]
        measured = F.grid_sample(depth, grid, mode="nearest", align_corners=False)[0, 0, 0]
        delta = measured - camera[:, 2]
        is_visible = (grid.abs() <= 1).all(-1)[0, 0] & (camera[:, 2] > 0) & (delta > -mu_m)
        is_visible &= measured > 0
        weight = is_visible * torch.exp(-(delta.abs() - mu_m).clamp(min=0) / mu_m)
        sampled = F.grid_sample(
            feature_map[None], grid, mode="bilinear", padding_mode="border", align_corners=False
        )[0, :, 0]
        total += weight[:, None] * sampled.T
        weights += weight[:, None]
    return F.normalize(total / weights.clamp(min=1e-9), dim=1)


def measure(variants: dict[str, Callable[[], object]], repeats: int) -> dict[str, list[float]]:
    """Run all variants in turn; return the median wall and CPU seconds of each."""
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in variants}
    for run in range(repeats + 1):
        for name, function in variants.items():
            wall, cpu = time.perf_counter(), time.process_time()
            result = function()
            spent = (time.perf_counter() - wall, time.process_time() - cpu)
            del result  # its memory is given back outside of the next measurement
            if run > 0:  # the first is for warming up
                times[name].append(spent)
    return {
        name: [statistics.median(column) for column in zip(*rows, strict=True)]
        for name, rows in times.items()
    }


@torch.no_grad()
def main(config: BenchConfig) -> None:
    """Measure, compare results and print."""
    torch.set_num_threads(config.threads)
    points, views = make_points(config.points), make_views()
    generator = torch.Generator().manual_seed(0)
    height, width = config.map_size
    inner = torch.randn(len(views), height, width, config.channels, generator=generator)
    inner = F.normalize(inner, dim=-1).permute(0, 3, 1, 2)  # as encoders give them
    first = [feature_map.contiguous() for feature_map in inner]  # as grid_sample likes them
    half = inner.to(torch.bfloat16)
    short, full = LiftingConfig(precision="bfloat16"), LiftingConfig()
    tensor = torch.from_numpy(points)
    variants: dict[str, Callable[[], object]] = {
        "loop over views, grid_sample, float32": lambda: reference(tensor, views, first, 0.02),
        "ours, float32": lambda: lift_features(points, views, inner, full),
        "ours, bfloat16": lambda: lift_features(points, views, half, short),
        "ours, float32, maps channels first": lambda: lift_features(points, views, first, full),
    }
    wanted = reference(tensor, views, first, 0.02).numpy()
    worst = {
        "ours, float32": lift_features(points, views, inner, full).features,
        "ours, bfloat16": lift_features(points, views, half, short).features,
    }
    times = measure(variants, config.repeats)
    base_wall, base_cpu = next(iter(times.values()))
    print(
        f"{config.points} points, {len(views)} views, {config.channels} channels of "
        f"{height}x{width} maps, {config.threads} thread(s)\n\n"
        "| lifting | wall s | CPU s | points/s (CPU) | ratio wall | ratio CPU | worst angle |\n"
        "| --- | --- | --- | --- | --- | --- | --- |"
    )
    rows = {}
    for name, (wall, cpu) in times.items():
        angle = ""
        if name in worst:
            chord = np.linalg.norm(worst[name].astype(float) - wanted, axis=1).max()
            angle = f"{np.degrees(2 * np.arcsin(chord / 2)):.4f} deg"
        rows[name] = {"wall_s": wall, "cpu_s": cpu, "ratio_cpu": base_cpu / cpu}
        print(
            f"| {name} | {wall:.3f} | {cpu:.3f} | {config.points / cpu:,.0f} "
            f"| {base_wall / wall:.1f} | {base_cpu / cpu:.1f} | {angle} |"
        )
    if config.json is not None:
        config.json.write_text(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    main(tyro.cli(BenchConfig, description=__doc__))
