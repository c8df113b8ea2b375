import numpy as np
import pytest

from sr_mj.errors import ConfigError
from sr_mj.trajectory import MotionLimits, time_waypoints

LIMITS = MotionLimits(speed=1.5, acceleration=6.0)


def random_waypoints(seed, num):
    return np.random.default_rng(seed).uniform(-2, 2, (num, 6))


@pytest.mark.parametrize("num", [2, 3, 12])
@pytest.mark.parametrize("seed", range(3))
def test_limits_hold_everywhere(seed, num):
    trajectory = time_waypoints(random_waypoints(seed, num), LIMITS)
    times = np.linspace(0, trajectory.duration_s, 20001)
    qpos, qvel = trajectory.sample(times)
    qacc = np.gradient(qvel, times, axis=0)
    assert np.abs(qvel).max() <= LIMITS.speed * (1 + 1e-6)
    assert np.abs(qacc[2:-2]).max() <= LIMITS.acceleration * (1 + 1e-3)
    np.testing.assert_allclose(np.gradient(qpos, times, axis=0)[2:-2], qvel[2:-2], atol=1e-4)


def test_starts_and_ends_at_rest_at_the_outer_waypoints_and_passes_the_others():
    waypoints = random_waypoints(0, 5)
    trajectory = time_waypoints(waypoints, LIMITS)
    qpos, qvel = trajectory.sample(
        np.array([0.0, trajectory.duration_s, 2 * trajectory.duration_s])
    )
    np.testing.assert_allclose(qpos, waypoints[[0, -1, -1]], atol=1e-12)
    np.testing.assert_allclose(qvel, 0, atol=1e-12)
    dense, _ = trajectory.sample(np.linspace(0, trajectory.duration_s, 20001))
    for waypoint in waypoints:
        assert np.abs(dense - waypoint).max(axis=1).min() < 1e-3


def test_two_waypoints_move_as_fast_as_the_binding_limit_allows():
    far = time_waypoints(
        np.array([np.zeros(6), np.full(6, 3.0)]), MotionLimits(speed=1, acceleration=50)
    )
    _, qvel = far.sample(np.linspace(0, far.duration_s, 1001))
    assert np.abs(qvel).max() == pytest.approx(1.0, rel=5e-3)


def test_coinciding_waypoints_take_no_time():
    trajectory = time_waypoints(np.ones((3, 6)), LIMITS)
    assert trajectory.duration_s == 0
    qpos, qvel = trajectory.sample(np.array([0.0, 1.0]))
    np.testing.assert_array_equal(qpos, 1.0)
    np.testing.assert_array_equal(qvel, 0.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: MotionLimits(speed=0), "Joint speed limit is 0 rad/s; expected more than 0 and at most 3.1416 (180 degrees/s)."),
        (lambda: MotionLimits(speed=4), "Joint speed limit is 4 rad/s; expected more than 0 and at most 3.1416 (180 degrees/s)."),
        (lambda: MotionLimits(acceleration=-1), "Joint acceleration limit is -1 rad/s^2; expected more than 0."),
        (lambda: time_waypoints(np.zeros((1, 6)), LIMITS), "Waypoints have shape (1, 6); expected (W, 6) with W >= 2."),
    ],
)  # fmt: skip
def test_bad_input(make, message):
    with pytest.raises(ConfigError) as error:
        make()
    assert str(error.value) == message
