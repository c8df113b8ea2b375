"""Compare policies on the same random scenes, those for placing included, or on arrangements.

    python -m tools.bench.policies --policies oracle grounding random --seeds 0 20
    python -m tools.bench.policies --policies oracle --scene place8 --seeds 100 130
    python -m tools.bench.policies --policies oracle --suite place --split unseen --seeds 0 15
    python -m tools.bench.policies --policies sr a2 --suite grasp --conditions points-0.1 l515-2x

For development: unlike `python -m sr_mj.eval`, whose harness this uses, it runs only the policies
that are named, and scenes `place8` and `pickplace8` get random goals with a place part. Episodes
are kept as they end, and those that the folder already has are skipped. Prints success with 95 %
Wilson intervals, the causes of failure, and how attempts ended.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from tqdm import tqdm

from sr_mj.cli import run_command
from sr_mj.evaluation.statistics import wilson
from sr_mj.gl import select_backend

if TYPE_CHECKING:
    from sr_mj.evaluation.plan import Episode
    from sr_mj.evaluation.setting import Setting
    from sr_mj.scene import Scene


PLACE_SCENES = ("place8", "pickplace8")
"""Kinds of random scenes that get goals with a place part."""


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """What to run.

    Attributes:
        policies: Names of policies, or NAME@CHECKPOINT.
        scene: Kind of random scene.
        suite: Arrangements to run instead.
        split: Objects.
        seeds: First seed and one past the last.
        attempts: Grasps an episode.
        conditions: What is made harder, as in docs/evaluation.md.
        encoder: Image and text encoder. Policies that do not look, oracle and random, are spared
            it in any case; "blank" spares it to all.
        workers: Processes.
        out: Folder of results; an ending .jsonl is left out of its name.
    """

    policies: tuple[str, ...] = ("oracle", "grounding", "random")
    scene: str = "cluttered15"
    suite: Literal["grasp", "place", "pick-place", "heavy30"] | None = None
    split: Literal["seen", "unseen"] = "seen"
    seeds: tuple[int, int] = (0, 20)
    attempts: int = 8
    conditions: tuple[str, ...] = ("clean",)
    encoder: str = "embedded"
    workers: int = 1
    out: Path = Path("outputs/policies")


def wilson_interval(successes: int, runs: int) -> tuple[float, float]:
    """Return the 95 % Wilson score interval of a success rate."""
    interval = wilson(successes, runs)
    return interval.low, interval.high


def make_place_goal_scene(episode: "Episode") -> "Scene":
    """Make the random scene of an episode in which something has to be placed."""
    from tools.bench.place_goals import make_place_scene

    split = "seen" if episode.split == "seen" else "unseen"
    return make_place_scene(episode.scene, split, episode.seed)


def bench_setting(config: BenchConfig) -> "Setting":
    """Say what all episodes share."""
    from perception.encoders import load_encoder
    from sr_mj.evaluation.plan import read_policies
    from sr_mj.evaluation.setting import BLANK, Setting
    from sr_mj.provenance import git_revision, package_versions

    encoder = None if config.encoder == BLANK else load_encoder(config.encoder)
    chosen = {choice.label: choice for choice in read_policies(config.policies)}
    # By its full name, so that other processes find it.
    from tools.bench import policies

    return Setting(
        policies=tuple(c for c in chosen.values() if _is_asked_for(c.label, config)),
        encoder=config.encoder,
        encoder_fingerprint=BLANK if encoder is None else encoder.fingerprint,
        encoder_fingerprints=(BLANK,) if encoder is None else tuple(encoder.fingerprints),
        attempts=config.attempts,
        versions=package_versions(),
        revision=git_revision(),
        scene_makers=dict.fromkeys(PLACE_SCENES, policies.make_place_goal_scene),
    )


def _is_asked_for(label: str, config: BenchConfig) -> bool:
    return label in config.policies or "@" in label


def bench_episodes(config: BenchConfig, setting: "Setting") -> "tuple[Episode, ...]":
    """List the episodes."""
    from sr_mj.evaluation.plan import plan_random, plan_suites

    conditions, seeds = config.conditions, range(*config.seeds)
    if config.suite is None:
        return plan_random(
            config.scene, config.split, seeds, setting.policies, conditions=conditions
        )
    return plan_suites(
        [config.suite], [config.split], seeds, setting.policies, conditions=conditions
    )


def report(records: list[dict[str, Any]]) -> None:
    """Print a line a policy, then the causes of failure, then what failed."""
    from sr_mj.evaluation.summary import attempt_outcomes, by_policy, causes, score

    for policy, mine in by_policy(records).items():
        s = score(policy, mine)
        wins = round(s.success.value * s.runs)
        print(
            f"{policy:10s} {wins}/{s.runs} = {s.success.value:.1%} "
            f"[{s.success.low:.1%}, {s.success.high:.1%}], {s.steps:.2f} actions"
        )
        for cause, count in causes(mine):
            share = wilson(count, s.runs)
            ends = f"[{share.low:.1%}, {share.high:.1%}]"
            print(f"  failed, {cause}: {count} = {share.value:.1%} {ends}")
        print("  attempts: " + ", ".join(f"{name} {n}" for name, n in attempt_outcomes(mine)))
        for record in mine:
            if not record["success"]:
                goal = record.get("goal", "")
                print(f"    {record['scene']} {record['seed']}: {goal!r}, {record['cause']}")


def main(config: BenchConfig) -> int:
    """Run what is missing, then report."""
    select_backend()
    from sr_mj.evaluation.identity import Identity
    from sr_mj.evaluation.pool import run_episodes
    from sr_mj.evaluation.results import ResultFolder

    setting = bench_setting(config)
    episodes, identity = bench_episodes(config, setting), Identity(setting)
    out = config.out.with_suffix("") if config.out.suffix == ".jsonl" else config.out
    with ResultFolder(out, resume=True) as folder:
        for episode in episodes:
            if episode in folder.lines:
                identity.check(episode, folder.lines[episode])
        missing = [episode for episode in episodes if episode not in folder.lines]
        running = run_episodes(missing, setting, workers=config.workers)
        for done in tqdm(running, desc="episodes", total=len(missing)):
            folder.add(done)
        folder.finish()
        for condition in dict.fromkeys(episode.condition for episode in episodes):
            print(condition)
            report([folder.lines[e] for e in episodes if e.condition == condition])
    return 0


if __name__ == "__main__":
    run_command(BenchConfig, main, __doc__ or "")
