"""Which scene comes next, and when there is no point in going on."""

import pytest

from sr_mj.collecting.folder import open_folder, save
from sr_mj.collecting.schedule import CollectionError, Schedule
from sr_mj.collecting.tasks import SceneTask
from sr_mj.collecting.work import SceneResult


def new_schedule(tmp_path, pick=12, place=8):
    return Schedule(
        {"pick": pick, "place": place}, open_folder(tmp_path / "out", "encoder-1", 16), 0
    )


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
