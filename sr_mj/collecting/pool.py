"""Does many scenes, each in a process that does one after another; who asks gets the files."""

import os
from collections.abc import Callable, Generator
from functools import partial

from sr_mj.collecting.tasks import SceneTask
from sr_mj.collecting.work import SceneResult, Work, attempt
from sr_mj.parallel.processes import run_in_processes

NUM_TRIES = 3
"""How often a scene is begun before it is given up."""

RENEW_AFTER = 40
"""Scenes after which a process is replaced: whatever a library keeps of each is then given back."""


def run_scenes(
    make_work: Callable[[], Work],
    next_task: Callable[[], SceneTask | None],
    *,
    workers: int | None,
    ray: str | None = None,
) -> Generator[SceneResult]:
    """Do scenes until there are no more.

    An exception is part of a scene's result. A scene whose process dies is done again, and given
    up after some times.

    Args:
        make_work: Makes what does a scene; called once in every process, to which it is sent.
        next_task: Returns the next scene, or None; asked whenever a process is free.
        workers: Number of processes; one a core, or one a processor of the cluster, when None.
        ray: Address of a Ray cluster to work on instead. No disk is shared with it.

    Yields:
        What came of each scene, as it ends. Closing the generator ends the processes.

    Raises:
        ConfigError: If Ray is not installed, there is no cluster at that address, or its machines
            can't load this package.
    """
    make_attempt = partial(_attempting, make_work)
    if ray is None:
        yield from run_in_processes(
            make_attempt,
            lambda _: next_task(),
            _give_up,
            workers=workers or len(os.sched_getaffinity(0)),
            renew_after=RENEW_AFTER,
            num_tries=NUM_TRIES,
        )
    else:
        from sr_mj.parallel.ray_cluster import run_on_ray

        yield from run_on_ray(
            make_attempt,
            lambda _: next_task(),
            _give_up,
            workers=workers,
            address=ray,
            renew_after=RENEW_AFTER,
            num_tries=NUM_TRIES,
        )


def _attempting(make_work: Callable[[], Work]) -> Work:
    return partial(attempt, make_work())


def _give_up(task: SceneTask) -> SceneResult:
    return SceneResult(task=task, reasons={"worker_died": 1})
