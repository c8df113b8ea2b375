"""Does scenes in processes of their own on this machine, one thread each."""

import multiprocessing
import os
import signal
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from sr_mj.collecting.tasks import SceneTask
from sr_mj.collecting.work import SceneResult, Work, attempt

NUM_TRIES = 3
"""How often a scene is begun before it is given up; a process that dies takes only one with it."""

SCENES_A_PROCESS = 40
"""Scenes after which a process is replaced: whatever a library keeps of each is then given back."""

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass
class _Process:
    """A process and what it is doing."""

    process: BaseProcess
    connection: Connection
    task: SceneTask
    num_begun: int = 1


def run_here(
    make_work: Callable[[], Work], next_task: Callable[[], SceneTask | None], num_workers: int
) -> Generator[SceneResult]:
    """Do scenes until there are no more.

    Args:
        make_work: Makes what does a scene; called once in every process, to which it is sent.
        next_task: Returns the next scene, or None; asked whenever a process is free.
        num_workers: Number of processes.

    Yields:
        What came of each scene, as it ends.
    """
    active: list[_Process] = []
    again: deque[SceneTask] = deque()
    tries: Counter[SceneTask] = Counter()

    def following() -> SceneTask | None:
        task = again.popleft() if again else next_task()
        if task is not None:
            tries[task] += 1
        return task

    try:
        while True:
            while len(active) < num_workers and (task := following()) is not None:
                active.append(_start(make_work, task))
            if not active:
                return
            ready = wait([item.connection for item in active])
            for item in [item for item in active if item.connection in ready]:
                result = _receive(item)
                if result is None:
                    active.remove(item)
                    if tries[item.task] < NUM_TRIES:
                        again.append(item.task)
                        continue
                    yield SceneResult(task=item.task, reasons={"worker_died": 1})
                    continue
                # Before the next scene is chosen, this one has to be counted.
                yield result
                is_old = item.num_begun >= SCENES_A_PROCESS
                task = None if is_old else following()
                if task is None:
                    active.remove(item)
                    item.connection.close()
                    item.process.join()
                else:
                    item.task = task
                    item.num_begun += 1
                    _send(item)
    finally:
        for item in active:
            item.process.kill()
            item.process.join()


def _receive(item: _Process) -> SceneResult | None:
    """Return the result that is ready; None if the process has died instead."""
    try:
        return item.connection.recv()
    except (EOFError, ConnectionResetError):
        item.process.join()
        return None


def _send(item: _Process) -> None:
    # If it has died meanwhile, the next wait tells.
    with suppress(BrokenPipeError):
        item.connection.send(item.task)


def _start(make_work: Callable[[], Work], task: SceneTask) -> _Process:
    # A forked process would share the state of OpenGL and of thread pools.
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_serve, args=(there, make_work), daemon=True)
    with _single_threaded_children():
        process.start()
    there.close()
    item = _Process(process=process, connection=here, task=task)
    _send(item)
    return item


@contextmanager
def _single_threaded_children() -> Iterator[None]:
    """Let processes that start in this context find the variables that thread pools read."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _serve(connection: Connection, make_work: Callable[[], Work]) -> None:
    """Do the scenes that come through the pipe until it closes; the body of a process."""
    # Control-C reaches every process of a terminal; the parent is the one to answer.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    work = make_work()
    # The pipe closes when nothing is left to do, or when the parent was killed.
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            connection.send(attempt(work, connection.recv()))
