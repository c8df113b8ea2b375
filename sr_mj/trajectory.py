"""Smooth timed joint trajectories within velocity and acceleration limits."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline, PPoly

from models.ur5 import MAX_JOINT_SPEED
from sr_mj.errors import ConfigError

# Sampling of the time law, and the span over which the acceleration's steps are smeared.
_SAMPLE_S, _SMOOTH_S = 0.004, 0.08
_GRID_A_WAYPOINT, _LEAST_GRID, _LARGEST_GRID = 12, 60, 240
# Between the samples the limits could be exceeded by less than this.
_RESERVE = 1.002


@dataclass(frozen=True, kw_only=True)
class MotionLimits:
    """Limits on every joint.

    Attributes:
        speed: Largest joint speed, rad/s.
        acceleration: Largest joint acceleration, rad/s^2. Universal Robots publishes no limit for
            the UR5; 8 is our assumption, well under what the joints' torque allows.
    """

    speed: float = 0.9 * MAX_JOINT_SPEED
    acceleration: float = 8.0

    def __post_init__(self) -> None:
        """Check that both limits are positive and the speed is within the data sheet's."""
        if not 0 < self.speed <= MAX_JOINT_SPEED:
            raise ConfigError(
                f"Joint speed limit is {self.speed} rad/s; expected more than 0 and at most "
                f"{MAX_JOINT_SPEED:.4f} (180 degrees/s)."
            )
        if not self.acceleration > 0:
            raise ConfigError(
                f"Joint acceleration limit is {self.acceleration} rad/s^2; expected more than 0."
            )

    def scaled(self, factor: float) -> "MotionLimits":
        """Return limits for a motion slower by `factor` (0..1): speed by it, acceleration too."""
        return MotionLimits(speed=self.speed * factor, acceleration=self.acceleration * factor)


@dataclass(frozen=True, kw_only=True, eq=False)
class Trajectory:
    """A motion from rest to rest through joint waypoints.

    Attributes:
        path: Cubic spline over the path parameter 0..1 -> (6,) joint angles, rad.
        law: Path parameter over time, seconds; it rises from 0 to 1 and is at rest at both ends.
        duration_s: Time it takes, seconds.
    """

    path: PPoly
    law: PPoly
    duration_s: float

    @property
    def start(self) -> np.ndarray:
        """First waypoint (6,)."""
        return self.path(0.0)

    @property
    def end(self) -> np.ndarray:
        """Last waypoint (6,)."""
        return self.path(1.0)

    def sample(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Evaluate the motion.

        Args:
            times: (T,) seconds since its start; times past the end give the end at rest.

        Returns:
            Joint angles (T, 6) in rad and joint velocities (T, 6) in rad/s.
        """
        times = np.clip(np.asarray(times, float), 0, self.duration_s)
        s = np.clip(self.law(times), 0, 1)
        return self.path(s), self.path(s, 1) * self.law(times, 1)[:, None]


def time_waypoints(waypoints: np.ndarray, limits: MotionLimits) -> Trajectory:
    """Fit a smooth path through joint waypoints and time it within the limits.

    Along the path the motion is as fast as the limits allow everywhere, with the steps of its
    acceleration smeared over 80 ms.

    Args:
        waypoints: (W, 6) joint angles, rad; W >= 2.
        limits: Speed and acceleration limits, which hold for every joint at every time.

    Returns:
        The trajectory; it takes no time if the waypoints coincide.

    Raises:
        ConfigError: If there are fewer than two waypoints.
    """
    waypoints = np.asarray(waypoints, float)
    if waypoints.ndim != 2 or len(waypoints) < 2:
        raise ConfigError(f"Waypoints have shape {waypoints.shape}; expected (W, 6) with W >= 2.")
    path = fit_path(waypoints)
    if np.abs(waypoints - waypoints[0]).max() < 1e-9:
        still = CubicHermiteSpline([0.0, 1.0], [0.0, 0.0], [0.0, 0.0])
        return Trajectory(path=path, law=still, duration_s=0.0)
    num = int(np.clip(_GRID_A_WAYPOINT * len(waypoints), _LEAST_GRID, _LARGEST_GRID)) + 1
    times, speed = _fastest(path, np.linspace(0, 1, num), limits)
    law = _smoothed_law(times, speed)
    duration = float(law.x[-1])
    stretch = float(_RESERVE * _excess(path, law, limits))
    law = PPoly(law.c / stretch ** np.arange(3, -1, -1)[:, None], law.x * stretch)
    return Trajectory(path=path, law=law, duration_s=duration * stretch)


def fit_path(waypoints: np.ndarray) -> PPoly:
    """Fit a cubic spline through waypoints (W, 6), over 0..1 by their distance from each other."""
    steps = np.linalg.norm(np.diff(waypoints, axis=0), axis=1)
    waypoints, steps = waypoints[np.r_[True, steps > 1e-9]], steps[steps > 1e-9]
    if len(waypoints) == 1:
        waypoints, steps = np.repeat(waypoints, 2, axis=0), np.ones(1)
    knots = np.r_[0, np.cumsum(steps)] / steps.sum()
    knots[-1] = 1.0
    return CubicSpline(knots, waypoints, bc_type="natural")


def _fastest(path: PPoly, grid: np.ndarray, limits: MotionLimits) -> tuple[np.ndarray, np.ndarray]:
    """Find the greatest speed along the path; times and path speeds (G,) at the grid's points.

    The squared speed x is bounded by both limits where the path bends, and may rise and fall only
    as the acceleration limit leaves room for: q'' = path'' x + path' x'/2.
    """
    slope, bend = np.abs(path(grid, 1)), np.abs(path(grid, 2))
    slope = np.maximum(slope, 1e-9)
    highest = np.minimum(
        ((limits.speed / slope) ** 2).min(axis=1),
        (limits.acceleration / np.maximum(bend, 1e-9)).min(axis=1),
    )
    highest[[0, -1]] = 0
    step = grid[1] - grid[0]
    squared = highest
    for direction in (1, -1):
        squared = _limit_rise(
            squared[::direction], slope[::direction], bend[::direction], limits, step
        )[::direction]
    speed = np.sqrt(squared)
    return np.r_[0, np.cumsum(2 * step / (speed[:-1] + speed[1:]))], speed


def _limit_rise(
    squared: np.ndarray, slope: np.ndarray, bend: np.ndarray, limits: MotionLimits, step: float
) -> np.ndarray:
    """Lower squared path speeds (G,) until none rises faster than the acceleration allows."""
    squared = squared.copy()
    room, loss = limits.acceleration / slope, bend / slope
    for i in range(len(squared) - 1):
        rise = max((room[i] - loss[i] * squared[i]).min(), 0.0)
        squared[i + 1] = min(squared[i + 1], squared[i] + 2 * step * rise)
    return squared


def _smoothed_law(times: np.ndarray, speed: np.ndarray) -> PPoly:
    """Smear a speed profile over a short span and integrate it to a law from 0 to 1."""
    samples = np.arange(0, times[-1] + _SAMPLE_S, _SAMPLE_S)
    width = round(_SMOOTH_S / _SAMPLE_S)
    profile = np.interp(samples, times, speed, right=0.0)
    profile = np.r_[0, np.convolve(profile, np.full(width, 1 / width)), 0]
    travelled = np.r_[0, np.cumsum((profile[1:] + profile[:-1]) * _SAMPLE_S / 2)]
    scale = 1 / travelled[-1]
    clock = np.arange(len(profile)) * _SAMPLE_S
    return CubicHermiteSpline(clock, travelled * scale, profile * scale)


def _excess(path: PPoly, law: PPoly, limits: MotionLimits) -> float:
    """Factor by which the law must be stretched to keep the limits; below 1 it has reserves."""
    times = np.linspace(0, law.x[-1], 4 * len(law.x))
    s = np.clip(law(times), 0, 1)
    rate, slope = law(times, 1)[:, None], path(s, 1)
    speed = np.abs(slope * rate).max()
    acceleration = np.abs(path(s, 2) * rate**2 + slope * law(times, 2)[:, None]).max()
    return max(speed / limits.speed, np.sqrt(acceleration / limits.acceleration))
