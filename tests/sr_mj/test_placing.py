import mujoco
import numpy as np
import pytest
import trimesh

from models.cameras import camera_preset
from perception.cloud import GeometryCloud
from perception.fusion import FusionConfig, fuse
from sr_mj.candidates import AntipodalSampler
from sr_mj.candidates.generator import PlaceGenerator
from sr_mj.candidates.held import HeldObject, held_object, support_height
from sr_mj.candidates.place_columns import columns_of, gripper_columns
from sr_mj.candidates.place_config import PlaceConfig
from sr_mj.candidates.place_heights import height_map
from sr_mj.candidates.place_ranking import choose_spread
from sr_mj.candidates.placing import SurfacePlacer
from sr_mj.errors import ConfigError
from sr_mj.scene import SceneConfig, make_scene
from sr_mj.scene.placement import find_object, place_region
from sr_mj.sensors.capture import capture_views
from sr_mj.sensors.l515 import L515NoiseConfig
from sr_mj.sensors.renderer import CameraRig

CONFIG = PlaceConfig()
DOWN = np.diag([1.0, -1.0, -1.0, 1.0])
COLUMN = 5e-3


def cloud_of(*meshes, table=True, half_m=0.224):
    """Sample surfaces as cameras above see them: no undersides, no noise, each in its colour."""
    points, normals, colors = [np.zeros((0, 3))], [np.zeros((0, 3))], [np.zeros((0, 3))]
    for index, mesh in enumerate(meshes):
        point, face = trimesh.sample.sample_surface(mesh, int(mesh.area / 2e-6), seed=1)
        normal = mesh.face_normals[face]
        is_seen = normal[:, 2] > -0.3
        points.append(point[is_seen])
        normals.append(normal[is_seen])
        colors.append(np.full((is_seen.sum(), 3), (0.1, 0.9, 0.5)[index % 3]))
    if table:
        axis = np.arange(-half_m, half_m + 1e-9, 0.004)
        grid = np.stack(np.meshgrid(axis + 0.5, axis, [0.0]), axis=-1).reshape(-1, 3)
        points.append(grid)
        normals.append(np.tile([0.0, 0.0, 1.0], (len(grid), 1)))
        colors.append(np.full_like(grid, 0.7))
    return GeometryCloud(
        points=np.concatenate(points).astype(np.float32),
        colors=np.concatenate(colors).astype(np.float32),
        normals=np.concatenate(normals).astype(np.float32),
    )


def box(extents, x=0.5, y=0.0, z=0.0):
    mesh = trimesh.creation.box(extents)
    mesh.apply_translation([x, y, z + extents[2] / 2])
    return mesh


def bowl(x=0.5, y=0.0):
    outer = [[0.0, 0.0], [0.04, 0.0], [0.075, 0.05], [0.071, 0.05], [0.037, 0.005], [0.0, 0.005]]
    mesh = trimesh.creation.revolve(np.array(outer), sections=64)
    mesh.apply_translation([x, y, 0])
    return mesh


def grasp_at(x, y, z, yaw=0.0):
    pose = DOWN.copy()
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    pose = turn @ pose
    pose[:3, 3] = x, y, z
    return pose


def held_box(extents=(0.04, 0.03, 0.04)):
    """Hold a box grasped from above, 1 cm below its top."""
    tool = grasp_at(0.5, 0.0, extents[2] - 0.01)
    return held_object(cloud_of(box(extents)), tool, extents[0])


def place(cloud, held=None, seed=0, **options):
    placer = SurfacePlacer(PlaceConfig(**options))
    return placer.place(cloud, held or held_box(), np.random.default_rng(seed))


def released_points(held, pose):
    return held.points_tool @ pose[:3, :3].T + pose[:3, 3]


def check_release(candidates, held, cloud):
    """Whatever is proposed, the held object neither touches nor overlaps anything."""
    for pose in candidates.Ts_world_tool:
        body = released_points(held, pose)
        scene = cloud.points
        low, high = body.min(axis=0), body.max(axis=0)
        under = scene[(scene[:, :2] > low[:2]).all(axis=1) & (scene[:, :2] < high[:2]).all(axis=1)]
        top = columns_of(under, COLUMN)
        column = columns_of(body, COLUMN)
        shared = {tuple(cell): z for cell, z in zip(np.rint(top.xy / 1e-4), top.top_m, strict=True)}
        gaps = [
            bottom - shared[tuple(cell)]
            for cell, bottom in zip(np.rint(column.xy / 1e-4), column.bottom_m, strict=True)
            if tuple(cell) in shared
        ]
        assert min(gaps) > 0


# ----- held objects -----


def test_a_box_on_the_table_is_held_whole():
    held = held_box((0.05, 0.03, 0.06))
    assert held.drop_m == pytest.approx(0.05, abs=1e-6)
    body = released_points(held, held.T_world_tool)
    np.testing.assert_allclose(np.ptp(body, axis=0), (0.05, 0.03, 0.06), atol=0.005)
    assert body[:, 2].min() == pytest.approx(0, abs=1e-6)
    np.testing.assert_allclose(columns_of(body, COLUMN).center, (0.5, 0), atol=0.003)


def test_unseen_sides_are_closed_down_to_the_table():
    roof = cloud_of(box((0.06, 0.04, 0.05)))
    is_top = (roof.points[:, 2] > 0.049) | (roof.points[:, 2] == 0)
    seen = GeometryCloud(
        points=roof.points[is_top], colors=roof.colors[is_top], normals=roof.normals[is_top]
    )
    held = held_object(seen, grasp_at(0.5, 0, 0.035), 0.06)
    body = released_points(held, held.T_world_tool)
    assert held.drop_m == pytest.approx(0.035)
    column = columns_of(body, COLUMN)
    np.testing.assert_allclose(column.bottom_m, 0, atol=1e-6)
    assert np.ptp(column.xy, axis=0) == pytest.approx((0.06, 0.04), abs=0.006)


def test_a_neighbour_is_not_held():
    cloud = cloud_of(box((0.04, 0.04, 0.05)), box((0.08, 0.08, 0.07), y=0.075))
    held = held_object(cloud, grasp_at(0.5, 0, 0.03), 0.04)
    body = released_points(held, held.T_world_tool)
    assert body[:, 1].max() < 0.025
    assert np.ptp(body[:, 0]) == pytest.approx(0.04, abs=0.005)


def test_what_something_else_carries_all_around_stands_on_that():
    points = cloud_of(box((0.12, 0.12, 0.05)), box((0.04, 0.03, 0.04), z=0.052), table=False).points
    is_upper = points[:, 2] > 0.051
    assert support_height(points, is_upper) == pytest.approx(0.05, abs=0.002)
    # Carried on one side only, it leans on the table somewhere.
    one_side = is_upper | (points[:, 0] > 0.5)
    assert support_height(points[one_side], is_upper[one_side]) == 0
    assert support_height(points[is_upper], np.ones(is_upper.sum(), bool)) == 0


@pytest.mark.parametrize("meshes", [(), (box((0.05, 0.05, 0.05), x=0.6),)])
def test_nothing_seen_between_the_fingers(meshes):
    held = held_object(cloud_of(*meshes), grasp_at(0.4, 0, 0.05), 0.03)
    y, z = CONFIG.grasping.gripper.pad_half_m
    np.testing.assert_allclose(np.abs(held.points_tool).max(axis=0), (0.015, y, z), atol=1e-6)
    assert held.drop_m == pytest.approx(z)


def test_a_cloud_without_points():
    empty = GeometryCloud(
        **{n: np.zeros((0, 3), np.float32) for n in ("points", "colors", "normals")}
    )
    held = held_object(empty, grasp_at(0.4, 0, 0.05), 0.03)
    assert len(held.points_tool) > 8
    assert len(place(empty, held)) == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"points_tool": np.zeros((0, 3))}, "HeldObject: points_tool has shape (0, 3), expected (N, 3) with N > 0."),
        ({"T_world_tool": np.eye(3)}, "HeldObject: T_world_tool has shape (3, 3), expected (4, 4)."),
        ({"drop_m": np.nan}, "HeldObject: a value isn't finite."),
    ],
)  # fmt: skip
def test_bad_held_objects(change, message):
    good = {
        "points_tool": np.zeros((1, 3)),
        "drop_m": 0.1,
        "T_world_tool": np.eye(4),
        "width_m": 0.03,
    }
    with pytest.raises(ConfigError) as error:
        HeldObject(**good | change)
    assert str(error.value) == message


# ----- parts -----


def test_heights_are_those_of_the_highest_points():
    points = np.array([[0.5, 0, 0.02], [0.5, 0, 0.05], [0.6, 0.1, 0.01]], np.float32)
    heights = height_map(points, np.array([[0.3, -0.2], [0.7, 0.2]]), 0.004)
    at = np.array([[0.5, 0.0], [0.6, 0.1], [0.4, 0.0], [5.0, 5.0]])
    np.testing.assert_allclose(heights.height_m(at), (0.05, 0.01, 0, 0))
    np.testing.assert_allclose(heights.clearance_m(at[:3]), (0, 0, 0.1), atol=0.006)
    empty = height_map(points[:0], np.array([[0.3, -0.2], [0.7, 0.2]]), 0.004)
    assert empty.clearance_m(at).min() > 1


def test_gripper_from_below():
    gripper = CONFIG.grasping.gripper
    columns = gripper_columns(DOWN[:3, :3], 0.04, CONFIG.grasping, 0.006)
    assert columns.bottom_m.min() == pytest.approx(-gripper.tip_below_tool_m)
    lowest = columns.xy[columns.bottom_m < -0.01]
    assert np.abs(lowest[:, 0]).min() == pytest.approx(0.02, abs=0.006)
    assert np.abs(columns.xy[:, 0]).max() == pytest.approx(gripper.palm_half_m[0], abs=0.006)
    middle = np.abs(columns.xy).max(axis=1) < 0.01
    assert columns.bottom_m[middle].min() == pytest.approx(gripper.palm_above_tool_m)


def test_spread_prefers_other_places_to_other_headings():
    xy = np.array([[0, 0], [0, 0], [0.1, 0], [0.101, 0], [0, 0]])
    yaw = np.array([0, np.pi, 0, 0, 0.1])
    prior = np.array([0.9, 0.8, 0.5, 0.4, 0.85])
    assert choose_spread(xy, yaw, prior, 0.02, 10).tolist() == [0, 2, 1]
    assert choose_spread(xy, yaw, prior, 0.02, 1).tolist() == [0]
    assert choose_spread(xy, yaw, 0 * prior, 0.02, 10).tolist() == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"cell_m": 0.0}, "PlaceConfig: cell_m is 0.0, expected more than 0."),
        ({"release_gap_m": -0.1}, "PlaceConfig: release_gap_m is -0.1, expected 0 or more."),
        ({"num_yaws": 0}, "PlaceConfig: num_yaws is 0, expected 1 or more."),
        ({"ring_m": (0.1, 0.05)}, "PlaceConfig: ring_m is (0.1, 0.05), expected a least and a larger distance."),
    ],
)  # fmt: skip
def test_bad_settings(options, message):
    with pytest.raises(ConfigError) as error:
        PlaceConfig(**options)
    assert str(error.value) == message


# ----- placing -----


def test_beside_and_on_a_box():
    extents = (0.10, 0.08, 0.05)
    cloud, held = cloud_of(box(extents)), held_box()
    places = place(cloud, held)
    assert isinstance(SurfacePlacer(), PlaceGenerator)
    assert places.kind == "place" and 40 < len(places) <= CONFIG.max_candidates
    assert (np.diff(places.prior) <= 0).all()
    np.testing.assert_allclose(places.width_m, held.width_m)
    lowest = places.positions[:, 2] - held.drop_m
    is_on = lowest > 0.03
    np.testing.assert_allclose(lowest[is_on], 0.05 + CONFIG.release_gap_m, atol=0.003)
    np.testing.assert_allclose(lowest[~is_on], CONFIG.release_gap_m, atol=1e-6)
    offset = places.positions[:, :2] - (0.5, 0)
    assert is_on.sum() >= 8
    assert np.abs(offset[is_on]).max() < 0.03
    outside = np.linalg.norm((np.abs(offset) - (0.05, 0.04)).clip(0), axis=1)
    in_ring = (outside[~is_on] > 0.05) & (outside[~is_on] < 0.15)
    assert in_ring.sum() >= CONFIG.num_beside
    angles = np.arctan2(*offset[~is_on][in_ring].T)
    assert np.diff(np.sort(angles)).max() < np.pi / 3
    check_release(places, held, cloud)


def test_the_tilt_of_the_grasp_is_kept():
    tilt = np.radians(30)
    pose = grasp_at(0.5, 0, 0.03)
    turn = np.eye(4)
    turn[1:3, 1:3] = [[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]]
    pose[:3, :3] = turn[:3, :3] @ pose[:3, :3]
    held = held_object(cloud_of(box((0.04, 0.03, 0.04))), pose, 0.04)
    cloud = cloud_of(box((0.10, 0.08, 0.05)))
    places = place(cloud, held)
    assert len(places) > 20
    np.testing.assert_allclose(places.Ts_world_tool[:, 2, 2], pose[2, 2], atol=1e-9)
    np.testing.assert_allclose(places.Ts_world_tool[:, 2, 0], pose[2, 0], atol=1e-9)
    check_release(places, held, cloud)


def test_in_a_bowl():
    cloud, held = cloud_of(bowl()), held_box((0.03, 0.03, 0.03))
    places = place(cloud, held)
    off = np.linalg.norm(places.positions[:, :2] - (0.5, 0), axis=1)
    inside = off < 0.025
    assert inside.sum() >= 6
    assert not ((off > 0.03) & (off < 0.12)).any()
    lowest = places.positions[inside, 2] - held.drop_m
    # Below the rim, unless the gripper would hit it.
    assert lowest.min() < 0.04
    tips = places.positions[inside, 2] - CONFIG.grasping.gripper.tip_below_tool_m
    assert tips.min() > 0.005
    check_release(places, held, cloud)


def test_a_deep_narrow_cup_is_released_into_from_above_its_rim():
    profile = [[0, 0], [0.035, 0], [0.035, 0.09], [0.032, 0.09], [0.032, 0.004], [0, 0.004]]
    cup = trimesh.creation.revolve(np.array(profile), sections=64)
    cup.apply_translation([0.5, 0, 0])
    held = held_box((0.03, 0.03, 0.03))
    places = place(cloud_of(cup), held)
    inside = np.linalg.norm(places.positions[:, :2] - (0.5, 0), axis=1) < 0.02
    assert inside.any()
    tips = places.positions[inside, 2] - CONFIG.grasping.gripper.tip_below_tool_m
    assert tips.min() > 0.09


def test_on_a_ball_nothing_stays():
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.035)
    ball.apply_translation([0.5, 0, 0.035])
    places = place(cloud_of(ball), contact_m=0.001)
    assert len(places) > 20
    assert (np.linalg.norm(places.positions[:, :2] - (0.5, 0), axis=1) > 0.05).all()


def test_no_free_space():
    spikes = [
        box((0.015, 0.015, 0.08), x=0.5 + dx, y=dy)
        for dx in np.arange(-0.07, 0.08, 0.035)
        for dy in np.arange(-0.07, 0.08, 0.035)
    ]
    cloud = cloud_of(*spikes, half_m=0.08)
    assert len(place(cloud, held_box((0.08, 0.06, 0.04)))) == 0


def test_an_empty_table_is_free():
    places = place(cloud_of())
    assert 5 < len(places) <= CONFIG.num_table
    assert (np.abs(places.positions[:, :2] - (0.5, 0)) < 0.224 - 0.02).all()


def test_the_workspace_can_be_set():
    places = place(cloud_of(), workspace_min=(0.5, 0.0), workspace_max=(0.7, 0.2))
    assert len(places) > 3
    assert (places.positions[:, 0] > 0.515).all() and (places.positions[:, 1] > 0.01).all()


def test_same_seed_same_bytes():
    cloud, held = cloud_of(box((0.1, 0.08, 0.05)), bowl(x=0.38, y=0.12)), held_box()
    first, again, other = (place(cloud, held, seed=seed) for seed in (3, 3, 4))
    assert first.Ts_world_tool.tobytes() == again.Ts_world_tool.tobytes()
    assert first.prior.tobytes() == again.prior.tobytes()
    assert first.Ts_world_tool.tobytes() != other.Ts_world_tool.tobytes()


# ----- a rendered scene -----

OBJECTS = ("red_bowl", "lemon", "banana", "orange", "apple", "block_cube", "plum", "tuna_can")


def look(scene, seed):
    with CameraRig(scene.model, camera_preset("sr")) as rig:
        views = capture_views(rig, scene.data, L515NoiseConfig(), np.random.default_rng(seed))
    return fuse(views, FusionConfig())


@pytest.mark.render
def test_rendered_scene_has_candidates_in_true_regions():
    scene = make_scene(SceneConfig(scene="place8", objects=OBJECTS, seed=3))
    body = find_object(scene, "lemon").body
    cloud = look(scene, 0)
    center = scene.data.xipos[body.body_id].copy()
    picks = AntipodalSampler().pick(cloud, np.random.default_rng(0))
    on_lemon = np.linalg.norm(picks.positions - center, axis=1) < 0.02
    grasp = int(np.flatnonzero(on_lemon)[0])
    tool = picks.Ts_world_tool[grasp]
    held = held_object(cloud, tool, float(picks.width_m[grasp]))
    true_low = (
        find_object(scene, "lemon").asset.vertices @ scene.T_world_object("lemon")[2, :3]
    ).min()
    true_low += scene.T_world_object("lemon")[2, 3]
    assert held.drop_m == pytest.approx(tool[2, 3] - true_low, abs=0.003)

    scene.data.qpos[body.qpos][:3] = 0.5, 3.0, 1.0
    scene.data.qvel[body.dof_adr + 2] = -0.01
    mujoco.mj_forward(scene.model, scene.data)
    places = place(look(scene, 1), held)
    centers = (places.Ts_world_tool @ np.linalg.inv(tool) @ np.r_[center, 1])[:, :3]
    covered = {
        (relation, name): int(
            place_region(scene, relation, name, moved="lemon").contains(centers).sum()
        )
        for name in OBJECTS
        if name != "lemon"
        for relation in ("in", "near")
    }
    assert covered["in", "red_bowl"] >= 3
    assert covered["in", "tuna_can"] >= 3
    assert min(count for (relation, _), count in covered.items() if relation == "near") >= 3
