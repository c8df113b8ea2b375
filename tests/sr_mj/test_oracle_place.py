from dataclasses import replace

import mujoco
import numpy as np
import pytest
import shapely
from scipy.spatial.transform import Rotation

from models.robot import TOOL_SITE_NAME
from policy.actions import ActionCandidates
from sr_mj.oracle_drop import rule_out_falls, stays
from sr_mj.oracle_place import score_places
from sr_mj.scene import Goal, PlaceGoal, SceneConfig, make_scene
from sr_mj.scene.placement import find_object, place_region

OBJECTS = ("red_bowl", "lemon", "banana", "orange", "apple", "block_cube", "plum", "tuna_can")
MOVED = "block_cube"


@pytest.fixture(scope="module")
def scene():
    """The cube between the fingers; its centre is the tool's origin."""
    made = make_scene(SceneConfig(scene="place8", objects=OBJECTS, seed=3))
    body = find_object(made, MOVED).body
    shift = made.data.site(TOOL_SITE_NAME).xpos - made.data.xipos[body.body_id]
    made.data.qpos[body.qpos][:3] += shift
    mujoco.mj_forward(made.model, made.data)
    return made


def with_goal(scene, relation, *references):
    place = PlaceGoal(relation=relation, references=references)
    return replace(scene, goal=Goal(text="", targets=(MOVED,), place=place))


def places(positions, prior=0.5):
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("x", np.pi).as_matrix()
    poses[:, :3, 3] = positions
    return ActionCandidates(
        kind="place",
        Ts_world_tool=poses,
        width_m=np.full(len(positions), 0.04),
        prior=np.broadcast_to(prior, len(positions)),
    )


def center(scene, name):
    return scene.data.xipos[find_object(scene, name).body.body_id]


def anywhere(num=2000):
    rng = np.random.default_rng(0)
    return rng.uniform((0.28, -0.22, 0.05), (0.72, 0.22, 0.2), (num, 3))


@pytest.mark.parametrize("relation", ["near", "around", "in", "on top of"])
@pytest.mark.parametrize("reference", ["tuna_can", "red_bowl"])
def test_every_place_that_counts_as_good_is_valid(scene, relation, reference):
    scene = with_goal(scene, relation, reference)
    positions = anywhere()
    scores = score_places(scene, MOVED, places(positions))
    region = place_region(scene, relation, reference, moved=MOVED)
    good = scores > 10
    assert good.any()
    # The region's arcs are polygons, whose corners cut off up to a millimetre.
    gaps = shapely.distance(region.area, shapely.points(positions[good][:, :2]))
    assert gaps.max() < 1e-3
    # The best lies further inside than most of the good ones.
    edge = region.area.boundary
    depths = shapely.distance(edge, shapely.points(positions[good][:, :2]))
    best = shapely.distance(edge, shapely.Point(positions[scores.argmax()][:2]))
    assert best > np.median(depths)


def test_around_an_object_others_are_kept_clear_of(scene):
    scene = with_goal(scene, "near", "tuna_can")
    positions = anywhere()
    good = score_places(scene, MOVED, places(positions)) > 10
    half = np.ptp(find_object(scene, MOVED).asset.vertices, axis=0).min() / 2
    for name in set(OBJECTS) - {MOVED}:
        vertices = find_object(scene, name).asset.vertices
        pose = scene.T_world_object(name)
        outline = (vertices @ pose[:3, :3].T + pose[:3, 3])[:, :2]
        gaps = np.linalg.norm(positions[good][:, None, :2] - outline[None], axis=2).min(axis=1)
        assert gaps.min() > half


def test_the_prior_decides_between_equal_places_only(scene):
    scene = with_goal(scene, "on", "tuna_can")
    middle = center(scene, "tuna_can")
    beside = np.add(middle, [0.1, 0, 0])
    candidates = places([middle, middle, beside], np.array([0.3, 0.6, 1.0]))
    scores = score_places(scene, MOVED, candidates)
    assert scores.argsort().tolist() == [2, 0, 1]


def test_any_of_several_references_will_do(scene):
    scene = with_goal(scene, "on", "tuna_can", "red_bowl")
    candidates = places([center(scene, name) for name in ("lemon", "tuna_can", "red_bowl")])
    scores = score_places(scene, MOVED, candidates)
    assert scores[0] < 1 and min(scores[1:]) > 10


def test_nearer_is_better_where_no_place_is_valid(scene):
    scene = with_goal(scene, "on", "tuna_can")
    can = center(scene, "tuna_can")
    scores = score_places(scene, MOVED, places(np.add(can, [[0.06, 0, 0], [0.2, 0, 0]])))
    assert 1 > scores[0] > scores[1]


def test_without_a_reference_the_prior_decides(scene):
    candidates = places(anywhere(3), np.array([0.1, 0.9, 0.5]))
    for goal in (replace(scene.goal, place=None), with_goal(scene, "near").goal):
        scores = score_places(replace(scene, goal=goal), MOVED, candidates)
        np.testing.assert_allclose(scores, [0.05, 0.45, 0.25], rtol=1e-6)
    assert len(score_places(scene, MOVED, places(np.zeros((0, 3))))) == 0


def test_a_place_that_the_object_falls_from_is_ruled_out(scene):
    scene = with_goal(scene, "on", "tuna_can")
    top = center(scene, "tuna_can") * [1, 1, 2]
    vertices = find_object(scene, MOVED).asset.vertices
    low = vertices[:, 2].max() + 0.003
    # Over the edge, as a bad estimate of what is held may have it; from the air; just above.
    poses = np.add(top, [[0.042, 0, low], [0, 0, low + 0.15], [0, 0, low]])
    before = scene.data.qpos.copy()
    scores = rule_out_falls(scene, MOVED, places(poses), np.array([12.0, 9.0, 11.0]), 10.0)
    np.testing.assert_array_equal(scores, [7, 9, 11])
    np.testing.assert_array_equal(scene.data.qpos, before)
    assert stays(scene, MOVED, places(poses).Ts_world_tool[2])
    # Nothing is tried that is not good otherwise.
    low_scores = np.array([5.0, 4.0, 3.0])
    np.testing.assert_array_equal(
        rule_out_falls(scene, MOVED, places(poses), low_scores, 10.0), low_scores
    )
