"""What is made harder than in the plain suites: noise, errors of the executed pose, wording."""

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from sr_mj.errors import ConfigError

if TYPE_CHECKING:
    from sr_mj.perturbation import PosePerturbation
    from sr_mj.sensors.l515 import L515NoiseConfig

_NUMBER = r"(\d+(?:\.\d+)?)"
_FORMS = {
    "points": re.compile(rf"points-{_NUMBER}"),
    "l515": re.compile(rf"l515-{_NUMBER}x"),
    "pose": re.compile(rf"pose-{_NUMBER}cm-{_NUMBER}deg"),
}
_LARGEST = {
    "points": (10.0, "Noise of the points, in half extents of the workspace,"),
    "l515": (100.0, "Factor of the sensor's noise"),
}
_LEAST_FACTOR = 0.01
FORMS = ("clean", "reworded", "points-SIGMA", "l515-FACTORx", "pose-CMcm-DEGdeg")
"""How conditions are written."""


@dataclass(frozen=True, kw_only=True)
class Condition:
    """Circumstances of an episode; the plain protocol is `Condition(name="clean")`.

    Attributes:
        name: As in `FORMS`.
        is_reworded: Say the goal in other words (`models.arrangements.paraphrases`).
        point_sigma: Standard deviation of the noise of the points that the policy sees, in half
            extents of the workspace along each axis.
        sensor_factor: Factor of the L515's noise; 1 is the plain sensor, 0 a perfect one. Which
            parts it scales says `sensor_noise`.
        pose_sigma_cm: Standard deviation of an error of the executed position, each axis.
        pose_sigma_deg: Standard deviation of an error of the executed rotation, each axis.
    """

    name: str
    is_reworded: bool = False
    point_sigma: float = 0.0
    sensor_factor: float = 1.0
    pose_sigma_cm: float = 0.0
    pose_sigma_deg: float = 0.0

    @property
    def beginning(self) -> str:
        """Name of the plainest condition with the same scene, hand-over and first look.

        Noise of the policy's points and errors of the executed pose come after these.
        """
        is_later = self.point_sigma or self.pose_sigma_cm or self.pose_sigma_deg
        return "clean" if is_later else self.name

    def perturbation(self) -> "PosePerturbation | None":
        """Return the error of executed poses, None for none.

        Raises:
            ConfigError: If it is out of range.
        """
        from sr_mj.perturbation import PosePerturbation

        if not self.pose_sigma_cm and not self.pose_sigma_deg:
            return None
        return PosePerturbation(sigma_m=self.pose_sigma_cm / 100, sigma_deg=self.pose_sigma_deg)

    def sensor_noise(self) -> "L515NoiseConfig":
        """Return the noise of the cameras.

        The factor multiplies the standard deviations of depth, of the jitter at depth edges and of
        the colours, and the shares of flying pixels (0.3) and of dropouts on black surfaces (0.5),
        which end at 1: from 3.33 and 2 on, they grow no more. Dropouts at grazing angles, range
        and depth unit stay as they are. A factor of 0 switches all of them off.

        Returns:
            The configuration of the sensor.
        """
        from sr_mj.sensors.l515 import L515NoiseConfig

        factor, plain = self.sensor_factor, L515NoiseConfig()
        if factor == 0:
            return L515NoiseConfig.off()
        return replace(
            plain,
            axial_sigma_at_zero_m=plain.axial_sigma_at_zero_m * factor,
            axial_sigma_per_m=plain.axial_sigma_per_m * factor,
            lateral_sigma_px=plain.lateral_sigma_px * factor,
            flying_rate=min(plain.flying_rate * factor, 1.0),
            dark_rate=min(plain.dark_rate * factor, 1.0),
            # Photon noise grows with the square root of the light.
            full_well_electrons=plain.full_well_electrons / factor**2,
        )


def read_condition(name: str) -> Condition:
    """Read the name of a condition.

    Args:
        name: One of `FORMS`, with numbers.

    Returns:
        The condition, named in the one way that numbers are written here: "points-0.10" is
        "points-0.1".

    Raises:
        ConfigError: If the name has another form, or a number is out of range.
    """
    if name == "clean":
        return Condition(name=name)
    if name == "reworded":
        return Condition(name=name, is_reworded=True)
    for kind, form in _FORMS.items():
        if match := form.fullmatch(name):
            return _numbered(kind, *(float(text) for text in match.groups()))
    raise ConfigError(
        f"Condition {name!r} is not understood; expected one of {', '.join(FORMS)}, for example "
        "points-0.1 or pose-1cm-5deg."
    )


def _numbered(kind: str, value: float, degrees: float = 0.0) -> Condition:
    if kind == "pose":
        condition = Condition(
            name=f"pose-{value:g}cm-{degrees:g}deg", pose_sigma_cm=value, pose_sigma_deg=degrees
        )
        condition.perturbation()
        return condition
    largest, what = _LARGEST[kind]
    if value > largest:
        raise ConfigError(f"{what} is {value:g}; expected 0 to {largest:g}.")
    if kind == "points":
        return Condition(name=f"points-{value:g}", point_sigma=value)
    if 0 < value < _LEAST_FACTOR:
        raise ConfigError(f"{what} is {value:g}; expected 0, or {_LEAST_FACTOR:g} to {largest:g}.")
    return Condition(name=f"l515-{value:g}x", sensor_factor=value)
