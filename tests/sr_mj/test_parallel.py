"""Work in other processes; functions of the standard library stand for it, which all can import."""

import math
import multiprocessing
import pydoc
import threading
import time
from functools import partial

import pytest

from sr_mj.errors import ConfigError
from sr_mj.parallel.processes import NUM_TRIES, SINGLE_THREADED, run_in_processes
from sr_mj.parallel.ray_cluster import run_on_ray

pytestmark = pytest.mark.distributed

FACTORIAL = partial(pydoc.locate, "math.factorial")
EXIT = partial(pydoc.locate, "os._exit")


def handing_out(tasks):
    waiting = iter(tasks)
    return lambda: next(waiting, None)


def given_up(task):
    return "given up", task


def here(make_work, tasks, workers=2):
    return list(run_in_processes(make_work, handing_out(tasks), given_up, workers=workers))


def test_every_piece_is_done_once():
    assert sorted(here(FACTORIAL, range(1, 8))) == [math.factorial(n) for n in range(1, 8)]
    assert multiprocessing.active_children() == []


def test_nothing_to_do_starts_nothing():
    assert here(pydoc.locate, []) == []


def test_processes_find_one_thread_in_their_environment():
    assert here(partial(pydoc.locate, "os.getenv"), SINGLE_THREADED, workers=1) == ["1"] * 3


def test_the_next_piece_is_chosen_after_the_last_is_known():
    known = []

    def next_task():
        return len(known) + 1 if len(known) < 3 else None

    for result in run_in_processes(FACTORIAL, next_task, given_up, workers=1):
        known.append(result)
    assert known == [1, 2, 6]


def test_a_piece_that_kills_its_process_is_given_up_and_the_others_go_on():
    assert sorted(here(EXIT, [3, 4])) == [("given up", 3), ("given up", 4)]


def test_processes_are_replaced_when_they_are_old():
    running = run_in_processes(
        partial(pydoc.locate, "os.getpgid"),
        handing_out([0] * 5),
        given_up,
        workers=1,
        renew_after=2,
    )
    pids = set()
    for _ in running:
        pids |= {process.pid for process in multiprocessing.active_children()}
    assert len(pids) == 3


class Killer(threading.Thread):
    """Kills the first process that this one starts."""

    killed = None

    def run(self):
        while self.killed is None:
            for process in multiprocessing.active_children()[:1]:
                process.kill()
                self.killed = process.pid
            time.sleep(0.001)


def test_a_process_that_was_killed_costs_nothing_but_time():
    killer = Killer(daemon=True)
    killer.start()
    assert sorted(here(FACTORIAL, [3, 4], workers=1)) == [6, 24]
    assert killer.killed is not None and NUM_TRIES > 1


def test_leaving_early_leaves_no_process_behind():
    running = run_in_processes(FACTORIAL, handing_out(range(1, 9)), given_up, workers=2)
    assert next(running) in (1, 2)
    running.close()
    assert multiprocessing.active_children() == []


@pytest.mark.slow
def test_a_ray_cluster_does_the_same():
    def there(make_work, tasks):
        return sorted(
            run_on_ray(
                make_work, handing_out(tasks), given_up, workers=2, address="local", renew_after=1
            )
        )

    assert there(FACTORIAL, [3, 4, 5]) == [6, 24, 120]
    assert there(EXIT, [3]) == [("given up", 3)]


def test_no_cluster_gets_one_line():
    running = run_on_ray(FACTORIAL, handing_out([1]), given_up, workers=1, address="127.0.0.1:1")
    with pytest.raises(ConfigError) as error:
        next(running)
    assert str(error.value) == (
        "No Ray cluster answers at '127.0.0.1:1' ([Errno 111] Connection refused); start one with "
        "ray start --head, or give --ray local."
    )
