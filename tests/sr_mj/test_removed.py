import numpy as np
import pytest
import trimesh

from perception.cloud import GeometryCloud
from sr_mj.candidates.held import held_object
from sr_mj.candidates.removed import revealed_heights

DOWN = np.diag([1.0, -1.0, -1.0, 1.0])
GRAY, RED, BLUE = (0.5, 0.5, 0.5), (0.9, 0.1, 0.1), (0.1, 0.1, 0.9)


def box(extents, x=0.5, y=0.0, z=0.0, color=GRAY):
    mesh = trimesh.creation.box(extents)
    mesh.apply_translation([x, y, z + extents[2] / 2])
    mesh.metadata["color"] = color
    return mesh


def cloud_of(*meshes, hidden=()):
    """What is seen of boxes on a table: points 3 mm apart on them, and on the free table.

    Heights in `hidden`, pairs of a lower and an upper one, are seen by no camera.
    """
    x, y = np.meshgrid(np.arange(0.3, 0.7, 0.003), np.arange(-0.2, 0.2, 0.003))
    table = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    points, normals, colors = [], [], []
    for mesh in meshes:
        low, high = mesh.bounds
        table = table[~np.all((table[:, :2] > low[:2]) & (table[:, :2] < high[:2]), axis=1)]
        spots, faces = trimesh.sample.sample_surface_even(mesh, 4000, seed=0)
        points.append(spots)
        normals.append(mesh.face_normals[faces])
        colors.append(np.tile(mesh.metadata["color"], (len(spots), 1)))
    cloud = np.concatenate([table, *points])
    seen = np.ones(len(cloud), bool)
    for low, high in hidden:
        seen &= (cloud[:, 2] < low) | (cloud[:, 2] > high)
    up = np.tile([0.0, 0, 1], (len(table), 1))
    gray = np.full((len(table), 3), 0.5)
    return GeometryCloud(
        points=cloud[seen].astype(np.float32),
        normals=np.concatenate([up, *normals])[seen].astype(np.float32),
        colors=np.concatenate([gray, *colors])[seen].astype(np.float32),
    )


def grasp_at(x, y, z):
    pose = DOWN.copy()
    pose[:3, 3] = x, y, z
    return pose


def body_of(held):
    return held.points_tool @ held.T_world_tool[:3, :3].T + held.T_world_tool[:3, 3]


HEAD, TORSO = box((0.03, 0.03, 0.03), z=0.06), box((0.05, 0.05, 0.045))
NECK = ((0.047, 0.06),)


def test_a_head_over_an_unseen_neck_is_held_with_its_body():
    before = cloud_of(HEAD, TORSO, hidden=NECK)
    held = held_object(before, grasp_at(0.5, 0, 0.075), 0.03, after=cloud_of())
    body = body_of(held)
    assert held.drop_m == pytest.approx(0.075)
    np.testing.assert_allclose(np.ptp(body, axis=0), (0.05, 0.05, 0.09), atol=0.005)
    # From the first look alone it may as well stand on something else.
    alone = held_object(before, grasp_at(0.5, 0, 0.075), 0.03)
    assert np.ptp(body_of(alone)[:, 0]) < 0.04


def test_what_stood_on_something_reaches_down_to_what_is_left():
    before = cloud_of(HEAD, TORSO, hidden=NECK)
    held = held_object(before, grasp_at(0.5, 0, 0.075), 0.03, after=cloud_of(TORSO))
    body = body_of(held)
    assert body[:, 2].min() == pytest.approx(0.045, abs=0.002)
    assert held.drop_m == pytest.approx(0.03, abs=0.002)
    assert np.ptp(body[:, 0]) == pytest.approx(0.03, abs=0.005)


def test_a_touching_neighbour_that_stays_is_not_held():
    neighbour = box((0.04, 0.04, 0.04), x=0.541)
    before = cloud_of(box((0.04, 0.04, 0.04)), neighbour)
    held = held_object(before, grasp_at(0.5, 0, 0.03), 0.04, after=cloud_of(neighbour))
    body = body_of(held)
    assert body[:, 0].max() < 0.5245
    assert body[:, 0].min() == pytest.approx(0.48, abs=0.003)


def test_a_neighbour_that_was_pushed_aside_is_not_held():
    mine = box((0.04, 0.04, 0.04), color=RED)
    before = cloud_of(mine, box((0.04, 0.04, 0.06), x=0.547, y=0.03, color=BLUE))
    after = cloud_of(box((0.04, 0.04, 0.06), x=0.57, y=0.03, color=BLUE))
    body = body_of(held_object(before, grasp_at(0.5, 0, 0.03), 0.04, after=after))
    assert body[:, 0].max() < 0.5245


def test_a_second_look_that_shows_the_object_in_place_says_nothing():
    cloud, pose = cloud_of(box((0.04, 0.04, 0.05))), grasp_at(0.5, 0, 0.04)
    with_it = held_object(cloud, pose, 0.04, after=cloud)
    without = held_object(cloud, pose, 0.04)
    np.testing.assert_array_equal(with_it.points_tool, without.points_tool)
    assert with_it.drop_m == without.drop_m


def test_nothing_seen_between_the_fingers_needs_no_second_look():
    held = held_object(cloud_of(), grasp_at(0.4, 0, 0.05), 0.03, after=cloud_of())
    assert len(held.points_tool) > 8


def test_revealed_heights_are_those_below_the_object():
    own = np.array([[0.001, 0.001, 0.09], [0.007, 0.001, 0.09]])
    after = np.array([[0.002, 0.002, 0.03], [0.002, 0.003, 0.05], [0.1, 0.1, 0.2]])
    np.testing.assert_array_equal(revealed_heights(own, after), [0.05])
    assert len(revealed_heights(own, after[2:])) == 0
