"""How well do segments of the cloud stand for objects?

    python -m tools.bench.segments --scene cluttered15 --seeds 100 108

Prints a table, with a row for `policy.segments` and one for connected components: over all objects
in sight, the mean intersection over union of each with the segment that fits it best, and the share
of objects for which that is above one half, with its 95 % Wilson interval; and seconds of processor
time a cloud.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree
from tqdm import tqdm

from policy.errors import InvalidConfigError
from policy.segments import MIN_POINTS, NEIGHBOUR_M, segment
from sr_mj.assemble import lifter_for
from sr_mj.cli import run_command
from sr_mj.evaluation.statistics import wilson
from sr_mj.scene import SceneConfig
from tools.bench.grounding_scenes import photograph
from tools.table_text import markdown, percent


@dataclass(frozen=True, kw_only=True)
class SegmentsConfig:
    """Options of `python -m tools.bench.segments`."""

    scene: str = "cluttered15"
    """Kind of random scene."""
    split: str = "seen"
    """Objects."""
    seeds: tuple[int, int] = (100, 108)
    """First seed and one past the last."""


def components(points: Float[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
    """Divide a cloud into what hangs together, whatever its shape.

    Args:
        points: (N, 3) world, metres.

    Returns:
        (N,) labels 0..S-1.
    """
    pairs = KDTree(points).query_pairs(NEIGHBOUR_M, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(points), len(points)))
    return connected_components(graph, directed=False)[1]


METHODS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "hills (`policy.segments`)": segment,
    "connected components": components,
}


def best_overlaps(
    labels: Int[np.ndarray, " N"], owners: Int[np.ndarray, " N"]
) -> Float[np.ndarray, " M"]:
    """Compare segments with objects.

    Args:
        labels: (N,) segment of each point.
        owners: (N,) index of the object that it lies on; -1 for none. Ground truth.

    Returns:
        (M,) for each object with `policy.segments.MIN_POINTS` points or more, the largest
        intersection over union that a segment has with it.
    """
    sizes = np.bincount(labels)
    overlaps = []
    for owner in np.unique(owners[owners >= 0]):
        is_mine = owners == owner
        if is_mine.sum() >= MIN_POINTS:
            shared = np.bincount(labels[is_mine], minlength=len(sizes))
            overlaps.append((shared / (sizes + is_mine.sum() - shared)).max())
    return np.array(overlaps)


def main(config: SegmentsConfig) -> int:
    """Measure and print a table in markdown."""
    overlaps: dict[str, list[float]] = {name: [] for name in METHODS}
    seconds = dict.fromkeys(METHODS, 0.0)
    lifter = lifter_for(SceneConfig(scene=config.scene).kind.workspace, "embedded")
    for seed in tqdm(range(*config.seeds), unit="scenes"):
        bench = photograph(config.scene, config.split, seed)
        points = lifter.lift(bench.views).cloud.points
        owners = bench.owners(points)
        for name, divide in METHODS.items():
            start = time.process_time()
            labels = divide(points)
            seconds[name] += time.process_time() - start
            overlaps[name] += best_overlaps(labels, owners).tolist()
    total = len(next(iter(overlaps.values())))
    if not total:
        raise InvalidConfigError(
            f"seeds: got {config.seeds}, among which no object is in sight; expected more scenes."
        )
    rows = [
        [
            name,
            f"{np.mean(own):.2f}",
            percent(wilson(sum(overlap > 0.5 for overlap in own), total)),
            f"{seconds[name] / (config.seeds[1] - config.seeds[0]):.3f}",
        ]
        for name, own in overlaps.items()
    ]
    print(markdown(["segments", f"mean IoU, {total} objects", "above 0.5, %", "seconds"], rows))
    return 0


if __name__ == "__main__":
    run_command(SegmentsConfig, main, __doc__ or "")
