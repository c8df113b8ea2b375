"""Whether an arrangement can be solved: by the oracle in physics, or by dropping into the place."""

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from perception.lifter import MultiViewLifter
from sr_mj.assemble import assembled, make_policy
from sr_mj.episode import DEFAULT_ATTEMPTS, run_episode
from sr_mj.scene import Scene
from sr_mj.scene.layout import state_at_rest
from sr_mj.scene.placement import PlaceRegion, find_object, is_placed, touched_bodies

_NUM_DROPS = 4
_RAISE_M = 0.005
_MAX_HEIGHT_M = 0.3
_REST_S = 2.0
_TILT_RAD = np.radians(4)


def oracle_attempts(scene: Scene, lifter: MultiViewLifter, seed: int) -> int | None:
    """Run an episode of the oracle.

    Args:
        scene: The scene; its state changes.
        lifter: Perception stage.
        seed: Seed of noise and candidates.

    Returns:
        The attempt, from 1, that held a target; None if none of eight did.
    """
    policy = make_policy("oracle", scene)
    with assembled(scene, lifter=lifter, policy=policy) as pipeline:
        attempts = run_episode(scene, pipeline, seed=seed, max_attempts=DEFAULT_ATTEMPTS)
        picks = [attempt for attempt in attempts if attempt.kind == "pick"]
    return len(picks) if picks[-1].outcome.success else None


def holds_when_put_down(
    scene: Scene, moved: str, region: PlaceRegion, rng: np.random.Generator
) -> bool:
    """Tell whether an object let go of just above a region stays there.

    Args:
        scene: The scene; left as it was when it was made.
        moved: Name of the object.
        region: Where to put it.
        rng: Draws places and headings.

    Returns:
        Whether each of four drops, from a little above and a little tilted, satisfies the
        protocol's rule.
    """
    holds = not region.area.is_empty
    for center in region.sample(rng, _NUM_DROPS):
        tilt = rng.uniform(-_TILT_RAD, _TILT_RAD, 2)
        turn = Rotation.from_euler("zxy", [rng.uniform(-np.pi, np.pi), *tilt])
        _put_down(scene, moved, center, turn)
        holds = is_placed(scene, moved, region)
        if not holds:
            break
    _restore(scene)
    return holds


def _restore(scene: Scene) -> None:
    fresh = state_at_rest(scene.model, scene.settled_qpos)
    mujoco.mj_copyData(scene.data, scene.model, fresh)


def _put_down(scene: Scene, moved: str, center: np.ndarray, turn: Rotation) -> None:
    """Let go of an object, turned from how it lies, a little above where it touches nothing."""
    _restore(scene)
    body = find_object(scene, moved).body
    qpos = scene.data.qpos[body.qpos]
    offset = turn.apply(scene.data.xipos[body.body_id] - qpos[:3])
    qpos[3:] = (turn * Rotation.from_quat(qpos[3:], scalar_first=True)).as_quat(scalar_first=True)
    qpos[:2] = center - offset[:2]
    while touched_bodies(scene, moved) and qpos[2] < _MAX_HEIGHT_M:
        qpos[2] += _RAISE_M
    qpos[2] += _RAISE_M
    # A body at rest may be asleep, and would stay in the air.
    scene.data.qvel[body.dof_adr + 2] = -0.01
    mujoco.mj_step(scene.model, scene.data, round(_REST_S / scene.model.opt.timestep))
