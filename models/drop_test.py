"""Drop tests of single objects: does one come to rest, and does a vessel keep a ball?

Everything runs with the table and the physics options that scenes have, except that nothing may
fall asleep: an object that trembles must not look as if it rested.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from dm_control import mjcf
from scipy import ndimage
from scipy.spatial.transform import Rotation

from models.objects.mjcf_builder import ROLLING_FRICTION, build_object
from models.tabletop import TABLE_GEOM, build_tabletop

if TYPE_CHECKING:
    from models.objects.catalogue import CatalogueObject

ORIENTATIONS: dict[str, Rotation] = {
    "upright": Rotation.identity(),
    "on its side": Rotation.from_euler("zx", (8, 90), degrees=True),
    "on its end": Rotation.from_euler("zy", (8, 90), degrees=True),
    "tilted": Rotation.from_euler("xyz", (35, 20, 50), degrees=True),
}
"""How objects are turned, from their natural rest pose, before they fall.

Lying ones are turned 8 degrees about their own axis first: exactly level, a tube would balance on
its edge, which nothing in a heap ever does.
"""

MAX_SETTLE_S, MAX_SPEED_M_S, MAX_SPIN_RAD_S, MAX_SINK_M = 3.0, 5e-4, 0.02, 1e-3
"""What a sound object keeps to."""

DROP_M = 0.02
WATCH_S = 0.5
SPOT = (0.5, 0.0)
"""Point of the table above which things fall, x and y in metres."""

_BALL_MAX_RADIUS_M, _BALL_FIT, _GLASS_KG_M3 = 0.012, 0.7, 2500.0
_GRID = 48
_VESSELS = ("container", "cup")


@dataclass(frozen=True, kw_only=True)
class Rest:
    """How an object came to rest.

    Attributes:
        settle_s: When it last moved at 0.5 mm/s or 0.02 rad/s or more, seconds after its release.
        speed_m_s: Greatest speed of its centre of mass from 3.0 to 3.5 s.
        spin_rad_s: Greatest angular speed in that time.
        sink_m: Deepest penetration into the table in that time.
        wandered_m: Horizontal distance of the centre of mass from where it was released.
        up: Cosine of the angle between the vertical and its z axis, as it lies in the end.
    """

    settle_s: float
    speed_m_s: float
    spin_rad_s: float
    sink_m: float
    wandered_m: float
    up: float


@dataclass(frozen=True, kw_only=True)
class BallDrop:
    """What became of a ball that fell into a vessel.

    Attributes:
        radius_m: The ball's radius, chosen to fit; 0 if the object has no hollow open upwards.
        is_inside: The ball lies in the vessel, and the vessel still stands upright.
    """

    radius_m: float
    is_inside: bool


def _stage(item: "CatalogueObject") -> mjcf.RootElement:
    """Return table and object, the object free to move; without what is only seen."""
    root = build_tabletop("drop_test")
    root.option.flag.sleep = "disable"
    tree = build_object(item, name="dropped")
    for geom in tree.find_all("geom"):
        if geom.contype == 0 and geom.conaffinity == 0:
            geom.remove()
    frame = root.attach(tree)
    frame.pos = (*SPOT, 0)
    frame.add("freejoint")
    return root


def _compile(root: mjcf.RootElement) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())


def _motion(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> tuple[float, float]:
    """Return speed of the centre of mass, m/s, and angular speed, rad/s."""
    velocity = np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, body, velocity, 0)
    return math.hypot(*velocity[3:]), math.hypot(*velocity[:3])


def _sink(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    table = model.geom(TABLE_GEOM).id
    on_table = (data.contact.geom == table).any(axis=1)
    return -float(data.contact.dist[on_table].min(initial=0))


def _drop(model: mujoco.MjModel, turn: Rotation, lowest_m: float) -> Rest:
    """Drop the object of a stage once; see `drop_object`."""
    data = mujoco.MjData(model)
    body = model.body("dropped/object").id
    data.qpos[2:7] = DROP_M - lowest_m, *turn.as_quat(scalar_first=True)
    mujoco.mj_forward(model, data)
    start = data.xipos[body, :2].copy()
    settle_s, watched = 0.0, []
    while data.time < MAX_SETTLE_S + WATCH_S:
        mujoco.mj_step(model, data)
        speed, spin = _motion(model, data, body)
        watched.append((speed, spin, _sink(model, data)))
        if speed >= MAX_SPEED_M_S or spin >= MAX_SPIN_RAD_S:
            settle_s = data.time
    num_watched = round(WATCH_S / model.opt.timestep)
    fastest, fastest_spin, deepest = np.max(watched[-num_watched:], axis=0).tolist()
    return Rest(
        settle_s=settle_s,
        speed_m_s=fastest,
        spin_rad_s=fastest_spin,
        sink_m=deepest,
        wandered_m=float(np.linalg.norm(data.xipos[body, :2] - start)),
        up=float(data.xmat[body][8]),
    )


def drop_object(item: "CatalogueObject") -> dict[str, Rest]:
    """Drop an object on the table from 2 cm in each of four orientations.

    Args:
        item: The object.

    Returns:
        How it came to rest, by name of the orientation.
    """
    model = _compile(_stage(item))
    return {
        name: _drop(model, turn, float((item.vertices @ turn.as_matrix()[2]).min()))
        for name, turn in ORIENTATIONS.items()
    }


def _find_hollow(item: "CatalogueObject") -> tuple[np.ndarray, float]:
    """Return the centre (2,) of the widest hollow seen from above, and its inner radius, metres.

    A hollow is where a ray from above passes 45 % of the height before it meets the object.
    """
    model = _compile(_stage(item))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    low, high = item.vertices.min(axis=0), item.vertices.max(axis=0)
    cell = float((high - low)[:2].max()) / _GRID
    xs, ys = (np.arange(low[k], high[k] + cell, cell) for k in (0, 1))
    deep = np.zeros((len(xs), len(ys)), bool)
    hit = np.zeros(1, np.int32)
    table = model.geom(TABLE_GEOM).id
    for i, j in np.ndindex(deep.shape):
        above = np.array([SPOT[0] + xs[i], SPOT[1] + ys[j], high[2] + 0.1])
        way = mujoco.mj_ray(model, data, above, np.array([0, 0, -1.0]), None, 1, -1, hit)
        deep[i, j] = hit[0] != table and way - 0.1 > 0.45 * high[2]
    clear = np.asarray(ndimage.distance_transform_edt(np.pad(deep, 1)))[1:-1, 1:-1]
    i, j = np.unravel_index(int(np.argmax(clear)), clear.shape)
    return np.array([xs[i], ys[j]]), float(clear[i, j]) * cell


def drop_ball(item: "CatalogueObject") -> BallDrop:
    """Drop a glass ball into an object that stands upright on the table.

    The ball falls from 5 cm above the rim, a fifth of its radius off the hollow's centre.

    Args:
        item: The object.

    Returns:
        What became of the ball.
    """
    center, clear = _find_hollow(item)
    radius = min(_BALL_MAX_RADIUS_M, _BALL_FIT * clear)
    if radius < 0.002:
        return BallDrop(radius_m=0.0, is_inside=False)
    root = _stage(item)
    top = float(item.vertices[:, 2].max())
    spot = (*(np.array(SPOT) + center + radius / 5), top + 0.05)
    ball = root.worldbody.add("body", name="ball", pos=spot)
    ball.add("freejoint")
    mass = _GLASS_KG_M3 * 4 / 3 * np.pi * radius**3
    ball.add("geom", type="sphere", size=[radius], mass=mass, condim=6, friction=ROLLING_FRICTION)
    model = _compile(root)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, round(2.0 / model.opt.timestep))
    vessel = data.body("dropped/object")
    turn = vessel.xmat.reshape(3, 3)
    local = turn.T @ (data.body("ball").xpos - vessel.xpos)
    within = np.all(np.abs(local[:2] - center) < clear) and 0 < local[2] < top
    return BallDrop(radius_m=radius, is_inside=bool(within and turn[2, 2] > 0.99))


def is_vessel(item: "CatalogueObject") -> bool:
    """Tell whether an object is said to hold other things.

    Args:
        item: The object.

    Returns:
        True for containers, cups and whatever has that function.
    """
    return item.words.category in _VESSELS or "hold other things" in item.words.functions


def find_faults(rests: dict[str, Rest], ball: BallDrop | None = None) -> list[str]:
    """List what an object's drop tests show to be wrong.

    Args:
        rests: From `drop_object`.
        ball: From `drop_ball`, for a vessel.

    Returns:
        One phrase a fault; empty for a sound object.
    """
    faults = []
    for name, rest in rests.items():
        if rest.speed_m_s >= MAX_SPEED_M_S:
            faults.append(f"{name}: still moves at {1e3 * rest.speed_m_s:.2f} mm/s")
        if rest.spin_rad_s >= MAX_SPIN_RAD_S:
            faults.append(f"{name}: still turns at {rest.spin_rad_s:.3f} rad/s")
        if rest.sink_m > MAX_SINK_M:
            faults.append(f"{name}: sinks {1e3 * rest.sink_m:.2f} mm into the table")
    if ball is not None and not ball.is_inside:
        faults.append("the ball leaves it" if ball.radius_m else "it has no hollow open upwards")
    return faults
