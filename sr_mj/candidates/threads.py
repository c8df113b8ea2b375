"""How many threads the sampler's tensor operations use."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch


@contextmanager
def single_threaded() -> Iterator[None]:
    """Run torch in one thread within the block.

    The sampler is a few thousand operations of well under a millisecond. Sharing them out gains
    little on an idle machine, and on a busy one the threads wait for each other: with two threads
    on two loaded cores a call took nine times as long as with one.
    """
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
