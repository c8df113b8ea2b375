from dataclasses import replace

import numpy as np
import pytest

from models.ur5 import HOME_QPOS
from policy.actions import ActionCandidates, ActionScores
from policy.baselines.random import RandomPolicy
from sr_mj.account import attempt_record, describe_attempt, describe_result, episode_record
from sr_mj.assemble import assembled, lifter_for, make_policy
from sr_mj.episode import PLACE_LOOKS, has_succeeded, is_handed_over, run_episode
from sr_mj.judge import object_in_gripper
from sr_mj.outcome import Reason
from sr_mj.perturbation import PoseError, PosePerturbation
from sr_mj.pipeline import EpisodeRngs
from sr_mj.planning import Planner
from sr_mj.scene import Goal, PlaceGoal, SceneConfig, make_scene
from sr_mj.scene.placement import find_object, is_placed, place_region

OBJECTS = ("block_cube", "tuna_can", "lemon", "banana", "apple", "plum", "red_bowl", "orange")


@pytest.fixture(scope="module")
def planner():
    return Planner()


@pytest.fixture(scope="module")
def lifter(planner):
    return lifter_for(SceneConfig(scene="place8").kind.workspace, "embedded")


@pytest.fixture
def act(planner, lifter):
    """Run an episode on eight objects set apart; return the scene and the attempts."""

    def run(goal, policy="oracle", max_attempts=8, changes=None, seed=0):
        text = goal if isinstance(goal, str) else goal.text
        scene = make_scene(SceneConfig(scene="place8", objects=OBJECTS, seed=2, goal=text))
        if goal is not text:
            scene = replace(scene, goal=goal)
        with assembled(
            scene, lifter=lifter, policy=make_policy(policy, scene), planner=planner
        ) as pipeline:
            pipeline = replace(pipeline, **(changes or {}))
            return scene, list(run_episode(scene, pipeline, seed=seed, max_attempts=max_attempts))

    return run


class Proposes:
    """Generates the same candidates whatever is seen."""

    def __init__(self, kind, *positions):
        poses = np.tile(np.diag([1.0, -1.0, -1.0, 1.0]), (len(positions), 1, 1))
        poses[:, :3, 3] = np.reshape(positions, (-1, 3))
        self.candidates = ActionCandidates(
            kind=kind,
            Ts_world_tool=poses,
            width_m=np.full(len(positions), 0.05),
            prior=np.full(len(positions), 0.5),
        )

    def pick(self, cloud, rng):
        return self.candidates

    def place(self, cloud, held, rng):
        return self.candidates


def without_times(attempts):
    records = [attempt_record(attempt) for attempt in attempts]
    return [{k: v for k, v in record.items() if k != "seconds"} for record in records]


@pytest.fixture(scope="module")
def picked_and_placed(planner, lifter):
    runs = []
    for _ in range(2):
        scene = make_scene(
            SceneConfig(
                scene="place8",
                objects=OBJECTS,
                seed=2,
                goal="give me the lemon, put it near the apple",
            )
        )
        policy = make_policy("oracle", scene)
        with assembled(scene, lifter=lifter, policy=policy, planner=planner) as pipeline:
            region = place_region(scene, "near", "apple", moved="lemon")
            runs.append((scene, list(run_episode(scene, pipeline, seed=0)), region))
    return runs


def test_picks_and_places(picked_and_placed):
    scene, attempts, region = picked_and_placed[0]
    assert [attempt.kind for attempt in attempts] == ["pick", "place"]
    assert [attempt.outcome.reason for attempt in attempts] == [
        Reason.GRASPED_TARGET,
        Reason.PLACED,
    ]
    assert has_succeeded(scene, attempts) and is_placed(scene, "lemon", region)
    np.testing.assert_allclose(scene.data.qpos[:6], HOME_QPOS, atol=5e-3)
    place = attempts[1]
    assert place.held is not None and place.candidates.kind == "place"
    # The place is looked for by the reference, not by the object to pick.
    assert attempts[0].percept.target_phrase == "lemon"
    assert place.percept.target_phrase == "apple"
    record = episode_record(scene, attempts, 8)
    assert record["success"] and (record["num_attempts"], record["num_actions"]) == (1, 2)
    assert describe_attempt(place).startswith("pl  ")
    assert describe_result(scene, attempts, 8) == "Result success: lemon placed near apple"


def test_the_held_object_is_not_in_the_cloud(picked_and_placed):
    _, (pick, place), _ = picked_and_placed[0]
    at_lemon = pick.plan.T_world_tool[:3, 3]

    def num_near(attempt):
        points = attempt.percept.geometry.points
        above_table = points[points[:, 2] > 0.01]
        return np.sum(np.linalg.norm(above_table - at_lemon, axis=1) < 0.035)

    assert num_near(pick) > 20 and num_near(place) == 0


def test_same_seed_same_episode(picked_and_placed):
    (first_scene, first, _), (second_scene, second, _) = picked_and_placed
    assert without_times(first) == without_times(second)
    assert first_scene.data.qpos.tobytes() == second_scene.data.qpos.tobytes()


def test_what_is_not_named_is_handed_over(act):
    place = PlaceGoal(relation="on", references=("tuna_can",))
    goal = Goal(text="put it on the tuna", targets=("block_cube",), place=place)
    # The policy under test would pick anything.
    scene, attempts = act(goal, policy="random")
    assert is_handed_over(scene)
    *picks, last = attempts
    assert picks and all(a.is_hand_over and a.kind == "pick" for a in picks)
    assert picks[-1].outcome.grasped == "block_cube"
    assert last.kind == "place" and not last.is_hand_over
    record = episode_record(scene, attempts, 8)
    assert record["num_attempts"] == 0 and record["num_actions"] == 1
    assert describe_attempt(attempts[0]).startswith("ho  ")


def test_no_candidates_is_an_outcome_and_the_robot_looks_again(act):
    scene, attempts = act("a lemon", changes={"generator": Proposes("pick")}, max_attempts=2)
    assert [a.outcome.reason for a in attempts] == [Reason.NO_CANDIDATES] * 2
    assert not has_succeeded(scene, attempts)
    assert attempts[0].views[0].depth_m.tobytes() != attempts[1].views[0].depth_m.tobytes()
    assert attempts[0].outcome.reward == -1


def test_no_place_is_an_outcome_and_the_robot_looks_again(act):
    scene, attempts = act(
        "give me the lemon, put it near the apple", changes={"placer": Proposes("place")}
    )
    assert [a.kind for a in attempts] == ["pick"] + ["place"] * PLACE_LOOKS
    assert {a.outcome.reason for a in attempts[1:]} == {Reason.NO_CANDIDATES}
    assert not has_succeeded(scene, attempts)
    assert object_in_gripper(scene) == "lemon"
    assert describe_result(scene, attempts, 8) == "Result failure: no place found"


FAR, NEAR = (1.6, 0.0, 0.1), (0.5, 0.0, 0.15)


@pytest.mark.parametrize("keep", [False, True])
def test_what_cannot_be_reached_is_left_out_before_the_choice(act, keep):
    changes = {"generator": Proposes("pick", FAR, NEAR), "keep_unreachable": keep}
    (attempt,) = act("a lemon", changes=changes, max_attempts=1)[1]
    assert attempt.num_unreachable == (not keep)
    assert attempt.candidates.positions[-1].tolist() == list(NEAR)
    assert len(attempt.candidates) == len(attempt.scores) == 1 + keep


def test_a_choice_that_cannot_be_reached_costs_an_attempt_if_kept(act):
    changes = {"generator": Proposes("pick", FAR), "keep_unreachable": True}
    (attempt,) = act("a lemon", changes=changes, max_attempts=1)[1]
    assert attempt.outcome.reason is Reason.UNREACHABLE and attempt.plan is None


def test_the_executed_pose_is_perturbed_and_the_choice_is_not(act):
    changes = {
        "generator": Proposes("pick", NEAR),
        "perturbation": PosePerturbation(sigma_m=0.01),
        "policy": RandomPolicy(),
    }
    plans = []
    for _ in range(2):
        (attempt,) = act("a lemon", changes=changes, max_attempts=1)[1]
        np.testing.assert_array_equal(attempt.candidates.positions[0], NEAR)
        plans.append(attempt.plan.T_world_tool)
    np.testing.assert_array_equal(plans[0], plans[1])
    assert 1e-3 < np.linalg.norm(plans[0][:3, 3] - NEAR) < 0.05


class Prefers:
    """Likes candidates in the order in which they were proposed."""

    name = "prefers"

    def score(self, observation, candidates, rng):
        return ActionScores(logits=-np.arange(len(candidates), dtype=float))


class Errs:
    """Errs by known distances, one after the other, and remembers how many were asked for."""

    def __init__(self, *shifts_m):
        self.shifts_m, self.num_drawn = shifts_m, 0

    def draw(self, rng):
        shift = self.shifts_m[min(self.num_drawn, len(self.shifts_m) - 1)]
        self.num_drawn += 1
        return PoseError(shift_m=np.array(shift), turn_rad=np.zeros(3))


def test_an_error_changes_neither_the_choice_nor_is_it_avoided(act):
    scene = make_scene(SceneConfig(scene="place8", objects=OBJECTS, seed=2))
    x, y, _ = scene.data.xipos[find_object(scene, "tuna_can").body.body_id]
    over_can, lower_m = (x, y, 0.1), 0.08
    changes = {"generator": Proposes("pick", over_can, NEAR), "policy": Prefers()}
    for perturbation, z in ((None, 0.1), (Errs((0, 0, -lower_m)), 0.1 - lower_m)):
        (attempt,) = act(
            "a lemon", changes=changes | {"perturbation": perturbation}, max_attempts=1
        )[1]
        assert attempt.plan.chosen == 0
        np.testing.assert_allclose(attempt.plan.T_world_tool[:3, 3], (x, y, z))
    # It ran into the can, which the planner would have avoided.
    assert attempt.outcome.reason in (Reason.APPROACH_COLLISION, Reason.GRASPED_OTHER)
    lowered = [np.subtract(over_can, (0, 0, lower_m)), NEAR]
    (attempt,) = act(
        "a lemon", changes=changes | {"generator": Proposes("pick", *lowered)}, max_attempts=1
    )[1]
    assert attempt.plan.chosen == 1


def test_a_place_that_cannot_be_reached_is_final_if_kept(act):
    changes = {"placer": Proposes("place", FAR), "keep_unreachable": True}
    attempts = act("give me the lemon, put it near the apple", changes=changes)[1]
    (place,) = (a for a in attempts if a.kind == "place")
    assert place.outcome.reason is Reason.UNREACHABLE


def test_an_error_into_the_table_ends_on_it(act):
    low_m = -0.04
    down = Errs((0.01, 0, low_m - NEAR[2]))
    changes = {
        "generator": Proposes("pick", NEAR),
        "perturbation": down,
        "policy": Prefers(),
    }
    (attempt,) = act("a lemon", changes=changes, max_attempts=1)[1]
    x, y, z = attempt.plan.T_world_tool[:3, 3]
    np.testing.assert_allclose((x, y), (0.51, 0.0))
    # Of poses 5 mm apart, the lowest at which the gripper is not in the table.
    rise = (z - low_m) / 0.005
    assert rise == pytest.approx(round(rise)) and rise > 0
    alone = attempt.candidates.take(np.array([0]))
    heights = {}
    for height in (z, z - 0.005):
        pose = attempt.plan.T_world_tool.copy()
        pose[2, 3] = height
        heights[height] = Planner().reachable(replace(alone, Ts_world_tool=pose[None]))[0]
    assert heights == {z: True, z - 0.005: False}
    # What was chosen is remembered, not where the arm went.
    np.testing.assert_array_equal(attempt.chosen_pose[:3, 3], NEAR)


def test_of_one_placement_there_is_one_error_however_often_it_is_looked_for(act):
    # No arm reaches the first, and the second would be none.
    errs = Errs((0, 0, 0), (2.0, 0, 0), (0, 0, 0))
    goal = "give me the lemon, put it near the apple"
    _, attempts = act(goal, changes={"perturbation": errs})
    pick, *places = attempts
    assert pick.outcome.success
    assert [a.outcome.reason for a in places] == [Reason.UNREACHABLE] * PLACE_LOOKS
    assert errs.num_drawn == 2


def test_errors_differ_from_scene_to_scene_and_nothing_else_does():
    scenes = [make_scene(SceneConfig(scene="single", seed=seed)) for seed in (0, 1)]
    first, second = (EpisodeRngs.of_episode(scene, 5) for scene in scenes)
    again = EpisodeRngs.of_episode(scenes[0], 5)
    draws = {}
    for name in ("noise", "candidates", "policy", "perturbation"):
        rngs = (getattr(r, name) for r in (first, second, again))
        draws[name] = [rng.random() for rng in rngs]
    for name, (one, other, repeated) in draws.items():
        assert one == repeated
        assert (one == other) is (name != "perturbation")
    assert len({one for one, *_ in draws.values()}) == len(draws)


def test_an_episode_draws_nothing_from_the_streams_that_drew_its_scene():
    scene = make_scene(SceneConfig(scene="single", seed=5))
    of_scene = {rng.random() for rng in np.random.default_rng(5).spawn(3)}
    rngs = EpisodeRngs.of_episode(scene, 5)
    first = {rng.random() for rng in (rngs.noise, rngs.candidates, rngs.policy)}
    assert len(of_scene | first) == 6


def test_an_episode_of_an_arrangement_draws_the_same_as_ever():
    # Recorded runs are repeated by their seed.
    scene = make_scene(SceneConfig(arrangement="place-seen-00"))
    rngs = EpisodeRngs.of_episode(scene, 5)
    expected = [rng.random() for rng in np.random.default_rng(5).spawn(3)]
    assert [rng.random() for rng in (rngs.noise, rngs.candidates, rngs.policy)] == expected
