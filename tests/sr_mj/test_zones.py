"""A goal to pick and place keeps to the zones of the scene's workspace."""

import mujoco
import pytest

from models.workspace import PICK_PLACE_WORKSPACE, PICK_ZONE, PLACE_ZONE
from sr_mj.assemble import assembled, lifter_for, make_policy
from sr_mj.episode import run_episode
from sr_mj.outcome import Reason
from sr_mj.planning import Planner
from sr_mj.scene import SceneConfig, make_scene
from sr_mj.scene.config import scene_config


@pytest.fixture(scope="module")
def act():
    lifter, planner = lifter_for(PICK_PLACE_WORKSPACE, "embedded"), Planner()

    def run(scene):
        policy = make_policy("oracle", scene)
        with assembled(scene, lifter=lifter, policy=policy, planner=planner) as pipeline:
            return list(run_episode(scene, pipeline, seed=0, max_attempts=2))

    return run


def test_each_phase_looks_and_acts_in_its_zone(act):
    attempts = act(make_scene(scene_config("pick-place-seen-05")))
    assert [attempt.outcome.reason for attempt in attempts] == [
        Reason.GRASPED_TARGET,
        Reason.PLACED,
    ]
    for attempt, zone, other in zip(
        attempts, (PICK_ZONE, PLACE_ZONE), (PLACE_ZONE, PICK_ZONE), strict=True
    ):
        assert zone.contains_xy(attempt.percept.features.points).all()
        assert len(attempt.candidates) and zone.contains_xy(attempt.candidates.positions).all()
        # What is in the other zone is an obstacle all the same.
        assert other.contains_xy(attempt.percept.geometry.points).any()


def test_a_goal_to_pick_alone_may_take_anything(act):
    (attempt,) = act(make_scene(scene_config("pick-place-seen-05", goal="give me the plum")))
    assert attempt.outcome.reason is Reason.GRASPED_TARGET
    assert PLACE_ZONE.contains_xy(attempt.plan.T_world_tool[:3, 3])


def test_a_zone_with_nothing_in_it(act):
    scene = make_scene(scene_config("pick-place-seen-05"))
    for item in scene.objects:
        if PICK_ZONE.contains_xy(scene.T_world_object(item.name)[:3, 3]):
            scene.data.qpos[item.body.qpos][:2] += 5.0
    mujoco.mj_forward(scene.model, scene.data)
    (attempt,) = act(scene)
    assert attempt.outcome.reason is Reason.NOTHING_IN_SIGHT and attempt.percept is None


def test_zones_belong_to_goals_with_both_phases():
    scene = make_scene(scene_config("pick-place-seen-05"))
    assert (scene.zone("pick"), scene.zone("place")) == (PICK_ZONE, PLACE_ZONE)


@pytest.mark.parametrize(
    ("kind", "goal"),
    [
        ("pickplace8", "put it near the plum"),
        ("place8", "give me the lemon, put it near the apple"),
    ],
)
def test_no_zones_without_both_phases(kind, goal):
    scene = make_scene(SceneConfig(scene=kind, goal=goal))
    assert scene.zone("pick") is None and scene.zone("place") is None
