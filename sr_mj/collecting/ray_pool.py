"""Does scenes on a Ray cluster; the machine that asks writes the files, no disk is shared."""

import os
from collections.abc import Callable, Generator
from typing import Any

from sr_mj.collecting.pool import NUM_TRIES, SCENES_A_PROCESS
from sr_mj.collecting.tasks import SceneTask
from sr_mj.collecting.work import SceneResult, Work, attempt
from sr_mj.errors import ConfigError

_INSTALL = "pip install 'sr-mj[ray]'"


def run_on_ray(
    make_work: Callable[[], Work],
    next_task: Callable[[], SceneTask | None],
    address: str,
    num_workers: int | None = None,
) -> Generator[SceneResult]:
    """Do scenes until there are no more, each as one task with one processor.

    A scene whose worker or machine dies is done again elsewhere.

    Args:
        make_work: Makes what does a scene; called for every scene, so it has to remember.
        next_task: Returns the next scene, or None; asked whenever a scene has ended.
        address: Where the cluster is: "auto", "HOST:PORT", "ray://HOST:PORT", or "local" to start
            one on this machine.
        num_workers: Scenes at a time; as many as the cluster has processors when None.

    Yields:
        What came of each scene, as it ends.

    Raises:
        ConfigError: If Ray is not installed, there is no cluster at that address, or its machines
            can't load this package.
    """
    ray = _connect(address, num_workers)
    options = {"num_cpus": 1, "max_retries": NUM_TRIES - 1, "max_calls": SCENES_A_PROCESS}
    remote = ray.remote(**options)(_do_scene)
    num_workers = num_workers or max(1, int(ray.cluster_resources().get("CPU", 1)))
    active: dict[Any, SceneTask] = {}
    try:
        while True:
            while len(active) < num_workers and (task := next_task()) is not None:
                active[remote.remote(make_work, task)] = task
            if not active:
                return
            (ready,), _ = ray.wait(list(active), num_returns=1)
            task = active.pop(ready)
            try:
                yield ray.get(ready)
            except (ray.exceptions.WorkerCrashedError, ray.exceptions.NodeDiedError):
                yield SceneResult(task=task, reasons={"worker_died": 1})
            except ray.exceptions.RayError as error:
                reason = str(error).strip().splitlines()[-1]
                raise ConfigError(
                    f"The workers at {address!r} can't do a scene ({reason}); every machine needs "
                    "this package in the same version."
                ) from error
    finally:
        for reference in active:
            ray.cancel(reference, force=True)
        ray.shutdown()


def _connect(address: str, num_workers: int | None) -> Any:
    try:
        import ray
    except ModuleNotFoundError:
        raise ConfigError(f"--ray needs Ray, which is not installed; {_INSTALL}") from None
    # A cluster of other machines has its own number of processors.
    local = {"num_cpus": num_workers, "include_dashboard": False} if address == "local" else {}
    # Nothing reaches a network unless it is asked to.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        ray.init(
            address=address,
            log_to_driver=False,
            configure_logging=False,
            **local,
        )
    except (ConnectionError, ValueError, RuntimeError) as error:
        reason = str(error).strip().splitlines()[0]
        raise ConfigError(
            f"No Ray cluster answers at {address!r} ({reason}); start one with ray start --head, "
            "or give --ray local."
        ) from error
    return ray


def _do_scene(make_work: Callable[[], Work], task: SceneTask) -> SceneResult:
    """Do one scene in a worker of the cluster."""
    return attempt(make_work(), task)
