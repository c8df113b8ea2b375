"""Compare policies on random scenes: the same scenes and seeds for every policy.

    python -m tools.bench.policies --policies oracle grounding random --seeds 0 20

Writes one JSON line an episode as it ends, skips what the file already has, and prints success
within the attempts with 95 % Wilson intervals.
"""

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from tqdm import tqdm

from sr_mj.gl import select_backend


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """What to run.

    Attributes:
        policies: Names of policies.
        scene: Kind of scene.
        split: Objects.
        seeds: First seed and one past the last.
        attempts: Grasps an episode.
        encoder: Image and text encoder.
        out: File of JSON lines.
    """

    policies: tuple[str, ...] = ("oracle", "grounding", "random")
    scene: str = "cluttered15"
    split: str = "seen"
    seeds: tuple[int, int] = (0, 20)
    attempts: int = 8
    encoder: str = "embedded"
    out: Path = Path("outputs/policies.jsonl")


def wilson_interval(successes: int, runs: int, z: float = 1.96) -> tuple[float, float]:
    """Return the 95 % Wilson score interval of a success rate."""
    rate, spread = successes / runs, z**2 / runs
    center = (rate + spread / 2) / (1 + spread)
    half = z * np.sqrt(rate * (1 - rate) / runs + spread / (4 * runs)) / (1 + spread)
    return float(center - half), float(center + half)


def run_one(config: BenchConfig, policy: str, seed: int) -> dict:
    """Run one episode and return its record."""
    from sr_mj.account import episode_record
    from sr_mj.assemble import assembled, lifter_for, make_policy
    from sr_mj.episode import run_episode
    from sr_mj.scene import SceneConfig, make_scene

    scene = make_scene(SceneConfig(scene=config.scene, split=config.split, seed=seed))  # pyright: ignore[reportArgumentType]
    lifter = lifter_for(scene.workspace, config.encoder)
    with assembled(scene, lifter=lifter, policy=make_policy(policy, scene)) as pipeline:
        attempts = list(run_episode(scene, pipeline, seed=seed, max_attempts=config.attempts))
    return {"policy": policy, **episode_record(scene, attempts, config.attempts)}


def report(records: list[dict]) -> None:
    """Print a line a policy: success, interval, steps, seconds, reasons."""
    for policy in dict.fromkeys(record["policy"] for record in records):
        mine = [record for record in records if record["policy"] == policy]
        wins = sum(record["success"] for record in mine)
        low, high = wilson_interval(wins, len(mine))
        steps = np.mean([record["num_attempts"] for record in mine])
        attempts = [attempt for record in mine for attempt in record["attempts"]]
        seconds = np.mean([sum(attempt["seconds"].values()) for attempt in attempts])
        reasons = Counter(attempt["reason"] for attempt in attempts)
        print(
            f"{policy:10s} {wins}/{len(mine)} = {wins / len(mine):.0%} "
            f"[{low:.0%}, {high:.0%}], {steps:.2f} attempts, {seconds:.1f} s an attempt, "
            + ", ".join(f"{name} {count}" for name, count in reasons.most_common())
        )


def main(config: BenchConfig) -> None:
    """Run what is missing, then report."""
    select_backend()
    config.out.parent.mkdir(parents=True, exist_ok=True)
    lines = config.out.read_text().splitlines() if config.out.exists() else []
    records = [json.loads(line) for line in lines]
    done = {(record["policy"], record["seed"]) for record in records}
    todo = [(p, s) for p in config.policies for s in range(*config.seeds) if (p, s) not in done]
    with config.out.open("a") as file:
        for policy, seed in tqdm(todo, desc="episodes"):
            record = run_one(config, policy, seed)
            records.append(record)
            file.write(json.dumps(record) + "\n")
            file.flush()
    report(records)


if __name__ == "__main__":
    main(tyro.cli(BenchConfig, description=__doc__))
