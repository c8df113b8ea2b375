"""Stopping a run between two steps."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class StopSignal:
    """Whether the run was asked to stop.

    Attributes:
        number: The signal that asked; None before.
    """

    def __init__(self) -> None:
        """Start unset."""
        self.number: int | None = None

    @property
    def is_set(self) -> bool:
        """Whether the run was asked to stop."""
        return self.number is not None

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Note a signal; a second one interrupts at once."""
        if self.is_set:
            raise KeyboardInterrupt
        self.number = number


@contextmanager
def stop_signal() -> Iterator[StopSignal]:
    """Listen to SIGINT and SIGTERM; the run decides when to obey.

    Yields:
        What notes them.
    """
    stop = StopSignal()
    before = {number: signal.signal(number, stop) for number in _SIGNALS}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
