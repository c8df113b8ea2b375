"""Which scenes demonstrations come from."""

import itertools

import pytest

from models.arrangements.library import arrangement_names, load_arrangement
from models.objects.catalogue import object_names
from sr_mj.collecting.crowds import CrowdConfig, arranged_casts, draw_crowd, task_rng
from sr_mj.collecting.tasks import FIRST_SEED, MAX_RUNS, SceneTask
from sr_mj.errors import ConfigError
from sr_mj.scene import SCENE_KINDS

_LAST = 499_999


def tasks(num):
    return [
        SceneTask(phase=p, number=n, run=r)
        for p in ("pick", "place")
        for n in range(num)
        for r in (0, 7)
    ]


def test_seeds_are_apart_from_those_of_arrangements_tests_and_benchmarks():
    arranged = [load_arrangement(name).seed for name in arrangement_names()]
    assert max(seed for seed in arranged if seed is not None) < FIRST_SEED
    # What anybody gives by hand, and what benchmarks add to it.
    assert 100_000 * 40 + 2000 < FIRST_SEED
    assert min(task.seed for task in tasks(3)) == FIRST_SEED


def test_no_two_tasks_share_a_seed_or_a_name():
    ends = [
        SceneTask(phase=phase, number=number, run=run)
        for phase, number, run in itertools.product(
            ("pick", "place"), (0, 1, _LAST), (0, 1, MAX_RUNS - 1)
        )
    ]
    assert len({task.seed for task in ends}) == len({task.name for task in ends}) == len(ends)
    # The ranges touch, but do not overlap.
    assert (
        SceneTask(phase="pick", number=_LAST, run=3).seed + 1
        == SceneTask(phase="place", number=0, run=3).seed
    )
    assert (
        SceneTask(phase="place", number=_LAST, run=3).seed + 1
        == SceneTask(phase="pick", number=0, run=4).seed
    )


@pytest.mark.parametrize(
    ("number", "run", "message"),
    [
        (0, -1, "Seed is -1; expected 0 to 999."),
        (0, MAX_RUNS, "Seed is 1000; expected 0 to 999."),
        (
            _LAST + 1,
            0,
            "Scene 500000 of a run; expected 0 to 499999. Use another seed for more.",
        ),
    ],
)
def test_numbers_out_of_range_are_refused(number, run, message):
    with pytest.raises(ConfigError) as error:
        SceneTask(phase="pick", number=number, run=run)
    assert str(error.value) == message


def test_crowds_have_seen_objects_only_and_are_no_arrangement():
    seen = set(object_names("seen"))
    casts = arranged_casts()
    assert len(casts) > 50
    for task in tasks(120):
        config = draw_crowd(task, task_rng(task))
        assert set(config.objects) <= seen
        assert len(set(config.objects)) == len(config.objects) == config.kind.num_objects
        assert frozenset(config.objects) not in casts
        assert (config.arrangement, config.split, config.seed) == (None, "seen", task.seed)


def test_crowds_vary_within_their_kinds():
    found = {"pick": set(), "place": set()}
    for task in tasks(120):
        config = draw_crowd(task, task_rng(task))
        found[task.phase].add((config.scene, config.num_heaped, config.num_spread))
    assert found["pick"] == {("cluttered15", num, 0) for num in range(6, 16)}
    assert found["place"] == {
        *(("place8", 0, num) for num in range(5, 9)),
        *(("pickplace8", num, 3) for num in range(3, 6)),
    }


def test_the_same_task_gives_the_same_crowd():
    first, second = SceneTask(phase="place", number=3), SceneTask(phase="place", number=4)
    assert draw_crowd(first, task_rng(first)) == draw_crowd(first, task_rng(first))
    assert draw_crowd(first, task_rng(first)) != draw_crowd(second, task_rng(second))


def test_a_crowd_keeps_all_else_of_its_kind():
    config = CrowdConfig(scene="pickplace8", num_heaped=4, num_spread=3)
    full = SCENE_KINDS["pickplace8"]
    assert (config.kind.num_objects, config.kind.workspace) == (7, full.workspace)
    assert (config.kind.heap_center, config.kind.spread_lower) == (
        full.heap_center,
        full.spread_lower,
    )
