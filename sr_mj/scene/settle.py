"""Drops objects onto the table and lets them come to rest, in simulated time."""

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from models.workspace import Workspace
from sr_mj.errors import SceneError

_logger = logging.getLogger(__name__)

DROP_HEIGHT_M = 0.2
_DROP_INTERVAL_S = 0.25
_FENCE_INSET_M, _FENCE_INTERVAL_S = 0.015, 0.01
_CHECK_INTERVAL_S = 0.05
_CALM_LINEAR, _CALM_ANGULAR = 0.001, 0.05  # m/s and rad/s
_CALM_FOR_S = 0.1
_FREE_LIMIT_S, _THICK_LIMIT_S, _LAST_LIMIT_S = 1.0, 1.0, 2.0
_HONEY = 0.7  # share of speed kept over 10 ms
_REDROP_HEIGHT_M = 0.02
_MAX_REDROPS = 40
_RELEASE_SPEED, _PUSH_SPEED = 0.01, 0.15  # m/s


@dataclass(frozen=True, kw_only=True)
class FreeBody:
    """Where the state of a free-floating body lives in a compiled model.

    Attributes:
        name: Name of the object.
        body_id: Body in the model.
        qpos_adr: First of its 7 entries in qpos (x y z, quaternion wxyz).
        dof_adr: First of its 6 entries in qvel.
        bottom_m: How far its frame's origin lies above its lowest point in its rest pose.
        radius_m: Distance of its farthest point from the frame's origin.
    """

    name: str
    body_id: int
    qpos_adr: int
    dof_adr: int
    bottom_m: float
    radius_m: float

    @property
    def qpos(self) -> slice:
        """Its entries in qpos."""
        return slice(self.qpos_adr, self.qpos_adr + 7)

    @property
    def qvel(self) -> slice:
        """Its entries in qvel."""
        return slice(self.dof_adr, self.dof_adr + 6)


@dataclass(frozen=True, kw_only=True)
class Drop:
    """The pose from which an object falls.

    Attributes:
        position: (3,) metres, world.
        quat_wxyz: (4,) orientation.
    """

    position: np.ndarray
    quat_wxyz: np.ndarray


def heap_drop(
    center: tuple[float, float],
    half_m: float,
    rng: np.random.Generator,
    height_m: float = DROP_HEIGHT_M,
) -> Drop:
    """Draw a drop pose over a heap: anywhere in a square, in any orientation.

    Args:
        center: x, y of the square's centre, metres.
        half_m: Half its width, metres.
        rng: Source of randomness.
        height_m: Height of the object's frame over the table.

    Returns:
        The pose.
    """
    xy = rng.uniform(-half_m, half_m, 2) + center
    quat = Rotation.random(rng=rng).as_quat(scalar_first=True)
    return Drop(position=np.array([*xy, height_m]), quat_wxyz=quat)


class Settler:
    """Drops the objects of one scene; those that wait hover where the model's `qpos0` has them.

    While it simulates, a soft fence stands just inside the workspace: an object whose centre of
    mass is outside loses its spin and is pushed back slowly. The fence is no geom, so nothing
    can lean on it and the model stays as it is.

    Args:
        model: Compiled scene.
        data: Its state, robot at home; changed in place.
        bodies: The objects, in the order in which they drop.
        workspace: Where they have to end up, seen from above.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        bodies: Sequence[FreeBody],
        workspace: Workspace,
    ) -> None:
        """Remember where every object waits."""
        self._model, self._data = model, data
        self._bodies = tuple(bodies)
        self._workspace = workspace
        self._waiting = {body.name: model.qpos0[body.qpos].copy() for body in self._bodies}
        self._body_ids = np.array([body.body_id for body in self._bodies], int)
        self._dofs = np.array([np.r_[body.qvel] for body in self._bodies], int).reshape(-1, 6)
        self._fence = np.array([workspace.lower[:2], workspace.upper[:2]])
        self._fence += _FENCE_INSET_M * np.array([[1], [-1]])

    def drop(self, body: FreeBody, pose: Drop) -> None:
        """Release one object and simulate until the next one may follow.

        Args:
            body: The object.
            pose: Where it starts; raised as far as needed to start free of contact.

        Raises:
            SceneError: If the simulation became unstable.
        """
        self._waiting.pop(body.name, None)
        qpos = self._data.qpos[body.qpos]
        qpos[:3], qpos[3:] = pose.position, pose.quat_wxyz
        self._data.qvel[body.qvel] = 0
        self._hold_waiting()
        mujoco.mj_forward(self._model, self._data)
        while self._touches(body):
            qpos[2] += 0.03
            mujoco.mj_forward(self._model, self._data)
        # Moving, if only just: a body asleep on the table would go on sleeping in the air.
        self._data.qvel[body.dof_adr + 2] = -_RELEASE_SPEED
        with _creeping(self._model):
            self._simulate(_DROP_INTERVAL_S)

    def wait_until_calm(self) -> float:
        """Simulate until no object moves any more.

        Most of it without the no-slip pass, which triples the time and only matters to what
        hardly moves. What still moves after a second (a ball that rolls, a trembling heap) does so
        through honey for another; the rest of the way nothing helps.

        Returns:
            Simulated seconds it took; at most the limit of 4 s, after which slow motion is
            accepted.

        Raises:
            SceneError: If the simulation became unstable.
        """
        start = self._data.time
        with _creeping(self._model):
            self._run_until_calm(_FREE_LIMIT_S)
            self._run_until_calm(_THICK_LIMIT_S, keep=_HONEY)
        # Without fence and honey, so that nothing rests on either.
        self._run_until_calm(_LAST_LIMIT_S, fence=False)
        return self._data.time - start

    def outside(self) -> list[FreeBody]:
        """List the objects that rest outside the workspace or fell off the table."""
        positions = self._data.xipos[self._body_ids]
        inside = self._workspace.contains_xy(positions) & (positions[:, 2] > -0.01)
        return [body for body, ok in zip(self._bodies, inside, strict=True) if not ok]

    def recover(self, center: tuple[float, float], half_m: float, rng: np.random.Generator) -> None:
        """Drop again whatever came to rest outside the workspace, from just above what lies there.

        From the full height a ball would bounce off the heap again and again.

        Args:
            center: x, y about which to drop, metres.
            half_m: Half width of the square to drop in, metres.
            rng: Source of randomness.

        Raises:
            SceneError: If some object still will not stay.
        """
        for _ in range(_MAX_REDROPS):
            self.wait_until_calm()
            lost = self.outside()
            if not lost:
                return
            for body in lost:
                _logger.debug("Dropping %r again: it came to rest outside.", body.name)
                self.drop(body, heap_drop(center, half_m / 2, rng, _REDROP_HEIGHT_M))
        names = ", ".join(body.name for body in lost)
        raise SceneError(
            f"After {_MAX_REDROPS} tries these objects still do not stay in the workspace: {names}."
            " Use another seed, fewer objects or a larger workspace."
        )

    def _touches(self, body: FreeBody) -> bool:
        geoms = self._data.contact.geom[: self._data.ncon]
        return bool(np.any(self._model.geom_bodyid[geoms] == body.body_id))

    def _hold_waiting(self) -> None:
        for body in self._bodies:
            if (qpos := self._waiting.get(body.name)) is not None:
                self._data.qpos[body.qpos] = qpos
                self._data.qvel[body.qvel] = 0

    def _push_back(self) -> None:
        xy = self._data.xipos[self._body_ids, :2]
        inward = (xy < self._fence[0]).astype(float) - (xy > self._fence[1])
        out = np.any(inward, axis=1)
        # Falling goes on; spin would only carry a ball further.
        velocity = self._data.qvel[self._dofs[out]]
        velocity[:, :2], velocity[:, 3:] = _PUSH_SPEED * inward[out], 0
        self._data.qvel[self._dofs[out]] = velocity

    def _run_until_calm(self, limit_s: float, *, keep: float = 1.0, fence: bool = True) -> None:
        calm = 0.0
        for _ in range(round(limit_s / _CHECK_INTERVAL_S)):
            self._simulate(_CHECK_INTERVAL_S, keep=keep, fence=fence)
            speed = np.abs(self._data.qvel[self._dofs])
            still = np.all(speed[:, :3] < _CALM_LINEAR) and np.all(speed[:, 3:] < _CALM_ANGULAR)
            calm = calm + _CHECK_INTERVAL_S if still else 0.0
            if calm >= _CALM_FOR_S:
                return

    def _simulate(self, seconds: float, *, keep: float = 1.0, fence: bool = True) -> None:
        """Simulate; every 10 ms the objects keep only a share of their speed."""
        chunk = round(_FENCE_INTERVAL_S / self._model.opt.timestep)
        for _ in range(round(seconds / _FENCE_INTERVAL_S)):
            self._hold_waiting()
            if fence:
                self._push_back()
            self._data.qvel[self._dofs] *= keep
            mujoco.mj_step(self._model, self._data, chunk)
        check_stable(self._data)


@contextmanager
def _creeping(model: mujoco.MjModel) -> Iterator[None]:
    """Leave the no-slip pass out; it would triple the time for nothing while objects move."""
    passes = model.opt.noslip_iterations
    model.opt.noslip_iterations = 0
    try:
        yield
    finally:
        model.opt.noslip_iterations = passes


def check_stable(data: mujoco.MjData) -> None:
    """Raise if MuJoCo reported that the simulation became unstable.

    Args:
        data: State of a simulation.

    Raises:
        SceneError: If positions, velocities or accelerations diverged since the last reset.
    """
    kinds = (
        mujoco.mjtWarning.mjWARN_BADQPOS,
        mujoco.mjtWarning.mjWARN_BADQVEL,
        mujoco.mjtWarning.mjWARN_BADQACC,
    )
    for kind in kinds:
        if data.warning[kind].number:
            raise SceneError(
                f"The simulation became unstable ({kind.name} at {data.time:.3f} s). Use another "
                "seed, or a smaller time step."
            )
