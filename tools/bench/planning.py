"""Measure the planner on noisy clouds of simulated scenes.

    python -m tools.bench.planning --scenes 20 --seed 100

For every scene: the verdict on all grasp candidates at once, the plan for the best-scored one, and
plans for a part of the others, each alone, with which the verdict is compared. Then every third of
the first candidates is taken as grasped: its object's points leave the cloud, and a place for it
is planned. Times are CPU times of this process. Prints a markdown table; `--json` writes a summary.
"""

import json
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import tyro
from scipy.spatial import KDTree

from perception.cloud import GeometryCloud
from policy.actions import ActionCandidates
from sr_mj.candidates import AntipodalSampler
from sr_mj.candidates.held import HeldObject, held_object
from sr_mj.candidates.placing import SurfacePlacer
from sr_mj.planning import Phase, Plan, Planner
from sr_mj.scene import SceneConfig, make_scene
from sr_mj.scene.config import Split
from tools.bench.candidates import look

_HELD_MARGIN_M = 0.008


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """What to measure.

    Attributes:
        scenes: Number of scenes.
        seed: Seed of the first scene.
        kind: Kind of scene.
        split: Objects.
        stride: Every so many candidates one is planned alone.
        places: Placements planned a scene.
        json: File for the summary.
    """

    scenes: int = 20
    seed: int = 100
    kind: str = "cluttered15"
    split: Split = "seen"
    stride: int = 10
    places: int = 3
    json: Path | None = None


@dataclass(kw_only=True)
class Tally:
    """Decisions of one kind.

    Attributes:
        planned: Decisions with a plan.
        best: Decisions whose best-scored candidate has the plan.
        searched: Phases for which the sampling planner was needed.
        plan_s: CPU time of every decision.
        verdict_s: CPU time of every verdict on all candidates.
        motion_s: Simulated time that the arm moves in every plan.
        reachable: Share of candidates with a good verdict, a decision.
    """

    planned: int = 0
    best: int = 0
    searched: Counter[Phase] = field(default_factory=Counter)
    plan_s: list[float] = field(default_factory=list)
    verdict_s: list[float] = field(default_factory=list)
    motion_s: list[float] = field(default_factory=list)
    reachable: list[float] = field(default_factory=list)

    def decide(
        self,
        planner: Planner,
        candidates: ActionCandidates,
        obstacles: np.ndarray,
        held: HeldObject | None = None,
        start: np.ndarray | None = None,
    ) -> Plan | None:
        """Plan the best-scored candidate that can be reached, as an episode does."""
        began = time.process_time()
        verdict = planner.reachable(candidates)
        self.verdict_s.append(time.process_time() - began)
        self.reachable.append(float(verdict.mean()))
        best_first = np.argsort(-candidates.prior, kind="stable")
        order = best_first[verdict[best_first]]
        began = time.process_time()
        plan = planner.plan(candidates, order, obstacles=obstacles, held=held, start=start)
        self.plan_s.append(time.process_time() - began)
        if plan is not None:
            self.planned += 1
            self.best += plan.chosen == best_first[0]
            self.searched.update(plan.searched)
            moves = (segment.trajectory for segment in plan.segments)
            self.motion_s.append(sum(move.duration_s for move in moves if move is not None))
        return plan

    def summary(self) -> dict[str, float]:
        """Reduce to ratios and percentiles."""
        count = max(len(self.plan_s), 1)
        return {
            "decisions": len(self.plan_s),
            "planned": self.planned / count,
            "best_planned": self.best / count,
            "searched": self.searched.total() / count,
            "reachable": float(np.mean(self.reachable)),
            "verdict_p50_s": float(np.percentile(self.verdict_s, 50)),
            "verdict_p95_s": float(np.percentile(self.verdict_s, 95)),
            "plan_p50_s": float(np.percentile(self.plan_s, 50)),
            "plan_p95_s": float(np.percentile(self.plan_s, 95)),
            "plan_max_s": float(np.max(self.plan_s)),
            "motion_s": float(np.mean(self.motion_s)),
        }


def agreement(
    planner: Planner, picks: ActionCandidates, obstacles: np.ndarray, stride: int
) -> Counter[str]:
    """Compare the verdict with plans of single candidates."""
    verdict, counts = planner.reachable(picks), Counter()
    for index in range(0, len(picks), stride):
        plan = planner.plan(picks, np.array([index]), obstacles=obstacles)
        good = "reachable" if verdict[index] else "unreachable"
        counts[f"{good}, {'a plan' if plan else 'no plan'}"] += 1
    return counts


def without_object(cloud: GeometryCloud, held: HeldObject) -> GeometryCloud:
    """Take the points of a held object out of the cloud that it was seen in."""
    pose = held.T_world_tool
    there = held.points_tool @ pose[:3, :3].T + pose[:3, 3]
    stays = KDTree(there).query(cloud.points)[0] > _HELD_MARGIN_M
    return GeometryCloud(
        points=cloud.points[stays], colors=cloud.colors[stays], normals=cloud.normals[stays]
    )


def place_some(
    planner: Planner, cloud: GeometryCloud, picks: ActionCandidates, num: int, tally: Tally
) -> None:
    """Plan places for what some of the grasps hold."""
    rng = np.random.default_rng(0)
    for index in range(0, min(3 * num, len(picks)), 3):
        pick = planner.plan(picks, np.array([index]), obstacles=cloud.points)
        if pick is None:
            continue
        moves = {segment.phase: segment.trajectory for segment in pick.segments}
        carry = moves[Phase.CARRY]
        assert carry is not None
        held = held_object(cloud, picks.Ts_world_tool[index], float(picks.width_m[index]))
        rest = without_object(cloud, held)
        places = SurfacePlacer().place(rest, held, rng)
        if len(places):
            tally.decide(planner, places, rest.points, held, carry.end)


def main(config: BenchConfig) -> None:
    """Measure scene after scene and print."""
    planner, picked, placed, agreed = Planner(), Tally(), Tally(), Counter[str]()
    for seed in range(config.seed, config.seed + config.scenes):
        scene = make_scene(SceneConfig(scene=config.kind, split=config.split, seed=seed))
        cloud, _ = look(scene, seed)
        picks = AntipodalSampler().pick(cloud, np.random.default_rng(seed))
        if not len(picks):
            continue
        picked.decide(planner, picks, cloud.points)
        agreed += agreement(planner, picks, cloud.points, config.stride)
        place_some(planner, cloud, picks, config.places, placed)
    summary = {"pick": picked.summary(), "place": placed.summary()}
    print("| | pick | place |\n| --- | --- | --- |")
    for name in summary["pick"]:
        print(f"| {name} | {summary['pick'][name]:.3g} | {summary['place'][name]:.3g} |")
    print("verdict against single plans: " + ", ".join(f"{k} {n}" for k, n in agreed.items()))
    if config.json is not None:
        config.json.write_text(json.dumps(summary | {"verdict": agreed}, indent=2) + "\n")


if __name__ == "__main__":
    main(tyro.cli(BenchConfig))
