"""Evaluate policies: the protocol's suites, or random scenes, many episodes, one report.

    python -m sr_mj.eval --suite grasp --policy sr grounding --out outputs/grasp
    python -m sr_mj.eval --suite all --policy sr sr@mine.safetensors --workers 2 --out outputs/all
    python -m sr_mj.eval --suite all --policy sr sr@mine.safetensors --out outputs/all --resume
    python -m sr_mj.eval --scene cluttered15 --seeds 100 120 --policy grounding --out outputs/dev
    python -m sr_mj.eval --report outputs/grasp outputs/place --out outputs/both

Every policy runs the same scenes with the same seeds; `oracle`, which reads ground truth, and
`random` always run along. One line of JSON an episode is kept as it ends: killed at any moment, the
command goes on with `--resume`. The report is made from those lines alone.
"""

import sys
import time
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from sr_mj.cli import run_command
from sr_mj.errors import ConfigError

if TYPE_CHECKING:
    from sr_mj.evaluation.plan import Episode, PolicyChoice
    from sr_mj.evaluation.results import ResultFolder
    from sr_mj.evaluation.setting import Setting

MAX_WORKERS = 256


@dataclass(frozen=True, kw_only=True)
class EvalConfig:
    """Options of `python -m sr_mj.eval`."""

    suite: tuple[str, ...] = ()
    """What to run: grasp, place, pick-place, heavy30, paraphrase (goals in other words), noise (of
    points and sensor), perturbation (of the executed place pose), or all."""
    scene: str | None = None
    """Kind of random scene (cluttered15, heavy30, ...) instead of a suite, for development; every
    seed is a scene."""
    split: Literal["seen", "unseen", "both"] = "both"
    """Objects. Random scenes with both are made of seen objects."""
    policy: tuple[str, ...] = ("sr",)
    """Policies to compare, besides oracle and random: NAME, or NAME@CHECKPOINT for weights of your
    own, which results call NAME@ and the file's stem."""
    runs: int = 15
    """Runs of every arrangement, with seeds from 0 on."""
    seeds: Annotated[tuple[int, int] | None, tyro.conf.arg(metavar="FIRST END")] = None
    """First seed and one past the last, instead of --runs."""
    arrangements: tuple[str, ...] = ()
    """Only these arrangements of the suites, such as grasp-seen-03."""
    conditions: tuple[str, ...] = ()
    """Instead of the suites' own: clean, reworded, points-SIGMA (half extents of the workspace),
    l515-FACTORx, pose-CMcm-DEGdeg."""
    attempts: int = 8
    """Grasps that may be tried; placing is tried once."""
    generator: str = "antipodal"
    """Where grasps come from; as in `sr_mj.run`."""
    encoder: str = "embedded"
    """Image and text encoder; as in `sr_mj.run`."""
    cameras: str = "sr"
    """Camera preset: sr or a2."""
    keep_unreachable: bool = False
    """Leave what the arm cannot reach to the policy, as the paper does."""
    workers: int = 1
    """Processes, of one thread and some 2 GB each. Their number does not change the results."""
    ray: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS")] = None
    """Run on a Ray cluster instead: its address, or "local" for one on this machine."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Folder for lines, configuration and report."""
    resume: bool = False
    """Go on with what the folder already has; may add policies, suites and seeds to it."""
    retry_errors: bool = False
    """With --resume: run episodes again that ended in an exception."""
    pictures: bool = False
    """Keep pictures of the first run of every arrangement: first view, choice, outcome."""
    report: Annotated[tuple[Path, ...], tyro.conf.arg(metavar="PATH")] = ()
    """Run nothing; make one report of these folders or files of lines."""
    allow_download: bool = False
    """Let the encoder fetch missing weights from the hub."""


def _check(config: EvalConfig) -> None:
    """Refuse what can be refused before anything heavy is loaded."""
    if config.out is None:
        raise ConfigError("No --out is given; name a folder for the results.")
    if bool(config.suite) + bool(config.scene) + bool(config.report) != 1:
        raise ConfigError("Give one of --suite, --scene and --report.")
    if config.scene and config.seeds is None:
        raise ConfigError(
            "Random scenes need --seeds: the first seed and one past the last, for example "
            "--seeds 100 120."
        )
    if config.scene and config.arrangements:
        raise ConfigError("--arrangements restricts suites; leave it or --scene out.")
    if config.retry_errors and not config.resume:
        raise ConfigError("--retry-errors goes with --resume.")
    for name, value, largest in (
        ("Runs", config.runs, 10_000),
        ("Attempts", config.attempts, 100),
        ("Workers", config.workers, MAX_WORKERS),
    ):
        if not 1 <= value <= largest:
            raise ConfigError(f"{name} is {value}; expected 1 to {largest}.")
    if config.seeds is not None and not 0 <= config.seeds[0] < config.seeds[1]:
        raise ConfigError(
            f"Seeds are {config.seeds[0]} {config.seeds[1]}; expected the first one, 0 or more, "
            "and one past the last."
        )


def run(config: EvalConfig) -> int:
    """Run what is missing, then write the report.

    Args:
        config: Options.

    Returns:
        Exit status 0: failures in the world are results, and so are episodes that ended in an
        exception, which are told.
    """
    _check(config)
    assert config.out is not None
    if config.report:
        from sr_mj.evaluation.report import merge_results, write_report

        lines, seconds, pictures = merge_results(config.report)
        config.out.mkdir(parents=True, exist_ok=True)
        print(write_report(config.out, lines, seconds, pictures))
        return 0
    from sr_mj.gl import select_backend

    # Before anything imports dm_control, which binds OpenGL to one library for good.
    select_backend()
    from sr_mj.evaluation.plan import read_policies
    from sr_mj.evaluation.report import write_report
    from sr_mj.evaluation.results import ResultFolder

    # Mistakes first: nothing is made before every name is known to exist.
    policies = read_policies(config.policy)
    episodes = _plan(config, policies)
    setting = _setting(config, policies, config.seeds[0] if config.seeds else 0)
    with ResultFolder(config.out, resume=config.resume) as folder:
        _run_missing(config, episodes, setting, folder)
        print(write_report(config.out, folder.lines, folder.seconds, (config.out / "pictures",)))
    return 0


def _plan(config: EvalConfig, policies: "tuple[PolicyChoice, ...]") -> "tuple[Episode, ...]":
    from sr_mj.evaluation.plan import plan_random, plan_suites

    seeds = range(*config.seeds) if config.seeds else range(config.runs)
    conditions = config.conditions or None
    if config.scene:
        split = "seen" if config.split == "both" else config.split
        return plan_random(config.scene, split, seeds, policies, conditions=conditions)
    splits = ("seen", "unseen") if config.split == "both" else (config.split,)
    return plan_suites(
        config.suite, splits, seeds, policies, conditions=conditions, only=config.arrangements
    )


def _setting(
    config: EvalConfig, policies: "tuple[PolicyChoice, ...]", first_seed: int
) -> "Setting":
    """Load once what every worker will load, so that what is missing shows at once."""
    from models.cameras import camera_preset
    from perception.encoders import load_encoder
    from sr_mj.candidates.external import check_generator_name
    from sr_mj.evaluation.setting import PRIVILEGED_POLICIES, Setting, load_choice
    from sr_mj.provenance import git_revision, package_versions

    camera_preset(config.cameras)
    check_generator_name(config.generator)
    encoder = load_encoder(config.encoder, allow_download=config.allow_download)
    for choice in policies:
        if choice.name not in PRIVILEGED_POLICIES:
            load_choice(choice, encoder.fingerprints)
    assert config.out is not None
    return Setting(
        policies=policies,
        encoder=config.encoder,
        encoder_fingerprint=encoder.fingerprint,
        encoder_fingerprints=encoder.fingerprints,
        generator=config.generator,
        cameras=config.cameras,
        attempts=config.attempts,
        keep_unreachable=config.keep_unreachable,
        allow_download=config.allow_download,
        pictures=config.out.resolve() / "pictures" if config.pictures else None,
        picture_seeds=(first_seed,),
        versions=package_versions(),
        revision=git_revision(),
    )


def _run_missing(
    config: EvalConfig,
    episodes: "tuple[Episode, ...]",
    setting: "Setting",
    folder: "ResultFolder",
) -> None:
    """Run what the folder does not have yet, and tell what ended in an exception."""
    from tqdm import tqdm

    from sr_mj.evaluation.identity import Identity
    from sr_mj.evaluation.plan import Episode
    from sr_mj.evaluation.pool import run_episodes
    from sr_mj.provenance import to_json

    start, identity = time.perf_counter(), Identity(setting)
    # Every line, planned now or not: all of them end in the same rows of the report.
    for episode, record in folder.lines.items():
        identity.check(episode, record)
    about = {"config": config, "git_revision": setting.revision, "versions": setting.versions}
    (folder.path / "run.json").write_text(to_json(about))
    done = folder.lines
    # What is run again stays on the disk until it has a new result.
    failed = {e for e in done if done[e]["error"]} if config.retry_errors else set[Episode]()
    missing = [episode for episode in episodes if episode not in done or episode in failed]
    lost: list[str] = []
    with closing(run_episodes(missing, setting, workers=config.workers, ray=config.ray)) as running:
        for ended in tqdm(running, desc="episodes", total=len(missing)):
            folder.add(ended)
            lost += [] if ended.lost_pictures is None else [ended.lost_pictures]
    folder.finish()
    if lost:
        print(
            f"Pictures of {len(lost)} episodes could not be kept ({lost[0]}); their results are.",
            file=sys.stderr,
        )
    num_errors = sum(line["error"] is not None for line in folder.lines.values())
    if num_errors:
        print(
            f"{num_errors} episodes ended in an exception and count as failures; "
            f"{folder.path / 'errors.txt'} has them, --resume --retry-errors runs them again.",
            file=sys.stderr,
        )
    print(
        f"{len(missing)} episodes in {time.perf_counter() - start:.0f} s, "
        f"{len(episodes) - len(missing)} were there already"
    )


def main() -> None:
    """Entry point of the command line."""
    run_command(EvalConfig, run, description=__doc__ or "")


if __name__ == "__main__":
    sys.exit(main())
