import numpy as np
import pytest

from policy.errors import InvalidDemonstrationsError
from policy.training.split import name_fraction, split_demonstrations

SCENES = [f"scene-{i // 3:05d}" for i in range(900)]
NONE = [()] * len(SCENES)
# Every instruction means one object or two.
OBJECTS = [{f"object-{i % 40}", f"object-{i % 7}"} for i in range(len(SCENES))]


def test_scenes_stay_together_and_every_index_is_used_once() -> None:
    split = split_demonstrations(SCENES, NONE, val_share=0.2)
    names = np.array(SCENES)
    assert not set(names[split.train]) & set(names[split.val])
    np.testing.assert_array_equal(np.sort(np.append(split.train, split.val)), range(len(SCENES)))


def test_share_is_about_what_was_asked_for() -> None:
    # 300 scenes: five standard deviations of the binomial.
    held_out = len(split_demonstrations(SCENES, NONE, val_share=0.2).val) / len(SCENES)
    assert abs(held_out - 0.2) < 5 * (0.2 * 0.8 / 300) ** 0.5


def test_more_data_moves_no_scene() -> None:
    names = np.array(SCENES)
    few = split_demonstrations(SCENES[:300], NONE[:300], val_share=0.1)
    many = split_demonstrations(SCENES, NONE, val_share=0.1)
    assert set(names[few.val]) <= set(names[many.val])
    assert set(names[few.train]) <= set(names[many.train])


def test_a_share_of_the_scenes_is_part_of_a_larger_share() -> None:
    all_of_it = split_demonstrations(SCENES, NONE, val_share=0.1)
    half = split_demonstrations(SCENES, NONE, val_share=0.1, train_share=0.5)
    quarter = split_demonstrations(SCENES, NONE, val_share=0.1, train_share=0.25)
    np.testing.assert_array_equal(half.val, all_of_it.val)
    assert set(quarter.train) < set(half.train) < set(all_of_it.train)
    assert 0.35 < len(half.train) / len(all_of_it.train) < 0.65


def test_new_objects_are_nowhere_else() -> None:
    objects = [sorted(names) for names in OBJECTS]
    split = split_demonstrations(SCENES, objects, val_share=0.2, new_share=0.15)

    def named(indices: np.ndarray) -> set[str]:
        return {name for index in indices for name in objects[index]}

    held_out = {n for n in named(np.arange(len(SCENES))) if name_fraction(n, "object") < 0.15}
    assert held_out and not held_out & (named(split.train) | named(split.val))
    assert all(held_out & set(objects[index]) for index in split.new)
    every = np.concatenate([split.train, split.val, split.new])
    np.testing.assert_array_equal(np.sort(every), range(len(SCENES)))
    plain = split_demonstrations(SCENES, objects, val_share=0.2)
    assert len(plain.new) == 0 and set(split.val) < set(plain.val)


def test_no_object_to_hold_out() -> None:
    with pytest.raises(InvalidDemonstrationsError) as caught:
        split_demonstrations(SCENES, NONE, val_share=0.2, new_share=0.1)
    assert str(caught.value) == (
        "data: got no demonstration that means one of the objects held out at new_share=0.1, "
        "expected at least 1. Raise --new-share, or collect more."
    )


def test_purposes_are_independent() -> None:
    pairs = np.array([[name_fraction(s, p) for p in "ab"] for s in sorted(set(SCENES))])
    assert abs(np.corrcoef(pairs.T)[0, 1]) < 0.3


def test_too_few_scenes() -> None:
    with pytest.raises(InvalidDemonstrationsError) as caught:
        split_demonstrations(["one", "one"], [[], []], val_share=0.01)
    assert str(caught.value) == (
        "data: got 1 scenes, 1 for training and 0 for validation at val_share=0.01, expected at "
        "least 1 of each. Collect more scenes, or change --val-share."
    )
