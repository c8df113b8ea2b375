"""Batches, made one ahead of the network."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from policy.training.distributed import Ranks
from policy.training.draws import ExampleBatch, ExampleDrawer, collate_examples


def feed(
    batches: Sequence[np.ndarray], drawer: ExampleDrawer, ranks: Ranks, *, epoch: int
) -> Iterator[tuple[int, int, ExampleBatch]]:
    """Draw this process's share of every batch, in a thread: numpy leaves a processor free.

    Args:
        batches: Demonstrations of every batch, over all processes.
        drawer: Draws the examples.
        ranks: This process among its peers.
        epoch: Number of the epoch.

    Yields:
        Decisions of the whole batch, those of this process, and their examples. A process without
        a decision of its own gets an example that must count nothing, since every process has to
        take part in every step.
    """

    def make(batch: np.ndarray) -> tuple[int, int, ExampleBatch]:
        own = batch[ranks.rank :: ranks.size]
        drawn = [drawer.training(int(i), epoch) for i in (own if len(own) else batch[:1])]
        return len(batch), len(own), collate_examples(drawn).to(ranks.device)

    with ThreadPoolExecutor(max_workers=1) as pool:
        pending = [pool.submit(make, batch) for batch in batches[:1]]
        try:
            for following in range(1, len(batches) + 1):
                made = pending.pop().result()
                pending += [pool.submit(make, b) for b in batches[following : following + 1]]
                yield made
        finally:
            for future in pending:
                future.cancel()
