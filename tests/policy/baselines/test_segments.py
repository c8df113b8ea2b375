import numpy as np
import pytest

from policy.segments import MIN_POINTS, means, owners, ranks, segment


def _same_partition(first: np.ndarray, second: np.ndarray) -> bool:
    pairs = np.unique(np.stack([first, second]), axis=1)
    return pairs.shape[1] == len(np.unique(first)) == len(np.unique(second))


def test_separate_and_stacked_blocks_are_segments(block) -> None:
    blocks = [
        block(x=0.35, y=-0.1),
        block(x=0.35, y=0.1, size=(0.12, 0.12)),
        block(x=0.55, y=0.0, top=0.12),
        # 8 mm away from its neighbour: no valley between them, only a gap.
        block(x=0.55, y=0.072),
    ]
    clouds = [b.points() for b in blocks]
    truth = np.repeat(np.arange(4), [len(cloud) for cloud in clouds])
    points = np.concatenate(clouds)
    apart = truth != 3
    assert _same_partition(segment(points[apart]), truth[apart])


@pytest.mark.parametrize(("valley", "num_segments"), [(0.008, 2), (0.002, 1), (0.0, 1)])
def test_a_valley_parts_two_tops(valley: float, num_segments: int) -> None:
    x, y = (a.ravel() for a in np.meshgrid(np.arange(17) * 0.008, np.arange(6) * 0.008))
    depth = valley * (1 - np.abs(x - 0.064) / 0.064)
    points = np.stack([x, y, 0.1 - depth], axis=1)
    assert segment(points).max() + 1 == num_segments


def test_order_of_points_does_not_matter(block, rng: np.random.Generator) -> None:
    points = np.concatenate([block(x=0.3 + 0.1 * i, y=0.0).points() for i in range(4)])
    points = points + rng.normal(0, 0.001, points.shape)
    shuffled = rng.permutation(len(points))
    assert _same_partition(segment(points)[shuffled], segment(points[shuffled]))


def test_labels_are_dense(block, rng: np.random.Generator) -> None:
    labels = segment(rng.uniform(0, 0.3, (400, 3)))
    np.testing.assert_array_equal(np.unique(labels), np.arange(labels.max() + 1))
    assert segment(np.zeros((0, 3))).shape == (0,)
    assert segment(np.zeros((1, 3))).tolist() == [0]


def test_means_leave_specks_out() -> None:
    labels = np.array([0] * MIN_POINTS + [1] * (MIN_POINTS - 1))
    values = np.linspace(0, 1, len(labels))
    expected = [values[:MIN_POINTS].mean(), -np.inf]
    np.testing.assert_allclose(means(values, labels), expected)
    # Specks are all there is.
    np.testing.assert_allclose(means(np.array([0.1, 0.3, 0.6]), np.array([0, 0, 1])), [0.2, 0.6])


def test_owners_are_the_nearest_points_segments(block) -> None:
    blocks = [block(x=0.35, y=0.0), block(x=0.55, y=0.0)]
    clouds = [b.points() for b in blocks]
    truth = np.repeat([0, 1], [len(cloud) for cloud in clouds])
    positions = np.array([[0.56, 0.0, 0.03], [0.34, 0.01, 0.1], [0.44, 0.0, 0.02]])
    assert owners(np.concatenate(clouds), truth, positions).tolist() == [1, 0, 0]


def test_ranks_invert_sorting(rng: np.random.Generator) -> None:
    values = rng.permutation(7).astype(float)
    np.testing.assert_array_equal(ranks(values), values)
    np.testing.assert_array_equal(ranks(np.array([2.0, -np.inf, 2.0])), [1, 0, 2])
