"""Measure perception from three views to a finished cloud, and a second question about it.

    python -m tools.bench.perceiving --seed 100 --threads 2

Prints a markdown table; docs/fusion.md carries one. CPU time is printed beside wall time, since
other work on the machine disturbs the latter.
"""

import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sr_mj.cli import run_command

QUESTIONS = ("give me the mug", "I need a fruit")


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """Options of `python -m tools.bench.perceiving`."""

    scene: str = "cluttered15"
    """Kind of scene."""
    seed: int = 100
    """Seed of scene and sensor noise."""
    encoder: str = "embedded"
    """Encoder."""
    repeats: int = 9
    """Runs, each with nothing remembered."""
    threads: int = 2
    """Threads of torch."""


def _measure(work: Callable[[], object]) -> tuple[float, float]:
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - wall, time.process_time() - cpu


def run(config: BenchConfig) -> int:
    """Measure and print.

    Args:
        config: Options.

    Returns:
        Exit status 0.
    """
    import torch

    from models.cameras import camera_preset
    from perception.fusion import fuse
    from perception.lifter import MultiViewLifter
    from sr_mj.assemble import lifter_for
    from sr_mj.gl import select_backend
    from sr_mj.scene import make_scene, scene_config
    from sr_mj.sensors.capture import capture_views
    from sr_mj.sensors.l515 import L515NoiseConfig
    from sr_mj.sensors.renderer import CameraRig

    select_backend()
    torch.set_num_threads(config.threads)
    scene = make_scene(scene_config(config.scene, seed=config.seed))
    with CameraRig(scene.model, camera_preset(scene.config.cameras)) as rig:
        noise = np.random.default_rng(config.seed)
        views = capture_views(rig, scene.data, L515NoiseConfig(), noise)
    first = lifter_for(scene.workspace, config.encoder)
    images = [view.rgb for view in views]
    steps = ("fusion and normals", "dense features", "first question", "second question")
    times: dict[str, list[tuple[float, float]]] = {step: [] for step in steps}
    for _ in range(config.repeats + 1):
        lifter = MultiViewLifter(first.encoder, first.config)
        works = (
            lambda: fuse(views, first.config.fusion),
            lambda: first.encoder.encode_dense(images),
            lambda lifter=lifter: lifter.perceive(views, QUESTIONS[0]),
            lambda lifter=lifter: lifter.perceive(views, QUESTIONS[1]),
        )
        for step, work in zip(steps, works, strict=True):
            times[step].append(_measure(work))
    print("| step | wall s, least | wall s, median | CPU s, median |")
    print("| --- | ---: | ---: | ---: |")
    for step, measured in times.items():
        # The first run pays for what is made once.
        wall, cpu = zip(*measured[1:], strict=True)
        figures = (min(wall), statistics.median(wall), statistics.median(cpu))
        print(f"| {step} | " + " | ".join(f"{value:.2f}" for value in figures) + " |")
    return 0


def main() -> None:
    """Entry point of the command line."""
    run_command(BenchConfig, run, description=__doc__ or "")


if __name__ == "__main__":
    sys.exit(main())
