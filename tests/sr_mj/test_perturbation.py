import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from policy.actions import ActionCandidates
from sr_mj.errors import ConfigError
from sr_mj.perturbation import PosePerturbation


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
    before = candidates(4000)
    perturbation = PosePerturbation(sigma_m=0.01, sigma_deg=5)
    after = perturbation.apply(before, np.random.default_rng(2))
    shift = after.positions - before.positions
    turns = after.Ts_world_tool[:, :3, :3] @ before.Ts_world_tool[:, :3, :3].transpose(0, 2, 1)
    rotvec = np.degrees(Rotation.from_matrix(turns).as_rotvec())
    # Four standard errors of a standard deviation from 4000 draws.
    np.testing.assert_allclose(shift.std(axis=0), 0.01, rtol=4 / np.sqrt(8000))
    np.testing.assert_allclose(rotvec.std(axis=0), 5, rtol=4 / np.sqrt(8000))
    np.testing.assert_allclose(shift.mean(axis=0), 0, atol=4 * 0.01 / np.sqrt(4000))
    assert after.kind == "place"
    np.testing.assert_array_equal(after.width_m, before.width_m)
    np.testing.assert_array_equal(after.prior, before.prior)


def test_the_two_errors_are_drawn_independently():
    both = PosePerturbation(sigma_m=0.01, sigma_deg=5)
    only_position = PosePerturbation(sigma_m=0.01)
    first, second = (
        p.apply(candidates(5), np.random.default_rng(3)) for p in (both, only_position)
    )
    np.testing.assert_array_equal(first.positions, second.positions)
    np.testing.assert_allclose(
        second.Ts_world_tool[:, :3, :3], candidates(5).Ts_world_tool[:, :3, :3], atol=1e-12
    )


def test_no_error_and_no_candidates():
    poses = candidates(3)
    same = PosePerturbation().apply(poses, np.random.default_rng(0))
    np.testing.assert_allclose(same.Ts_world_tool, poses.Ts_world_tool, atol=1e-12)
    assert len(PosePerturbation(sigma_m=0.01).apply(candidates(0), np.random.default_rng(0))) == 0


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
