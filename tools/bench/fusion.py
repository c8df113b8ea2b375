"""Measure fusion methods against the true surfaces of simulated scenes under the sensor's noise.

    python -m tools.bench.fusion --scenes 5

Prints a markdown table; docs/fusion.md carries one.

Error: distance of fused points, more than 3 mm above the table, from the nearest true surface.
Completeness: the share of the surface that the cameras see, taken from noise-free depth, that has a
fused point within 2 or 4 mm. Normals: angle to the normal of the nearest true triangle.
"""
# pyright: reportCallIssue=false, reportArgumentType=false
# open3d's stubs do not know that a Tensor is made from an array.

import json
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import open3d as o3d
import trimesh
import tyro
from scipy.spatial import KDTree

from models.cameras import camera_preset
from perception.cloud import GeometryCloud
from perception.fusion import FusionConfig, fuse
from perception.views import CameraView
from sr_mj.scene import Scene, SceneConfig, make_scene
from sr_mj.sensors.capture import capture_views
from sr_mj.sensors.l515 import L515NoiseConfig
from sr_mj.sensors.renderer import CameraRig

TABLE_MARGIN_M = 0.003

METHODS: dict[str, FusionConfig] = {
    "voxel means 2 mm (default)": FusionConfig(),
    "same, depth not smoothed": FusionConfig(is_depth_smoothed=False),
    "same, nothing filtered": FusionConfig(
        is_depth_smoothed=False, flying_pixel_neighbours=0, outlier_neighbours=0
    ),
    "voxel means 3 mm": FusionConfig(voxel_size_m=0.003),
    "TSDF 2 mm, reach 4 voxels": FusionConfig(method="tsdf"),
    "TSDF 2 mm, reach 8 voxels": FusionConfig(method="tsdf", tsdf_truncation_voxels=8.0),
    "TSDF 2 mm, depth not smoothed": FusionConfig(method="tsdf", is_depth_smoothed=False),
    "TSDF 3 mm, reach 4 voxels": FusionConfig(method="tsdf", voxel_size_m=0.003),
}


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """What to measure.

    Attributes:
        scenes: Number of scenes.
        seed: Seed of the first scene.
        kind: Kind of scene.
        repeats: Runs of each method for the time; the median counts.
        json: File for the figures.
    """

    scenes: int = 5
    seed: int = 3000
    kind: str = "cluttered15"
    repeats: int = 1
    json: Path | None = None


def true_surface(scene: Scene) -> o3d.t.geometry.RaycastingScene:
    """Place the true meshes of all objects."""
    surface = o3d.t.geometry.RaycastingScene()
    for item in scene.objects:
        mesh = trimesh.Trimesh(item.asset.vertices, item.asset.faces, process=False)
        mesh.apply_transform(scene.T_world_object(item.name))
        surface.add_triangles(
            o3d.core.Tensor(np.asarray(mesh.vertices, np.float32)),
            o3d.core.Tensor(np.asarray(mesh.faces, np.uint32)),
        )
    return surface


def photograph(scene: Scene, seed: int) -> tuple[tuple[CameraView, ...], tuple[CameraView, ...]]:
    """Take the same views with the sensor's noise and without any."""
    rng = np.random.default_rng(seed)
    with CameraRig(scene.model, camera_preset(scene.config.cameras)) as rig:
        noisy = capture_views(rig, scene.data, L515NoiseConfig(), rng)
        clean = capture_views(rig, scene.data, L515NoiseConfig.off(), rng)
    return noisy, clean


def visible_surface(clean: tuple[CameraView, ...]) -> np.ndarray:
    """Return (N, 3) points, one a 2 mm voxel of all that noise-free cameras see above the table."""
    nothing = FusionConfig(
        is_depth_smoothed=False,
        flying_pixel_neighbours=0,
        outlier_neighbours=0,
        min_observations=1,
    )
    return _above_table(fuse(clean, nothing)).points


def _above_table(cloud: GeometryCloud) -> GeometryCloud:
    kept = cloud.points[:, 2] > TABLE_MARGIN_M
    return GeometryCloud(
        points=cloud.points[kept], colors=cloud.colors[kept], normals=cloud.normals[kept]
    )


def judge(
    fused: GeometryCloud, surface: o3d.t.geometry.RaycastingScene, visible: np.ndarray
) -> dict[str, float]:
    """Compare a fused cloud with the truth."""
    cloud = _above_table(fused)
    closest = surface.compute_closest_points(o3d.core.Tensor(np.array(cloud.points)))
    error = np.linalg.norm(closest["points"].numpy() - cloud.points, axis=1)
    error = np.minimum(error, cloud.points[:, 2])  # the table is a true surface too
    cosine = np.abs((closest["primitive_normals"].numpy() * cloud.normals).sum(axis=1)).clip(0, 1)
    gap = KDTree(cloud.points).query(visible)[0]
    return {
        "points": len(cloud),
        "mean_mm": 1e3 * error.mean(),
        "p95_mm": 1e3 * np.quantile(error, 0.95),
        "over_5mm": (error > 5e-3).mean(),
        "normal_deg": float(np.degrees(np.median(np.arccos(cosine)))),
        "within_2mm": (gap < 2e-3).mean(),
        "within_4mm": (gap < 4e-3).mean(),
    }


def main(config: BenchConfig) -> None:
    """Measure every method on the same views."""
    rows: dict[str, list[dict[str, float]]] = {name: [] for name in METHODS}
    for seed in range(config.seed, config.seed + config.scenes):
        scene = make_scene(SceneConfig(scene=config.kind, seed=seed))
        surface = true_surface(scene)
        noisy, clean = photograph(scene, seed)
        visible = visible_surface(clean)
        for name, method in METHODS.items():
            times = []
            for _ in range(config.repeats):
                wall, cpu = time.perf_counter(), time.process_time()
                fused = fuse(noisy, method)
                times.append((time.perf_counter() - wall, time.process_time() - cpu))
            wall_s, cpu_s = np.median(times, axis=0)
            rows[name].append(judge(fused, surface, visible) | {"wall_s": wall_s, "cpu_s": cpu_s})
    means = {
        name: {key: float(np.mean([row[key] for row in found])) for key in found[0]}
        for name, found in rows.items()
    }
    print(
        "| method | points | error mm, mean | 95 % | over 5 mm | normals, median | "
        "complete to 2 mm | to 4 mm | wall s | CPU s |\n" + "| --- " * 10 + "|"
    )
    for name, m in means.items():
        print(
            f"| {name} | {m['points']:,.0f} | {m['mean_mm']:.2f} | {m['p95_mm']:.2f} "
            f"| {m['over_5mm']:.1%} | {m['normal_deg']:.1f} deg | {m['within_2mm']:.1%} "
            f"| {m['within_4mm']:.1%} | {m['wall_s']:.2f} | {m['cpu_s']:.2f} |"
        )
    if config.json is not None:
        config.json.write_text(json.dumps(means, indent=2) + "\n")


if __name__ == "__main__":
    main(tyro.cli(BenchConfig, description=__doc__))
