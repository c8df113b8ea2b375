"""Work in other processes, of this machine and of a Ray cluster, and scenes done in them.

Functions of the standard library stand for the work, which all can import, or a few files do.
"""

import math
import multiprocessing
import pydoc
import threading
import time
from collections import Counter
from functools import partial

import pytest

from sr_mj.collecting.folder import open_folder, save
from sr_mj.collecting.pool import RENEW_AFTER, run_scenes
from sr_mj.collecting.schedule import Schedule
from sr_mj.collecting.tasks import SceneTask
from sr_mj.collecting.work import SceneResult
from sr_mj.errors import ConfigError
from sr_mj.parallel.processes import NUM_TRIES, SINGLE_THREADED, run_in_processes
from sr_mj.parallel.ray_cluster import run_on_ray

pytestmark = pytest.mark.distributed

FACTORIAL = partial(pydoc.locate, "math.factorial")
EXIT = partial(pydoc.locate, "os._exit")


def handing_out(tasks):
    waiting = iter(tasks)
    return lambda last: next(waiting, None)


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
    known, before = [], []

    def next_task(last):
        before.append(last)
        return len(known) + 1 if len(known) < 3 else None

    for result in run_in_processes(FACTORIAL, next_task, given_up, workers=1):
        known.append(result)
    assert known == [1, 2, 6]
    assert before == [None, 1, 2, 3, None]


def test_a_piece_that_kills_its_process_is_given_up_and_the_others_go_on():
    assert sorted(here(EXIT, [3, 4])) == [("given up", 3), ("given up", 4)]


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


# In a file of its own, since fresh processes have to import it.
_WORK = '''
import os, signal
from pathlib import Path
from sr_mj.collecting.work import SceneResult

class Work:
    """Kills its process at the scenes that it is told to, as often as it is told to."""

    def __init__(self, log, deadly):
        self.log, self.deadly = Path(log), deadly

    def __call__(self, task):
        with (self.log / task.name).open("a") as file:
            file.write(f"{os.getpid()}\\n")
        begun = len((self.log / task.name).read_text().split())
        if begun <= self.deadly.get((task.phase, task.number), 0):
            os.kill(os.getpid(), signal.SIGKILL)
        if (task.phase, task.number) == ("pick", 5):
            raise RuntimeError("a fault")
        return SceneResult(task=task, file_name=f"{task.name}.none.json", content=b"{}",
                           stored={task.phase: 2})
'''


@pytest.fixture
def make_work(tmp_path, monkeypatch):
    (tmp_path / "code").mkdir()
    (tmp_path / "log").mkdir()
    (tmp_path / "code" / "scene_work_for_tests.py").write_text(_WORK)
    monkeypatch.syspath_prepend(tmp_path / "code")
    import scene_work_for_tests

    return lambda deadly: partial(scene_work_for_tests.Work, str(tmp_path / "log"), deadly)


def new_schedule(tmp_path, pick=12, place=8):
    return Schedule(
        {"pick": pick, "place": place}, open_folder(tmp_path / "out", "encoder-1", 16), 0
    )


def collect(schedule, results, out):
    found = []
    for result in results:
        save(out, result)
        schedule.record(result)
        found.append(result)
    return found


def check_all_done(schedule, found, tmp_path):
    """Every scene came back once, whichever process died."""
    assert schedule.next_task() is None
    assert len({result.task for result in found}) == len(found)
    good = [result for result in found if result.stored]
    assert Counter(result.task.phase for result in good) >= Counter(pick=6, place=4)
    assert {path.name for path in (tmp_path / "out").glob("*.none.json")} == {
        result.file_name for result in good
    }
    assert not list((tmp_path / "out").glob(".*"))


def begun_by(tmp_path, task):
    """Processes that began a scene, in order."""
    return (tmp_path / "log" / task.name).read_text().split()


def check_killed_and_given_up(tmp_path, make_work, **where):
    """One scene kills its process once, another always; all others are stored."""
    schedule = new_schedule(tmp_path)
    results = run_scenes(
        make_work({("pick", 1): 1, ("place", 1): 99}), schedule.next_task, workers=2, **where
    )
    found = collect(schedule, results, tmp_path / "out")
    check_all_done(schedule, found, tmp_path)
    pids = begun_by(tmp_path, SceneTask(phase="pick", number=1))
    assert len(pids) == 2 and len(set(pids)) == 2
    (lost,) = [result for result in found if not result.stored and not result.error]
    assert lost == SceneResult(task=SceneTask(phase="place", number=1), reasons={"worker_died": 1})
    assert len(set(begun_by(tmp_path, lost.task))) == len(begun_by(tmp_path, lost.task)) == 3
    (fault,) = [result for result in found if result.error]
    assert fault.task.number == 5 and fault.error.endswith("RuntimeError: a fault\n")
    # The other worker may have been at one more scene of a phase when that was complete.
    assert schedule.stored["pick"] in (12, 14) and schedule.stored["place"] in (8, 10)


def test_scenes_here_survive_killed_processes(tmp_path, make_work):
    check_killed_and_given_up(tmp_path, make_work)
    assert multiprocessing.active_children() == []


@pytest.mark.slow
def test_scenes_on_a_ray_cluster_survive_killed_workers(tmp_path, make_work):
    import scene_work_for_tests
    from ray import cloudpickle

    # The workers of a cluster have another path.
    cloudpickle.register_pickle_by_value(scene_work_for_tests)
    try:
        check_killed_and_given_up(tmp_path, make_work, ray="local")
    finally:
        cloudpickle.unregister_pickle_by_value(scene_work_for_tests)


def test_processes_are_replaced_after_some_scenes(tmp_path, make_work):
    schedule = new_schedule(tmp_path, pick=2 * RENEW_AFTER + 2, place=0)
    results = run_scenes(make_work({}), schedule.next_task, workers=1)
    found = collect(schedule, results, tmp_path / "out")
    pids = [pid for result in found for pid in begun_by(tmp_path, result.task)]
    assert len(pids) == RENEW_AFTER + 2  # one of them fails
    assert len(set(pids[:RENEW_AFTER])) == 1
    assert len(set(pids)) == 2


@pytest.mark.parametrize(
    ("address", "reason"),
    [("127.0.0.1:1", "[Errno 111] Connection refused"), ("auto", "Could not find any running Ray")],
)
def test_no_cluster_gets_one_line(address, reason):
    running = run_on_ray(FACTORIAL, handing_out([1]), given_up, workers=None, address=address)
    with pytest.raises(ConfigError) as error:
        next(running)
    told = str(error.value)
    assert told.startswith(f"No Ray cluster answers at {address!r} ({reason}")
    assert told.endswith("); start one with ray start --head, or give --ray local.")
    assert "\n" not in told
