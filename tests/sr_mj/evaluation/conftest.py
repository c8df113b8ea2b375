"""Lines of results as an evaluation would write them."""

import pytest

from sr_mj.evaluation.identity import Identity
from sr_mj.evaluation.lines import Done, result_line
from sr_mj.evaluation.plan import Episode, PolicyChoice
from sr_mj.evaluation.setting import Setting

LABELS = ("oracle", "random", "grounding", "sr")


@pytest.fixture(scope="session")
def setting():
    return Setting(
        policies=tuple(PolicyChoice(label=label, name=label) for label in LABELS),
        encoder_fingerprint="0123",
        versions={"mujoco": "3.17.0"},
        revision="abc",
    )


@pytest.fixture(scope="session")
def make_done(setting):
    """Return a function that makes up what came of an episode."""
    identity = Identity(setting)

    def make(
        policy="random",
        seed=0,
        *,
        reasons=("wrong_object", "grasped_target"),
        error=None,
        scene="grasp-seen-02",
        task="grasp",
        split="seen",
        condition="clean",
        goal="give me the pear",
    ):
        episode = Episode(
            task=task, split=split, scene=scene, condition=condition, seed=seed, policy=policy
        )
        success = bool(reasons) and reasons[-1] in ("grasped_target", "placed")
        attempts = [
            {
                "attempt": number + 1,
                "kind": "pick",
                "is_hand_over": False,
                "reason": reason,
                "reward": 1.0 if reason == "grasped_target" else -0.25,
                "seconds": {"look": 0.4},
            }
            for number, reason in enumerate(reasons)
        ]
        told = {
            "goal": goal,
            "objects": ["pear", "apple"],
            "targets": ["pear"],
            "relation": None,
            "references": [],
            "success": success,
            "num_actions": len(reasons),
            "attempts": attempts,
        }
        record = result_line(episode, setting, identity, told, error)
        return Done(
            episode=episode,
            record=record,
            seconds={"total": 2.0, "look": 0.4},
            traceback=error and "Traceback ...",
        )

    return make


@pytest.fixture(scope="session")
def as_lines():
    """Return a function that makes lines of what came of episodes."""
    return lambda dones: {done.episode: done.record for done in dones}
