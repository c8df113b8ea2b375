import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from policy.actions import ActionCandidates
from sr_mj.memory import FailedGrasps
from sr_mj.outcome import Outcome, Reason


def pose(x, yaw_deg=0.0, tilt_deg=0.0):
    T = np.eye(4)
    turn = Rotation.from_euler("zx", [yaw_deg, 180 + tilt_deg], degrees=True)
    T[:3, :3], T[:3, 3] = turn.as_matrix(), [x, 0, 0.05]
    return T


def candidates(*poses):
    num = len(poses)
    return ActionCandidates(
        kind="pick",
        Ts_world_tool=np.array(poses),
        width_m=np.full(num, 0.03, np.float32),
        prior=np.arange(num, dtype=np.float32) / 10,
    )


def failed_at(T, reason=Reason.SLIPPED_CARRY):
    memory = FailedGrasps()
    memory.record(T, Outcome(success=False, reason=reason))
    return memory


@pytest.mark.parametrize(
    ("other", "is_repeat"),
    [
        (pose(0.5), True),
        (pose(0.51), True),
        (pose(0.52), False),
        (pose(0.5, yaw_deg=20), True),
        (pose(0.5, yaw_deg=40), False),
        (pose(0.5, yaw_deg=180), True),
        (pose(0.5, tilt_deg=40), False),
    ],
)
def test_repeats_are_left_out(other, is_repeat):
    left = failed_at(pose(0.5)).without(candidates(other, pose(0.6)))
    assert len(left) == (1 if is_repeat else 2)
    assert left.positions[-1, 0] == 0.6


def test_keeps_everything_if_only_repeats_remain():
    assert len(failed_at(pose(0.5)).without(candidates(pose(0.5), pose(0.505)))) == 2


def test_forgets_when_something_was_carried_away():
    memory = failed_at(pose(0.5))
    # Slipped or not, the fingers felt it to the end: the robot knows no more.
    memory.record(pose(0.6), Outcome(success=False, reason=Reason.SLIPPED_CARRY, felt_to_end=True))
    assert len(memory.without(candidates(pose(0.5), pose(0.6)))) == 2


def test_nothing_executed_is_nothing_to_remember():
    memory = FailedGrasps()
    memory.record(None, Outcome(success=False, reason=Reason.UNREACHABLE))
    assert len(memory.without(candidates(pose(0.5)))) == 1
