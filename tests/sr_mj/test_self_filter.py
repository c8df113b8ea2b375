import numpy as np
import pytest

from models.cameras import camera_preset
from models.tabletop import BIN_CENTER
from models.ur5 import HOME_QPOS
from models.workspace import GRASP_WORKSPACE, PICK_PLACE_WORKSPACE
from sr_mj.planning import Planner
from sr_mj.planning.body import RobotBody
from sr_mj.scene import SceneConfig, make_scene
from sr_mj.self_filter import hide_robot
from sr_mj.sensors.capture import capture_views
from sr_mj.sensors.l515 import L515NoiseConfig
from sr_mj.sensors.renderer import CameraRig

OVER_BIN = np.diag([1.0, -1.0, -1.0, 1.0])
OVER_BIN[:3, 3] = (*BIN_CENTER[:2], 0.32)


@pytest.fixture(scope="module")
def over_bin():
    """Joint angles (6,) over the bin, and the views of an empty table from there."""
    import mujoco

    scene = make_scene(SceneConfig(scene="empty"))
    posture = Planner().postures_over_bin[0]
    scene.data.qpos[:6] = posture
    mujoco.mj_forward(scene.model, scene.data)
    with CameraRig(scene.model, camera_preset("sr")) as rig:
        rng = np.random.default_rng(0)
        return posture, capture_views(rig, scene.data, L515NoiseConfig(), rng)


def points_of(view):
    rows, columns = np.nonzero(view.depth_m)
    depth = view.depth_m[rows, columns].astype(float)
    i = view.intrinsics
    local = np.stack([(columns - i.cx) / i.fx * depth, (rows - i.cy) / i.fy * depth, depth], axis=1)
    return local @ view.T_world_cam_cv[:3, :3].T + view.T_world_cam_cv[:3, 3]


def num_above_table(views, workspace):
    points = np.concatenate([points_of(view) for view in views])
    low, high = np.add(workspace.lower, [0, 0, 0.03]), np.array(workspace.upper)
    return int(np.all((points > low) & (points < high), axis=1).sum())


def test_the_arm_over_the_workspace_disappears(over_bin):
    posture, views = over_bin
    before = num_above_table(views, PICK_PLACE_WORKSPACE)
    hidden = hide_robot(views, RobotBody(), posture, PICK_PLACE_WORKSPACE)
    assert before > 1000
    assert num_above_table(hidden, PICK_PLACE_WORKSPACE) < before / 200


def test_nothing_else_does(over_bin):
    posture, views = over_bin
    for view, left in zip(
        views, hide_robot(views, RobotBody(), posture, PICK_PLACE_WORKSPACE), strict=True
    ):
        changed = view.depth_m != left.depth_m
        assert np.all(left.depth_m[changed] == 0)
        assert left.rgb is view.rgb or np.array_equal(left.rgb, view.rgb)
    table = [np.abs(points_of(v)[:, 2]) < 0.01 for v in views]
    kept = [
        np.abs(points_of(v)[:, 2]) < 0.01
        for v in hide_robot(views, RobotBody(), posture, PICK_PLACE_WORKSPACE)
    ]
    assert sum(k.sum() for k in kept) > 0.99 * sum(t.sum() for t in table)


def test_views_without_the_arm_stay_as_they_are(over_bin):
    _, views = over_bin
    for workspace in (GRASP_WORKSPACE, PICK_PLACE_WORKSPACE):
        same = hide_robot(views, RobotBody(), HOME_QPOS, workspace)
        assert all(a is b for a, b in zip(views, same, strict=True))
