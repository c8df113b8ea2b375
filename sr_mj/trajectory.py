"""Smooth timed joint trajectories within velocity and acceleration limits."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, PPoly

from models.ur5 import MAX_JOINT_SPEED
from sr_mj.errors import ConfigError

# The quintic s(u) = 10u^3 - 15u^4 + 6u^5 starts and ends at rest; over its unit time its speed
# peaks at 1.875 and its acceleration at 10/sqrt(3).
_PEAK_SPEED = 1.875
_PEAK_ACCELERATION = 10 / np.sqrt(3)


@dataclass(frozen=True, kw_only=True)
class MotionLimits:
    """Limits on every joint.

    Attributes:
        speed: Largest joint speed, rad/s.
        acceleration: Largest joint acceleration, rad/s^2. Universal Robots publishes no limit for
            the UR5; 8 is our assumption, well under what the joints' torque allows.
    """

    speed: float = 0.7 * MAX_JOINT_SPEED
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
        duration_s: Time it takes, seconds.
    """

    path: PPoly
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
        u = np.clip(np.asarray(times, float) / max(self.duration_s, 1e-9), 0, 1)
        s = u**3 * (10 - 15 * u + 6 * u**2)
        ds = 30 * u**2 * (1 - u) ** 2 / max(self.duration_s, 1e-9)
        return self.path(s), self.path(s, 1) * ds[:, None]


def time_waypoints(waypoints: np.ndarray, limits: MotionLimits) -> Trajectory:
    """Fit a smooth path through joint waypoints and time it within the limits.

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
    steps = np.linalg.norm(np.diff(waypoints, axis=0), axis=1)
    keep = np.r_[True, steps > 1e-9]
    waypoints, steps = waypoints[keep], steps[steps > 1e-9]
    if len(waypoints) == 1:
        waypoints, steps = np.repeat(waypoints, 2, axis=0), np.ones(1)
    knots = np.r_[0, np.cumsum(steps)] / steps.sum()
    knots[-1] = 1.0
    path = CubicSpline(knots, waypoints, bc_type="natural")
    grid = np.linspace(0, 1, 20 * len(waypoints) + 1)
    slope = np.abs(path(grid, 1)).max()
    curvature = np.abs(path(grid, 2)).max()
    # q'' = path'' ds^2 + path' dds: each factor is bounded by its peak, so the sum is too.
    duration = max(
        _PEAK_SPEED * slope / limits.speed,
        np.sqrt((_PEAK_ACCELERATION * slope + _PEAK_SPEED**2 * curvature) / limits.acceleration),
    )
    return Trajectory(path=path, duration_s=float(duration))
