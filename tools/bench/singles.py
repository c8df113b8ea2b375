"""Grasp every object of the catalogue, alone on the table, by its best-scored candidate.

    python -m tools.bench.singles --out singles.jsonl
    python -m tools.bench.singles --out singles.jsonl --report

Each object falls `--poses` times from a random orientation and is looked at; the grasp with the
best prior that can be planned is carried out. An object is *graspable as it lies* if a search over
grasps of its true mesh, under the gripper's stroke of 85 mm, finds one that is antipodal and free
of collisions. Every try is a line of the file; what the file has is not done again.
"""

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from models.cameras import camera_preset
from models.objects.catalogue import object_names
from perception.errors import EmptyCloudError
from perception.fusion import FusionConfig, fuse
from sr_mj.candidates import AntipodalConfig, AntipodalSampler
from sr_mj.errors import SceneError
from sr_mj.execution import Executor
from sr_mj.planning import Planner
from sr_mj.scene import SPLITS, Scene, SceneConfig, make_scene
from sr_mj.sensors.capture import capture_views
from sr_mj.sensors.l515 import L515NoiseConfig
from sr_mj.sensors.renderer import CameraRig
from tools.bench.candidates import TrueScene

HELD = ("grasped_target", "wrong_object")


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """What to measure.

    Attributes:
        out: JSON lines, one a try.
        poses: Poses an object.
        seed: Seed of the first pose.
        report: Only report what the file has.
    """

    out: Path
    poses: int = 5
    seed: int = 100
    report: bool = False


def attempt(scene: Scene, planner: Planner, seed: int) -> dict[str, Any]:
    """Look, propose, plan the best-scored candidate and carry it out."""
    with CameraRig(scene.model, camera_preset(scene.config.cameras)) as rig:
        views = capture_views(rig, scene.data, L515NoiseConfig(), np.random.default_rng(seed))
    try:
        cloud = fuse(views, FusionConfig())
    except EmptyCloudError:
        return {"candidates": 0, "outcome": "nothing_in_sight"}
    picks = AntipodalSampler().pick(cloud, np.random.default_rng(seed))
    if not len(picks):
        return {"candidates": 0, "outcome": "no_candidate"}
    plan = planner.plan(picks, np.argsort(-picks.prior, kind="stable"), obstacles=cloud.points)
    if plan is None:
        return {"candidates": len(picks), "outcome": "unreachable"}
    outcome = Executor(scene).execute(plan)
    tilt = np.degrees(np.arccos(np.clip(-plan.T_world_tool[2, 2], -1, 1)))
    return {
        "candidates": len(picks),
        "outcome": str(outcome.reason),
        "rank": int((picks.prior > picks.prior[plan.chosen]).sum()),
        "prior": round(float(picks.prior[plan.chosen]), 3),
        "width_m": round(float(picks.width_m[plan.chosen]), 4),
        "tilt_deg": round(float(tilt), 1),
    }


def measure(name: str, split: str, pose: int, seed: int, planner: Planner) -> dict[str, Any]:
    """Try one object in one pose."""
    row: dict[str, Any] = {"object": name, "split": split, "pose": pose}
    try:
        # A goal of its own keeps the layout whether or not the object can be held.
        scene = make_scene(
            SceneConfig(scene="single", objects=(name,), seed=seed + pose, goal=f"the {name}")
        )
    except SceneError as error:
        return {**row, "graspable": False, "candidates": 0, "outcome": f"no scene: {error}"}
    truth = TrueScene(scene)
    rng = np.random.default_rng(seed + pose)
    row["graspable"] = truth.is_graspable(0, AntipodalConfig(), rng)
    return {**row, **attempt(scene, planner, seed + pose)}


def wilson(successes: int, total: int, z: float = 1.96) -> str:
    """Format a share with its 95 % interval."""
    if not total:
        return "-"
    share, spread = successes / total, z**2 / total
    middle = (share + spread / 2) / (1 + spread)
    half = z * np.sqrt(share * (1 - share) / total + spread / (4 * total)) / (1 + spread)
    return f"{100 * share:.1f} % [{100 * (middle - half):.1f}, {100 * (middle + half):.1f}]"


def report(rows: list[dict[str, Any]]) -> None:
    """Print shares, and what was lost object by object."""
    print("| objects | tries | graspable as they lie | held, of graspable | held, of all |")
    print("| --- | --- | --- | --- | --- |")
    for split in (*SPLITS, None):
        part = [row for row in rows if split in (None, row["split"])]
        can = [row for row in part if row["graspable"]]
        held = [row["outcome"] in HELD for row in part]
        held_can = [row["outcome"] in HELD for row in can]
        print(
            f"| {split or 'all'} | {len(part)} | {len(can)} "
            f"| {sum(held_can)} of {len(can)}: {wilson(sum(held_can), len(can))} "
            f"| {sum(held)} of {len(part)}: {wilson(sum(held), len(part))} |"
        )
    print("\n| object | split | tries | graspable | held | lost while graspable | lost otherwise |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name in sorted({row["object"] for row in rows}):
        part = [row for row in rows if row["object"] == name]
        lost = [row for row in part if row["outcome"] not in HELD]
        if not lost:
            continue
        causes = [
            ", ".join(f"{cause} {n}" for cause, n in Counter(chosen).most_common())
            for chosen in (
                [row["outcome"] for row in lost if row["graspable"]],
                [row["outcome"] for row in lost if not row["graspable"]],
            )
        ]
        print(
            f"| {name} | {part[0]['split']} | {len(part)} | {sum(r['graspable'] for r in part)} "
            f"| {len(part) - len(lost)} | {causes[0]} | {causes[1]} |"
        )


def main(config: BenchConfig) -> None:
    """Go through all objects, pose after pose, or report."""
    rows = []
    if config.out.exists():
        rows = [json.loads(line) for line in config.out.read_text().splitlines()]
    if not config.report:
        done = {(row["object"], row["pose"]) for row in rows}
        planner = Planner()
        for pose in range(config.poses):
            for split in SPLITS:
                for name in object_names(split):
                    if (name, pose) in done:
                        continue
                    rows.append(measure(name, split, pose, config.seed, planner))
                    with config.out.open("a") as file:
                        file.write(json.dumps(rows[-1]) + "\n")
    report(rows)


if __name__ == "__main__":
    main(tyro.cli(BenchConfig, description=__doc__))
