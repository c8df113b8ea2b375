import itertools
from dataclasses import replace

import numpy as np
import open3d as o3d
import pytest
import trimesh
from scipy.spatial import cKDTree

from models.cameras import camera_preset
from perception.cloud import GeometryCloud
from sr_mj.candidates import (
    AntipodalConfig,
    AntipodalSampler,
    CandidateGenerator,
    Relaxation,
)
from sr_mj.candidates.collision import swept_boxes, table_clearance
from sr_mj.errors import ConfigError

CONFIG = AntipodalConfig()
GRIPPER = CONFIG.gripper


def _placed(mesh, x=0.5, y=0.0, yaw_deg=0.0):
    """Turn a mesh about z and set it on the table."""
    mesh = mesh.copy()
    mesh.apply_transform(trimesh.transformations.rotation_matrix(np.radians(yaw_deg), [0, 0, 1]))
    mesh.apply_translation([x, y, -mesh.bounds[0, 2]])
    return mesh


def _lying(mesh):
    mesh = mesh.copy()
    mesh.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0]))
    return mesh


def _bowl():
    outer = np.array([[0.03, 0.0], [0.055, 0.05], [0.051, 0.05], [0.027, 0.004], [0.0, 0.004]])
    return trimesh.creation.revolve(np.vstack([[0.0, 0.0], outer]), sections=64)


def _look(meshes, sigma_m=0.002, seed=0):
    """Render from the preset's cameras, add noise, back-project, fuse and estimate normals."""
    rng = np.random.default_rng(seed)
    table = trimesh.creation.box((1.2, 1.2, 0.02))
    table.apply_translation((0.5, 0, -0.01))
    scene = o3d.t.geometry.RaycastingScene()
    for mesh in (table, *meshes):
        scene.add_triangles(
            o3d.core.Tensor(np.asarray(mesh.vertices, np.float32)),
            o3d.core.Tensor(np.asarray(mesh.faces, np.uint32)),
        )
    points, eyes = [], []
    for camera in camera_preset("sr"):
        sensor, pose = camera.sensor, camera.T_world_cam_cv()
        u, v = np.meshgrid(np.arange(0, sensor.width, 2), np.arange(0, sensor.height, 2))
        ray = np.stack([(u - sensor.cx) / sensor.fx, (v - sensor.cy) / sensor.fy, u * 0 + 1], -1)
        ray = ray.reshape(-1, 3) @ pose[:3, :3].T
        origin = np.broadcast_to(pose[:3, 3], ray.shape)
        cast = scene.cast_rays(o3d.core.Tensor(np.hstack([origin, ray]).astype(np.float32)))
        depth_m = cast["t_hit"].numpy() + rng.normal(0, sigma_m, len(ray))
        # A time-of-flight sensor gets nothing back at grazing incidence.
        cosine = np.abs((cast["primitive_normals"].numpy() * ray).sum(1))
        is_seen = np.isfinite(depth_m) & (cosine > 0.15 * np.linalg.norm(ray, axis=1))
        hit = origin[is_seen] + depth_m[is_seen, None] * ray[is_seen]
        points.append(hit)
        eyes.append(origin[is_seen])
    points, eyes = np.concatenate(points), np.concatenate(eyes)
    inside = (np.abs(points[:, :2] - [0.5, 0]) < 0.224).all(axis=1)
    points, eyes = points[inside], eyes[inside]
    _, cell = np.unique(np.floor(points / 0.003).astype(int), axis=0, return_inverse=True)
    size = np.bincount(cell.ravel())
    points, eyes = (
        np.stack([np.bincount(cell.ravel(), column) / size for column in rows.T], axis=1)
        for rows in (points, eyes)
    )
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(0.009, 30))
    normals = np.asarray(cloud.normals)
    normals = normals * np.sign(((eyes - points) * normals).sum(axis=1, keepdims=True))
    return _cloud(points, normals)


def _cloud(points, normals):
    return GeometryCloud(
        points=points.astype(np.float32),
        colors=np.zeros_like(points, dtype=np.float32),
        normals=normals.astype(np.float32),
    )


def _pick(cloud, config=CONFIG, seed=0):
    return AntipodalSampler(config).pick(cloud, np.random.default_rng(seed))


def _heap():
    return [
        _placed(trimesh.creation.box((0.06, 0.04, 0.05)), 0.45, -0.06, 20),
        _placed(trimesh.creation.box((0.16, 0.12, 0.03)), 0.58, -0.05, 75),
        _placed(trimesh.creation.cylinder(0.03, 0.09), 0.43, 0.03),
        _placed(trimesh.creation.icosphere(subdivisions=4, radius=0.032), 0.52, 0.06),
        _placed(_lying(trimesh.creation.cylinder(0.009, 0.12)), 0.60, 0.09, 40),
        _placed(trimesh.creation.box((0.05, 0.03, 0.12)), 0.50, 0.0, -30),
        _placed(_bowl(), 0.40, -0.14),
    ]


@pytest.fixture(scope="module")
def heap_cloud():
    return _look(_heap())


@pytest.fixture(scope="module")
def heap_picks(heap_cloud):
    return _pick(heap_cloud)


def _angle_to_axes_deg(directions, yaws_deg):
    """Smallest angle between horizontal directions and any of some lines."""
    azimuth = np.degrees(np.arctan2(directions[:, 1], directions[:, 0]))
    turns = (azimuth[:, None] - np.asarray(yaws_deg) + 90) % 180 - 90
    return np.abs(turns).min(axis=1)


@pytest.mark.parametrize("yaw_deg", [0, 25, 70])
def test_box_is_closed_on_across_its_faces(yaw_deg):
    box = _placed(trimesh.creation.box((0.07, 0.04, 0.05)), yaw_deg=yaw_deg)
    cloud = _look([box])
    # One draw has a dozen of them: too few for a share.
    draws = [_pick(cloud, seed=seed) for seed in range(4)]
    assert min(len(picks) for picks in draws) > 15
    best = [picks.take(np.arange(len(picks) // 3)) for picks in draws]
    closing = np.concatenate([picks.Ts_world_tool[:, :3, 0] for picks in best])
    width_m = np.concatenate([picks.width_m for picks in best])
    assert (np.abs(closing[:, 2]) < np.sin(np.radians(15))).all()
    angle = _angle_to_axes_deg(closing, [yaw_deg, yaw_deg + 90])
    assert np.median(angle) < 7
    assert np.mean(angle < 20) >= 0.8
    sides = np.abs(width_m[:, None] - [0.04, 0.07]).min(axis=1)
    assert np.median(sides) < 0.003
    assert np.mean(sides < 0.008) > 0.8


@pytest.mark.parametrize(
    ("mesh", "width_m"),
    [
        (trimesh.creation.cylinder(0.03, 0.10), 0.06),
        (trimesh.creation.icosphere(subdivisions=4, radius=0.03), 0.06),
    ],
    ids=["cylinder", "sphere"],
)
def test_round_object_is_held_across_its_middle(mesh, width_m):
    mesh = _placed(mesh, 0.48, 0.03)
    picks = _pick(_look([mesh]))
    assert len(picks) > 15
    best = picks.take(np.arange(len(picks) // 3))
    to_axis = best.positions[:, :2] - mesh.centroid[:2]
    closing = best.Ts_world_tool[:, :2, 0]
    miss = np.abs(closing[:, 0] * to_axis[:, 1] - closing[:, 1] * to_axis[:, 0])
    assert np.median(miss) < 0.006
    assert miss.max() < 0.02
    assert np.abs(np.median(best.width_m) - width_m) < 0.004


def test_thin_rod_on_the_table_is_held_across_by_the_fingertips():
    rod = _placed(_lying(trimesh.creation.cylinder(0.006, 0.14)), yaw_deg=35)
    picks = _pick(_look([rod]))
    assert len(picks) >= 5
    best = picks.Ts_world_tool[: max(len(picks) // 4, 5)]
    assert np.median(_angle_to_axes_deg(best[:, :3, 0], [35 + 90])) < 12
    low, high = swept_boxes(picks.width_m, CONFIG)
    tips_m = table_clearance(picks.Ts_world_tool, low, high)
    assert tips_m.min() > 0.0025
    assert np.median(tips_m) < 0.006


def test_bowl_is_held_by_its_rim():
    picks = _pick(_look([_placed(_bowl())]))
    rim = picks.take(np.flatnonzero(picks.width_m < 0.02))
    assert len(rim) > 5
    radius_m = np.linalg.norm(rim.positions[:, :2] - [0.5, 0], axis=1)
    assert np.median(np.abs(radius_m - 0.05)) < 0.01
    assert rim.prior.max() > 0.3


@pytest.mark.parametrize("yaw_deg", [0, 10])
def test_cube_wider_than_the_gripper_gets_no_candidates(yaw_deg):
    cube = _placed(trimesh.creation.box((0.12, 0.12, 0.12)), yaw_deg=yaw_deg)
    assert len(_pick(_look([cube]))) == 0


def test_every_small_object_of_a_heap_gets_candidates(heap_picks):
    heap = _heap()
    counts = [
        sum(np.linalg.norm(heap_picks.positions - mesh.bounds.mean(axis=0), axis=1) < 0.045)
        for mesh in heap
    ]
    is_held = [count > 0 for count in counts]
    # The flat box at index 1 is wider than the gripper.
    assert is_held[:1] + is_held[2:6] == [True] * 5


def test_open_gripper_keeps_clear_of_the_table_and_of_all_it_saw(heap_picks):
    true_points = _look(_heap(), sigma_m=0.0).points.astype(float)
    true_points = true_points[true_points[:, 2] > 0.003]
    low, high = swept_boxes(AntipodalSampler().approach_opening(heap_picks.width_m), CONFIG)
    assert len(heap_picks) > 50
    for pose, lower, upper in zip(heap_picks.Ts_world_tool, low, high, strict=True):
        corners = np.array(
            [
                np.where(pattern, box_high, box_low)
                for box_low, box_high in zip(lower, upper, strict=True)
                for pattern in itertools.product([False, True], repeat=3)
            ]
        )
        assert (corners @ pose[2, :3] + pose[2, 3]).min() > 0.0025
        local = (true_points - pose[:3, 3]) @ pose[:3, :3]
        # 2 mm of noise may hide behind the surface that the sampler saw.
        inside = (local > lower[:, None] + 0.002) & (local < upper[:, None] - 0.002)
        assert not inside.all(axis=2).any()


def test_fingers_close_on_something(heap_picks):
    tree = cKDTree(_look(_heap(), sigma_m=0.0).points)
    half = heap_picks.width_m[:, None] / 2 * heap_picks.Ts_world_tool[:, :3, 0]
    for contact in (heap_picks.positions - half, heap_picks.positions + half):
        assert (tree.query(contact)[0] < 0.03).all()


def test_candidates_are_sorted_distinct_and_few(heap_picks):
    assert (np.diff(heap_picks.prior) <= 0).all()
    assert len(heap_picks) <= CONFIG.max_candidates
    assert heap_picks.kind == "pick"
    assert heap_picks.width_m.max() < GRIPPER.max_width_m
    first, second = np.triu_indices(len(heap_picks), k=1)
    axes = heap_picks.Ts_world_tool[:, :3, :3]
    is_near = np.linalg.norm(np.diff(heap_picks.positions[[first, second]], axis=0)[0], axis=1)
    cosine = np.cos(np.radians(CONFIG.nms_angle_deg))
    same = (is_near < CONFIG.nms_distance_m - 1e-6) & (
        (axes[first, :, 2] * axes[second, :, 2]).sum(1) > cosine + 1e-6
    )
    same &= np.abs((axes[first, :, 0] * axes[second, :, 0]).sum(1)) > cosine + 1e-6
    assert not same.any()


def test_approaches_stay_within_a_cone_about_the_vertical(heap_picks):
    tilt = np.degrees(np.arccos(-heap_picks.Ts_world_tool[:, 2, 2]))
    assert tilt.max() < 63
    assert tilt.min() < 1e-3
    assert (tilt > 10).mean() > 0.1


def test_turning_the_scene_turns_the_candidates(heap_cloud, heap_picks):
    cloud, base = heap_cloud, heap_picks
    for angle_deg in (37, 90):
        turn = trimesh.transformations.rotation_matrix(
            np.radians(angle_deg), [0, 0, 1], [0.5, 0, 0]
        )
        turned = _cloud(cloud.points @ turn[:3, :3].T + turn[:3, 3], cloud.normals @ turn[:3, :3].T)
        picks = _pick(turned, seed=1)
        expected = base.positions @ turn[:3, :3].T + turn[:3, 3]
        # Other voxels and other seeds, hence statistically: almost every place is found again.
        assert np.mean(cKDTree(picks.positions).query(expected)[0] < 0.02) > 0.9
        assert np.mean(cKDTree(expected).query(picks.positions)[0] < 0.02) > 0.9
        assert abs(picks.prior.mean() - base.prior.mean()) < 0.05


def test_same_generator_state_gives_the_same_bytes(heap_cloud, heap_picks):
    before = heap_cloud.points.tobytes()
    again, other = (_pick(heap_cloud, seed=seed) for seed in (0, 1))
    for name in ("Ts_world_tool", "width_m", "prior"):
        assert getattr(again, name).tobytes() == getattr(heap_picks, name).tobytes()
    assert again.Ts_world_tool.tobytes() != other.Ts_world_tool.tobytes()
    assert heap_cloud.points.tobytes() == before


def test_points_of_the_table_change_nothing(heap_cloud, heap_picks):
    cloud = heap_cloud
    above = cloud.points[:, 2] > CONFIG.object_min_height_m
    objects_only = _cloud(cloud.points[above], cloud.normals[above])
    assert _pick(objects_only).Ts_world_tool.tobytes() == heap_picks.Ts_world_tool.tobytes()


@pytest.mark.parametrize("meshes", [None, []], ids=["empty cloud", "bare table"])
def test_nothing_to_grasp_gives_no_candidates(meshes):
    cloud = _cloud(np.zeros((0, 3)), np.zeros((0, 3))) if meshes is None else _look(meshes)
    picks = _pick(cloud)
    assert len(picks) == 0
    assert picks.kind == "pick"


def test_a_single_point_is_survived():
    assert len(_pick(_cloud(np.array([[0.5, 0, 0.02]]), np.array([[0, 0, 1.0]])))) == 0


def test_relaxed_passes_run_only_when_stricter_ones_found_nothing():
    cloud = _look([_placed(trimesh.creation.box((0.07, 0.04, 0.05)), yaw_deg=20)])
    impossible = Relaxation(min_alignment=1.0, max_opposition=-1.0, clearance_m=0.0)
    usual = CONFIG.passes[0]
    strict = replace(CONFIG, min_alignment=1.0, max_opposition=-1.0, relaxations=())
    assert len(_pick(cloud, strict)) == 0
    relaxed = _pick(cloud, replace(strict, relaxations=(impossible, usual)))
    assert relaxed.Ts_world_tool.tobytes() == _pick(cloud).Ts_world_tool.tobytes()
    with_spare = _pick(cloud, replace(CONFIG, relaxations=(impossible,)))
    assert with_spare.Ts_world_tool.tobytes() == _pick(cloud).Ts_world_tool.tobytes()


def test_sampler_is_a_candidate_generator():
    assert isinstance(AntipodalSampler(), CandidateGenerator)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("voxel_m", 0.0, "AntipodalConfig: voxel_m is 0.0, expected more than 0."),
        ("cell_m", float("nan"), "AntipodalConfig: cell_m is nan, expected more than 0."),
        (
            "extra_opening_m",
            -0.01,
            "AntipodalConfig: extra_opening_m is -0.01, expected 0 or more.",
        ),
        ("max_seeds", 0, "AntipodalConfig: max_seeds is 0, expected 1 or more."),
        ("min_alignment", 1.2, "AntipodalConfig: min_alignment is 1.2, expected 0 to 1."),
        ("max_opposition", 0.5, "AntipodalConfig: max_opposition is 0.5, expected -1 to 0."),
        ("clearance_m", -0.1, "AntipodalConfig: clearance_m is -0.1, expected -0.005 to 0.02."),
        (
            "tilts_deg",
            (0.0, 80.0),
            "AntipodalConfig: tilts_deg is (0.0, 80.0), expected at least one angle, all within "
            "75 degrees of the vertical.",
        ),
        (
            "tilts_deg",
            (),
            "AntipodalConfig: tilts_deg is (), expected at least one angle, all within "
            "75 degrees of the vertical.",
        ),
        (
            "depths_m",
            (0.02, 0.01),
            "AntipodalConfig: depths_m is (0.02, 0.01), expected at least one, more than 0 and "
            "ascending.",
        ),
        (
            "depths_m",
            (),
            "AntipodalConfig: depths_m is (), expected at least one, more than 0 and ascending.",
        ),
    ],
)
def test_bad_settings_are_refused_in_one_line(field, value, message):
    with pytest.raises(ConfigError) as caught:
        replace(CONFIG, **{field: value})
    assert str(caught.value) == message


def test_bad_relaxation_is_refused_in_one_line():
    with pytest.raises(ConfigError) as caught:
        Relaxation(min_alignment=-0.1, max_opposition=-0.6, clearance_m=0.0)
    assert str(caught.value) == "Relaxation: min_alignment is -0.1, expected 0 to 1."
