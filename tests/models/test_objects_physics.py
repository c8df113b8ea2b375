"""Every object comes to rest, and vessels keep what falls into them."""

import mujoco
import numpy as np
import pytest

from models.drop_test import (
    ORIENTATIONS,
    BallDrop,
    Rest,
    drop_ball,
    drop_object,
    find_faults,
    is_vessel,
)
from models.objects.catalogue import load_object, object_names, object_words
from models.objects.mjcf_builder import build_object
from models.tabletop import build_tabletop

# Names and words are known without building: the objects come from the cache, one at a time.
VESSELS = [
    name
    for name in object_names()
    if object_words(name).category in ("container", "cup")
    or "hold other things" in object_words(name).functions
]
CALM = Rest(settle_s=0.2, speed_m_s=1e-4, spin_rad_s=1e-3, sink_m=2e-4, wandered_m=0.01, up=1.0)
LIVELY = Rest(settle_s=3.0, speed_m_s=6e-4, spin_rad_s=0.03, sink_m=2e-3, wandered_m=0.01, up=1.0)


@pytest.mark.parametrize("name", object_names())
def test_object_settles_from_four_orientations(name):
    item = load_object(name)
    rests = drop_object(item)
    assert tuple(rests) == tuple(ORIENTATIONS)
    assert find_faults(rests) == []
    assert rests["upright"].up > np.cos(np.radians(30)), "does not rest as it was modelled"
    assert all(rest.settle_s < 3.0 and rest.wandered_m < 0.3 for rest in rests.values())


@pytest.mark.parametrize("name", VESSELS)
def test_vessel_keeps_a_ball(name):
    item = load_object(name)
    assert is_vessel(item)
    ball = drop_ball(item)
    assert ball.is_inside
    assert ball.radius_m >= 0.005


def test_a_solid_has_no_hollow():
    assert drop_ball(load_object("racquetball")) == BallDrop(radius_m=0.0, is_inside=False)


def test_faults_are_named():
    ball = BallDrop(radius_m=0.012, is_inside=False)
    assert find_faults({"upright": CALM}, BallDrop(radius_m=0.012, is_inside=True)) == []
    assert find_faults({"upright": CALM, "tilted": LIVELY}, ball) == [
        "tilted: still moves at 0.60 mm/s",
        "tilted: still turns at 0.030 rad/s",
        "tilted: sinks 2.00 mm into the table",
        "the ball leaves it",
    ]
    solid = BallDrop(radius_m=0.0, is_inside=False)
    assert find_faults({}, solid) == ["it has no hollow open upwards"]


def test_dropping_twice_gives_the_same_figures():
    item = load_object("red_mug")
    assert drop_object(item) == drop_object(item)
    assert drop_ball(item) == drop_ball(item)


def _stage(name: str, height_m: float) -> mujoco.MjModel:
    root = build_tabletop()
    frame = root.attach(build_object(load_object(name)))
    frame.pos = (0, 0, height_m)
    frame.add("freejoint")
    return mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())


def test_handle_of_the_mug_is_open():
    model = _stage("red_mug", 0.0)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    asset = load_object("red_mug")
    # Along y through the middle between the wall (radius 40 mm about x = -19.75 mm) and the bow.
    wall_x = -asset.size_m[0] / 2 + 0.080
    start = np.array([wall_x + 0.017, 0.1, asset.size_m[2] / 2])
    groups = np.array([0, 0, 0, 1, 0, 0], np.uint8)
    through = np.array([0.0, -1.0, 0.0])
    hit = np.zeros(1, np.int32)
    assert mujoco.mj_ray(model, data, start, through, groups, 1, -1, hit) == -1
    bow = np.add(start, [0.017, 0, 0])
    assert mujoco.mj_ray(model, data, bow, through, groups, 1, -1, hit) > 0
