import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from policy.actions import ActionCandidates
from policy.observation import Observation
from sr_mj.oracle import OraclePolicy
from sr_mj.scene import SceneConfig, make_scene


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
