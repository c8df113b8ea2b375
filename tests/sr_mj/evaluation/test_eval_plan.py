from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from models.arrangements.library import arrangement_names
from policy.actions import ActionCandidates, ActionScores
from policy.observation import Observation
from sr_mj.errors import ConfigError, SrMjError
from sr_mj.evaluation.conditions import Condition, read_condition
from sr_mj.evaluation.noisy import NoisyPoints
from sr_mj.evaluation.plan import (
    SUITES,
    Episode,
    PolicyChoice,
    plan_random,
    plan_suites,
    read_policies,
)
from sr_mj.sensors.l515 import L515NoiseConfig

ONE = (PolicyChoice(label="random", name="random"),)
BOTH = ("seen", "unseen")


def test_references_always_run_and_first():
    labels = [choice.label for choice in read_policies(["grounding", "random"])]
    assert labels == ["oracle", "random", "grounding"]


def test_a_checkpoint_names_its_policy(tmp_path):
    weights = tmp_path / "sr_a.safetensors"
    weights.touch()
    choice = read_policies([f"sr@{weights}"])[-1]
    assert choice == PolicyChoice(label="sr@sr_a", name="sr", checkpoint=weights)


@pytest.mark.parametrize(
    ("policies", "message"),
    [
        (
            ["grunding"],
            "Unknown policy 'grunding'. Policies: {all}. Did you mean 'grounding'?",
        ),
        (["sr@nowhere.st"], "Checkpoint 'nowhere.st' of policy 'sr' is no file; check it."),
        (
            ["oracle@README.md"],
            "Policy 'oracle' is given the checkpoint 'README.md', but has no weights; leave the "
            "checkpoint out, or name the policy that it belongs to.",
        ),
    ],
)
def test_bad_policies_get_one_line(policies, message):
    from sr_mj.assemble import ALL_POLICIES

    with pytest.raises(SrMjError) as error:
        read_policies(policies)
    assert str(error.value) == message.format(all=", ".join(ALL_POLICIES))


def test_two_checkpoints_of_one_name_are_refused(tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "w.st").touch()
    with pytest.raises(ConfigError, match=r"^Two policies would both be called 'sr@w'; "):
        read_policies([f"sr@{tmp_path}/a/w.st", f"sr@{tmp_path}/b/w.st"])


@pytest.mark.parametrize("task", ["grasp", "place", "pick-place", "heavy30"])
def test_a_plain_suite_is_every_arrangement_with_every_seed(task):
    episodes = plan_suites([task], BOTH, range(15), ONE)
    assert len(episodes) == 15 * len(arrangement_names(task))
    assert {episode.condition for episode in episodes} == {"clean"}
    assert {(e.scene, e.seed) for e in episodes} == {
        (name, seed) for name in arrangement_names(task) for seed in range(15)
    }


def test_all_is_every_suite_with_shared_episodes_once():
    everything = plan_suites(["all"], BOTH, range(2), ONE)
    assert set(everything) == set(plan_suites(list(SUITES), BOTH, range(2), ONE))
    assert len(everything) == len(set(everything))
    parts = [plan_suites([suite], BOTH, range(2), ONE) for suite in SUITES]
    assert len(everything) < sum(map(len, parts))
    assert {e.condition for e in everything if e.task == "place"} == {
        *("clean", "reworded", "pose-0.5cm-2deg", "pose-1cm-5deg", "pose-2cm-10deg"),
    }


def test_policies_share_scenes_seeds_and_conditions():
    policies = read_policies(["grounding"])
    episodes = plan_suites(["noise"], ["unseen"], range(3), policies)
    sets = {
        choice.label: {(e.scene, e.seed, e.condition) for e in episodes if e.policy == choice.label}
        for choice in policies
    }
    assert len(set(map(frozenset, sets.values()))) == 1 and len(sets) == 3


def test_the_order_does_not_depend_on_how_it_was_asked():
    a = plan_suites(["grasp", "place"], BOTH, range(2), read_policies(["grounding"]))
    b = plan_suites(["place", "grasp"], BOTH[::-1], [1, 0], read_policies(["grounding"])[::-1])
    assert a == b == tuple(sorted(a))
    # The policies of one scene and seed come one after another: they share what was perceived.
    assert len({(e.scene, e.seed, e.condition) for e in a[:3]}) == 1


def test_an_episode_survives_its_record_and_has_a_key_of_its_own():
    episodes = plan_suites(["all"], BOTH, range(2), read_policies([]))
    assert [Episode.of_record(episode.record()) for episode in episodes] == list(episodes)
    assert len({episode.key for episode in episodes}) == len(episodes)
    assert all(Path(episode.key).name == episode.key for episode in episodes)


def test_random_scenes_are_not_mistaken_for_arrangements():
    episodes = plan_random("heavy30", "seen", range(100, 102), ONE)
    assert [(e.task, e.seed, e.is_arranged) for e in episodes] == [
        ("random-heavy30", 100, False),
        ("random-heavy30", 101, False),
    ]


@pytest.mark.parametrize(
    ("plan", "message"),
    [
        (
            lambda: plan_suites(["graps"], BOTH, [0], ONE),
            "Unknown suite 'graps'. Suites: grasp, place, pick-place, heavy30, paraphrase, noise, "
            "perturbation, all. Did you mean 'grasp'?",
        ),
        (
            lambda: plan_suites(["grasp"], BOTH, [0], ONE, only=["grasp-seen-00", "place-seen-00"]),
            "Arrangement 'place-seen-00' is in none of the suites grasp with split seen and "
            "unseen; add its suite and split, or leave it out.",
        ),
        (
            lambda: plan_suites(["grasp"], ["unseen"], [0], ONE, only=["grasp-seen-00"]),
            "Arrangement 'grasp-seen-00' is in none of the suites grasp with split unseen; add its "
            "suite and split, or leave it out.",
        ),
        (
            lambda: plan_suites(["grasp"], BOTH, [], ONE),
            "Nothing to run in the suites grasp: got 0 seeds and 1 policies, expected at least one "
            "of each.",
        ),
        (
            lambda: plan_suites(["grasp"], BOTH, [0], ONE, conditions=["foggy"]),
            "Condition 'foggy' is not understood; expected one of clean, reworded, points-SIGMA, "
            "l515-FACTORx, pose-CMcm-DEGdeg, for example points-0.1 or pose-1cm-5deg.",
        ),
        (
            lambda: plan_random("cluttered15", "seen", [1], ONE, conditions=["reworded"]),
            "Only the goals of arrangements have other wordings; use a suite.",
        ),
        (
            lambda: plan_random("cluttered15", "seen", [], ONE),
            "There is no seed to run; give the first seed and one past the last.",
        ),
    ],
)
def test_bad_plans_get_one_line(plan, message):
    with pytest.raises(SrMjError) as error:
        plan()
    assert str(error.value) == message


def test_conditions_say_what_their_names_say():
    assert read_condition("clean") == Condition(name="clean")
    assert read_condition("reworded").is_reworded
    assert read_condition("points-0.1").point_sigma == 0.1
    assert read_condition("l515-2x").sensor_factor == 2
    perturbation = read_condition("pose-0.5cm-2deg").perturbation()
    assert perturbation is not None
    assert (perturbation.sigma_m, perturbation.sigma_deg) == (0.005, 2)
    for name in ("clean", "points-0.3", "l515-0x"):
        assert read_condition(name).perturbation() is None
    for name in ("clean", "points-0.3", "pose-0.5cm-2deg"):
        assert read_condition(name).beginning == "clean"
    for name in ("reworded", "l515-0x", "l515-2x"):
        assert read_condition(name).beginning == name


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("pose-50cm-0deg", "Perturbation of positions is 50 cm; expected 0 to 10."),
        (
            "points-20",
            "Noise of the points, in half extents of the workspace, is 20; expected 0 to 10.",
        ),
        ("points-" + "9" * 400, "Noise of the points, .* is inf; expected 0 to 10."),
        ("l515-101x", "Factor of the sensor's noise is 101; expected 0 to 100."),
        ("l515-0.001x", "Factor of the sensor's noise is 0.001; expected 0, or 0.01 to 100."),
    ],
)
def test_absurd_conditions_are_refused(name, message):
    with pytest.raises(ConfigError, match=f"^{message}$"):
        read_condition(name)


@pytest.mark.parametrize("factor", ["0.01", "100"])
def test_extreme_sensors_are_sensors(factor):
    assert read_condition(f"l515-{factor}x").sensor_noise().full_well_electrons > 0


def test_numbers_are_written_in_one_way():
    names = ["points-0.10", "points-0.1", "pose-1.0cm-05deg", "l515-02.00x", "points-0"]
    written = ["points-0.1", "points-0.1", "pose-1cm-5deg", "l515-2x", "points-0"]
    assert [read_condition(name).name for name in names] == written
    episodes = plan_suites(
        ["grasp"], ["seen"], [0], ONE, conditions=names[:2], only=["grasp-seen-00"]
    )
    assert {episode.condition for episode in episodes} == {"points-0.1"}


def test_sensor_noise_is_scaled_and_can_be_switched_off():
    plain = L515NoiseConfig()
    assert read_condition("clean").sensor_noise() == plain
    assert read_condition("l515-0x").sensor_noise() == L515NoiseConfig.off()
    # Everything that is not named here stays as it is.
    assert read_condition("l515-1.5x").sensor_noise() == replace(
        plain,
        axial_sigma_at_zero_m=1.5 * plain.axial_sigma_at_zero_m,
        axial_sigma_per_m=1.5 * plain.axial_sigma_per_m,
        lateral_sigma_px=1.5 * plain.lateral_sigma_px,
        flying_rate=0.3 * 1.5,
        dark_rate=0.5 * 1.5,
        full_well_electrons=plain.full_well_electrons / 1.5**2,
    )
    strong = read_condition("l515-4x").sensor_noise()
    assert (strong.flying_rate, strong.dark_rate) == (1.0, 1.0)


class Remembers:
    """Keeps what it was shown, and draws a score."""

    name = "remembers"

    def score(self, observation, candidates, rng):
        self.seen = observation
        return ActionScores(logits=rng.normal(size=len(candidates)))


def test_noise_of_points_has_the_stated_spread_and_touches_nothing_else():
    num = 4000
    lower, upper = np.array([0.2, -0.2, 0.0]), np.array([0.8, 0.2, 0.4])
    observation = Observation(
        points=np.tile((lower + upper) / 2, (num, 1)),
        features=np.tile([1.0, 0.0], (num, 1)),
        similarity=np.zeros(num),
        confidence=np.ones(num),
        text_tokens=np.array([[1.0, 0.0]]),
        text_pooled=np.array([1.0, 0.0]),
        workspace_min=lower,
        workspace_max=upper,
    )
    candidates = ActionCandidates(
        kind="pick",
        Ts_world_tool=np.tile(np.eye(4), (3, 1, 1)),
        width_m=np.full(3, 0.05),
        prior=np.ones(3),
    )
    policy = Remembers()
    scores = NoisyPoints(policy, 0.1).score(observation, candidates, np.random.default_rng(0))
    shift = policy.seen.points - observation.points
    assert np.allclose(shift.std(axis=0), 0.1 * (upper - lower) / 2, rtol=0.05)
    assert np.abs(shift.mean(axis=0)).max() < 0.002
    assert (policy.seen.features == observation.features).all()
    # The policy's own draws are those that it makes without noise: the pairing stays.
    plain = policy.score(observation, candidates, np.random.default_rng(0))
    assert (scores.logits == plain.logits).all()
