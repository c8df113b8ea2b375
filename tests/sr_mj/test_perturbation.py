import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from policy.actions import ActionCandidates
from sr_mj.errors import ConfigError
from sr_mj.perturbation import PoseError, PosePerturbation, raised


def candidates(num):
    poses = np.tile(np.eye(4), (num, 1, 1))
    poses[:, :3, :3] = Rotation.random(num, rng=np.random.default_rng(0)).as_matrix()
    poses[:, :3, 3] = np.random.default_rng(1).uniform(0.2, 0.7, (num, 3))
    return ActionCandidates(
        kind="place",
        Ts_world_tool=poses,
        width_m=np.full(num, 0.03),
        prior=np.linspace(0, 1, num),
    )


def test_errors_have_the_stated_spread():
    perturbation, rng = PosePerturbation(sigma_m=0.01, sigma_deg=5), np.random.default_rng(2)
    errors = [perturbation.draw(rng) for _ in range(4000)]
    shift = np.array([error.shift_m for error in errors])
    turn = np.degrees([error.turn_rad for error in errors])
    # Four standard errors of a standard deviation from 4000 draws.
    np.testing.assert_allclose(shift.std(axis=0), 0.01, rtol=4 / np.sqrt(8000))
    np.testing.assert_allclose(turn.std(axis=0), 5, rtol=4 / np.sqrt(8000))
    np.testing.assert_allclose(shift.mean(axis=0), 0, atol=4 * 0.01 / np.sqrt(4000))
    # The six are independent of one another.
    correlation = np.corrcoef(np.hstack([shift, turn]).T)
    np.testing.assert_allclose(correlation, np.eye(6), atol=5 / np.sqrt(4000))


def test_an_error_moves_in_the_world_and_turns_about_the_tool_point():
    before, turn = candidates(6), np.radians([0, 0, 90])
    after = PoseError(shift_m=np.array([0.01, -0.02, 0.03]), turn_rad=turn).apply(before)
    np.testing.assert_allclose(after.positions - before.positions, [[0.01, -0.02, 0.03]] * 6)
    axes, turned = before.Ts_world_tool[:, :3, :3], after.Ts_world_tool[:, :3, :3]
    # A quarter turn about the world's vertical: x becomes y, and y becomes -x.
    np.testing.assert_allclose(turned[:, 0], -axes[:, 1], atol=1e-12)
    np.testing.assert_allclose(turned[:, 1], axes[:, 0], atol=1e-12)
    np.testing.assert_allclose(turned[:, 2], axes[:, 2], atol=1e-12)
    assert after.kind == "place"
    np.testing.assert_array_equal(after.width_m, before.width_m)
    np.testing.assert_array_equal(after.prior, before.prior)


def test_the_two_errors_are_drawn_independently():
    both, only_position = (
        PosePerturbation(sigma_m=0.01, sigma_deg=5),
        PosePerturbation(sigma_m=0.01),
    )
    first, second = (p.draw(np.random.default_rng(3)) for p in (both, only_position))
    np.testing.assert_array_equal(first.shift_m, second.shift_m)
    assert not second.turn_rad.any() and first.turn_rad.all()
    nothing = PosePerturbation().draw(np.random.default_rng(0)).apply(candidates(3))
    np.testing.assert_allclose(nothing.Ts_world_tool, candidates(3).Ts_world_tool, atol=1e-12)


def test_a_pose_is_raised_step_by_step():
    before = candidates(2)
    poses = raised(before.take(np.array([1])))
    np.testing.assert_array_equal(poses.Ts_world_tool[0], before.Ts_world_tool[1])
    rises = poses.positions - before.positions[1]
    np.testing.assert_allclose(rises[:, 2], np.arange(21) * 0.005, atol=1e-7)
    assert not rises[:, :2].any()
    assert (poses.width_m == before.width_m[1]).all() and poses.kind == "place"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"sigma_m": -0.01}, "Perturbation of positions is -1 cm; expected 0 to 10."),
        ({"sigma_m": 0.5}, "Perturbation of positions is 50 cm; expected 0 to 10."),
        ({"sigma_deg": -2}, "Perturbation of orientations is -2 degrees; expected 0 to 90."),
    ],
)
def test_bad_values(options, message):
    with pytest.raises(ConfigError) as caught:
        PosePerturbation(**options)
    assert str(caught.value) == message
