import multiprocessing
import operator
import threading
import time
from dataclasses import replace

import pytest

from sr_mj.evaluation.plan import Episode, plan_random
from sr_mj.evaluation.pool import make_runner, run_episodes

pytestmark = pytest.mark.distributed


@pytest.fixture
def broken_setting(setting):
    """Random scenes cannot be made: an exception at once."""
    return replace(setting, scene_makers={"single": operator.index})


class Killer(threading.Thread):
    """Kills the first processes that this one starts."""

    def __init__(self, num):
        super().__init__(daemon=True)
        self.left, self.seen = num, set()

    def run(self):
        while self.left:
            for process in multiprocessing.active_children():
                if process.pid not in self.seen and self.left:
                    self.seen.add(process.pid)
                    self.left -= 1
                    process.kill()
            time.sleep(0.001)


def test_an_exception_is_a_failure_the_next_goes_on(broken_setting):
    episodes = plan_random("single", "seen", [7, 8], broken_setting.policies[:1])
    dones = list(run_episodes(episodes, broken_setting, workers=1))
    assert [done.episode for done in dones] == list(episodes)
    for done in dones:
        assert done.record["success"] is False and done.record["cause"] == "error"
        assert done.record["error"].startswith("TypeError: 'Episode' object cannot be interpreted")
        assert done.record["seed"] == done.episode.seed and done.record["attempts"] == []
        assert done.traceback.startswith("Traceback (most recent call last):")


def test_an_episode_that_kills_its_process_twice_is_a_failure(broken_setting):
    (episode,) = plan_random("single", "seen", [7], broken_setting.policies[:1])
    killer = Killer(2)
    killer.start()
    (done,) = run_episodes([episode], broken_setting, workers=1)
    assert done.episode == episode and len(killer.seen) == 2
    assert done.record["error"] == "the process that ran it died 2 times"
    assert done.record["success"] is False and done.record["cause"] == "error"


def test_a_process_runs_all_policies_of_a_scene(broken_setting):
    episodes = plan_random("single", "seen", [7, 8], broken_setting.policies)
    dones = list(run_episodes(episodes[::-1], broken_setting, workers=1))
    assert [done.episode for done in dones] == list(episodes[::-1])
    mixed = sorted(episodes, key=lambda episode: (episode.policy, episode.seed))
    seeds = [done.episode.seed for done in run_episodes(mixed, broken_setting, workers=1)]
    assert seeds == [7] * 4 + [8] * 4


def test_what_policies_share_changes_no_record(setting):
    """An object is handed over once, looked at once with features and once without."""
    episodes = [
        Episode(
            task="place",
            split="seen",
            scene="place-seen-00",
            condition="clean",
            seed=3,
            policy=label,
        )
        for label in ("random", "grounding", "oracle")
    ]
    run = make_runner(setting)
    shared = [run(episode) for episode in episodes]
    alone = [make_runner(setting)(episode) for episode in episodes[1:]]
    assert [done.record for done in shared[1:]] == [done.record for done in alone]
    assert [done.record["success"] for done in shared] == [False, True, True]
    assert shared[0].record["attempts"][0] == shared[2].record["attempts"][0]
    # Each is told the time that it would have taken alone.
    look_s = [done.seconds["look"] for done in shared]
    assert look_s[0] == look_s[2] and min(done.seconds["total"] for done in shared) > look_s[0]
