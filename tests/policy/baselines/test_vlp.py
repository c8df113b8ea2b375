import numpy as np
import pytest

from policy.baselines.vlp import VlpPolicy, distance_to_relation
from policy.observation import PlaceSide

REFERENCE = np.stack(np.meshgrid(np.linspace(0.44, 0.56, 17), np.linspace(-0.06, 0.06, 17)), -1)
REFERENCE = REFERENCE.reshape(-1, 2)


@pytest.mark.parametrize(
    ("place", "inside", "outside"),
    [
        ((0.5, 0.0), 0.0, 0.05),
        ((0.52, -0.02), 0.0, 0.05),
        ((0.54, 0.0), 0.02, 0.05),
        ((0.58, 0.0), 0.06, 0.03),
        ((0.62, 0.0), 0.10, 0.0),
        ((0.70, 0.0), 0.18, 0.0),
        ((0.76, 0.0), 0.24, 0.05),
    ],
)
def test_distance_to_relation(place: tuple[float, float], inside: float, outside: float) -> None:
    places = np.array([place])
    expectations: dict[PlaceSide | None, float] = {
        "inside": inside,
        "outside": outside,
        None: min(inside, outside),
    }
    for side, expected in expectations.items():
        found = distance_to_relation(REFERENCE, places, side)
        np.testing.assert_allclose(found, [expected], atol=0.0055)


@pytest.mark.parametrize("side", ["inside", "outside"])
def test_highest_place_that_satisfies_the_relation(
    make_blocks, make_grasps, block, rng: np.random.Generator, side: str
) -> None:
    blocks = [
        block(x=0.5, y=0.0, size=(0.08, 0.08), similarity=0.8),
        block(x=0.66, y=0.15, similarity=0.3),
    ]
    observation = make_blocks(blocks, phase="place", relation="a word", side=side)
    inside = [[0.5, 0.0, 0.10], [0.505, 0.0, 0.12], [0.5, 0.005, 0.101]]
    outside = [[0.5, 0.13, 0.06], [0.38, 0.0, 0.08], [0.5, -0.13, 0.061]]
    beyond = [[0.3, -0.2, 0.3], [0.66, 0.15, 0.3]]
    candidates = make_grasps(
        [*inside, *outside, *beyond], [0.2, 0.1, 0.9, 0.2, 0.1, 0.9, 1.0, 1.0], kind="place"
    )
    order = np.argsort(-VlpPolicy().score(observation, candidates, rng).logits).tolist()
    # The highest first; the other two are level, and their prior decides.
    assert order[:3] == ([1, 2, 0] if side == "inside" else [4, 5, 3])


def test_the_nearest_if_none_satisfies_it(
    make_blocks, make_grasps, block, rng: np.random.Generator
) -> None:
    observation = make_blocks(
        [block(x=0.5, y=0.0, size=(0.08, 0.08))], phase="place", relation="on", side="inside"
    )
    candidates = make_grasps([[0.6, 0, 0.3], [0.54, 0, 0.05], [0.7, 0, 0.3]], kind="place")
    assert VlpPolicy().score(observation, candidates, rng).best == 1
