"""Measure the SR network: forward of one decision, a training step, and what it has to hold.

    python -m tools.bench.network --threads 2 --json outputs/network.json
    python -m tools.bench.network --widths 256 --points 256 512 --variants base sr-a sr

Synthetic decisions of full size: every point, token and candidate is real. The least of several
runs counts, wall and CPU time apart, since other work on the machine only ever adds to both. A
training step is forward, loss and backward in the given precision, and Adam. Prints a markdown
table; docs/network.md carries one.
"""

import json
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from sr_mj.cli import run_command

if TYPE_CHECKING:
    from torch import nn

    from policy.network.batch import DecisionBatch
    from policy.network.config import SRConfig
    from policy.network.loss import ExpertTargetBatch

Variant = Literal["base", "sr-a", "sr"]


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """Options of `python -m tools.bench.network`."""

    variants: tuple[Variant, ...] = ("sr",)
    """Ablations to measure: base, sr-a, sr."""
    widths: tuple[int, ...] = (256, 512)
    """Widths of the network."""
    points: tuple[int, ...] = (256, 512)
    """Points of a decision."""
    candidates: int = 128
    """Candidates of a decision."""
    channels: int = 384
    """Channels of the features; 384 for the embedded encoder, 768 for ViT-L/14."""
    batch: int = 32
    """Decisions of a training step; 0 leaves training out."""
    precision: Literal["bfloat16", "float32"] = "bfloat16"
    """Precision of matrix products while training."""
    forwards: int = 20
    """Runs of the forward pass, after two that don't count."""
    steps: int = 3
    """Training steps, after one that doesn't count."""
    threads: int = 2
    """Threads of torch."""
    json: Path | None = None
    """File for the figures."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """Figures of one network."""

    variant: Variant
    width: int
    points: int
    parameters: int
    half_precision_mb: float
    forward_wall_ms: float
    forward_cpu_ms: float
    step_wall_s: float | None
    step_cpu_s: float | None


def least(work: Callable[[], object], runs: int, warm_up: int) -> tuple[float, float]:
    """Return the least wall and the least CPU seconds of several runs."""
    times = []
    for _ in range(warm_up + runs):
        wall, cpu = time.perf_counter(), time.process_time()
        work()
        times.append((time.perf_counter() - wall, time.process_time() - cpu))
    walls, cpus = zip(*times[warm_up:], strict=True)
    return min(walls), min(cpus)


def make_batch(config: BenchConfig, size: int, points: int) -> "DecisionBatch":
    """Make decisions of random numbers, none of them padded."""
    import torch
    from torch.nn.functional import normalize

    from policy.network.batch import DecisionBatch

    generator = torch.Generator().manual_seed(0)

    def randn(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=generator)

    num_tokens, num = 12, config.candidates
    poses = torch.cat([randn(size, num, 3) / 3, normalize(randn(size, num, 4), dim=-1)], dim=-1)
    return DecisionBatch(
        positions=torch.rand(size, points, 3, generator=generator) * 2 - 1,
        features=normalize(randn(size, points, config.channels), dim=-1),
        similarity=torch.rand(size, points, generator=generator),
        point_mask=torch.ones(size, points, dtype=torch.bool),
        tokens=normalize(randn(size, num_tokens, config.channels), dim=-1),
        token_mask=torch.ones(size, num_tokens, dtype=torch.bool),
        pooled=normalize(randn(size, config.channels), dim=-1),
        phrase=normalize(randn(size, config.channels), dim=-1),
        poses=poses,
        prior=torch.rand(size, num, generator=generator),
        candidate_mask=torch.ones(size, num, dtype=torch.bool),
        phase=torch.arange(size) % 4,
    )


def make_targets(config: BenchConfig) -> "ExpertTargetBatch":
    """Make targets for a training step."""
    import torch

    from policy.network.loss import ExpertTargetBatch

    shape = (config.batch, config.candidates)
    return ExpertTargetBatch(
        positive=torch.arange(config.candidates).expand(shape) < 3,
        opening_m=torch.full(shape, 0.04),
        avoid_collision=torch.zeros(shape),
        rotvec_tool=torch.zeros(*shape, 3),
    )


def measure(config: BenchConfig, variant: Variant, width: int, points: int) -> Row:
    """Measure one network."""
    import torch

    from policy.network.config import SRConfig, ablation_switches
    from policy.network.model import SRNetwork

    switches: dict[str, Any] = ablation_switches("sr_a" if variant == "sr-a" else variant)
    network_config = SRConfig(
        feature_dim=config.channels, width=width, max_points=points, **switches
    )
    torch.manual_seed(0)
    network = SRNetwork(network_config)
    one = make_batch(config, 1, points)
    with torch.inference_mode():
        forward = least(lambda: network(one), config.forwards, warm_up=2)
    step = _measure_steps(config, network, network_config, points) if config.batch else None
    num_parameters = sum(p.numel() for p in network.parameters())
    return Row(
        variant=variant,
        width=width,
        points=points,
        parameters=num_parameters,
        half_precision_mb=num_parameters * 2 / 1e6,
        forward_wall_ms=forward[0] * 1e3,
        forward_cpu_ms=forward[1] * 1e3,
        step_wall_s=step and step[0],
        step_cpu_s=step and step[1],
    )


def _measure_steps(
    config: BenchConfig, network: "nn.Module", network_config: "SRConfig", points: int
) -> tuple[float, float]:
    import torch

    from policy.network.loss import choice_loss, decoding_loss

    batch, targets = make_batch(config, config.batch, points), make_targets(config)
    optimizer = torch.optim.Adam(network.parameters(), lr=1e-4)
    is_half = config.precision == "bfloat16"

    def step() -> None:
        with torch.autocast("cpu", torch.bfloat16, enabled=is_half):
            output = network(batch)
        optimizer.zero_grad()
        loss = choice_loss(output.logits, targets.positive)
        (loss + 0.1 * decoding_loss(output, targets, network_config)).backward()
        optimizer.step()

    return least(step, config.steps, warm_up=1)


def report(rows: list[Row]) -> None:
    """Print a table."""
    print("| variant | width | points | fp16 MB | forward ms (CPU ms) | step s (CPU s) |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    for row in rows:
        step = "" if row.step_wall_s is None else f"{row.step_wall_s:.2f} ({row.step_cpu_s:.2f})"
        print(
            f"| {row.variant} | {row.width} | {row.points} | {row.half_precision_mb:.1f} | "
            f"{row.forward_wall_ms:.1f} ({row.forward_cpu_ms:.1f}) | {step} |"
        )


def run(config: BenchConfig) -> int:
    """Measure every combination and report.

    Args:
        config: Options.

    Returns:
        Exit status 0.
    """
    import torch

    torch.set_num_threads(config.threads)
    square = torch.randn(1024, 1024)
    speed = 2 * 1024**3 / least(lambda: square @ square, 20, warm_up=3)[0] / 1e9
    rows = [
        measure(config, variant, width, points)
        for variant in config.variants
        for width in config.widths
        for points in config.points
    ]
    report(rows)
    # Says how busy the machine was: a product of this size is nearly all arithmetic.
    print(f"\nfloat32 matrix product of 1024: {speed:.0f} GFLOP/s; {config.threads} threads")
    if config.json is not None:
        config.json.parent.mkdir(parents=True, exist_ok=True)
        about = {"matmul_gflops": speed, "config": asdict(config) | {"json": str(config.json)}}
        text = json.dumps(about | {"rows": [asdict(row) for row in rows]}, indent=2)
        config.json.write_text(text + "\n")
    return 0


def main() -> None:
    """Entry point of the command line."""
    run_command(BenchConfig, run, description=__doc__ or "")


if __name__ == "__main__":
    sys.exit(main())
