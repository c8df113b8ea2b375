"""In which order an epoch goes through the demonstrations."""

from collections.abc import Sequence

import numpy as np

_BATCHES_A_BUCKET = 8


def epoch_batches(
    indices: np.ndarray, sizes: Sequence[int], *, batch: int, seed: int, epoch: int
) -> list[np.ndarray]:
    """Cut a random order into batches of decisions of similar size, to save padding.

    The order is cut into pieces of eight batches, each sorted by size and cut into batches, whose
    order is then random.

    Args:
        indices: Demonstrations to go through.
        sizes: Size of every demonstration of the folder, such as its number of candidates.
        batch: Decisions a batch; one batch may be smaller.
        seed: Seed of the run.
        epoch: Number of the epoch.

    Returns:
        Batches that hold every index once. The same arguments give the same batches.
    """
    rng = np.random.default_rng([seed, epoch])
    order = rng.permutation(indices)
    # Ties must not go by index, or neighbours in the folder would meet in every epoch: stable.
    by_size = np.asarray(sizes)[order]
    piece = batch * _BATCHES_A_BUCKET
    batches: list[np.ndarray] = []
    for start in range(0, len(order), piece):
        part = order[start : start + piece]
        part = part[np.argsort(by_size[start : start + piece], kind="stable")]
        batches += [part[i : i + batch] for i in range(0, len(part), batch)]
    return [batches[i] for i in rng.permutation(len(batches))]


def sorted_batches(indices: np.ndarray, sizes: Sequence[int], *, batch: int) -> list[np.ndarray]:
    """Cut demonstrations into batches by size, without randomness.

    Args:
        indices: Demonstrations to go through.
        sizes: Size of every demonstration of the folder.
        batch: Decisions a batch; the last may be smaller.

    Returns:
        Batches that hold every index once.
    """
    order = indices[np.argsort(np.asarray(sizes)[indices], kind="stable")]
    return [order[i : i + batch] for i in range(0, len(order), batch)]
