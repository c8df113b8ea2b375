"""Grasp whatever is easiest out of random heaps: the best-scored candidate, attempt after attempt.

    python -m tools.bench.heaps --out heaps.jsonl --scenes 100 --seed 300
    python -m tools.bench.heaps --out heaps.jsonl --report

Before every attempt the heap is looked at anew; the grasp with the best prior that can be planned
is carried out and what is held goes into the bin. An attempt counts if something was lifted and was
still held over the bin, whatever it was; objects in the bin tell whether there were two at once.
Every attempt is a line of the file; scenes that the file has in full are not done again.
"""

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from models.tabletop import BIN_CENTER, BIN_HALF_M
from sr_mj.candidates import AntipodalSampler
from sr_mj.execution import Executor
from sr_mj.planning import Planner
from sr_mj.scene import Scene, SceneConfig, make_scene
from sr_mj.scene.config import Split
from tools.bench.candidates import TrueScene, look
from tools.bench.singles import HELD, wilson


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """What to measure.

    Attributes:
        out: JSON lines, one an attempt.
        scenes: Number of scenes.
        seed: Seed of the first scene.
        attempts: Attempts in each.
        kind: Kind of scene.
        split: Objects.
        report: Only report what the file has.
    """

    out: Path
    scenes: int = 100
    seed: int = 300
    attempts: int = 2
    kind: str = "cluttered15"
    split: Split = "seen"
    report: bool = False


def in_bin(scene: Scene) -> set[str]:
    """Name the objects over or in the bin."""
    return {
        item.name
        for item in scene.objects
        if np.all(np.abs(scene.T_world_object(item.name)[:2, 3] - BIN_CENTER[:2]) < BIN_HALF_M)
    }


def attempt(scene: Scene, planner: Planner, seed: int) -> dict[str, Any]:
    """Look, propose, plan the best-scored candidate and carry it out."""
    cloud, _ = look(scene, seed)
    sampler = AntipodalSampler()
    picks = sampler.pick(cloud, np.random.default_rng(seed))
    if not len(picks):
        return {"candidates": 0, "outcome": "no_candidate"}
    plan = planner.plan(picks, np.argsort(-picks.prior, kind="stable"), obstacles=cloud.points)
    if plan is None:
        return {"candidates": len(picks), "outcome": "unreachable"}
    chosen = np.array([plan.chosen])
    aimed, is_good = TrueScene(scene).judge(
        picks.Ts_world_tool[chosen], sampler.approach_opening(picks.width_m[chosen])
    )
    before = in_bin(scene)
    outcome = Executor(scene).execute(plan)
    return {
        "candidates": len(picks),
        "outcome": str(outcome.reason),
        "held": outcome.grasped,
        "aimed": scene.objects[aimed[0]].name if aimed[0] >= 0 else None,
        "good": bool(is_good[0]),
        "in_bin": sorted(in_bin(scene) - before),
        "knocked_off": list(outcome.knocked_off),
        "prior": round(float(picks.prior[plan.chosen]), 3),
        "width_m": round(float(picks.width_m[plan.chosen]), 4),
        "tilt_deg": round(float(np.degrees(np.arccos(-plan.T_world_tool[2, 2].clip(-1, 1)))), 1),
    }


def measure(config: BenchConfig, seed: int, planner: Planner) -> list[dict[str, Any]]:
    """Make one scene, and attempts in it."""
    scene = make_scene(SceneConfig(scene=config.kind, split=config.split, seed=seed))
    return [
        {"seed": seed, "attempt": index} | attempt(scene, planner, 10 * seed + index)
        for index in range(config.attempts)
    ]


def report(rows: list[dict[str, Any]]) -> None:
    """Print the share that was held, and what the others ended with."""
    held = sum(row["outcome"] in HELD for row in rows)
    pairs = sum(len(row.get("in_bin", ())) > 1 for row in rows)
    print(f"lifted and held: {held} of {len(rows)}: {wilson(held, len(rows))}")
    print(f"of these, two objects at once: {pairs}")
    causes = Counter(row["outcome"] for row in rows if row["outcome"] not in HELD)
    print("lost: " + ", ".join(f"{cause} {n}" for cause, n in causes.most_common()))


def main(config: BenchConfig) -> None:
    """Go through the scenes, or report."""
    rows: list[dict[str, Any]] = []
    if config.out.exists():
        rows = [json.loads(line) for line in config.out.read_text().splitlines()]
    if not config.report:
        done, planner = {row["seed"] for row in rows}, Planner()
        for seed in range(config.seed, config.seed + config.scenes):
            if seed in done:
                continue
            new = measure(config, seed, planner)
            with config.out.open("a") as file:
                file.write("".join(json.dumps(row) + "\n" for row in new))
            rows += new
    report(rows)


if __name__ == "__main__":
    main(tyro.cli(BenchConfig, description=__doc__))
