from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from policy.actions import ActionCandidates
from policy.observation import Observation
from sr_mj.oracle import OraclePolicy
from sr_mj.scene import SceneConfig, make_scene
from sr_mj.scene.placement import find_object


@pytest.fixture(scope="module")
def scene():
    objects = (
        "apple",
        "banana",
        "lemon",
        "tomato_soup_can",
        "red_bowl",
        "red_mug",
        "box",
        "strawberry",
    )
    return make_scene(SceneConfig(scene="place8", objects=objects, goal="give me the lemon"))


def observation():
    return Observation(
        points=np.zeros((1, 3), np.float32),
        features=np.ones((1, 1), np.float32),
        similarity=np.zeros(1, np.float32),
        confidence=np.ones(1, np.float32),
        text_tokens=np.ones((1, 1), np.float32),
        text_pooled=np.ones(1, np.float32),
        workspace_min=np.zeros(3),
        workspace_max=np.ones(3),
    )


def grasps(positions, prior):
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("x", np.pi).as_matrix()
    poses[:, :3, 3] = positions
    num = len(positions)
    return ActionCandidates(
        kind="pick", Ts_world_tool=poses, width_m=np.full(num, 0.07, np.float32), prior=prior
    )


def center(scene, name):
    body = next(item.body for item in scene.objects if item.name == name)
    return scene.data.xipos[body.body_id]


def test_prefers_the_target_to_better_grasps_of_others(scene):
    positions = [center(scene, name) for name in ("apple", "lemon", "lemon", "banana")]
    candidates = grasps(positions, np.array([1.0, 0.2, 0.4, 0.9], np.float32))
    scores = OraclePolicy(scene).score(observation(), candidates, np.random.default_rng(0))
    assert scores.best == 2
    assert np.argsort(-scores.logits)[1] == 1


@pytest.fixture(scope="module")
def loaded():
    """A calculator with a bottle of shampoo on it, to be put into a dish."""
    return make_scene(SceneConfig(arrangement="pick-place-unseen-00"))


def on_each(scene, names):
    """Choose a point on each object; on the calculator, near the corner that is free."""
    points = {name: center(scene, name) for name in names}
    corners = find_object(scene, "calculator").asset.vertices
    pose = scene.T_world_object("calculator")
    corners = corners @ pose[:3, :3].T + pose[:3, 3]
    free = np.linalg.norm(corners - center(scene, "shampoo"), axis=1).argmax()
    points["calculator"] = points["calculator"] / 4 + corners[free] * 3 / 4
    return [points[name] for name in names]


def best(scene, candidates):
    return OraclePolicy(scene).score(observation(), candidates, np.random.default_rng(0)).best


def test_what_lies_on_a_target_is_taken_away_before_it_is_put_elsewhere(loaded):
    names = ("calculator", "shampoo", "remote_controller")
    candidates = grasps(on_each(loaded, names), np.float32([1.0, 0.0, 1.0]))
    assert list(OraclePolicy(loaded).gripped(candidates)) == list(names)
    assert best(loaded, candidates) == 1
    # Where it cannot be gripped, both are carried.
    assert best(loaded, candidates.take(np.array([0, 2]))) == 0
    # What is only to be picked may bring it along.
    only_picked = replace(loaded, goal=replace(loaded.goal, place=None))
    assert best(only_picked, candidates) == 0
    # What the target is to be put by must stay.
    place = replace(loaded.goal.place, references=("shampoo",))
    near_it = replace(loaded, goal=replace(loaded.goal, place=place))
    assert best(near_it, candidates) == 0


def test_a_target_that_carries_nothing_is_taken_first(loaded):
    both = replace(loaded, goal=replace(loaded.goal, targets=("calculator", "remote_controller")))
    names = ("calculator", "shampoo", "remote_controller")
    candidates = grasps(on_each(both, names), np.float32([1.0, 1.0, 0.0]))
    assert best(both, candidates) == 2


def test_without_a_grasp_of_the_target_takes_the_nearest(scene):
    lemon = center(scene, "lemon")
    positions = np.add(lemon, [[0.0, 0.0, 0.12], [0.0, 0.0, 0.3]])
    candidates = grasps(positions, np.array([0.1, 0.9], np.float32))
    scores = OraclePolicy(scene).score(observation(), candidates, np.random.default_rng(0))
    assert scores.best == 0


def test_no_candidates_and_no_targets(scene):
    empty = ActionCandidates(
        kind="pick", Ts_world_tool=np.zeros((0, 4, 4)), width_m=np.zeros(0), prior=np.zeros(0)
    )
    assert len(OraclePolicy(scene).score(observation(), empty, np.random.default_rng(0))) == 0
    hopeless = make_scene(SceneConfig(scene="single", objects=("apple",), goal="a violin"))
    candidates = grasps([[0.5, 0, 0.1]] * 2, np.array([0.1, 0.9], np.float32))
    scores = OraclePolicy(hopeless).score(observation(), candidates, np.random.default_rng(0))
    assert scores.best == 1
