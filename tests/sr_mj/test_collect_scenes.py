"""The expert at work in scenes that are simulated, rendered and perceived."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from models.arrangements.library import arrangement_names, load_arrangement
from models.objects.catalogue import object_names
from policy.demonstrations import DemonstrationFolder
from sr_mj.assemble import assembled
from sr_mj.collecting.expert import Expert
from sr_mj.collecting.folder import open_folder, read_stock, save
from sr_mj.collecting.tasks import SceneTask
from sr_mj.collecting.work import Limits, WorkSetting
from sr_mj.collecting.worker import make_worker
from sr_mj.execution import Executor
from sr_mj.instruction import PhaseText
from sr_mj.oracle import OraclePolicy
from sr_mj.scene import SceneConfig, find_goal, find_targets, make_scene
from sr_mj.scene.state import SceneState

pytestmark = [pytest.mark.render, pytest.mark.slow]

LIMITS = Limits(num_looks=2, num_picks=2, num_rounds=1, num_places=2)
# Scenes that nobody trains on: the last run.
TASKS = (SceneTask(phase="pick", number=0, run=999), SceneTask(phase="place", number=0, run=999))


@pytest.fixture(scope="module")
def worker():
    return make_worker(WorkSetting(limits=LIMITS))


@pytest.fixture(scope="module")
def results(worker):
    return [worker(task) for task in TASKS]


@pytest.fixture(scope="module")
def folder(results, tmp_path_factory):
    out = tmp_path_factory.mktemp("demos") / "out"
    open_folder(out, "embedded", 384)
    for result in results:
        save(out, result)
    return DemonstrationFolder(out)


def test_scenes_give_decisions_within_the_limits(results, folder):
    assert folder.verify() == []
    pick, place = (result.stored for result in results)
    assert 1 <= pick["pick"] <= LIMITS.num_looks * LIMITS.num_picks and "place" not in pick
    assert place["pick"] == 1 and 1 <= place["place"] <= LIMITS.num_places
    stock = read_stock(folder.path)
    assert stock.stored == {"pick": pick["pick"] + 1, "place": place["place"]}
    assert stock.done == {task.name for task in TASKS} == set(folder.scenes)


def test_decisions_hold_what_training_needs(folder):
    for demonstration in folder:
        decision = demonstration.decision
        assert len(decision.wordings) >= 3
        assert len({wording.text for wording in decision.wordings}) == len(decision.wordings)
        assert decision.valid[decision.executed]
        valid = decision.expert_logits[decision.valid]
        others = decision.expert_logits[~decision.valid]
        assert others.max(initial=-9) < 2
        assert valid.max() < 2 if decision.clears else valid.min() > 7
        assert (decision.relation is None) == (decision.phase == "pick")
        for number in range(len(decision.wordings)):
            observation = demonstration.observation(number)
            norms = np.linalg.norm(observation.features, axis=1)
            np.testing.assert_allclose(norms, 1, atol=2e-3)
            assert observation.phrase_pooled is not None


def test_the_scene_is_described_without_any_arrangement(folder):
    seen = set(object_names("seen"))
    arranged = [
        (item.object, item.settled.position_m)
        for name in arrangement_names()
        for item in load_arrangement(name).objects
        if item.settled is not None
    ]
    for shard, task in zip(folder.shards, TASKS, strict=True):
        meta = shard.meta
        assert (meta["seed"], meta["split"]) == (task.seed, "seen")
        assert {"mujoco", "torch", "sr-mj"} <= set(meta["versions"])
        assert "arrangement" not in str(meta)
        assert {item["object"] for item in meta["objects"]} <= seen
        for item in meta["objects"]:
            here = np.array(item["pose"][:3])
            there = [place for name, place in arranged if name == item["object"]]
            assert all(np.abs(here - place).max() > 1e-4 for place in there)


def test_a_pick_names_what_it_closes_on(folder):
    """The words of the stored texts fit objects of the scene."""
    from models.objects.catalogue import object_words

    for shard in folder.shards:
        words = {item["name"]: object_words(item["object"]) for item in shard.meta["objects"]}
        for entry in shard.index:
            if entry["phase"] == "pick":
                targets = [find_targets(text, words) for text in entry["texts"]]
                assert targets[0] and all(set(t) == set(targets[0]) for t in targets)
                meant = {
                    item["object"] for item in shard.meta["objects"] if item["name"] in targets[0]
                }
                assert entry["objects"] == sorted(meant)
            else:
                # Said by its title, another name or a general word, "the bowl" is what it means.
                reference = find_goal(entry["texts"][0], words).place.references
                assert entry["objects"] == sorted(
                    {item["object"] for item in shard.meta["objects"] if item["name"] in reference}
                )


def test_the_same_task_gives_the_same_bytes(worker, results, folder, tmp_path):
    # After other scenes in the same process, and the place scene alone.
    again = worker(TASKS[1])
    (tmp_path / again.file_name).write_bytes(again.content)
    (shard,) = DemonstrationFolder(tmp_path).shards
    assert shard.digest == folder.shards[1].digest


@pytest.fixture
def blocked(worker):
    """An expert in a scene where no grasp closes on what is asked for, and its goal."""
    scene = make_scene(SceneConfig(arrangement="grasp-unseen-00"))
    pipeline = assembled(scene, lifter=worker._lifter(scene), policy=OraclePolicy(scene))
    with pipeline as stages:
        yield Expert(scene, stages, np.random.default_rng(0)), scene.goal


def test_what_is_in_the_way_is_taken_away_first(blocked):
    expert, goal = blocked
    text = PhaseText(phase="pick", text=goal.text)
    seen = expert.see_grasps()
    assert expert.choose(seen, goal, text) is None
    assert expert.reasons == {"no_valid_candidate": 1}
    assert set(goal.targets) <= set(expert.blocked(seen))

    choice = expert.choose(seen, goal, text, may_clear=True)
    assert choice.clears
    (obstacle,) = choice.scene.goal.targets
    gripped = OraclePolicy(expert.scene).gripped(seen.candidates)
    np.testing.assert_array_equal(choice.valid, gripped == obstacle)
    assert choice.valid[choice.logits.argmax()]

    plan = expert.plan(seen, choice.order)
    _, outcome = expert.act(choice, plan, keep_target=False)
    assert outcome.success and outcome.grasped == obstacle
    expert.store(seen, choice, plan.chosen, (text,), seed=0)
    assert expert.decisions[0][1].clears
    # What is asked for, not what is in the way.
    assert expert.decisions[0][1].objects == goal.targets
    assert not expert.choose(expert.see_grasps(), goal, text, may_clear=True).clears


def test_nothing_is_taken_away_for_what_cannot_be_seen(blocked):
    expert, goal = blocked
    seen = expert.see_grasps()
    cloud = seen.percept.features
    away = replace(cloud, points=cloud.points + np.float32(0.5))
    unseen = replace(seen, percept=replace(seen.percept, features=away))
    text = PhaseText(phase="pick", text=goal.text)
    assert expert.choose(unseen, goal, text, may_clear=True) is None
    assert expert.blocked(unseen) == []


@pytest.fixture(scope="module")
def heap():
    return make_scene(SceneConfig(scene="cluttered15", seed=101))


def test_what_follows_a_restored_state_is_the_same_as_before(heap):
    body = heap.objects[0].body
    before = SceneState(heap)
    ends = []
    for _ in range(2):
        # Something is thrown, so that a heap asleep wakes up.
        heap.data.qvel[body.dof_adr + 2] = 1.0
        executor = Executor(heap)
        executor.drive.set_width(0.05)
        mujoco.mj_step(heap.model, heap.data, 200)
        ends.append(np.concatenate([heap.data.qpos, heap.data.qvel, heap.data.ctrl]))
        before.restore()
    np.testing.assert_array_equal(ends[0], ends[1])
    assert heap.data.time == 0 or not np.array_equal(ends[0][: heap.model.nq], heap.data.qpos)
