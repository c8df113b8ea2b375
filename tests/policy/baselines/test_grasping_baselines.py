"""What tells the grasping baselines from one another."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from policy.baselines.clip_grounding import ClipGroundingPolicy
from policy.baselines.lerf_togo import LerfTogoPolicy, grow_object, multi_scale_relevancy
from policy.baselines.think_grasp import ThinkGraspPolicy, find_occluder

ON_TARGET, ON_COVER, ELSEWHERE = [0.4, 0.035, 0.03], [0.4, 0.0, 0.06], [0.6, 0.0, 0.03]


def _pile(block, *, cover_similarity: float = 0.3, **cover):
    """A wide target with something on its middle, and another object."""
    return [
        block(x=0.4, y=0.0, size=(0.12, 0.12), top=0.032, similarity=0.8),
        block(**({"x": 0.4, "y": 0.0, "size": (0.04, 0.04), "bottom": 0.048, "top": 0.08} | cover),
              similarity=cover_similarity),
        block(x=0.6, y=0.0, similarity=0.5),
    ]  # fmt: skip


def test_clip_grounding_draws_uniformly_on_the_object(
    make_blocks, make_grasps, block, rng: np.random.Generator
) -> None:
    observation = make_blocks([block(x=0.4, y=0.0), block(x=0.6, y=0.0)], target=1)
    candidates = make_grasps([[0.4, 0, 0.03]] + [[0.6, 0, 0.03]] * 3, [1.0, 0.9, 0.1, 0.1])
    policy = ClipGroundingPolicy()
    draws = [policy.score(observation, candidates, rng).best for _ in range(90)]
    counts = np.bincount(draws, minlength=4)
    assert counts[0] == 0
    # Four standard deviations of a binomial count with n = 90, p = 1/3.
    np.testing.assert_allclose(counts[1:], 90 / 3, atol=4 * (90 * 2 / 9) ** 0.5)


def test_clip_grounding_compares_boxes_with_all_that_is_in_them(
    make_blocks, make_grasps, block, rng: np.random.Generator
) -> None:
    walls = block(x=0.4, y=0.0, size=(0.12, 0.12))
    content = block(x=0.4, y=0.0, size=(0.064, 0.064), top=0.032)
    rival = block(x=0.6, y=0.0)
    full = make_blocks([walls, content, rival])
    # A box without a lid, and a rival that is a little less similar than its walls are.
    is_lid = (np.abs(full.points[:, :2] - [0.4, 0.0]) < 0.057).all(axis=1) & (
        full.points[:, 2] > 0.047
    )
    features = full.features.copy()
    features[full.features[:, 2] > 0] = [0.95, *[0] * 14, (1 - 0.95**2) ** 0.5]
    is_content = full.features[:, 1] > 0

    def best(keep: np.ndarray) -> int:
        arrays = {name: getattr(full, name)[keep] for name in ("points", "similarity")}
        seen = make_blocks([rival], features=features[keep], confidence=np.ones(keep.sum()),
                           **arrays)  # fmt: skip
        candidates = make_grasps([[0.344, 0, 0.03], [0.6, 0, 0.03]])
        return ClipGroundingPolicy().score(seen, candidates, rng).best

    assert best(~is_lid & ~is_content) == 0
    assert best(~is_lid) == 1


def test_think_grasp_takes_the_occluder_first(
    make_blocks, make_grasps, block, rng: np.random.Generator
) -> None:
    candidates = make_grasps([ELSEWHERE, ON_TARGET, ON_COVER], [1.0, 0.9, 0.1])
    covered = make_blocks(_pile(block))
    order = np.argsort(-ThinkGraspPolicy().score(covered, candidates, rng).logits)
    assert order.tolist() == [2, 1, 0]
    free = make_blocks([part for part in _pile(block) if part.size != (0.04, 0.04)])
    candidates = candidates.take(np.array([0, 1]))
    assert ThinkGraspPolicy().score(free, candidates, rng).best == 1


@pytest.mark.parametrize("cover", [{"x": 0.5}, {"bottom": 0.032, "top": 0.032}, {"y": 0.09}])
def test_what_is_beside_or_flush_is_no_occluder(block, cover: dict) -> None:
    clouds = [part.points() for part in _pile(block, **cover)]
    labels = np.repeat(np.arange(3), [len(cloud) for cloud in clouds])
    assert find_occluder(np.concatenate(clouds), labels, 0) == 0


def test_the_highest_of_several_occluders(block) -> None:
    parts = [
        block(x=0.4, y=0.0, size=(0.16, 0.16), top=0.032),
        block(x=0.36, y=0.0, size=(0.04, 0.04), bottom=0.048, top=0.06),
        block(x=0.44, y=0.0, size=(0.04, 0.04), bottom=0.048, top=0.1),
    ]
    clouds = [part.points() for part in parts]
    labels = np.repeat(np.arange(3), [len(cloud) for cloud in clouds])
    points = np.concatenate(clouds)
    assert [find_occluder(points, labels, target) for target in range(3)] == [2, 1, 2]


def test_a_line_has_no_outline() -> None:
    points = np.array([[0.4 + 0.008 * i, 0.0, 0.01] for i in range(12)] * 2)
    points[12:, 2] = 0.1
    assert find_occluder(points, np.repeat([0, 1], 12), 0) == 0


def test_lerf_relevancy_is_the_margin_of_the_pooled_feature(
    make_blocks, block, rng: np.random.Generator
) -> None:
    """Against one negative, pooling features and asking is the same as what is computed."""
    observation = make_blocks([block(x=0.4, y=0.0), block(x=0.6, y=0.0)], noise=0.3)
    negative = rng.normal(size=16)
    negative /= np.linalg.norm(negative)
    sharpness, features = 10.0, observation.features.astype(np.float64)
    phrase = np.eye(16)[0]
    similarity = 1 / (1 + np.exp(-sharpness * (features @ (phrase - negative))))
    asked = make_blocks([block(x=0.4, y=0.0), block(x=0.6, y=0.0)], features=features,
                        similarity=similarity)  # fmt: skip
    tree = KDTree(asked.points.astype(np.float64))
    expected = []
    for radius_m in (0.012, 0.02, 0.03, 0.04):
        near = tree.query_ball_point(tree.data, radius_m)
        pooled = np.array([features[indices].mean(axis=0) for indices in near])
        pooled /= np.linalg.norm(pooled, axis=1, keepdims=True)
        expected.append(sharpness * pooled @ (phrase - negative))
    best = max(expected, key=np.max)
    np.testing.assert_allclose(multi_scale_relevancy(asked, tree), best, atol=1e-3)


def test_lerf_mask_is_the_object(make_blocks, block) -> None:
    # Touching blocks of the same shape: only the features tell them apart.
    blocks = [block(x=0.4, y=0.0), block(x=0.464, y=0.0), block(x=0.6, y=0.1)]
    observation = make_blocks(blocks, noise=0.1)
    first = len(blocks[0].points())
    mask = grow_object(observation, KDTree(observation.points), 0)
    truth = np.arange(observation.num_points) < first
    # Pooling blurs the seam by one voxel on either side.
    is_seam = np.abs(observation.points[:, 0] - 0.432) < 0.013
    np.testing.assert_array_equal(mask[~is_seam], truth[~is_seam])


def test_lerf_prior_decides_little(
    make_blocks, make_grasps, block, rng: np.random.Generator
) -> None:
    observation = make_blocks([block(x=0.4, y=0.0, similarity=0.8), block(x=0.6, y=0.0)])
    candidates = make_grasps([[0.4, 0, 0.03]] * 3 + [[0.6, 0, 0.03]], [0.2, 0.9, 0.5, 1.0])
    logits = LerfTogoPolicy().score(observation, candidates, rng).logits
    assert np.argsort(-logits).tolist() == [1, 2, 0, 3]
    np.testing.assert_allclose(logits[1] - logits[0], 0.05 * 0.7, atol=1e-6)
