"""Scenes done by processes of this machine, and by a Ray cluster; the work here is a few files."""

from collections import Counter
from functools import partial

import pytest

from sr_mj.collecting.folder import open_folder, save
from sr_mj.collecting.pool import NUM_TRIES, SCENES_A_PROCESS, run_here
from sr_mj.collecting.ray_pool import run_on_ray
from sr_mj.collecting.schedule import CollectionError, Schedule
from sr_mj.collecting.tasks import SceneTask
from sr_mj.collecting.work import SceneResult
from sr_mj.errors import ConfigError

# In a file of its own, since fresh processes have to import it.
_WORK = '''
import os, signal
from pathlib import Path
from sr_mj.collecting.work import SceneResult

class Work:
    """Kills its process at the scenes that it is told to, as often as it is told to."""

    def __init__(self, log, deadly, times):
        self.log, self.deadly, self.times = Path(log), deadly, times

    def __call__(self, task):
        with (self.log / task.name).open("a") as file:
            file.write(f"{os.getpid()}\\n")
        begun = len((self.log / task.name).read_text().split())
        if task.number in self.deadly and begun <= self.times:
            os.kill(os.getpid(), signal.SIGKILL)
        if task.number == 5:
            raise RuntimeError("a fault")
        return SceneResult(task=task, file_name=f"{task.name}.none.json", content=b"{}",
                           stored={task.phase: 2})

def make(log, deadly, times):
    return Work(log, deadly, times)
'''


@pytest.fixture
def make_work(tmp_path, monkeypatch):
    (tmp_path / "code").mkdir()
    (tmp_path / "log").mkdir()
    (tmp_path / "code" / "scene_work_for_tests.py").write_text(_WORK)
    monkeypatch.syspath_prepend(tmp_path / "code")
    import scene_work_for_tests
    from ray import cloudpickle

    # The workers of a cluster have another path.
    cloudpickle.register_pickle_by_value(scene_work_for_tests)
    make = scene_work_for_tests.make
    return lambda deadly, times: partial(make, str(tmp_path / "log"), deadly, times)


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


@pytest.mark.distributed
def test_processes_here_survive_a_killed_one(tmp_path, make_work):
    schedule = new_schedule(tmp_path)
    results = run_here(make_work({1}, 1), schedule.next_task, 2)
    found = collect(schedule, results, tmp_path / "out")
    check_all_done(schedule, found, tmp_path)
    begun = {path.name: path.read_text().split() for path in (tmp_path / "log").iterdir()}
    again = SceneTask(phase="pick", number=1).name
    assert len(begun[again]) == 2 and len(set(begun[again])) == 2
    (fault,) = [result for result in found if result.error]
    assert fault.task.number == 5 and fault.error.endswith("RuntimeError: a fault\n")


@pytest.mark.distributed
def test_a_scene_that_kills_every_process_is_given_up(tmp_path, make_work):
    schedule = new_schedule(tmp_path, pick=6, place=0)
    results = run_here(make_work({1}, 99), schedule.next_task, 1)
    found = collect(schedule, results, tmp_path / "out")
    (lost,) = [result for result in found if not result.stored]
    assert (lost.task.number, lost.reasons, lost.file_name) == (1, {"worker_died": 1}, None)
    assert len((tmp_path / "log" / lost.task.name).read_text().split()) == NUM_TRIES
    assert schedule.stored["pick"] == 6


@pytest.mark.distributed
def test_processes_are_replaced_after_some_scenes(tmp_path, make_work):
    schedule = new_schedule(tmp_path, pick=2 * SCENES_A_PROCESS + 2, place=0)
    found = collect(
        schedule, run_here(make_work(set(), 0), schedule.next_task, 1), tmp_path / "out"
    )
    begun = [(tmp_path / "log" / result.task.name).read_text().strip() for result in found]
    assert len(begun) == SCENES_A_PROCESS + 2  # one of them fails
    assert len(set(begun[:SCENES_A_PROCESS])) == 1
    assert len(set(begun)) == 2


@pytest.mark.distributed
def test_a_ray_cluster_survives_a_killed_worker(tmp_path, make_work):
    schedule = new_schedule(tmp_path)
    results = run_on_ray(make_work({1}, 1), schedule.next_task, "local", 2)
    found = collect(schedule, results, tmp_path / "out")
    check_all_done(schedule, found, tmp_path)
    again = SceneTask(phase="pick", number=1).name
    assert len(set((tmp_path / "log" / again).read_text().split())) == 2


def test_a_cluster_that_is_not_there_is_one_clear_error(tmp_path, make_work):
    with pytest.raises(
        ConfigError, match=r"^No Ray cluster answers at 'auto' \(.*ray start --head"
    ):
        next(run_on_ray(make_work(set(), 0), lambda: None, "auto"))


def test_the_schedule_goes_on_where_it_was(tmp_path):
    first = new_schedule(tmp_path, pick=4, place=0)
    tasks = [first.next_task() for _ in range(3)]
    assert [task.number for task in tasks] == [0, 1, 2]
    save(
        tmp_path / "out",
        SceneResult(task=tasks[1], file_name=f"{tasks[1].name}.none.json", content=b"{}"),
    )
    second = new_schedule(tmp_path, pick=4, place=0)
    assert [second.next_task().number for _ in range(3)] == [0, 2, 3]


def test_the_schedule_does_what_is_farther_from_its_goal(tmp_path):
    schedule = new_schedule(tmp_path, pick=10, place=10)
    phases = []
    while (task := schedule.next_task()) is not None:
        phases.append(task.phase)
        schedule.record(SceneResult(task=task, stored={task.phase: 2}))
    assert sorted(phases) == ["pick"] * 5 + ["place"] * 5
    assert schedule.num_stored == 20
    # Placing gives picks as well; more than wanted do not make up for missing places.
    schedule = new_schedule(tmp_path, pick=2, place=4)
    schedule.record(
        SceneResult(task=SceneTask(phase="place", number=0), stored={"pick": 5, "place": 1})
    )
    assert schedule.num_stored == 3
    assert schedule.next_task().phase == "place"


def test_scene_after_scene_in_vain_is_an_error(tmp_path):
    schedule = new_schedule(tmp_path)
    with pytest.raises(
        CollectionError, match=r"^40 scenes in a row gave no decision \(no_scene 40"
    ):
        for _ in range(41):
            schedule.record(SceneResult(task=schedule.next_task(), reasons={"no_scene": 1}))
