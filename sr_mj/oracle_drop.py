"""Whether an object stays where it is let go, tried out in a copy of the scene; for the oracle."""

from dataclasses import replace

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from models.robot import TOOL_SITE_NAME
from policy.actions import ActionCandidates
from sr_mj.scene import Scene
from sr_mj.scene.layout import state_at_rest
from sr_mj.scene.placement import find_object, is_placed, place_region

_FALL_S = 1.5
_MAX_DROPS = 12
_FAILED = -5.0
_WAKING_SPEED = 0.01


def rule_out_falls(
    scene: Scene, moved: str, candidates: ActionCandidates, scores: np.ndarray, least: float
) -> np.ndarray:
    """Lower the scores of places at which the object would not stay.

    The best place is tried by letting the object fall from there, without the gripper; if that
    fails, the next one, until one holds.

    Args:
        scene: The scene, with the object in the gripper; left as it is.
        moved: Name of that object.
        candidates: K places.
        scores: (K,) how good they are otherwise.
        least: Score from which on a place is worth a try.

    Returns:
        (K,) scores, 5 lower where the object fell or rolled away.
    """
    scores = np.array(scores, float)
    for index in np.argsort(-scores, kind="stable")[:_MAX_DROPS]:
        if scores[index] < least or stays(scene, moved, candidates.Ts_world_tool[index]):
            break
        scores[index] += _FAILED
    return scores


def stays(scene: Scene, moved: str, T_world_tool: np.ndarray) -> bool:
    """Let an object fall from where a place would release it.

    Args:
        scene: The scene, with the object in the gripper and a place to put it; left as it is.
        moved: Name of that object.
        T_world_tool: (4, 4) pose of the tool at the release.

    Returns:
        Whether it then satisfies the goal.
    """
    place, model = scene.goal.place, scene.model
    assert place is not None
    regions = [place_region(scene, place.relation, name, moved=moved) for name in place.references]
    tool = np.eye(4)
    tool[:3, :3] = scene.data.site(TOOL_SITE_NAME).xmat.reshape(3, 3)
    tool[:3, 3] = scene.data.site(TOOL_SITE_NAME).xpos
    pose = T_world_tool @ np.linalg.inv(tool) @ scene.T_world_object(moved)
    body, qpos = find_object(scene, moved).body, scene.data.qpos.copy()
    qpos[body.qpos] = [*pose[:3, 3], *Rotation.from_matrix(pose[:3, :3]).as_quat(scalar_first=True)]
    data = state_at_rest(model, qpos)
    # What is at rest may be asleep, and would stay in the air.
    data.qvel[body.dof_adr + 2] = -_WAKING_SPEED
    mujoco.mj_step(model, data, round(_FALL_S / model.opt.timestep))
    after = replace(scene, data=data)
    return any(is_placed(after, moved, region) for region in regions)
