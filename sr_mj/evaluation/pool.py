"""Runs many episodes, each in a process that runs one after another."""

import warnings
from collections import deque
from collections.abc import Callable, Generator, Sequence
from functools import partial

from sr_mj.evaluation.identity import Identity
from sr_mj.evaluation.lines import Done, result_line
from sr_mj.evaluation.plan import Episode
from sr_mj.evaluation.setting import Setting
from sr_mj.parallel.processes import NUM_TRIES, run_in_processes

RENEW_AFTER = 200
"""Episodes after which a process is replaced: compiled scenes leave something behind."""


def run_episodes(
    episodes: Sequence[Episode], setting: Setting, *, workers: int, ray: str | None = None
) -> Generator[Done]:
    """Run episodes.

    Episodes that begin alike (`Episode.beginning`) are given to the same process, one after
    another, as they share that. Each process has one thread, whatever their number: sums then add
    up in the same order, and the same episode gives the same line everywhere. An episode whose
    process dies again and again counts as a failure.

    Args:
        episodes: What to run.
        setting: What they share.
        workers: Number of processes.
        ray: Address of a Ray cluster to run on instead. Its machines need this package, and the
            files that the options name (checkpoints, pictures) under the same paths.

    Yields:
        Every episode as it ends, in no particular order.

    Raises:
        ConfigError: If Ray is not installed, or there is no cluster at that address.
    """
    waiting, identity = _Waiting(episodes), Identity(setting)

    def give_up(episode: Episode) -> Done:
        error = f"the process that ran it died {NUM_TRIES} times"
        record = result_line(episode, setting, identity, {}, error)
        return Done(episode=episode, record=record, seconds={}, traceback=error)

    make_work = partial(make_runner, setting)
    if ray is None:
        yield from run_in_processes(
            make_work, waiting.next_after, give_up, workers=workers, renew_after=RENEW_AFTER
        )
    else:
        from sr_mj.parallel.ray_cluster import run_on_ray

        yield from run_on_ray(
            make_work,
            waiting.next_after,
            give_up,
            workers=workers,
            address=ray,
            renew_after=RENEW_AFTER,
        )


class _Waiting:
    """Episodes that nobody has begun, in groups that begin alike.

    Args:
        episodes: In the order in which they are to be run.
    """

    def __init__(self, episodes: Sequence[Episode]) -> None:
        self._groups: dict[Episode, deque[Episode]] = {}
        for episode in episodes:
            self._groups.setdefault(episode.beginning, deque()).append(episode)
        self._begun: set[Episode] = set()

    def next_after(self, last: Episode | None) -> Episode | None:
        """Take an episode of the last one's group, or else one that nobody has begun, or any."""
        if not self._groups:
            return None
        group = None if last is None else last.beginning
        if group not in self._groups:
            group = next((g for g in self._groups if g not in self._begun), None)
        if group is None:
            group = max(self._groups, key=lambda g: len(self._groups[g]))
        self._begun.add(group)
        episode = self._groups[group].popleft()
        if not self._groups[group]:
            del self._groups[group]
        return episode


def make_runner(setting: Setting) -> Callable[[Episode], Done]:
    """Return what runs an episode, in a process that has loaded nothing heavy yet.

    Args:
        setting: What all episodes share.

    Returns:
        A function that uses one thread.
    """
    # GLFW warns about a missing display on import, on every headless machine.
    warnings.filterwarnings("ignore", message=".*DISPLAY.*")
    import torch

    from sr_mj.gl import select_backend

    # Before anything imports dm_control, which binds OpenGL to one library for good.
    select_backend()
    torch.set_num_threads(1)
    from sr_mj.evaluation.worker import Worker

    return Worker(setting).run
