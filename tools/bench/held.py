"""Measure how well the held object is known: by the look before the grasp, and by both looks.

    python -m tools.bench.held --scenes place8 pickplace8 --seeds 110 150

Picks one object a scene with the oracle, looks again, and compares what `held_object` says with the
true mesh in the gripper. Writes one JSON line a grasp as it ends, skips what the file already has.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
import shapely
import tyro
from tqdm import tqdm

from sr_mj.gl import select_backend

if TYPE_CHECKING:
    from models.workspace import Workspace
    from perception.lifter import MultiViewLifter
    from sr_mj.candidates.held import HeldObject
    from sr_mj.scene import Scene

_TRIES = 2
# An object that hangs lower than thought is pressed into what it is put on, or falls from higher.
_WRONG_M = 0.006


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """What to run.

    Attributes:
        scenes: Kinds of random scenes.
        split: Objects.
        seeds: First seed and one past the last.
        out: File of JSON lines.
    """

    scenes: tuple[str, ...] = ("place8", "pickplace8")
    split: Literal["seen", "unseen"] = "seen"
    seeds: tuple[int, int] = (110, 150)
    out: Path = Path("outputs/held.jsonl")


def make_held_scene(config: BenchConfig, kind: str, seed: int) -> "Scene | None":
    """Make a scene with one object to pick up and keep; None if nothing can be held."""
    from sr_mj.scene import Goal, PlaceGoal, SceneConfig, make_scene

    scene = make_scene(SceneConfig(scene=kind, split=config.split, seed=seed))
    shape = scene.config.kind
    first = shape.num_spread if shape.num_heaped else 0
    names = [item.name for item in scene.objects[first:] if item.graspable]
    if not names:
        return None
    target = str(np.random.default_rng(seed).choice(names))
    reference = next(item.name for item in scene.objects if item.name != target)
    place = PlaceGoal(relation="near", references=(reference,))
    goal = Goal(text="give me the thing, put it near the thing", targets=(target,), place=place)
    return replace(scene, goal=goal)


def run_one(config: BenchConfig, kind: str, seed: int) -> Iterator[dict]:
    """Pick, look and compare; yields a record, or nothing if nothing was picked."""
    from sr_mj.assemble import assembled, make_policy
    from sr_mj.candidates.held import held_object
    from sr_mj.episode import run_episode
    from sr_mj.judge import object_in_gripper
    from sr_mj.pipeline import EpisodeRngs, look

    scene = make_held_scene(config, kind, seed)
    if scene is None:
        return
    lifter, policy = _lifter(scene.workspace), make_policy("oracle", scene)
    with assembled(scene, lifter=lifter, policy=policy) as pipeline:
        attempts = run_episode(scene, pipeline, seed=seed, max_attempts=_TRIES)
        attempt = next((a for a in attempts if a.outcome.success or a.kind == "place"), None)
        name = object_in_gripper(scene)
        pose = pipeline.executor.T_world_grasp
        if attempt is None or attempt.percept is None or name is None or pose is None:
            return
        views = look(scene, pipeline, EpisodeRngs.of_episode(scene, seed).noise)
        after = lifter.perceive(views, "thing").geometry
        before, width_m = attempt.percept.geometry, pipeline.executor.drive.width_m
        true = _true_points(scene, name) @ pose[:3, :3].T + pose[:3, 3]
        yield {
            "scene": kind,
            "seed": seed,
            "object": name,
            "first": _compare(held_object(before, pose, width_m), true),
            "both": _compare(held_object(before, pose, width_m, after=after), true),
        }


def _true_points(scene: "Scene", name: str) -> np.ndarray:
    """Vertices of an object in the tool's frame, metres."""
    from models.robot import TOOL_SITE_NAME
    from sr_mj.scene.placement import find_object

    tool, pose = scene.data.site(TOOL_SITE_NAME), scene.T_world_object(name)
    points = find_object(scene, name).asset.vertices @ pose[:3, :3].T + pose[:3, 3]
    return (points - tool.xpos) @ tool.xmat.reshape(3, 3)


def _compare(held: "HeldObject", true: np.ndarray) -> dict:
    """Errors of the lowest point, metres, and of the convex outline from above."""
    pose = held.T_world_tool
    points = held.points_tool @ pose[:3, :3].T + pose[:3, 3]
    outline, wanted = (shapely.MultiPoint(p[:, :2]).convex_hull for p in (points, true))
    overlap = outline.intersection(wanted).area / outline.union(wanted).area
    # Positive if the object reaches lower than thought.
    lower_m = pose[2, 3] - held.drop_m - true[:, 2].min()
    return {"lower_m": round(float(lower_m), 4), "iou": round(float(overlap), 3)}


@cache
def _lifter(workspace: "Workspace") -> "MultiViewLifter":
    from perception.lifter import MultiViewLifter
    from sr_mj.assemble import lifter_config
    from sr_mj.evaluation.blank import BlankEncoder

    return MultiViewLifter(BlankEncoder(), lifter_config(workspace))


def report(records: list[dict]) -> None:
    """Print a line a kind of scene and number of looks, then what is wrong with both."""
    for kind in dict.fromkeys(record["scene"] for record in records):
        mine = [record for record in records if record["scene"] == kind]
        for looks in ("first", "both"):
            lower = np.array([record[looks]["lower_m"] for record in mine])
            iou = np.array([record[looks]["iou"] for record in mine])
            print(
                f"{kind:10s} {looks:5s} {len(mine)} grasps, drop error: median "
                f"{np.median(np.abs(lower)) * 1000:.1f} mm, 90th percentile "
                f"{np.quantile(np.abs(lower), 0.9) * 1000:.1f} mm, too small by over 6 mm "
                f"{(lower > _WRONG_M).sum()}, too large {(lower < -_WRONG_M).sum()}; outline: "
                f"median IoU {np.median(iou):.2f}, under 0.7 {(iou < 0.7).sum()}"
            )
    for record in records:
        if abs(record["both"]["lower_m"]) > _WRONG_M or record["both"]["iou"] < 0.7:
            print(f"  {record['scene']} {record['seed']} {record['object']}: {record['both']}")


def main(config: BenchConfig) -> None:
    """Run what is missing, then report."""
    select_backend()
    config.out.parent.mkdir(parents=True, exist_ok=True)
    lines = config.out.read_text().splitlines() if config.out.exists() else []
    records = {(r["scene"], r["seed"]): r for r in map(json.loads, lines)}
    wanted = [(kind, seed) for seed in range(*config.seeds) for kind in config.scenes]
    with config.out.open("a") as file:
        for key in tqdm([key for key in wanted if key not in records], desc="grasps"):
            for record in run_one(config, *key):
                records[key] = record
                file.write(json.dumps(record) + "\n")
                file.flush()
    report([records[key] for key in wanted if key in records])


if __name__ == "__main__":
    main(tyro.cli(BenchConfig, description=__doc__))
