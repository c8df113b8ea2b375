import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from sr_mj.candidates.collision import hits_points, swept_boxes, table_clearance
from sr_mj.candidates.columns import points_in_boxes, sort_into_columns
from sr_mj.candidates.config import AntipodalConfig
from sr_mj.candidates.frames import Hypotheses, choose_orientations, gripper_orientations
from sr_mj.candidates.ranking import best_per_group, select_spread
from sr_mj.candidates.strips import depth_hypotheses, place_fingers, scan_strips
from sr_mj.candidates.surface import choose_seeds, thin, unseen_walls, voxel_keys, voxel_means

CONFIG = AntipodalConfig()


def _poses(count, rng, spread=0.1):
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = Rotation.random(count, rng=rng).as_matrix()
    poses[:, :3, 3] = rng.uniform(-spread, spread, (count, 3))
    return poses


def _grid(x, y, z):
    return np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3).astype(np.float32)


def test_voxel_means_average_each_cell():
    points = np.array([[0.1, 0.1, 0.1], [0.3, 0.1, 0.1], [-0.1, 0.2, 0.3]])
    keys = voxel_keys(points, 1.0)
    assert keys[0] == keys[1] != keys[2]
    np.testing.assert_allclose(
        voxel_means(points, keys), [[-0.1, 0.2, 0.3], [0.2, 0.1, 0.1]], rtol=1e-6
    )


def test_thinning_keeps_planes_and_spacing():
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(0, 0.1, (5000, 2)), np.full(5000, 0.031)])
    thinned = thin(points.astype(np.float32), 0.005)
    assert len(thinned) == 400
    np.testing.assert_allclose(thinned[:, 2], 0.031, atol=1e-6)


def test_walls_reach_from_the_edge_down_to_the_floor():
    top = _grid(np.arange(0, 0.06, 0.003), np.arange(0, 0.06, 0.003), [0.04])
    walls = unseen_walls(top, 0.006)
    assert len(walls) > 0
    edge = np.minimum(walls[:, :2], 0.057 - walls[:, :2]).min(axis=1)
    assert edge.max() <= 0.006
    assert walls[:, 2].min() == pytest.approx(0.04 - 6 * 0.006, abs=1e-6)
    assert walls[:, 2].max() == pytest.approx(0.034, abs=1e-6)


def test_a_gentle_slope_gets_no_walls():
    slope = _grid(np.arange(0, 0.06, 0.003), np.arange(0, 0.06, 0.003), [0])
    slope[:, 2] = 0.005
    assert len(unseen_walls(slope, 0.006)) == 0


def test_seeds_are_spread_and_bounded():
    rng = np.random.default_rng(0)
    points = rng.uniform(0, 0.3, (20000, 3)).astype(np.float32)
    points[:, 2] = 0.05
    seeds = choose_seeds(points, CONFIG, rng)
    assert 0.6 * CONFIG.max_seeds < len(seeds) <= CONFIG.max_seeds
    farthest = cKDTree(points[seeds]).query(points)[0].max()
    assert farthest < 0.03


def test_columns_pair_rectangles_with_all_points_in_them():
    rng = np.random.default_rng(1)
    points = rng.uniform(0.3, 0.6, (3000, 3)).astype(np.float32)
    lower = rng.uniform(0.25, 0.6, (40, 2))
    upper = lower + rng.uniform(0, 0.1, (40, 2))
    row, point = sort_into_columns(points, 0.012).pairs(lower, upper)
    assert (np.diff(row) >= 0).all()
    assert len(set(zip(row, point, strict=True))) == len(row)
    xy = points[point, :2]
    # Whole columns are found: at most one more to every side.
    assert ((xy > lower[row] - 0.0121) & (xy < upper[row] + 0.0121)).all()
    inside = ((points[:, None, :2] >= lower) & (points[:, None, :2] <= upper)).all(axis=2)
    assert {(b, a) for a, b in np.argwhere(inside)} <= set(zip(row, point, strict=True))


@pytest.mark.parametrize(("num_points", "num_boxes"), [(0, 3), (50, 0), (0, 0)])
def test_columns_without_points_or_rectangles_pair_nothing(num_points, num_boxes):
    points = np.full((num_points, 3), 0.5, np.float32)
    columns = sort_into_columns(points, 0.01)
    row, point = columns.pairs(np.zeros((num_boxes, 2)), np.ones((num_boxes, 2)))
    assert len(row) == len(point) == num_points * num_boxes


def test_points_in_boxes_are_those_that_a_pairwise_test_finds():
    rng = np.random.default_rng(6)
    points = rng.uniform(0.3, 0.5, (800, 3)).astype(np.float32)
    poses = _poses(30, rng)
    poses[:, :3, 3] += 0.4
    low, high = -rng.uniform(0, 0.05, (30, 3)), rng.uniform(0, 0.05, (30, 3))
    row, point = points_in_boxes(points, sort_into_columns(points, 0.01), poses, low, high)
    local = np.einsum("knj,kji->kni", points - poses[:, None, :3, 3], poses[:, :3, :3])
    inside = ((local > low[:, None]) & (local < high[:, None])).all(axis=2)
    assert inside.sum() > 100
    assert set(zip(row, point, strict=True)) == set(map(tuple, np.argwhere(inside)))


def test_orientations_are_rotations_and_closed_under_the_grippers_symmetry():
    rotations = gripper_orientations(CONFIG).astype(float)
    np.testing.assert_allclose(
        rotations @ rotations.transpose(0, 2, 1), np.broadcast_to(np.eye(3), rotations.shape),
        atol=1e-6,
    )  # fmt: skip
    np.testing.assert_allclose(np.linalg.det(rotations), 1, atol=1e-6)
    # Half a turn about the vertical, then half a turn of the gripper about its approach.
    turned = np.diag([-1.0, -1.0, 1.0]) @ rotations @ np.diag([-1.0, -1.0, 1.0])
    distance = np.abs(turned[:, None] - rotations).max(axis=(2, 3)).min(axis=1)
    assert distance.max() < 1e-6


def test_orientations_do_not_come_from_behind_and_follow_the_surface():
    rng = np.random.default_rng(2)
    points = rng.uniform(0, 0.3, (2000, 3)).astype(np.float32)
    normals = rng.normal(size=(2000, 3)).astype(np.float32)
    normals[:, 2] = np.abs(normals[:, 2])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    seeds = np.arange(50)
    found = choose_orientations(points, normals, seeds, CONFIG)
    chosen = found.rotations[found.orientation]
    assert (np.diff(found.seed) >= 0).all()
    assert ((chosen[:, :, 2] * normals[found.seed]).sum(axis=1) < 0.31).all()
    assert (chosen[:, 2, 2] < -np.cos(np.radians(51))).all()
    # A seed on a side is closed on along its normal, to half the step between azimuths.
    side = np.flatnonzero(np.linalg.norm(normals[seeds, :2], axis=1) > 0.9)
    across = normals[side, :2] / np.linalg.norm(normals[side, :2], axis=1, keepdims=True)
    for seed, direction in zip(side, across, strict=True):
        cosine = np.abs(chosen[found.seed == seed, :2, 0] @ direction).max()
        assert cosine > np.cos(np.radians(90 / CONFIG.num_azimuths + 0.1))


def test_profiles_are_the_largest_heights_in_lanes_and_bins():
    rng = np.random.default_rng(3)
    points = rng.uniform([0.4, -0.1, 0], [0.6, 0.1, 0.06], (4000, 3)).astype(np.float32)
    origins = points[:20]
    rotations = gripper_orientations(CONFIG)
    orientation = rng.integers(len(rotations), size=20)
    pairs = Hypotheses(seed=np.arange(20), orientation=orientation, rotations=rotations)
    profiles, shift_m = scan_strips(points, origins, pairs)
    assert profiles.shape == (20, 3, 35)
    for row in range(20):
        local = (points - origins[row]) @ rotations[orientation[row]]
        assert abs(shift_m[row]) < 0.0022
        column = np.rint((local[:, 0] - shift_m[row]) / 0.004) + 17
        for lane, middle in enumerate((-0.0087, 0, 0.0087)):
            for bin_ in range(35):
                # Lanes begin at the nearest of lines 2.2 mm apart.
                certain = np.abs(local[:, 1] - middle) < 0.0043 - 0.0015
                possible = np.abs(local[:, 1] - middle) < 0.0043 + 0.0015
                is_bin = np.abs((local[:, 0] - shift_m[row]) / 0.004 + 17 - bin_) < 0.4
                height = profiles[row, lane, bin_]
                assert height >= (-local[is_bin & certain, 2]).max(initial=-1) - 1e-3
                near = np.abs(column - bin_) <= 1
                assert height <= (-local[near & possible, 2]).max(initial=-1) + 1e-3


def test_fingers_are_placed_beside_a_ridge():
    ridge = _grid(
        np.arange(-0.0165, 0.0166, 0.003), np.arange(-0.03, 0.03, 0.003), np.arange(0, 0.05, 0.003)
    )
    origins = np.array([[0, 0, 0.048]], np.float32)
    vertical = np.diag([1.0, -1.0, -1.0]).astype(np.float32)[None]
    seed = np.zeros(1, np.int64)
    pairs = Hypotheses(seed=seed, orientation=seed, rotations=vertical)
    profiles, shift_m = scan_strips(ridge, origins, pairs)
    depth_m = np.array([0.02], np.float32)
    placed = place_fingers(seed, vertical, depth_m, profiles, shift_m, CONFIG)
    assert len(placed.seed) == 1
    assert abs(placed.center_m[0]) < 0.003
    assert 0.033 <= placed.width_m[0] < 0.042
    assert placed.engagement_m[0] == pytest.approx(0.02, abs=1e-4)
    assert (placed.alignment > 0.95).all()
    assert placed.opposition[0] < -0.9


def test_depths_stop_over_the_table():
    rotation = np.stack([np.diag([1.0, -1.0, -1.0])] * 3)
    row, depth_m = depth_hypotheses(np.array([0.2, 0.012, 0.005]), rotation, CONFIG)
    np.testing.assert_allclose(depth_m[row == 0], CONFIG.depths_m, rtol=1e-6)
    np.testing.assert_allclose(depth_m[row == 1], [0.006, 0.009], rtol=1e-6)
    assert 2 not in row


def test_boxes_are_the_grippers_swept_back():
    openings = np.array([0.0, 0.03, 0.085])
    low, high = swept_boxes(openings, CONFIG)
    for opening, lower, upper in zip(openings, low, high, strict=True):
        centers, halves = CONFIG.gripper.boxes(opening)
        np.testing.assert_allclose(lower[:2], (centers - halves)[:2], atol=1e-7)
        np.testing.assert_allclose(upper[:3], centers + halves, atol=1e-7)
        assert lower[2, 2] == pytest.approx((centers - halves)[2, 2] - CONFIG.pregrasp_m)
        # The wrist starts at the flange and lies behind the palm.
        assert upper[3, 2] == pytest.approx(-CONFIG.gripper.flange_to_tool_m, abs=1e-6)


def test_table_clearance_is_the_lowest_corner():
    rng = np.random.default_rng(3)
    poses = _poses(20, rng)
    low, high = swept_boxes(rng.uniform(0, 0.085, 20), CONFIG)
    expected = []
    for pose, lower, upper in zip(poses, low, high, strict=True):
        bits = np.array([[i >> k & 1 for k in range(3)] for i in range(8)], bool)
        corners = np.where(bits[None], upper[:, None], lower[:, None]).reshape(-1, 3)
        expected.append((corners @ pose[2, :3] + pose[2, 3]).min())
    np.testing.assert_allclose(table_clearance(poses, low, high), expected, atol=1e-6)


def test_points_in_boxes_are_found():
    rng = np.random.default_rng(4)
    poses = _poses(100, rng, spread=0.3)
    points = rng.uniform(-0.4, 0.4, (300, 3)).astype(np.float32)
    low, high = swept_boxes(rng.uniform(0, 0.085, 100), CONFIG)
    expected = [
        bool(((local > lower[:, None]) & (local < upper[:, None])).all(axis=2).any())
        for pose, lower, upper in zip(poses, low, high, strict=True)
        for local in [(points - pose[:3, 3]) @ pose[:3, :3]]
    ]
    assert 0.1 < np.mean(expected) < 0.9
    np.testing.assert_array_equal(hits_points(poses, low, high, points), expected)
    assert not hits_points(poses, low, high, points[:0]).any()


def test_best_per_group_is_fair():
    score = np.array([0.9, 0.8, 0.7, 0.1, 0.2])
    group = np.array([1, 1, 1, 2, 2])
    np.testing.assert_array_equal(best_per_group(score, group, 2), [0, 4])
    np.testing.assert_array_equal(best_per_group(score, group, 3), [0, 1, 4])
    np.testing.assert_array_equal(best_per_group(score, group, 99), np.arange(5))


def test_suppression_is_the_greedy_one():
    rng = np.random.default_rng(5)
    poses = np.tile(np.eye(4), (300, 1, 1))
    poses[:, :3, :3] = Rotation.from_rotvec(rng.normal(0, 0.3, (300, 3))).as_matrix()
    poses[:, :3, 3] = rng.uniform(0, 0.03, (300, 3))
    prior = rng.permutation(np.linspace(0, 1, 300))
    config = AntipodalConfig(max_per_cell=300, max_candidates=300)
    cosine = np.cos(np.radians(config.nms_angle_deg))
    kept = []
    for row in np.argsort(-prior):
        is_new = all(
            np.linalg.norm(poses[row, :3, 3] - poses[other, :3, 3]) >= config.nms_distance_m
            or poses[row, :3, 2] @ poses[other, :3, 2] <= cosine
            or abs(poses[row, :3, 0] @ poses[other, :3, 0]) <= cosine
            for other in kept
        )
        if is_new:
            kept.append(row)
    assert len(kept) < 250
    np.testing.assert_array_equal(select_spread(poses, prior, config), kept)


def test_selection_gives_every_cell_its_share():
    poses = np.tile(np.eye(4), (60, 1, 1))
    poses[:, 0, 3] = np.repeat([0.01, 0.05, 0.09], 20)
    poses[:, 1, 3] = 0.01
    poses[:, 2, 3] = np.tile(np.arange(20) * 0.01, 3)
    prior = np.repeat([0.9, 0.5, 0.1], 20) + np.tile(np.arange(20) * 1e-3, 3)
    chosen = select_spread(poses, prior, AntipodalConfig(max_per_cell=8, max_candidates=12))
    np.testing.assert_array_equal(np.bincount(chosen // 20), [4, 4, 4])
    assert (np.diff(prior[chosen]) <= 0).all()
