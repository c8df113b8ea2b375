import dataclasses
from typing import Any

import numpy as np
import pytest

from policy.demonstrations import DemonstrationFolder
from policy.network.batch import make_sample
from policy.training.config import AugmentationConfig
from policy.training.draws import Example, ExampleDrawer, kept_candidates, make_target
from policy.training.store import DecisionStore, memory_needed

INDEX = 5


@pytest.fixture
def make_drawer(make_train_config, scenes):
    def make(*, in_memory: bool = True, **changes: Any) -> ExampleDrawer:
        config = make_train_config(**changes)
        folder = DemonstrationFolder(scenes)
        network = config.network_config(folder.feature_dim)
        return ExampleDrawer(DecisionStore(folder, network, in_memory=in_memory), config)

    return make


def _assert_equal(first: Example, second: Example) -> None:
    np.testing.assert_array_equal(first.valid, second.valid)
    for a, b in ((first.sample, second.sample), (first.target, second.target)):
        for field in dataclasses.fields(a):
            np.testing.assert_array_equal(getattr(a, field.name), getattr(b, field.name))


def test_validation_sees_what_use_would_see(make_drawer, scenes) -> None:
    drawer = make_drawer()
    demonstration = DemonstrationFolder(scenes)[INDEX]
    assert len(demonstration.look.points) > drawer.store.config.max_points
    whole = make_sample(
        demonstration.observation(), demonstration.decision.candidates, drawer.store.config
    )
    example = drawer.validation(INDEX)
    for field in dataclasses.fields(whole):
        got, expected = getattr(example.sample, field.name), getattr(whole, field.name)
        np.testing.assert_array_equal(got, expected)
    np.testing.assert_array_equal(example.valid, demonstration.decision.valid)


def test_a_training_draw_without_augmentation_is_that_of_validation(make_drawer, plain) -> None:
    drawer = make_drawer(max_candidates=0, **plain)
    _assert_equal(drawer.training(INDEX, 3), drawer.validation(INDEX))


def test_draws_depend_on_seed_epoch_and_index_only(make_drawer) -> None:
    first, second = make_drawer(), make_drawer(in_memory=False)
    for index in (7, INDEX, 3):
        first.training(index, 0)
    _assert_equal(first.training(INDEX, 1), second.training(INDEX, 1))
    _assert_equal(first.training(INDEX, 1), first.training(INDEX, 1))
    others = (
        first.training(INDEX, 2),
        first.training(INDEX + 1, 1),
        make_drawer(seed=1).training(INDEX, 1),
    )
    drawn = first.training(INDEX, 1).sample.positions.tobytes()
    assert drawn not in [other.sample.positions.tobytes() for other in others]


def test_as_many_points_as_the_network_takes(make_drawer) -> None:
    drawer = make_drawer(augmentation=AugmentationConfig(point_dropout=0.3))
    assert {len(drawer.training(INDEX, epoch).sample.positions) for epoch in range(9)} == {24}


def test_paraphrases_are_drawn_as_often_as_asked(make_drawer, scenes) -> None:
    wordings = DemonstrationFolder(scenes)[INDEX].decision.wordings
    drawer = make_drawer(augmentation=AugmentationConfig(paraphrases=0.5, feature_dropout=0.0))
    own = wordings[0].pooled.tolist()
    drawn = [drawer.training(INDEX, epoch).sample.pooled.tolist() for epoch in range(200)]
    assert {tuple(d) for d in drawn} == {tuple(w.pooled.tolist()) for w in wordings}
    # Five standard deviations.
    assert abs(drawn.count(own) - 100) < 5 * np.sqrt(200 / 4)


@pytest.mark.parametrize("max_candidates", [0, 1, 4, 6, 99])
def test_the_executed_candidate_stays(max_candidates: int, rng) -> None:
    for executed in range(6):
        kept = kept_candidates(6, executed, max_candidates, rng)
        assert executed in kept and len(set(kept)) == len(kept) == min(6, max_candidates or 6)
        assert (np.diff(kept) > 0).all()


@pytest.mark.parametrize("phase", ["pick", "place"])
@pytest.mark.parametrize("positives", ["closest", "target"])
def test_targets_say_what_the_expert_did(phase: str, positives: Any, make_drawer) -> None:
    store = make_drawer().store
    decision = store.decision(store.folder.phases.index(phase))
    kept = np.array(sorted({decision.executed, 0, 2, 4}))
    target = make_target(decision, kept, positives)
    if phase == "pick" and positives == "closest":
        assert kept[target.positive].tolist() == [decision.executed]
    else:
        np.testing.assert_array_equal(target.positive, decision.valid[kept])
    np.testing.assert_array_equal(target.opening_m, decision.candidates.width_m[kept])
    np.testing.assert_array_equal(target.avoid_collision, decision.avoid_collision[kept])
    assert not target.rotvec_tool.any()


def test_candidates_and_answers_are_thinned_together(make_drawer, plain) -> None:
    drawer = make_drawer(max_candidates=3, pick_positives="target", **plain)
    whole = drawer.validation(INDEX)
    thinned = drawer.training(INDEX, 0)
    rows = [whole.sample.poses.tolist().index(pose) for pose in thinned.sample.poses.tolist()]
    assert len(rows) == 3
    np.testing.assert_array_equal(thinned.valid, whole.valid[rows])
    np.testing.assert_array_equal(thinned.target.positive, whole.target.positive[rows])
    np.testing.assert_array_equal(thinned.target.opening_m, whole.target.opening_m[rows])


def test_memory_is_that_of_the_features(scenes) -> None:
    folder = DemonstrationFolder(scenes)
    # Twelve looks of 40 points and 16 channels at two bytes; positions and confidence at four.
    looks = 12 * 40 * (16 * 2 + 4 * 4)
    assert memory_needed(folder) == looks + 150_000 * len(folder)
