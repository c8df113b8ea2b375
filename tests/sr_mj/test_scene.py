import mujoco
import numpy as np
import pytest

from models.objects.catalogue import load_object, object_names, object_words
from models.objects.words import ObjectWords
from models.workspace import GRASP_WORKSPACE
from sr_mj.errors import ConfigError, SceneError, UnknownNameError
from sr_mj.scene import SCENE_KINDS, SPLITS, SceneConfig, find_targets, make_scene
from sr_mj.scene.build import narrowest_width
from sr_mj.scene.goals import draw_goal
from sr_mj.scene.settle import Drop, Settler

WORDS = {name: object_words(name) for split in SPLITS for name in object_names(split)}


@pytest.fixture(scope="module", params=[(s, p) for s in SCENE_KINDS for p in SPLITS])
def scene(request):
    kind, split = request.param
    return make_scene(SceneConfig(scene=kind, split=split, seed=3))


def test_objects_rest_in_the_workspace(scene):
    for item in scene.objects:
        center = scene.data.xipos[item.body.body_id]
        assert scene.workspace.contains_xy(center)
        assert center[2] > 0
    assert len(scene.objects) == scene.config.kind.num_objects
    assert len({item.name for item in scene.objects}) == len(scene.objects)
    assert all(item.asset.split == scene.config.split for item in scene.objects)


def test_objects_stay_where_they_lie(scene):
    model, data = scene.model, mujoco.MjData(scene.model)
    data.qpos[:], data.ctrl[:] = scene.settled_qpos, scene.data.ctrl
    mujoco.mj_step(model, data, 1000)
    for item in scene.objects:
        moved = data.qpos[item.body.qpos][:3] - scene.settled_qpos[item.body.qpos][:3]
        assert np.linalg.norm(moved) < 2e-3, item.name


def test_nothing_is_deeply_interpenetrating(scene):
    assert np.all(scene.data.contact.dist[: scene.data.ncon] > -2e-3)


def test_a_goal_has_a_graspable_target(scene):
    if not scene.objects:
        assert scene.goal.targets == ()
        return
    graspable = {item.name for item in scene.objects if item.graspable}
    assert graspable & set(scene.goal.targets)


def test_same_configuration_same_bytes(cluttered_scene):
    again = make_scene(cluttered_scene.config)
    assert again.settled_qpos.tobytes() == cluttered_scene.settled_qpos.tobytes()
    assert again.goal == cluttered_scene.goal
    other = make_scene(SceneConfig(seed=cluttered_scene.config.seed + 1))
    assert [o.name for o in other.objects] != [o.name for o in again.objects]


def test_spread_objects_keep_their_distance():
    scene = make_scene(SceneConfig(scene="place8", seed=1))
    xy = np.array([scene.data.xipos[item.body.body_id][:2] for item in scene.objects])
    gaps = np.linalg.norm(xy[:, None] - xy[None], axis=-1)[np.triu_indices(8, 1)]
    assert gaps.min() >= 0.1


def test_named_objects_are_used():
    scene = make_scene(SceneConfig(scene="single", objects=("banana",)))
    assert [item.name for item in scene.objects] == ["banana"]
    assert scene.goal.targets == ("banana",)


def test_a_stated_goal_that_nothing_satisfies_has_no_targets():
    scene = make_scene(SceneConfig(scene="single", objects=("banana",), goal="give me the violin"))
    assert scene.goal.text == "give me the violin"
    assert scene.goal.targets == ()


def test_masses_are_those_of_the_catalogue(cluttered_scene):
    for item in cluttered_scene.objects:
        mass = cluttered_scene.model.body_mass[item.body.body_id]
        assert mass == pytest.approx(load_object(item.name).mass_kg)


@pytest.mark.parametrize(
    ("make", "error_type", "message"),
    [
        (lambda: SceneConfig(scene="cluttered51"), UnknownNameError, "Unknown scene 'cluttered51'. Scenes: cluttered15, place8, pickplace8, heavy30, single, empty. Did you mean 'cluttered15'?"),
        (lambda: SceneConfig(split="sene"), UnknownNameError, "Unknown split 'sene'. Splits: seen, unseen. Did you mean 'seen'?"),
        (lambda: SceneConfig(seed=-1), ConfigError, "Seed is -1; expected an integer of 0 or more."),
        (lambda: SceneConfig(goal=" "), ConfigError, "The goal is blank; say what to grasp, or leave the goal out."),
        (lambda: make_scene(SceneConfig(scene="place8", objects=("apple",))), SceneError, "Scene 'place8' has 8 objects, got 1 names; name as many as it has, or none."),
        (lambda: draw_goal(WORDS, [], np.random.default_rng(0)), SceneError, "No object of this scene can be held by the gripper as it lies, so no goal can be drawn. Use another seed, or state a goal."),
    ],
)  # fmt: skip
def test_bad_input(make, error_type, message):
    with pytest.raises(error_type) as error:
        make()
    assert str(error.value) == message


def test_drawn_goals_mean_what_their_text_says():
    rng = np.random.default_rng(0)
    for _ in range(300):
        names = rng.choice(sorted(WORDS), size=15, replace=False)
        objects = {str(name): WORDS[str(name)] for name in names}
        goal = draw_goal(objects, list(objects)[:5], rng)
        assert set(goal.targets) & set(list(objects)[:5])
        assert find_targets(goal.text, objects) == goal.targets, goal.text


def words(label=None, **kwargs):
    return ObjectWords(label=label, synonyms=() if label else ("thing x",), **kwargs)


SHELF = {
    "soap": words("soap", functions=("clean",)),
    "soap_dish": words("soap dish", category="container", colors=("red",)),
    "orange": words("orange", category="fruit", colors=("orange",), shapes=("round",)),
    "ball": words("racquetball", colors=("blue",), shapes=("round",), functions=("play",)),
    "cup": words("cup", category="cup", colors=("red",)),
    "yellow_cup": words("yellow cup", category="cup", colors=("yellow",)),
    "drill": words("power drill", colors=("orange",)),
}


@pytest.mark.parametrize(
    ("text", "targets"),
    [
        ("give me the soap", ("soap",)),
        ("give me the soap dish", ("soap_dish",)),
        ("I need a container", ("soap_dish",)),
        ("grasp a round object", ("orange", "ball")),
        ("grasp an orange object", ("orange", "drill")),
        ("give me the orange", ("orange",)),
        ("get something to clean", ("soap",)),
        ("Give me the CUP!", ("cup", "yellow_cup")),
        ("could I have a yellow cup, please", ("yellow_cup",)),
        ("something round and blue", ("ball",)),
        ("I want an orange, put it near the cup", ("orange",)),
        ("give me the violin", ()),
    ],
)
def test_targets_of_free_wording(text, targets):
    assert find_targets(text, SHELF) == targets


def test_narrowest_width_of_a_turned_plank():
    plank = np.array([(x, y, z) for x in (0, 0.2) for y in (0, 0.03) for z in (0, 0.5)])
    turn = np.radians(35)
    R = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    assert narrowest_width(plank @ R.T) == pytest.approx(0.03, abs=1e-9)


def test_workspace_contains():
    assert GRASP_WORKSPACE.contains_xy([[0.5, 0, 9], [0.2, 0, 0]]).tolist() == [True, False]


def test_an_object_that_sleeps_on_the_table_falls_when_it_is_dropped_again():
    scene = make_scene(SceneConfig(scene="single", objects=("dove",), goal="the dove"))
    body = scene.objects[0].body
    mujoco.mj_step(scene.model, scene.data, 2000)
    resting = scene.data.xipos[body.body_id][2]
    settler = Settler(scene.model, scene.data, [body], scene.workspace)
    drop = Drop(position=np.array([0.5, 0.0, 0.5]), quat_wxyz=np.array([1.0, 0.0, 0.0, 0.0]))
    settler.drop(body, drop)
    settler.wait_until_calm()
    assert scene.data.xipos[body.body_id][2] < resting + 0.1


@pytest.mark.parametrize("seed", range(5, 9))
def test_every_object_of_a_heap_rests_on_something(seed):
    scene = make_scene(SceneConfig(seed=seed))
    touching = scene.model.geom_bodyid[scene.data.contact.geom[: scene.data.ncon]]
    for item in scene.objects:
        assert item.body.body_id in touching, item.name
