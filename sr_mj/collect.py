"""Collect demonstrations: an expert that knows the truth picks and places in random scenes.

    python -m sr_mj.collect --out demos --pick 3000 --place 2000 --workers 2
    python -m sr_mj.collect --out demos --verify

Only what was executed and succeeded is stored, one file a scene. It may be stopped at any moment;
the same command goes on where it was. Scenes have seeds from 10 000 000 on and objects of the seen
split, so that none of the evaluation's is among them.
"""

import contextlib
import sys
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from sr_mj.cli import run_command
from sr_mj.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Generator

    from sr_mj.collecting.schedule import Schedule
    from sr_mj.collecting.work import SceneResult

MAX_DECISIONS = 1_000_000


@dataclass(frozen=True, kw_only=True)
class CollectConfig:
    """Options of `python -m sr_mj.collect`."""

    out: Annotated[Path, tyro.conf.arg(metavar="DIR")]
    """Folder of the demonstrations; new, or one to go on with."""
    pick: int = 2500
    """Decisions to pick that the folder shall have."""
    place: int = 2000
    """Decisions to place that the folder shall have."""
    workers: int | None = None
    """Processes, one thread each; by default one a core, or one a processor of the cluster."""
    seed: int = 0
    """Number of the run; runs with different numbers have no scene in common."""
    encoder: str = "embedded"
    """Image and text encoder: embedded, or ViT-L-14, ViT-B-16, ... from open_clip."""
    allow_download: bool = False
    """Let the encoder fetch missing weights from the hub."""
    ray: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS")] = None
    """Work on a Ray cluster: auto, HOST:PORT, ray://HOST:PORT, or local to start one here. Its
    machines need this package and Ray."""
    verify: bool = False
    """Only read everything that the folder has, and compare it with what was written."""


def _check(config: CollectConfig) -> None:
    """Refuse what can be refused before anything heavy is loaded."""
    for name in ("pick", "place"):
        value = getattr(config, name)
        if not 0 <= value <= MAX_DECISIONS:
            raise ConfigError(f"Option --{name} is {value}; expected 0 to {MAX_DECISIONS}.")
    if config.workers is not None and config.workers < 1:
        raise ConfigError(f"Option --workers is {config.workers}; expected at least 1.")


def run(config: CollectConfig) -> int:
    """Collect until the folder has what was asked for, or check what it has.

    Args:
        config: Options.

    Returns:
        Exit status: 0, or 1 if something is damaged.
    """
    _check(config)
    return _verify(config.out) if config.verify else _collect(config)


def _verify(out: Path) -> int:
    from policy.demonstrations import DemonstrationFolder

    folder = DemonstrationFolder(out)
    problems = folder.verify()
    for problem in problems:
        print(problem, file=sys.stderr)
    counts = {phase: folder.phases.count(phase) for phase in ("pick", "place")}
    print(
        f"{len(folder)} decisions ({counts['pick']} pick, {counts['place']} place) in "
        f"{len(folder.shards)} scenes, encoder {folder.encoder}, "
        + (f"{len(problems)} files damaged" if problems else "all as they were written")
    )
    return 1 if problems else 0


def _collect(config: CollectConfig) -> int:
    from perception.encoders import load_encoder
    from sr_mj.collecting.folder import check_disk, estimate_bytes, open_folder
    from sr_mj.collecting.schedule import Schedule
    from sr_mj.collecting.tasks import SceneTask

    SceneTask(phase="pick", number=0, run=config.seed)
    encoder = load_encoder(config.encoder, allow_download=config.allow_download)
    stock = open_folder(config.out, encoder.fingerprint, encoder.feature_dim)
    schedule = Schedule({"pick": config.pick, "place": config.place}, stock, config.seed)
    missing = config.pick + config.place - schedule.num_stored
    wanted = estimate_bytes(missing, encoder.feature_dim)
    check_disk(config.out, wanted)
    print(
        f"{config.out}: {schedule.stored['pick']} decisions to pick, {schedule.stored['place']} to "
        f"place; {missing} are missing, which take about {wanted / 1e9:.2f} GB"
    )
    del encoder
    start, before = time.perf_counter(), sum(schedule.stored.values())
    try:
        _work(config, schedule)
    except KeyboardInterrupt:
        print("interrupted; what is stored is whole, the same command goes on", file=sys.stderr)
        return 130
    finally:
        _account(config, schedule, before, time.perf_counter() - start)
    return 0


def _work(config: CollectConfig, schedule: "Schedule") -> None:
    from tqdm import tqdm

    from sr_mj.collecting.folder import save
    from sr_mj.collecting.schedule import describe_reasons

    total = sum(schedule.targets.values())
    with (
        contextlib.closing(_results(config, schedule)) as results,
        tqdm(total=total, initial=schedule.num_stored, unit=" decisions") as bar,
    ):
        for result in results:
            save(config.out, result)
            schedule.record(result)
            if result.error is not None:
                bar.write(f"{result.task.name}: {result.error}", file=sys.stderr)
            stored = schedule.stored
            bar.set_postfix_str(
                f"pick {stored['pick']}, place {stored['place']}; not stored: "
                f"{describe_reasons(schedule.reasons) or 'none'}",
                refresh=False,
            )
            bar.update(schedule.num_stored - bar.n)


def _results(config: CollectConfig, schedule: "Schedule") -> "Generator[SceneResult]":
    from sr_mj.collecting.pool import run_scenes
    from sr_mj.collecting.start import start_worker
    from sr_mj.collecting.work import WorkSetting

    setting = WorkSetting(encoder=config.encoder, allow_download=config.allow_download)
    make_work = partial(start_worker, setting)
    return run_scenes(make_work, schedule.next_task, workers=config.workers, ray=config.ray)


def _account(config: CollectConfig, schedule: "Schedule", before: int, seconds: float) -> None:
    """Say what the run did, and write it beside the shards."""
    from sr_mj.collecting.folder import write_run
    from sr_mj.collecting.schedule import describe_reasons

    num = sum(schedule.stored.values()) - before
    print(
        f"Stored {num} decisions in {seconds:.0f} s ({num / max(seconds, 1e-9):.2f} a second); the "
        f"folder has {schedule.stored['pick']} to pick and {schedule.stored['place']} to place"
    )
    if schedule.reasons:
        print(f"Not stored: {describe_reasons(schedule.reasons, 20)}")
    write_run(config.out, config, schedule.stored, schedule.reasons, seconds)


def main() -> None:
    """Entry point of the command line."""
    run_command(CollectConfig, run, description=__doc__ or "")


if __name__ == "__main__":
    sys.exit(main())
