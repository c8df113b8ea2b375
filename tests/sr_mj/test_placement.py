import mujoco
import numpy as np
import pytest
import shapely

from perception.relations import INSIDE_RELATIONS, OUTSIDE_RELATIONS
from sr_mj.errors import UnknownNameError
from sr_mj.scene import SceneConfig, make_scene
from sr_mj.scene.placement import (
    RING_M,
    find_object,
    footprint,
    is_placed,
    objects_on,
    place_region,
    touched_bodies,
)

OBJECTS = ("red_bowl", "lemon", "banana", "orange", "apple", "block_cube", "plum", "tuna_can")


@pytest.fixture
def scene():
    return make_scene(SceneConfig(scene="place8", objects=OBJECTS, seed=3))


def put(scene, name, xy, z):
    body = find_object(scene, name).body
    scene.data.qpos[body.qpos][:3] = [*xy, z]
    scene.data.qvel[body.dof_adr + 2] = -0.01
    mujoco.mj_step(scene.model, scene.data, 1500)


def test_footprint_of_a_round_object(scene):
    outline = footprint(scene, "orange")
    center = find_object(scene, "orange").body
    assert outline.area == pytest.approx(np.pi * (0.073 / 2) ** 2, rel=0.03)
    assert outline.contains(shapely.Point(scene.data.xipos[center.body_id][:2]))


@pytest.mark.parametrize("relation", INSIDE_RELATIONS)
def test_inside_is_a_third_of_the_smaller_side_about_the_middle(scene, relation):
    region = place_region(scene, relation, "tuna_can")
    assert region.is_inside
    diameter = np.sqrt(4 * footprint(scene, "tuna_can").area / np.pi)
    x0, y0, x1, y1 = region.area.bounds
    np.testing.assert_allclose((x1 - x0, y1 - y0), diameter / 3, rtol=0.03)
    center = scene.data.xipos[find_object(scene, "tuna_can").body.body_id][:2]
    np.testing.assert_allclose(((x0 + x1) / 2, (y0 + y1) / 2), center, atol=1e-3)


@pytest.mark.parametrize("relation", OUTSIDE_RELATIONS)
def test_outside_is_a_ring_free_of_others(scene, relation):
    region = place_region(scene, relation, "apple")
    points = region.sample(np.random.default_rng(0), 300)
    assert points.shape == (300, 2)
    outline = footprint(scene, "apple")
    distance = shapely.distance(outline, shapely.points(points))
    assert RING_M[0] <= distance.min() < 0.06 and 0.14 < distance.max() <= RING_M[1]
    assert np.all(scene.workspace.contains_xy(points))
    for name in set(OBJECTS) - {"apple"}:
        assert not shapely.contains_xy(footprint(scene, name), points[:, 0], points[:, 1]).any()


def test_clearance_keeps_the_whole_object_free(scene):
    region = place_region(scene, "near", "apple", clearance_m=0.03)
    points = shapely.points(region.sample(np.random.default_rng(0), 100))
    for name in set(OBJECTS) - {"apple"}:
        assert shapely.distance(footprint(scene, name), points).min() >= 0.03 - 1e-3


def test_the_moved_object_stands_in_nobodys_way(scene):
    blocked = place_region(scene, "near", "apple").area
    free = [place_region(scene, "near", "apple", moved=name).area for name in OBJECTS[1:4]]
    assert all(area.area >= blocked.area for area in free)
    assert max(area.area for area in free) > blocked.area


def test_a_region_may_be_empty(scene):
    region = place_region(scene, "near", "apple", clearance_m=0.2)
    assert region.area.is_empty
    assert region.sample(np.random.default_rng(0), 5).shape == (0, 2)
    assert not region.contains(np.array([0.5, 0.0]))


def test_in_a_bowl(scene):
    region = place_region(scene, "in", "red_bowl", moved="lemon")
    assert not is_placed(scene, "lemon", region)
    (center,) = region.sample(np.random.default_rng(1), 1)
    put(scene, "lemon", center, 0.05)
    assert touched_bodies(scene, "lemon") == {find_object(scene, "red_bowl").body.body_id}
    assert objects_on(scene, "red_bowl") == ("lemon",)
    assert objects_on(scene, "lemon") == ()
    assert is_placed(scene, "lemon", region)


def test_on_the_table_beside_the_bowl_is_not_in_it(scene):
    region = place_region(scene, "in", "red_bowl", moved="block_cube")
    (free,) = place_region(scene, "near", "red_bowl", clearance_m=0.05).sample(
        np.random.default_rng(0), 1
    )
    put(scene, "block_cube", free, 0.01)
    assert touched_bodies(scene, "block_cube") == {0}
    assert not is_placed(scene, "block_cube", region)


def test_beside(scene):
    region = place_region(scene, "beside", "apple", moved="block_cube", clearance_m=0.05)
    (center,) = region.sample(np.random.default_rng(0), 1)
    put(scene, "block_cube", center, 0.01)
    assert is_placed(scene, "block_cube", region)
    on_can = scene.data.xipos[find_object(scene, "tuna_can").body.body_id][:2]
    put(scene, "block_cube", on_can, 0.06)
    assert not is_placed(scene, "block_cube", place_region(scene, "beside", "tuna_can"))
    assert is_placed(scene, "block_cube", place_region(scene, "on", "tuna_can"))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s: place_region(s, "under", "apple"), "Unknown relation 'under'. Relations: on top of, upside, on, in, to, surrounding to, close to, next to, beside, around, near. Did you mean 'near'?"),
        (lambda s: footprint(s, "appel"), f"Unknown object 'appel'. Objects: {', '.join(OBJECTS)}. Did you mean 'apple'?"),
    ],
)  # fmt: skip
def test_bad_input(scene, call, message):
    with pytest.raises(UnknownNameError) as error:
        call(scene)
    assert str(error.value) == message
