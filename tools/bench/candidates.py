"""Measure the antipodal sampler against the true meshes of simulated scenes.

    python -m tools.bench.candidates --scenes 10
    python -m tools.bench.candidates --scenes 4 --execute

Prints a markdown table of scenes and a summary; `--json` writes the summary to a file.

An object is *visible* from 300 pixels over the three views on, and *graspable as it lies* if a
search over grasps of its true mesh finds one whose contacts are antipodal and whose approach is
free of true collisions. A candidate is *good* under the same test. `--execute` also carries out
the best candidate of every object in the simulation.
"""
# pyright: reportCallIssue=false
# open3d's stubs do not know that a Tensor is made from an array.

import json
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import open3d as o3d
import trimesh
import tyro

from models.cameras import camera_preset
from perception.cloud import GeometryCloud
from perception.fusion import FusionConfig, fuse
from policy.actions import ActionCandidates
from sr_mj.candidates import AntipodalConfig, AntipodalSampler
from sr_mj.candidates.collision import hits_points, swept_boxes, table_clearance
from sr_mj.execution import Executor
from sr_mj.planning import Planner
from sr_mj.scene import Scene, SceneConfig, make_scene
from sr_mj.scene.config import Split
from sr_mj.sensors.capture import capture_views
from sr_mj.sensors.l515 import L515NoiseConfig
from sr_mj.sensors.renderer import CameraRig

MIN_PIXELS = 300
# True contacts: 45 degrees of friction cone (friction 1), and normals that cancel.
MIN_ALIGNMENT, MAX_OPPOSITION = 0.7, -0.6
# Surface samples may reach this far into the gripper: their spacing and a touch.
TOUCH_M, SAMPLE_M = 0.001, 0.003


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """What to measure.

    Attributes:
        scenes: Number of scenes.
        seed: Seed of the first scene.
        kind: Kind of scene.
        split: Objects.
        execute: Execute the best candidate of every object.
        json: File for the summary.
    """

    scenes: int = 10
    seed: int = 1000
    kind: str = "cluttered15"
    split: Split = "seen"
    execute: bool = False
    json: Path | None = None


class TrueScene:
    """The true surfaces of a scene, for judging grasps."""

    def __init__(self, scene: Scene) -> None:
        """Place the meshes and sample their surfaces."""
        self.meshes = []
        self.rays = o3d.t.geometry.RaycastingScene()
        samples = []
        for item in scene.objects:
            mesh = trimesh.Trimesh(item.asset.vertices, item.asset.faces, process=False)
            mesh.apply_transform(scene.T_world_object(item.name))
            self.meshes.append(mesh)
            self.rays.add_triangles(
                o3d.core.Tensor(np.asarray(mesh.vertices, np.float32)),
                o3d.core.Tensor(np.asarray(mesh.faces, np.uint32)),
            )
            count = int(1.5 * mesh.area / SAMPLE_M**2)
            samples.append(trimesh.sample.sample_surface(mesh, count, seed=0)[0])
        self.samples = np.concatenate(samples).astype(np.float32)

    def judge(self, poses: np.ndarray, opening_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Say what grasps really hold.

        Args:
            poses: (K, 4, 4) tool poses.
            opening_m: (K,) openings on the approach.

        Returns:
            (K,) index of the object between the fingers, -1 for none or for two different ones,
            and (K,) mask of the good grasps.
        """
        sides = [self._close(poses, opening_m, sign) for sign in (-1, 1)]
        (left, left_normal), (right, right_normal) = sides
        closing = poses[:, :3, 0]
        alignment = np.minimum(
            -(left_normal * closing).sum(axis=1), (right_normal * closing).sum(axis=1)
        )
        opposition = (left_normal * right_normal).sum(axis=1)
        held = np.where(left == right, left, -1)
        is_good = (held >= 0) & (alignment > MIN_ALIGNMENT) & (opposition < MAX_OPPOSITION)
        low, high = swept_boxes(opening_m, AntipodalConfig())
        is_good &= table_clearance(poses, low, high) > 0
        rows = np.flatnonzero(is_good)
        low, high = low[rows] + TOUCH_M, high[rows] - TOUCH_M
        is_good[rows] = ~hits_points(poses[rows], low, high, self.samples)
        return held, is_good

    def _close(
        self, poses: np.ndarray, opening_m: np.ndarray, sign: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Object index (K,) and mean contact normal (K, 3) that one pad meets when it closes."""
        y, z = (
            a.ravel()
            for a in np.meshgrid(np.linspace(-9e-3, 9e-3, 5), np.linspace(-18e-3, 16e-3, 8))
        )
        start = np.zeros((len(poses), len(y), 3))
        start[..., 0] = sign * opening_m[:, None] / 2
        start[..., 1:] = np.stack([y, z], axis=1)
        origin = np.einsum("kij,knj->kni", poses[:, :3, :3], start) + poses[:, None, :3, 3]
        inward = np.broadcast_to(-sign * poses[:, None, :3, 0], origin.shape)
        rays = np.concatenate([origin, inward], axis=-1).astype(np.float32)
        cast = self.rays.cast_rays(o3d.core.Tensor(rays))
        normal = cast["primitive_normals"].numpy()
        normal = -normal * np.sign((normal * inward).sum(axis=-1, keepdims=True))
        distance = cast["t_hit"].numpy()
        distance = np.where(distance < opening_m[:, None], distance, np.inf)
        nearest = distance.min(axis=1, keepdims=True)
        first = np.take_along_axis(
            cast["geometry_ids"].numpy().astype(np.int64), distance.argmin(axis=1)[:, None], axis=1
        )
        patch = (distance < nearest + 2e-3) & (cast["geometry_ids"].numpy() == first)
        mean = (normal * patch[..., None]).sum(axis=1) / np.maximum(patch.sum(axis=1), 1)[:, None]
        return np.where(np.isfinite(nearest), first, -1 - (sign > 0))[:, 0], mean

    def is_graspable(self, index: int, config: AntipodalConfig, rng: np.random.Generator) -> bool:
        """Search grasps of one object as it lies, on its true mesh."""
        poses, opening_m = _true_grasps(self.meshes[index], config, rng)
        if not len(poses):
            return False
        held, is_good = self.judge(poses, opening_m)
        return bool((is_good & (held == index)).any())


def _true_grasps(
    mesh: trimesh.Trimesh, config: AntipodalConfig, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Antipodal pairs of a mesh under many approaches: poses (K, 4, 4) and openings (K,)."""
    point, face, *_ = trimesh.sample.sample_surface(mesh, 1500, seed=int(rng.integers(2**31)))
    normal = mesh.face_normals[face]
    rays = o3d.t.geometry.RaycastingScene()
    rays.add_triangles(
        o3d.core.Tensor(np.asarray(mesh.vertices, np.float32)),
        o3d.core.Tensor(np.asarray(mesh.faces, np.uint32)),
    )
    through = np.concatenate([point - 1e-4 * normal, -normal], axis=1).astype(np.float32)
    cast = rays.cast_rays(o3d.core.Tensor(through))
    width = cast["t_hit"].numpy()
    is_pair = np.abs((cast["primitive_normals"].numpy() * normal).sum(axis=1)) > 0.8
    is_pair &= (width < config.gripper.max_width_m - 0.005) & (np.abs(normal[:, 2]) < 0.6)
    chosen = rng.permutation(np.flatnonzero(is_pair))[:110]
    x, width = normal[chosen], width[chosen]
    center = point[chosen] - x * width[:, None] / 2
    down = np.array([0, 0, -1]) + x[:, 2:] * x
    down /= np.maximum(np.linalg.norm(down, axis=1, keepdims=True), 1e-9)
    poses = []
    for tilt in np.radians([0, 20, -20, 40, -40, 60, -60]):
        z = np.cos(tilt) * down + np.sin(tilt) * np.cross(down, x)
        for back_m in (0.0, 0.012):
            pose = np.tile(np.eye(4), (len(x), 1, 1))
            pose[:, :3, :3] = np.stack([x, np.cross(z, x), z], axis=-1)
            pose[:, :3, 3] = center - back_m * z
            poses.append(pose)
    # Half the extra opening: a grasp that needs care counts as possible.
    opening = np.minimum(width + config.extra_opening_m / 2, config.gripper.max_width_m)
    poses, opening = np.concatenate(poses), np.tile(opening, len(poses))
    low, high = swept_boxes(opening, config)
    lift = (0.002 - table_clearance(poses, low, high)).clip(0)
    poses[:, :3, 3] -= poses[:, :3, 2] * (lift / (-poses[:, 2, 2]).clip(0.3))[:, None]
    return poses[lift < 0.03], opening[lift < 0.03]


def look(scene: Scene, seed: int) -> tuple[GeometryCloud, np.ndarray]:
    """Take noisy views: the fused cloud, and the pixels of every object."""
    with CameraRig(scene.model, camera_preset(scene.config.cameras)) as rig:
        views = capture_views(rig, scene.data, L515NoiseConfig(), np.random.default_rng(seed))
        bodies = [rig.render_body_ids(scene.data, camera.name).ravel() for camera in rig.cameras]
    counts = Counter(np.concatenate(bodies).tolist())
    pixels = np.array([counts[item.body.body_id] for item in scene.objects])
    return fuse(views, FusionConfig()), pixels


def execute(
    scene: Scene, cloud: GeometryCloud, picks: ActionCandidates, held: np.ndarray
) -> Counter[str]:
    """Carry out the best candidate of every object, each from the same state of the scene."""
    planner, outcomes = Planner(), Counter()
    spec = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(scene.model, spec))
    mujoco.mj_getState(scene.model, scene.data, state, spec)
    for index in sorted(set(held.tolist()) - {-1}):
        plan = planner.plan(picks, np.flatnonzero(held == index)[:1], obstacles=cloud.points)
        if plan is None:
            outcomes["unreachable"] += 1
            continue
        outcome = Executor(scene).execute(plan)
        is_right = outcome.grasped == scene.objects[index].name
        outcomes["grasped" if is_right else str(outcome.reason)] += 1
        mujoco.mj_setState(scene.model, scene.data, state, spec)
        mujoco.mj_forward(scene.model, scene.data)
    return outcomes


def measure(config: BenchConfig, seed: int, outcomes: Counter[str]) -> dict[str, float]:
    """Measure one scene; outcomes of executed grasps are added to `outcomes`."""
    scene = make_scene(SceneConfig(scene=config.kind, split=config.split, seed=seed))
    cloud, pixels = look(scene, seed)
    sampler = AntipodalSampler()
    start, start_cpu = time.perf_counter(), time.process_time()
    picks = sampler.pick(cloud, np.random.default_rng(seed))
    wall_s, cpu_s = time.perf_counter() - start, time.process_time() - start_cpu
    truth = TrueScene(scene)
    held, is_good = truth.judge(picks.Ts_world_tool, sampler.approach_opening(picks.width_m))
    rng = np.random.default_rng(seed)
    visible = np.flatnonzero(pixels >= MIN_PIXELS)
    graspable = [i for i in visible if truth.is_graspable(int(i), sampler.config, rng)]
    first = [np.flatnonzero(held == i)[0] for i in visible if (held == i).any()]
    if config.execute:
        outcomes.update(execute(scene, cloud, picks, held))
    return {
        "visible": len(visible),
        "graspable": len(graspable),
        "graspable_with_candidate": sum((held == i).any() for i in graspable),
        "graspable_with_good": sum((is_good & (held == i)).any() for i in graspable),
        "held": len(first),
        "held_best_good": int(is_good[first].sum()) if first else 0,
        "candidates": len(picks),
        "good": int(is_good.sum()),
        "wall_s": wall_s,
        "cpu_s": cpu_s,
    }


def summarise(rows: list[dict[str, float]], outcomes: Counter[str]) -> dict[str, float]:
    """Reduce the scenes to ratios."""
    total = {name: float(sum(row[name] for row in rows)) for name in rows[0]}
    summary = {
        "scenes": len(rows),
        "visible": total["visible"],
        "graspable_as_it_lies": total["graspable"] / max(total["visible"], 1),
        "graspable_with_candidate": total["graspable_with_candidate"] / max(total["graspable"], 1),
        "graspable_with_good_candidate": total["graspable_with_good"] / max(total["graspable"], 1),
        "best_candidate_of_an_object_good": total["held_best_good"] / max(total["held"], 1),
        "good_candidates": total["good"] / max(total["candidates"], 1),
        "median_wall_s": float(np.median([row["wall_s"] for row in rows])),
        "mean_cpu_s": total["cpu_s"] / len(rows),
    }
    if outcomes:
        summary["executed"] = outcomes.total()
        summary["executed_grasped"] = outcomes["grasped"] / outcomes.total()
    return summary


def main(config: BenchConfig) -> None:
    """Measure scene after scene and print."""
    AntipodalSampler().pick(
        look(make_scene(SceneConfig(scene="single")), 0)[0], np.random.default_rng()
    )
    rows, outcomes = [], Counter()
    for seed in range(config.seed, config.seed + config.scenes):
        row = measure(config, seed, outcomes)
        if not rows:
            print("| seed | " + " | ".join(row) + " |\n" + "| --- " * (len(row) + 1) + "|")
        rows.append(row)
        print(f"| {seed} | " + " | ".join(f"{value:.3g}" for value in row.values()) + " |")
    summary = summarise(rows, outcomes)
    for name, value in summary.items():
        print(f"{name}: {value:.3g}")
    if outcomes:
        print("outcomes: " + ", ".join(f"{name} {n}" for name, n in outcomes.most_common()))
    if config.json is not None:
        config.json.write_text(json.dumps(summary, indent=2) + "\n")


if __name__ == "__main__":
    main(tyro.cli(BenchConfig))
