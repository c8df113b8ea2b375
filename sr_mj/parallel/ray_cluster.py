"""Does pieces of work on a Ray cluster; the machine that asks gets all results."""

import logging
import socket
from collections import Counter, deque
from collections.abc import Callable, Generator
from typing import Any
from urllib.parse import urlsplit

from sr_mj.errors import ConfigError
from sr_mj.parallel.processes import NUM_TRIES, SINGLE_THREADED, Result, Task

LOCAL = "local"
"""Address for a cluster on this machine that ends with the work."""

_CONNECT_TIMEOUT_S = 5.0


class _Actor:
    """A process of the cluster that does one piece of work after another."""

    def __init__(self, make_work: Callable[[], Callable[[Any], Any]]) -> None:
        self._work = make_work()

    def do(self, task: Any) -> Any:
        return self._work(task)


def run_on_ray(
    make_work: Callable[[], Callable[[Task], Result]],
    next_task: Callable[[], Task | None],
    give_up: Callable[[Task], Result],
    *,
    workers: int,
    address: str,
    renew_after: int | None = None,
) -> Generator[Result]:
    """Do pieces of work until there are no more, each in an actor with one processor.

    Args:
        make_work: Makes the function that does a piece; called once in every actor.
        next_task: Returns the next piece, or None; asked whenever an actor is free.
        give_up: Says what comes of a piece whose actor has died `NUM_TRIES` times. Ray starts
            actors that die again, on another machine if need be.
        workers: Number of actors.
        address: Where the cluster is: "auto", "HOST:PORT", "ray://HOST:PORT", or `LOCAL`.
        renew_after: Pieces after which an actor is replaced; never when None.

    Yields:
        What came of each piece, as it ends. Closing the generator leaves the cluster.

    Raises:
        ConfigError: If Ray is not installed, or there is no cluster at that address.
    """
    ray = _connect(address, workers)
    actor = ray.remote(num_cpus=1, max_restarts=-1)(_Actor)
    again: deque[Task] = deque()
    tries: Counter[Task] = Counter()
    idle: deque[Any] = deque()
    active: dict[Any, tuple[Any, Task]] = {}
    num_begun: Counter[Any] = Counter()
    try:
        while True:
            while len(active) < workers:
                task = again.popleft() if again else next_task()
                if task is None:
                    break
                tries[task] += 1
                if not idle:
                    idle.append(actor.remote(make_work))
                free = idle.popleft()
                num_begun[free] += 1
                active[free.do.remote(task)] = (free, task)
            if not active:
                return
            (ready,), _ = ray.wait(list(active), num_returns=1)
            free, task = active.pop(ready)
            if renew_after is not None and num_begun[free] >= renew_after:
                ray.kill(free)
            else:
                idle.append(free)
            try:
                result = ray.get(ready)
            except ray.exceptions.RayActorError:
                if tries[task] < NUM_TRIES:
                    again.append(task)
                else:
                    yield give_up(task)
                continue
            yield result
    finally:
        ray.shutdown()


def _connect(address: str, workers: int) -> Any:
    try:
        import ray
    except ModuleNotFoundError:
        raise ConfigError(
            "--ray needs Ray, which is not installed; pip install 'sr-mj[ray]'"
        ) from None
    # A cluster of other machines has its own number of processors.
    local = {"num_cpus": workers, "include_dashboard": False} if address == LOCAL else {}
    try:
        _check_address(address)
        ray.init(
            address=address,
            runtime_env={"env_vars": SINGLE_THREADED},
            log_to_driver=False,
            logging_level=logging.ERROR,
            **local,
        )
    except (OSError, ValueError, RuntimeError) as error:
        reason = str(error).strip().splitlines()[0]
        raise ConfigError(
            f"No Ray cluster answers at {address!r} ({reason}); start one with ray start --head, "
            f"or give --ray {LOCAL}."
        ) from None
    return ray


def _check_address(address: str) -> None:
    """Try the port first: Ray itself goes on trying for minutes where nobody listens."""
    parts = urlsplit(address if "//" in address else f"//{address}")
    if parts.port is not None:
        socket.create_connection((parts.hostname, parts.port), _CONNECT_TIMEOUT_S).close()
