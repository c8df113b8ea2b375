import numpy as np
import pytest

from policy.errors import InvalidDemonstrationsError
from policy.training.split import scene_fraction, split_by_scene

SCENES = [f"scene-{i // 3:05d}" for i in range(900)]


def test_scenes_stay_together_and_every_index_is_used_once() -> None:
    split = split_by_scene(SCENES, val_share=0.2)
    names = np.array(SCENES)
    assert not set(names[split.train]) & set(names[split.val])
    np.testing.assert_array_equal(np.sort(np.append(split.train, split.val)), range(len(SCENES)))


def test_share_is_about_what_was_asked_for() -> None:
    # 300 scenes: five standard deviations of the binomial.
    held_out = len(split_by_scene(SCENES, val_share=0.2).val) / len(SCENES)
    assert abs(held_out - 0.2) < 5 * (0.2 * 0.8 / 300) ** 0.5


def test_more_data_moves_no_scene() -> None:
    names = np.array(SCENES)
    few = split_by_scene(SCENES[:300], val_share=0.1)
    many = split_by_scene(SCENES, val_share=0.1)
    assert set(names[few.val]) <= set(names[many.val])
    assert set(names[few.train]) <= set(names[many.train])


def test_a_share_of_the_scenes_is_part_of_a_larger_share() -> None:
    all_of_it = split_by_scene(SCENES, val_share=0.1)
    half = split_by_scene(SCENES, val_share=0.1, train_share=0.5)
    quarter = split_by_scene(SCENES, val_share=0.1, train_share=0.25)
    np.testing.assert_array_equal(half.val, all_of_it.val)
    assert set(quarter.train) < set(half.train) < set(all_of_it.train)
    assert 0.35 < len(half.train) / len(all_of_it.train) < 0.65


def test_purposes_are_independent() -> None:
    pairs = np.array([[scene_fraction(s, p) for p in "ab"] for s in sorted(set(SCENES))])
    assert abs(np.corrcoef(pairs.T)[0, 1]) < 0.3


def test_too_few_scenes() -> None:
    with pytest.raises(InvalidDemonstrationsError) as caught:
        split_by_scene(["one", "one"], val_share=0.01)
    assert str(caught.value) == (
        "data: got 1 scenes, 1 for training and 0 for validation at val_share=0.01, expected at "
        "least 1 of each. Collect more scenes, or change --val-share."
    )
