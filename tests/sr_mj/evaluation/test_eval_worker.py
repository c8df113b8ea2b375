"""What a condition changes in an episode, and what it leaves as it is."""

from dataclasses import replace

import numpy as np
import pytest

from models.arrangements.library import load_arrangement
from models.arrangements.paraphrases import paraphrases
from policy.actions import ActionScores
from sr_mj.evaluation import worker
from sr_mj.evaluation.plan import Episode
from sr_mj.evaluation.setting import BLANK
from sr_mj.evaluation.worker import Worker
from sr_mj.sensors.l515 import L515NoiseConfig

SEED = 103
UNIT_M = L515NoiseConfig().depth_unit_m


class Watches:
    """Prefers upright grasps, whatever it sees, and keeps it."""

    name = "watches"

    def score(self, observation, candidates, rng):
        self.seen, self.candidates = observation, candidates
        return ActionScores(logits=-candidates.Ts_world_tool[:, 2, 2].astype(np.float64))


@pytest.fixture
def watched(setting, monkeypatch):
    """Return a function that runs an episode and returns its line and what its policy saw."""
    policy = Watches()
    monkeypatch.setattr(worker, "load_choice", lambda *_: policy)
    working = Worker(replace(setting, encoder=BLANK, attempts=1))

    def run(condition, **where):
        where = {"task": "random-single", "scene": "single", "seed": SEED, **where}
        episode = Episode(split="seen", condition=condition, policy="grounding", **where)
        done = working.run(episode)
        assert done.record["error"] is None
        return done.record, policy.seen, policy.candidates

    return run


def executed(record):
    return np.array(record["attempts"][0]["T_world_tool"])


def preferred(candidates):
    return candidates.Ts_world_tool[np.argmin(candidates.Ts_world_tool[:, 2, 2])]


def depth(seen):
    return np.stack([view.depth_m for view in seen.images.views])


def test_each_condition_reaches_its_stage(watched):
    plain, seen, candidates = watched("clean")
    assert np.allclose(executed(plain), preferred(candidates))

    noisy, moved, same = watched("points-0.1")
    half_m = (seen.workspace_max - seen.workspace_min) / 2
    shift = (moved.points - seen.points) / half_m
    assert np.allclose(shift.std(axis=0), 0.1, rtol=0.2)
    assert (same.Ts_world_tool == candidates.Ts_world_tool).all()
    assert np.array_equal(executed(noisy), executed(plain))

    erring, unmoved, same = watched("pose-0.5cm-2deg")
    assert (unmoved.points == seen.points).all() and (depth(unmoved) == depth(seen)).all()
    assert (same.Ts_world_tool == candidates.Ts_world_tool).all()
    error_m = np.linalg.norm(executed(erring)[:3, 3] - preferred(candidates)[:3, 3])
    assert 1e-4 < error_m < 0.03

    # The three begin alike and share the first look, but nothing that a condition changes later.
    assert watched("clean")[0] == plain

    truth, twice = (depth(watched(condition)[1]) for condition in ("l515-0x", "l515-2x"))
    units = truth[truth > 0] / UNIT_M
    assert np.abs(units - np.rint(units)).max() > 0.1
    is_seen = (truth > 0) & (twice > 0) & (depth(seen) > 0)
    spread = [np.median(np.abs(noisy - truth)[is_seen]) for noisy in (depth(seen), twice)]
    assert spread[1] == pytest.approx(2 * spread[0], rel=0.1)


def test_the_goal_is_said_in_other_words(watched):
    goal = load_arrangement("place-seen-00").goal.text
    others = paraphrases(goal)
    seed = len(others) + 2
    record, _, _ = watched("reworded", task="place", scene="place-seen-00", seed=seed)
    assert record["goal"] == others[2] != goal


def test_pictures_that_cannot_be_kept_change_no_result(setting, tmp_path):
    (tmp_path / "full").touch()
    episode = Episode(
        task="random-single",
        split="seen",
        scene="single",
        condition="clean",
        seed=SEED,
        policy="oracle",
    )
    options = {"attempts": 1, "picture_seeds": (SEED,)}
    working, failing = (
        Worker(replace(setting, pictures=tmp_path / name, **options)) for name in ("empty", "full")
    )
    kept, lost = working.run(episode), failing.run(episode)
    assert kept.record == lost.record and kept.record["success"]
    assert kept.lost_pictures is kept.traceback is lost.traceback is None
    assert len(list((tmp_path / "empty").iterdir())) == 3
    assert lost.lost_pictures == f"FileExistsError: [Errno 17] File exists: '{tmp_path}/full'"
