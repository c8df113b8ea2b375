"""Does pieces of work in processes of their own on this machine, one thread each."""

import multiprocessing
import os
import signal
from collections import Counter, deque
from collections.abc import Callable, Generator, Hashable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

Task = TypeVar("Task", bound=Hashable)
Result = TypeVar("Result")

NUM_TRIES = 2
"""How often a piece of work is begun by default; a process that dies takes only one with it."""

SINGLE_THREADED = {
    name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
}
"""What libraries have to find in the environment when they load, to start no threads."""


@dataclass
class _Process:
    """A process and what it is doing."""

    process: BaseProcess
    connection: Connection
    task: Any
    num_begun: int = 1


def run_in_processes(
    make_work: Callable[[], Callable[[Task], Result]],
    next_task: Callable[[Task | None], Task | None],
    give_up: Callable[[Task], Result],
    *,
    workers: int,
    renew_after: int | None = None,
    num_tries: int = NUM_TRIES,
) -> Generator[Result]:
    """Do pieces of work until there are no more.

    Args:
        make_work: Makes the function that does a piece; called once in every process, to which it
            is sent, so that it must be picklable.
        next_task: Returns the next piece, or None, for a process that is free; it is given the last
            piece that this process did, None if it has done none.
        give_up: Says what comes of a piece whose process has died `num_tries` times.
        workers: Number of processes.
        renew_after: Pieces after which a process is replaced, so that whatever libraries keep of
            each is given back; never when None.
        num_tries: How often a piece is begun.

    Yields:
        What came of each piece, as it ends. Closing the generator ends the processes.
    """
    active: list[_Process] = []
    again: deque[Task] = deque()
    tries: Counter[Task] = Counter()

    def following(last: Task | None) -> Task | None:
        task = again.popleft() if again else next_task(last)
        if task is not None:
            tries[task] += 1
        return task

    try:
        while True:
            while len(active) < workers and (task := following(None)) is not None:
                active.append(_start(make_work, task))
            if not active:
                return
            ready = wait([item.connection for item in active])
            for item in [item for item in active if item.connection in ready]:
                try:
                    result = item.connection.recv()
                except (EOFError, ConnectionResetError):
                    active.remove(item)
                    item.process.join()
                    if tries[item.task] < num_tries:
                        again.append(item.task)
                    else:
                        yield give_up(item.task)
                    continue
                # Before the next piece is chosen, whoever chooses has to know of this one.
                yield result
                is_old = renew_after is not None and item.num_begun >= renew_after
                if is_old or (task := following(item.task)) is None:
                    active.remove(item)
                    _end(item)
                else:
                    item.task = task
                    item.num_begun += 1
                    _send(item)
    finally:
        for item in active:
            _end(item)


def _send(item: _Process) -> None:
    # If it has died meanwhile, the next wait tells.
    with suppress(BrokenPipeError, ConnectionResetError):
        item.connection.send(item.task)


def _end(item: _Process) -> None:
    # What it did has arrived; taking down all that it loaded would only take seconds more.
    item.process.kill()
    item.process.join()
    item.connection.close()


def _start(make_work: Callable[[], Callable[[Any], Any]], task: Any) -> _Process:
    # A forked process would share the state of OpenGL and of thread pools.
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_serve, args=(there, make_work), daemon=True)
    with _environment(SINGLE_THREADED):
        process.start()
    there.close()
    item = _Process(process=process, connection=here, task=task)
    _send(item)
    return item


@contextmanager
def _environment(changes: dict[str, str]) -> Iterator[None]:
    """Let processes that start in this context find other environment variables."""
    before = {name: os.environ.get(name) for name in changes}
    os.environ.update(changes)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _serve(connection: Connection, make_work: Callable[[], Callable[[Any], Any]]) -> None:
    """Do what comes through the pipe until it closes; the body of a process."""
    # Control-C reaches every process of a terminal; the parent is the one to answer.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # The pipe closes when nothing is left to do, or when the parent was killed.
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        work = make_work()
        while True:
            connection.send(work(connection.recv()))
