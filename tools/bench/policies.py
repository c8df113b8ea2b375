"""Compare policies on the same scenes and seeds: random scenes, or fixed arrangements.

    python -m tools.bench.policies --policies oracle grounding random --seeds 0 20
    python -m tools.bench.policies --policies oracle --scene place8 --seeds 100 130
    python -m tools.bench.policies --policies oracle --suite place --split unseen --seeds 0 15

Scenes `place8` and `pickplace8` get random goals with a place part. Writes one JSON line an episode
as it ends, skips what the file already has, and prints success with 95 % Wilson intervals, the
causes of failure, and how attempts ended.
"""

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
import tyro
from tqdm import tqdm

from sr_mj.gl import select_backend

if TYPE_CHECKING:
    from models.workspace import Workspace
    from perception.lifter import MultiViewLifter
    from sr_mj.planning import Planner
    from sr_mj.scene import Scene


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """What to run.

    Attributes:
        policies: Names of policies.
        scene: Kind of random scene.
        suite: Arrangements to run instead.
        split: Objects.
        seeds: First seed and one past the last.
        attempts: Grasps an episode.
        perturb_cm: Standard deviation of an error added to executed positions.
        perturb_deg: Standard deviation of an error added to executed orientations.
        encoder: Image and text encoder; "blank" gives every point the same feature, which spares
            the time of a network to policies that do not look: oracle and random.
        out: File of JSON lines.
    """

    policies: tuple[str, ...] = ("oracle", "grounding", "random")
    scene: str = "cluttered15"
    suite: Literal["grasp", "place", "pick-place", "heavy30"] | None = None
    split: Literal["seen", "unseen"] = "seen"
    seeds: tuple[int, int] = (0, 20)
    attempts: int = 8
    perturb_cm: float = 0.0
    perturb_deg: float = 0.0
    encoder: str = "embedded"
    out: Path = Path("outputs/policies.jsonl")


def wilson_interval(successes: int, runs: int, z: float = 1.96) -> tuple[float, float]:
    """Return the 95 % Wilson score interval of a success rate."""
    rate, spread = successes / runs, z**2 / runs
    center = (rate + spread / 2) / (1 + spread)
    half = z * np.sqrt(rate * (1 - rate) / runs + spread / (4 * runs)) / (1 + spread)
    return float(center - half), float(center + half)


def episodes(config: BenchConfig) -> Iterator[dict]:
    """List what to run: policy, scene or arrangement, seed, and what else tells episodes apart."""
    from models.arrangements.library import arrangement_names

    names = (
        [config.scene] if config.suite is None else arrangement_names(config.suite, config.split)
    )
    for policy in config.policies:
        for name in names:
            for seed in range(*config.seeds):
                yield {
                    "policy": policy,
                    "name": name,
                    "of_split": config.split,
                    "run_seed": seed,
                    "perturb": [config.perturb_cm, config.perturb_deg],
                }


def make_bench_scene(config: BenchConfig, name: str, seed: int) -> "Scene":
    """Make the scene of an episode; arrangements are the same for every seed."""
    from sr_mj.scene import SceneConfig, make_scene
    from tools.bench.place_goals import make_place_scene

    if config.suite is not None:
        return make_scene(SceneConfig(arrangement=name))
    if name in ("place8", "pickplace8"):
        return make_place_scene(name, config.split, seed)
    return make_scene(SceneConfig(scene=name, split=config.split, seed=seed))


def run_one(config: BenchConfig, episode: dict) -> dict:
    """Run one episode and return its record."""
    from sr_mj.account import episode_record
    from sr_mj.assemble import assembled, make_policy
    from sr_mj.episode import run_episode
    from sr_mj.perturbation import PosePerturbation

    seed = episode["run_seed"]
    scene = make_bench_scene(config, episode["name"], seed)
    perturbation = PosePerturbation(sigma_m=config.perturb_cm / 100, sigma_deg=config.perturb_deg)
    with assembled(
        scene,
        lifter=_lifter(scene.workspace, config.encoder),
        policy=make_policy(episode["policy"], scene),
        planner=_planner(),
        perturbation=perturbation if config.perturb_cm or config.perturb_deg else None,
    ) as pipeline:
        attempts = list(run_episode(scene, pipeline, seed=seed, max_attempts=config.attempts))
    return {**episode, **episode_record(scene, attempts, config.attempts)}


@cache
def _lifter(workspace: "Workspace", encoder: str) -> "MultiViewLifter":
    from perception.lifter import MultiViewLifter
    from sr_mj.assemble import lifter_config, lifter_for
    from tools.bench.blank_encoder import BlankEncoder

    if encoder == BlankEncoder.name:
        return MultiViewLifter(BlankEncoder(), lifter_config(workspace))
    return lifter_for(workspace, encoder)


@cache
def _planner() -> "Planner":
    from sr_mj.planning import Planner

    return Planner()


def cause(record: dict) -> str:
    """Say why an episode failed: how its last attempt ended, and in which part."""
    if not record["attempts"]:
        return "nothing tried"
    last = record["attempts"][-1]
    part = "hand-over" if last["is_hand_over"] else last["kind"]
    return f"{part}: {last['reason']}"


def report(records: list[dict]) -> None:
    """Print a line a policy, then the causes of failure, then what failed."""
    for policy in dict.fromkeys(record["policy"] for record in records):
        mine = [record for record in records if record["policy"] == policy]
        wins = sum(record["success"] for record in mine)
        low, high = wilson_interval(wins, len(mine))
        actions = np.mean([record["num_actions"] for record in mine])
        attempts = [attempt for record in mine for attempt in record["attempts"]]
        seconds = np.mean([sum(attempt["seconds"].values()) for attempt in attempts])
        reasons = Counter(f"{a['kind']} {a['reason']}" for a in attempts)
        print(
            f"{policy:10s} {wins}/{len(mine)} = {wins / len(mine):.1%} "
            f"[{low:.1%}, {high:.1%}], {actions:.2f} actions, {seconds:.1f} s an attempt"
        )
        failed = [record for record in mine if not record["success"]]
        for reason, count in Counter(map(cause, failed)).most_common():
            low, high = wilson_interval(count, len(mine))
            print(f"  failed, {reason}: {count} = {count / len(mine):.1%} [{low:.1%}, {high:.1%}]")
        print("  attempts: " + ", ".join(f"{name} {n}" for name, n in reasons.most_common()))
        for record in failed:
            print(f"    {record['name']} {record['run_seed']}: {record['goal']!r}, {cause(record)}")


def main(config: BenchConfig) -> None:
    """Run what is missing, then report."""
    select_backend()
    config.out.parent.mkdir(parents=True, exist_ok=True)
    lines = config.out.read_text().splitlines() if config.out.exists() else []
    records = {_key(record): record for record in map(json.loads, lines)}
    wanted = [(_key(episode), episode) for episode in episodes(config)]
    with config.out.open("a") as file:
        for key, episode in tqdm([(k, e) for k, e in wanted if k not in records], desc="episodes"):
            records[key] = run_one(config, episode)
            file.write(json.dumps(records[key]) + "\n")
            file.flush()
    report([records[key] for key, _ in wanted])


def _key(record: dict) -> str:
    names = ("policy", "name", "of_split", "run_seed", "perturb")
    return json.dumps([record.get(name) for name in names])


if __name__ == "__main__":
    main(tyro.cli(BenchConfig, description=__doc__))
