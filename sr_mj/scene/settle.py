"""Drops objects onto the table and lets them come to rest, in simulated time."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from models.workspace import Workspace
from sr_mj.errors import SceneError

DROP_HEIGHT_M = 0.2
_DROP_INTERVAL_S = 0.35
_CHECK_INTERVAL_S = 0.05
_CALM_LINEAR, _CALM_ANGULAR = 0.002, 0.05  # m/s and rad/s
_CALM_FOR_S = 0.2
_SETTLE_LIMIT_S = 6.0
_REDROP_HEIGHT_M = 0.02
_MAX_REDROPS = 40
_RELEASE_SPEED = 0.01  # m/s


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

    def drop(self, body: FreeBody, pose: Drop) -> None:
        """Release one object and simulate until the next one may follow.

        Args:
            body: The object.
            pose: Where it starts; raised as far as needed to start free of contact.
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
        # Falling objects do not creep: the no-slip pass would double the time for nothing.
        passes = self._model.opt.noslip_iterations
        self._model.opt.noslip_iterations = 0
        self._simulate(_DROP_INTERVAL_S)
        self._model.opt.noslip_iterations = passes

    def wait_until_calm(self) -> float:
        """Simulate until no object moves any more.

        Returns:
            Simulated seconds it took; at most the limit of 6 s, after which slow motion is
            accepted (a ball may roll on for long).

        Raises:
            SceneError: If the simulation became unstable.
        """
        start, calm = self._data.time, 0.0
        dofs = np.concatenate([np.r_[body.qvel] for body in self._bodies])
        while calm < _CALM_FOR_S and self._data.time - start < _SETTLE_LIMIT_S:
            self._simulate(_CHECK_INTERVAL_S)
            speed = np.abs(self._data.qvel[dofs]).reshape(-1, 2, 3).max(axis=(0, 2))
            still = speed[0] < _CALM_LINEAR and speed[1] < _CALM_ANGULAR
            calm = calm + _CHECK_INTERVAL_S if still else 0.0
        return self._data.time - start

    def outside(self) -> list[FreeBody]:
        """List the objects that rest outside the workspace or fell off the table."""
        positions = np.array([self._data.xipos[body.body_id] for body in self._bodies])
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
        by_name = {body.name: body for body in self._bodies}
        for name, qpos in self._waiting.items():
            self._data.qpos[by_name[name].qpos] = qpos
            self._data.qvel[by_name[name].qvel] = 0

    def _simulate(self, seconds: float) -> None:
        chunk = round(_CHECK_INTERVAL_S / self._model.opt.timestep)
        for _ in range(round(seconds / _CHECK_INTERVAL_S)):
            self._hold_waiting()
            mujoco.mj_step(self._model, self._data, chunk)
        check_stable(self._data)


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
