"""Every object comes to rest, and containers keep what falls into them."""

import functools

import mujoco
import numpy as np
import pytest
from dm_control import mjcf
from scipy.spatial.transform import Rotation

from models.objects.catalogue import build_asset, object_names, object_words
from models.objects.mjcf_builder import FRICTION, SOLREF, build_object

build = functools.cache(build_asset)
CONTAINERS = [n for n in object_names() if "hold other things" in object_words(n).functions]
STEP_S = 0.002


def _table() -> mjcf.RootElement:
    root = mjcf.RootElement()
    root.option.set_attributes(
        timestep=STEP_S, cone="elliptic", impratio=10, integrator="implicitfast"
    )
    root.worldbody.add("geom", type="plane", size=(3, 3, 0.1), friction=FRICTION, solref=SOLREF)
    return root


def _add(root: mjcf.RootElement, name: str, height_m: float, turn: Rotation) -> None:
    frame = root.attach(build_object(build(name)))
    frame.pos = (0, 0, height_m)
    frame.quat = turn.as_quat(scalar_first=True)
    frame.add("freejoint")


@pytest.mark.parametrize("name", object_names())
def test_object_settles_from_any_side(name):
    turn = Rotation.random(random_state=np.random.default_rng(len(name)))
    lowest = turn.apply(build(name).vertices.copy())[:, 2].min()
    root = _table()
    _add(root, name, 0.02 - lowest, turn)
    model = mjcf.Physics.from_mjcf_model(root).model.ptr
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=round(3.0 / STEP_S))
    fastest = np.zeros(2)
    for _ in range(round(0.5 / STEP_S)):
        mujoco.mj_step(model, data)
        speeds = [np.linalg.norm(data.qvel[:3]), np.linalg.norm(data.qvel[3:])]
        fastest = np.maximum(fastest, speeds)
    assert fastest[0] < 0.005, "metres a second"
    assert fastest[1] < 0.1, "radians a second"
    assert np.linalg.norm(data.qpos[:2]) < 0.3
    assert np.all(data.contact.dist > -0.001)


@pytest.mark.parametrize("name", object_names())
def test_object_rests_as_it_was_modelled(name):
    root = _table()
    _add(root, name, 0.001, Rotation.identity())
    model = mjcf.Physics.from_mjcf_model(root).model.ptr
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=round(1.0 / STEP_S))
    up = Rotation.from_quat(data.qpos[3:], scalar_first=True).as_matrix()[2, 2]
    assert up > np.cos(np.radians(30))


@pytest.mark.parametrize("name", CONTAINERS)
def test_container_keeps_a_ball(name):
    asset = build(name)
    radius = 0.010
    root = _table()
    _add(root, name, 0.0, Rotation.identity())
    ball = root.worldbody.add("body", name="ball", pos=(0.006, 0.004, asset.size_m[2] + 0.05))
    ball.add("freejoint")
    ball.add("geom", type="sphere", size=[radius], mass=0.02, condim=6, friction=(0.7, 0.005, 1e-3))
    model = mjcf.Physics.from_mjcf_model(root).model.ptr
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=round(2.0 / STEP_S))
    inside = data.body("ball").xpos - data.body(f"{name}/").xpos
    upright = data.body(f"{name}/").xmat.reshape(3, 3)[2, 2]
    assert upright > 0.99
    assert np.all(np.abs(inside[:2]) < asset.size_m[:2] / 2)
    # On the floor of the vessel: above its underside, well below its rim.
    assert 0.002 < inside[2] - radius < 0.4 * asset.size_m[2]


def test_handle_of_the_mug_is_open():
    root = _table()
    _add(root, "red_mug", 0.0, Rotation.identity())
    model = mjcf.Physics.from_mjcf_model(root).model.ptr
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    asset = build("red_mug")
    # Along y through the middle between the wall (radius 40 mm about x = -19.75 mm) and the bow.
    wall_x = -asset.size_m[0] / 2 + 0.080
    start = np.array([wall_x + 0.017, 0.1, asset.size_m[2] / 2])
    groups = np.array([0, 0, 0, 1, 0, 0], np.uint8)
    through = np.array([0.0, -1.0, 0.0])
    hit = np.zeros(1, np.int32)
    assert mujoco.mj_ray(model, data, start, through, groups, 1, -1, hit) == -1
    bow = np.add(start, [0.017, 0, 0])
    assert mujoco.mj_ray(model, data, bow, through, groups, 1, -1, hit) > 0
