"""Does pieces of work on a Ray cluster; the machine that asks gets all results."""

import logging
import os
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
    next_task: Callable[[Task | None], Task | None],
    give_up: Callable[[Task], Result],
    *,
    workers: int | None,
    address: str,
    renew_after: int | None = None,
    num_tries: int = NUM_TRIES,
) -> Generator[Result]:
    """Do pieces of work until there are no more, each in an actor with one processor.

    Args:
        make_work: Makes the function that does a piece; called once in every actor.
        next_task: Returns the next piece, or None, for an actor that is free; it is given the last
            piece that this actor did, None if it has done none.
        give_up: Says what comes of a piece whose actor, or the actor's machine, has died
            `num_tries` times.
        workers: Number of actors; as many as the cluster has processors when None.
        address: Where the cluster is: "auto", "HOST:PORT", "ray://HOST:PORT", or `LOCAL`.
        renew_after: Pieces after which an actor is replaced; never when None.
        num_tries: How often a piece is begun.

    Yields:
        What came of each piece, as it ends. Closing the generator leaves the cluster.

    Raises:
        ConfigError: If Ray is not installed, there is no cluster at that address, or its machines
            can't load this package.
    """
    ray = _connect(address, workers)
    workers = workers or max(1, int(ray.cluster_resources().get("CPU", 1)))
    actor = ray.remote(num_cpus=1)(_Actor)
    again: deque[Task] = deque()
    tries: Counter[Task] = Counter()
    idle: deque[tuple[Any, Task]] = deque()
    active: dict[Any, tuple[Any, Task]] = {}
    num_begun: Counter[Any] = Counter()
    try:
        while True:
            while len(active) < workers:
                free, last = idle[0] if idle else (None, None)
                task = again.popleft() if again else next_task(last)
                if task is None:
                    break
                tries[task] += 1
                if free is None:
                    free = actor.remote(make_work)
                else:
                    idle.popleft()
                num_begun[free] += 1
                active[free.do.remote(task)] = (free, task)
            if not active:
                return
            (ready,), _ = ray.wait(list(active), num_returns=1)
            free, task = active.pop(ready)
            try:
                result = ray.get(ready)
            except ray.exceptions.RayError as error:
                if not _has_died(ray, error):
                    raise _cannot_work(address, error) from error
                # Another takes its place, on another machine if need be.
                ray.kill(free)
                if tries[task] < num_tries:
                    again.append(task)
                else:
                    yield give_up(task)
                continue
            if renew_after is not None and num_begun[free] >= renew_after:
                ray.kill(free)
            else:
                idle.append((free, task))
            yield result
    finally:
        ray.shutdown()


def _has_died(ray: Any, error: Exception) -> bool:
    """Tell whether a process or a machine is gone, rather than unfit from the start."""
    if isinstance(error, ray.exceptions.RayActorError):
        return not getattr(error, "actor_init_failed", False)
    lost = (
        ray.exceptions.NodeDiedError,
        ray.exceptions.ObjectLostError,
        ray.exceptions.OutOfMemoryError,
        ray.exceptions.WorkerCrashedError,
    )
    return isinstance(error, lost)


def _cannot_work(address: str, error: Exception) -> ConfigError:
    reason = str(error).strip().splitlines()[-1]
    return ConfigError(
        f"The workers at {address!r} can't do the work ({reason}); every machine needs this "
        "package in the same version."
    )


def _connect(address: str, workers: int | None) -> Any:
    try:
        import ray
    except ModuleNotFoundError:
        raise ConfigError(
            "--ray needs Ray, which is not installed; pip install '.[ray]' in a clone"
        ) from None
    # A cluster of other machines has its own number of processors.
    local = {"num_cpus": workers, "include_dashboard": False} if address == LOCAL else {}
    # Nothing reaches a network unless it is asked to.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
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
