"""Train a network on demonstrations: SR, its ablations, or a baseline.

    python -m policy.train --data DIR --out RUN
    python -m policy.train --data DIR --out RUN --variant a2
    python -m policy.train --data DIR --out RUN --resume
    torchrun --nproc-per-node 2 -m policy.train --data DIR --out RUN
    python -m policy.train plot RUN RUN --out curves.png

Writes to RUN: best.safetensors and its card best.json, steps.csv and epochs.csv, event files of
TensorBoard, and the state that --resume goes on from. A run that was interrupted and resumed gives
the numbers of one that was not.
"""

import io
import platform
import shlex
import sys
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Annotated, Any

import tyro

from policy.errors import InvalidConfigError, PolicyError
from policy.training.config import TrainConfig

USAGE_ERROR = 2
INTERRUPTED = 130

_PACKAGES = ("sr-mj", "torch", "numpy", "safetensors", "h5py")


@dataclass(frozen=True, kw_only=True)
class PlotConfig:
    """Options of `python -m policy.train plot`."""

    runs: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """Folders of runs, side by side in the picture."""
    out: Path = Path("curves.png")
    """The picture."""


def run(config: TrainConfig) -> int:
    """Train.

    Args:
        config: Options.

    Returns:
        Exit status: 0 when complete, 128 plus its number after a signal.
    """
    config.check()
    _check_folder(config)
    import torch

    from policy.training.distributed import joined
    from policy.training.logs import RunLog
    from policy.training.signals import stop_signal
    from policy.training.trainer import BEST_FILE, Trainer

    if config.threads:
        torch.set_num_threads(config.threads)
    with joined(config.device) as ranks, stop_signal() as stop:
        trainer = Trainer(config, ranks, _provenance())
        if not ranks.is_first:
            trainer.run(None, stop)
            return 0
        config.out.mkdir(parents=True, exist_ok=True)
        _describe(trainer)
        # Without a saved state, the row of the untrained network is made again too.
        last_step = trainer.progress.step or -1
        with RunLog(config.out, last_step=last_step, tensorboard=config.tensorboard) as log:
            is_complete = trainer.run(log, stop)
    progress = trainer.progress
    if not is_complete:
        print(f"Stopped after step {progress.step}; go on with --resume.")
        return 128 + (stop.number or 0)
    print(
        f"Best    epoch {progress.best_epoch} of {progress.epoch}, validation "
        f"{config.stop_on} {abs(progress.best_score or 0.0):.3f}: {config.out / BEST_FILE}"
    )
    return 0


def plot(config: PlotConfig) -> int:
    """Draw the curves of runs.

    Args:
        config: Options.

    Returns:
        Exit status 0.
    """
    from policy.training.plot import draw_curves

    draw_curves(config.runs, config.out)
    print(config.out)
    return 0


def _check_folder(config: TrainConfig) -> None:
    """Refuse to mix two runs."""
    if config.out.exists() and not config.out.is_dir():
        raise InvalidConfigError(f"out: got {config.out}, which is a file; expected a folder.")
    if not config.resume and config.out.is_dir() and any(config.out.iterdir()):
        raise InvalidConfigError(
            f"out: got {config.out}, which is not empty; expected a new folder, or --resume to go "
            "on with the run in it."
        )


def _describe(trainer: Any) -> None:
    config, split = trainer.config, trainer.split
    num_weights = sum(p.numel() for p in trainer.network.parameters())
    print(
        f"Data    {len(split.train)} decisions to learn from, {len(split.val)} held out"
        f"{f', {len(split.new)} of new objects' if len(split.new) else ''}, of "
        f"{len(set(trainer.folder.scenes))} scenes in {config.data}\n"
        f"Network {config.variant}, {num_weights / 1e6:.2f} million weights, width "
        f"{trainer.network.config.width}, {trainer.network.config.max_points} points"
    )
    if trainer.progress.step:
        print(f"Resumed after step {trainer.progress.step}, epoch {trainer.progress.epoch + 1}")


def _provenance() -> dict[str, Any]:
    """Say what was run, with which versions."""
    versions = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = "not installed"
    return {
        "command": shlex.join(["python", "-m", "policy.train", *sys.argv[1:]]),
        "versions": versions,
    }


def main() -> None:
    """Entry point of the command line: mistakes end in one line on stderr and status 2."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)  # a log is read while it is written
    try:
        if sys.argv[1:2] == ["plot"]:
            description = "Draw the curves of runs side by side, as the paper's figure 8 does."
            status = plot(tyro.cli(PlotConfig, args=sys.argv[2:], description=description))
        else:
            status = run(tyro.cli(TrainConfig, description=__doc__))
    except (PolicyError, OSError) as error:  # OSError: a full disk, a lost drive
        print(f"error: {error}", file=sys.stderr)
        status = USAGE_ERROR
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        status = INTERRUPTED
    sys.exit(status)


if __name__ == "__main__":
    main()
