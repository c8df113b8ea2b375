"""The policies that look at pictures, on two made-up cameras with made-up features."""

import numpy as np
import pytest

from policy.errors import InvalidArrayError, MissingImagesError
from policy.images import PictureFrame
from policy.registry import load_policy

NAMES = {"raw-image": 1, "raw-image-grid": 8}
WIDTH, HEIGHT = 160, 90
# From 0.75 m above (0.5, 0), and from the side at 45 degrees.
TOP = ((0.5, 0.0, 0.75), np.array([[0.0, -1, 0], [-1, 0, 0], [0, 0, -1]]))
HALF = 0.5**0.5
SIDE = ((0.9, 0.0, 0.4), np.array([[0.0, 1, 0], [HALF, 0, -HALF], [-HALF, 0, -HALF]]))


def _frame(position, R_cam_world: np.ndarray) -> PictureFrame:
    K = np.array([[110.0, 0, 79.5], [0, 110, 44.5], [0, 0, 1]])
    T = np.concatenate([R_cam_world, -R_cam_world @ np.reshape(position, (3, 1))], axis=1)
    return PictureFrame(P_pixel_world=K @ T, width=WIDTH, height=HEIGHT)


class Pictures:
    """Pictures whose parts have the features they are given; remembers what was asked for."""

    def __init__(self, features: np.ndarray) -> None:
        self.features, self.frames = features, (_frame(*TOP), _frame(*SIDE))
        self.asked: list[tuple[int, int, list[int]]] = []

    def describe(self, picture: int, num_parts: int, parts: np.ndarray) -> np.ndarray:
        self.asked.append((picture, num_parts, parts.tolist()))
        return self.features[picture, parts]


def _unit(rows: np.ndarray) -> np.ndarray:
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


@pytest.fixture
def make_pictures(rng: np.random.Generator):
    def make(name: str) -> Pictures:
        return Pictures(_unit(rng.normal(size=(2, NAMES[name] ** 2, 16))))

    return make


@pytest.fixture
def grasps(make_grasps, rng: np.random.Generator):
    """Grasps all over the table, some beyond the pictures."""
    positions = rng.uniform((0.2, -0.5, 0.0), (0.8, 0.5, 0.2), (200, 3))
    return make_grasps(positions, rng.uniform(0, 1, 200))


def _best_cosines(pictures: Pictures, num_parts: int, phrase, positions) -> np.ndarray:
    """Compute what counts for each grasp, one by one and through homogeneous coordinates."""
    best = []
    for x, y, z in positions:
        found = [-np.inf]
        for frame, features in zip(pictures.frames, pictures.features, strict=True):
            du, dv, d = frame.P_pixel_world @ (x, y, z, 1.0)
            u, v = du / d + 0.5, dv / d + 0.5
            if d > 0 and 0 <= u < WIDTH and 0 <= v < HEIGHT:
                row, column = int(v * num_parts // HEIGHT), int(u * num_parts // WIDTH)
                found.append(features[row * num_parts + column] @ phrase)
        best.append(max(found))
    return np.array(best)


@pytest.mark.parametrize("name", NAMES)
def test_the_most_similar_part_comes_first_and_the_prior_decides_within(
    make_observation, make_pictures, grasps, rng: np.random.Generator, name: str
) -> None:
    pictures = make_pictures(name)
    phrase = _unit(rng.normal(size=16)).astype(np.float32)
    observation = make_observation(rng, 40, images=pictures, phrase_pooled=phrase)
    best = _best_cosines(pictures, NAMES[name], phrase, grasps.positions)
    assert np.isinf(best).any() and len(np.unique(best)) > 1
    logits = load_policy(name).score(observation, grasps, rng).logits
    np.testing.assert_array_equal(np.argsort(logits), np.lexsort((grasps.prior, best)))


@pytest.mark.parametrize("picture", [0, 1])
@pytest.mark.parametrize("chosen", range(0, 200, 40))
def test_all_that_appears_in_the_crop_asked_for_beats_the_rest(
    make_observation, make_pictures, grasps, rng: np.random.Generator, picture: int, chosen: int
) -> None:
    pictures = make_pictures("raw-image-grid")
    part = pictures.frames[picture].parts_of(grasps.positions, 8)
    wanted = part[np.flatnonzero(part >= 0)[chosen % np.count_nonzero(part >= 0)]]
    phrase = pictures.features[picture, wanted]
    observation = make_observation(rng, 40, images=pictures, phrase_pooled=phrase)
    logits = load_policy("raw-image-grid").score(observation, grasps, rng).logits
    is_in = part == wanted
    assert logits[is_in].min() > logits[~is_in].max()


def test_a_whole_picture_tells_nothing_apart(
    make_observation, make_pictures, make_grasps, rng: np.random.Generator
) -> None:
    positions = rng.uniform((0.4, -0.1, 0.0), (0.6, 0.1, 0.1), (30, 3))
    grasps = make_grasps(positions, rng.uniform(0, 1, 30))
    observation = make_observation(rng, 40, images=make_pictures("raw-image"))
    logits = load_policy("raw-image").score(observation, grasps, rng).logits
    np.testing.assert_array_equal(logits, grasps.prior / 2)


def test_only_parts_in_which_something_appears_are_described(
    make_observation, make_pictures, grasps, rng: np.random.Generator
) -> None:
    pictures = make_pictures("raw-image-grid")
    load_policy("raw-image-grid").score(make_observation(rng, 40, images=pictures), grasps, rng)
    parts = [frame.parts_of(grasps.positions, 8) for frame in pictures.frames]
    assert pictures.asked == [
        (index, 8, sorted(set(part.tolist()) - {-1})) for index, part in enumerate(parts)
    ]


@pytest.mark.parametrize("name", NAMES)
def test_order_of_candidates_orders_logits_and_nothing_is_drawn(
    make_observation, make_pictures, grasps, rng: np.random.Generator, name: str
) -> None:
    observation = make_observation(rng, 40, images=make_pictures(name))
    order, policy = rng.permutation(len(grasps)), load_policy(name)
    state = rng.bit_generator.state
    straight = policy.score(observation, grasps, rng).logits
    permuted = policy.score(observation, grasps.take(order), rng).logits
    np.testing.assert_array_equal(permuted, straight[order])
    assert rng.bit_generator.state == state


@pytest.mark.parametrize("name", NAMES)
def test_without_a_phrase_the_instruction_counts(
    make_observation, make_pictures, grasps, rng: np.random.Generator, name: str
) -> None:
    pictures = make_pictures(name)
    whole = make_observation(rng, 40, images=pictures)
    named = make_observation(rng, 40, images=pictures, phrase_pooled=whole.text_pooled)
    policy = load_policy(name)
    found, expected = (policy.score(o, grasps, rng).logits for o in (whole, named))
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("name", NAMES)
def test_places_like_grounding_without_a_look_at_the_pictures(
    make_observation, make_pictures, make_grasps, rng: np.random.Generator, name: str
) -> None:
    pictures = make_pictures(name)
    told = {"phase": "place", "relation": "near", "side": "outside"}
    observation = make_observation(rng, 40, images=pictures, **told)
    places = make_grasps(rng.uniform((0.3, -0.2, 0), (0.7, 0.2, 0.1), (30, 3)), kind="place")
    expected = load_policy("grounding").score(observation, places, rng).logits
    found = load_policy(name).score(observation, places, rng).logits
    np.testing.assert_array_equal(found, expected)
    assert pictures.asked == []


@pytest.mark.parametrize("name", NAMES)
def test_nothing_to_choose_from(
    make_observation, make_pictures, make_grasps, rng: np.random.Generator, name: str
) -> None:
    pictures = make_pictures(name)
    observation = make_observation(rng, 40, images=pictures)
    assert len(load_policy(name).score(observation, make_grasps([]), rng)) == 0
    assert pictures.asked == []


@pytest.mark.parametrize("name", NAMES)
def test_pictures_that_are_missing_or_of_another_encoder(
    make_observation, make_grasps, rng: np.random.Generator, name: str
) -> None:
    grasps, policy = make_grasps([[0.5, 0, 0.02]]), load_policy(name)
    with pytest.raises(MissingImagesError) as missing:
        policy.score(make_observation(rng, 40), grasps, rng)
    assert str(missing.value) == (
        f"images: got None for the policy '{name}', which looks at the pictures; expected an "
        "ImageSource. Give the observation one, or use 'grounding'."
    )
    other = Pictures(np.ones((2, NAMES[name] ** 2, 9)))
    with pytest.raises(InvalidArrayError) as wrong:
        policy.score(make_observation(rng, 40, images=other), grasps, rng)
    assert str(wrong.value) == "features of parts: got shape (1, 9), expected (1, 16)."
