import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from sr_mj.candidates.collision import hits_points, swept_boxes, table_clearance
from sr_mj.candidates.config import AntipodalConfig
from sr_mj.candidates.frames import seed_frames
from sr_mj.candidates.neighbourhoods import exact_axes, gather_neighbours
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


def test_neighbours_are_those_within_the_radius():
    rng = np.random.default_rng(1)
    points = rng.uniform(0.3, 0.6, (3000, 3)).astype(np.float32)
    seeds = points[:130]
    found = gather_neighbours(points, seeds, 0.05)
    tree = cKDTree(points)
    for row, seed in enumerate(seeds):
        size = found.count[row]
        neighbours = set(found.index[row, :size])
        # Offsets are rounded to 0.12 mm, which may decide at the border.
        assert set(tree.query_ball_point(seed, 0.0498)) <= neighbours
        assert neighbours <= set(tree.query_ball_point(seed, 0.0502))
        assert (found.index[row, size:] == -1).all()
        offsets = points[found.index[row, :size]] - seed
        np.testing.assert_allclose(found.offsets[row, :size], offsets, atol=2.0**-14 + 1e-7)
        assert (found.offsets[row, size:] > 1).all()


def test_products_with_offsets_are_exact_in_any_order():
    rng = np.random.default_rng(6)
    points = rng.uniform(0.3, 0.5, (2000, 3)).astype(np.float32)
    offsets = gather_neighbours(points, points[:1], 0.12).offsets[0]
    axes = exact_axes(Rotation.random(rng=rng).as_matrix()[None])[0].numpy()
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=2e-3)
    exact = offsets.astype(float) @ axes.astype(float)
    for order in ([0, 1, 2], [2, 0, 1], [1, 2, 0]):
        summed = sum(offsets[:, [k]] * axes[[k]] for k in order)
        np.testing.assert_array_equal(summed, exact)


def test_frames_are_rotations_that_do_not_come_from_behind():
    rng = np.random.default_rng(2)
    normals = rng.normal(size=(50, 3))
    normals[:, 2] = np.abs(normals[:, 2])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    offsets = rng.uniform(-0.03, 0.03, (50, 40, 3))
    rotations, valid = seed_frames(normals, offsets, CONFIG)
    chosen = rotations[valid].astype(float)
    np.testing.assert_allclose(
        chosen @ chosen.transpose(0, 2, 1), np.broadcast_to(np.eye(3), chosen.shape), atol=1e-5
    )
    np.testing.assert_allclose(np.linalg.det(chosen), 1, atol=1e-5)
    seed, _ = np.nonzero(valid)
    assert ((chosen[:, :, 2] * normals[seed]).sum(axis=1) < 0.31).all()
    assert (chosen[:, 2, 2] < -np.cos(np.radians(63))).all()


def test_fingers_are_placed_beside_a_ridge():
    ridge = _grid(
        np.arange(-0.0165, 0.0166, 0.003), np.arange(-0.03, 0.03, 0.003), np.arange(0, 0.05, 0.003)
    )
    around = gather_neighbours(ridge, np.array([[0, 0, 0.048]], np.float32), 0.07)
    vertical = np.diag([1.0, -1.0, -1.0]).astype(np.float32)[None, None]
    seed, _, profiles = scan_strips(around, vertical, np.ones((1, 1), bool))
    depth_m = np.array([0.02], np.float32)
    placed = place_fingers(seed, vertical[0], depth_m, profiles, CONFIG)
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
