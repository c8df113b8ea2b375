"""Noise of an Intel RealSense L515: what its depth and colour images add to a perfect rendering.

Sources: the manufacturer's figures, as quoted in
https://github.com/IntelRealSense/librealsense/issues/5808 (standard deviation of depth 2.5 mm at
1 m and 15.5 mm at 9 m on a surface of 95 % reflectivity; range 0.25 m to 9 m) and
https://github.com/IntelRealSense/librealsense/issues/8058 (depth unit 0.25 mm). No public source
measures the other parts for this sensor; their values are marked as our assumption. Noise is
independent from pixel to pixel, which real noise is not quite.
"""

import dataclasses
from dataclasses import dataclass

import numpy as np

from models.cameras import PinholeSensor
from sr_mj.errors import ConfigError
from sr_mj.sensors.depth_edges import find_depth_edges, incidence_cosine

# A new part goes at the end, so that the draws of the others stay as they are.
_DEPTH_PARTS = ("lateral", "flying", "axial", "grazing", "dark")
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # Rec. 709, linear RGB


@dataclass(frozen=True, kw_only=True)
class L515NoiseConfig:
    """Every part of the noise, with a switch for each.

    Attributes:
        axial_noise: Gaussian error along the optical axis, which grows with range.
        axial_sigma_at_zero_m: Its standard deviation, extrapolated to range 0. With the slope
            below: the manufacturer's 2.5 mm at 1 m and 15.5 mm at 9 m; 2.0 mm at 0.7 m.
        axial_sigma_per_m: Growth of the standard deviation with every metre.
        lateral_jitter: Pixels near a depth edge report the depth of a pixel beside them.
        lateral_sigma_px: Standard deviation of that shift, an axis. Our assumption, after the 0.8
            px that Nguyen, Izadi and Lovell (3DIMPVT 2012) measured for the first Kinect.
        flying_pixels: Pixels at a depth edge report a depth between foreground and background.
        flying_rate: The share of edge pixels that do. Our assumption.
        edge_step_ratio: Two neighbouring pixels form an edge if their depths differ by more than
            this share of the smaller depth: 10 mm at 0.7 m. Our assumption.
        grazing_dropout: Surfaces seen at a grazing angle return too little light.
        grazing_onset_deg: Angle between ray and normal at which dropouts begin. Our assumption.
        grazing_limit_deg: Angle from which every pixel drops out; linear between the two. Our
            assumption.
        dark_dropout: Dark surfaces return too little light. The rendered image's luminance stands
            for the reflectance, although the laser's wavelength is 860 nm.
        dark_reflectance: Luminance (0 to 1, linear) below which dropouts begin. Our assumption.
        dark_rate: Share of pixels that drop out on a perfectly black surface; linear between the
            two. Our assumption.
        range_limits: Nothing is returned outside the sensor's range.
        quantisation: Depth comes in whole units.
        depth_unit_m: That unit, from the driver: 0.25 mm.
        shot_noise: Photon noise of the colour image, applied to linear light.
        full_well_electrons: Electrons that make a pixel white. Our assumption, for a small sensor
            in a lit room: a standard deviation of 1.6 grey levels at grey 128.
    """

    axial_noise: bool = True
    axial_sigma_at_zero_m: float = 0.000875
    axial_sigma_per_m: float = 0.001625
    lateral_jitter: bool = True
    lateral_sigma_px: float = 0.8
    flying_pixels: bool = True
    flying_rate: float = 0.3
    edge_step_ratio: float = 0.015
    grazing_dropout: bool = True
    grazing_onset_deg: float = 70.0
    grazing_limit_deg: float = 88.0
    dark_dropout: bool = True
    dark_reflectance: float = 0.03
    dark_rate: float = 0.5
    range_limits: bool = True
    quantisation: bool = True
    depth_unit_m: float = 0.00025
    shot_noise: bool = True
    full_well_electrons: float = 6000.0

    def __post_init__(self) -> None:
        """Check every value.

        Raises:
            ConfigError: If a value is out of its range.
        """
        for name in ("axial_sigma_at_zero_m", "axial_sigma_per_m", "lateral_sigma_px"):
            _check_between(name, getattr(self, name), 0, np.inf)
        for name in ("flying_rate", "dark_rate", "dark_reflectance"):
            _check_between(name, getattr(self, name), 0, 1)
        for name in ("edge_step_ratio", "depth_unit_m", "full_well_electrons"):
            if not getattr(self, name) > 0:
                raise ConfigError(f"Got {name} {getattr(self, name)}, expected more than 0.")
        _check_between("grazing_limit_deg", self.grazing_limit_deg, 0, 90)
        if not 0 <= self.grazing_onset_deg < self.grazing_limit_deg:
            raise ConfigError(
                f"Got grazing_onset_deg {self.grazing_onset_deg}, expected a value from 0 to "
                f"below grazing_limit_deg ({self.grazing_limit_deg})."
            )

    @classmethod
    def off(cls) -> "L515NoiseConfig":
        """Return a configuration with every part switched off; `replace` turns single ones on."""
        switches = [field.name for field in dataclasses.fields(cls) if field.default is True]
        return cls(**dict.fromkeys(switches, False))


def apply_depth_noise(
    depth_m: np.ndarray,
    rgb: np.ndarray,
    sensor: PinholeSensor,
    config: L515NoiseConfig,
    rng: np.random.Generator,
) -> np.ndarray:
    """Turn a perfect depth image into one that the sensor might have taken.

    Each part draws from a stream of its own, so that switching one off leaves the others' draws
    as they were.

    Args:
        depth_m: (H, W) float32, metres along the optical axis, 0 = no return. Not changed.
        rgb: (H, W, 3) uint8, the noise-free colours of the same view. Not changed.
        sensor: The pinhole model and the range.
        config: Which parts to apply, and how strongly.
        rng: Source of randomness; advances by the same amount whatever is switched on.

    Returns:
        A new (H, W) float32 image, 0 = no return.

    Raises:
        ConfigError: If an array's shape or type does not fit.
    """
    _check_array("depth_m", depth_m, (sensor.height, sensor.width), np.float32)
    _check_array("rgb", rgb, (sensor.height, sensor.width, 3), np.uint8)
    streams = _independent_streams(rng)
    noisy = depth_m.copy()
    if config.lateral_jitter or config.flying_pixels:
        pixels, across = find_depth_edges(depth_m, config.edge_step_ratio)
        if config.lateral_jitter:
            _jitter_edges(noisy, depth_m, pixels, config.lateral_sigma_px, streams["lateral"])
        if config.flying_pixels:
            _add_flying_pixels(
                noisy, depth_m, pixels, across, config.flying_rate, streams["flying"]
            )
    if config.axial_noise:
        _add_axial_noise(noisy, config, streams["axial"])
    if config.quantisation:
        np.divide(noisy, np.float32(config.depth_unit_m), out=noisy)
        np.rint(noisy, out=noisy)
        np.multiply(noisy, np.float32(config.depth_unit_m), out=noisy)
    if config.grazing_dropout:
        _drop_grazing(noisy, depth_m, sensor, config, streams["grazing"])
    if config.dark_dropout:
        _drop_dark(noisy, rgb, config, streams["dark"])
    if config.range_limits:
        nearest_m, farthest_m = sensor.range_m
        noisy[(noisy < nearest_m) | (noisy > farthest_m)] = 0
    return noisy


def apply_rgb_noise(
    rgb: np.ndarray, config: L515NoiseConfig, rng: np.random.Generator
) -> np.ndarray:
    """Add photon noise to a colour image.

    A pixel of linear brightness L collects n = L * full_well electrons, with variance n (Poisson;
    Gaussian here, as n is large wherever it shows). The sRGB curve then spreads dark tones.

    Args:
        rgb: (H, W, 3) uint8, sRGB. Not changed.
        config: Uses `shot_noise` and `full_well_electrons`.
        rng: Source of randomness; advances by the same amount whatever is switched on.

    Returns:
        A new (H, W, 3) uint8 image.

    Raises:
        ConfigError: If the array's shape or type does not fit.
    """
    _check_array("rgb", rgb, (*rgb.shape[:2], 3), np.uint8)
    stream = np.random.Generator(np.random.SFC64(int(rng.integers(2**63))))
    if not config.shot_noise:
        return rgb.copy()
    noisy = stream.standard_normal(rgb.shape, dtype=np.float32)
    noisy *= shot_noise_sigma(config.full_well_electrons)[rgb]
    noisy += rgb
    np.rint(noisy, out=noisy)
    return np.clip(noisy, 0, 255, out=noisy).astype(np.uint8)


def shot_noise_sigma(full_well_electrons: float) -> np.ndarray:
    """Return the standard deviation of photon noise for each grey level, (256,) float32."""
    linear = _srgb_to_linear()
    # Slope of the sRGB encoding: 12.92 on its linear foot, the derivative of the power law above.
    slope = np.where(
        linear <= 0.0031308, 12.92, 1.055 / 2.4 * np.maximum(linear, 1e-6) ** (1 / 2.4 - 1)
    )
    return (255 * slope * np.sqrt(linear / full_well_electrons)).astype(np.float32)


def _srgb_to_linear() -> np.ndarray:
    """Return the linear brightness (256,) of each grey level (IEC 61966-2-1)."""
    encoded = np.arange(256) / 255
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def _independent_streams(rng: np.random.Generator) -> dict[str, np.random.Generator]:
    seeds = rng.integers(2**63, size=len(_DEPTH_PARTS))
    return {
        part: np.random.Generator(np.random.SFC64(int(seed)))
        for part, seed in zip(_DEPTH_PARTS, seeds, strict=True)
    }


def _jitter_edges(
    noisy: np.ndarray,
    depth_m: np.ndarray,
    edge_pixels: np.ndarray,
    sigma_px: float,
    rng: np.random.Generator,
) -> None:
    """Let pixels within two of an edge look up their depth at a shifted place."""
    height, width = depth_m.shape
    near_edge = np.zeros(depth_m.shape, bool)
    near_edge.flat[edge_pixels] = True
    grown = near_edge.copy()
    grown[1:] |= near_edge[:-1]
    grown[:-1] |= near_edge[1:]
    grown[:, 1:] |= near_edge[:, :-1]
    grown[:, :-1] |= near_edge[:, 1:]
    rows, columns = np.nonzero(grown)
    shifts = np.rint(rng.standard_normal((2, rows.size)) * sigma_px).astype(np.int64)
    from_rows = np.clip(rows + shifts[0], 0, height - 1)
    from_columns = np.clip(columns + shifts[1], 0, width - 1)
    noisy[rows, columns] = depth_m[from_rows, from_columns]


def _add_flying_pixels(
    noisy: np.ndarray,
    depth_m: np.ndarray,
    pixels: np.ndarray,
    across: np.ndarray,
    rate: float,
    rng: np.random.Generator,
) -> None:
    """Mix the depths on both sides of an edge, in a share of the pixels beside it."""
    here, there = depth_m.flat[pixels], depth_m.flat[across]
    flies = (rng.random(pixels.size) < rate) & (here > 0) & (there > 0)
    share = rng.random(pixels.size, dtype=np.float32)
    noisy.flat[pixels[flies]] = (here + share * (there - here))[flies]


def _add_axial_noise(noisy: np.ndarray, config: L515NoiseConfig, rng: np.random.Generator) -> None:
    error = noisy * np.float32(config.axial_sigma_per_m)
    error += np.float32(config.axial_sigma_at_zero_m)
    error *= rng.standard_normal(noisy.shape, dtype=np.float32)
    error *= noisy > 0
    noisy += error
    np.maximum(noisy, 0, out=noisy)


def _drop_grazing(
    noisy: np.ndarray,
    depth_m: np.ndarray,
    sensor: PinholeSensor,
    config: L515NoiseConfig,
    rng: np.random.Generator,
) -> None:
    cosine = incidence_cosine(depth_m, sensor)
    at_risk = np.flatnonzero(cosine < np.cos(np.radians(config.grazing_onset_deg)))
    angle_deg = np.degrees(np.arccos(np.maximum(cosine.flat[at_risk], 0)))
    ramp_deg = config.grazing_limit_deg - config.grazing_onset_deg
    rate = (angle_deg - config.grazing_onset_deg) / ramp_deg
    noisy.flat[at_risk[rng.random(at_risk.size) < rate]] = 0


def _drop_dark(
    noisy: np.ndarray, rgb: np.ndarray, config: L515NoiseConfig, rng: np.random.Generator
) -> None:
    if config.dark_reflectance == 0:
        return
    linear = _srgb_to_linear().astype(np.float32)
    # Green alone tells most bright pixels apart: its share of the luminance is the largest.
    green = _LUMINANCE[1] * linear
    at_risk = np.flatnonzero((green < config.dark_reflectance)[rgb[..., 1]])
    luminance = linear[rgb.reshape(-1, 3)[at_risk]] @ _LUMINANCE
    rate = config.dark_rate * (1 - luminance / config.dark_reflectance)
    noisy.flat[at_risk[rng.random(at_risk.size) < rate]] = 0


def _check_between(name: str, value: float, lower: float, upper: float) -> None:
    if not lower <= value <= upper:
        expected = f"{lower:g} to {upper:g}" if np.isfinite(upper) else f"at least {lower:g}"
        raise ConfigError(f"Got {name} {value}, expected {expected}.")


def _check_array(name: str, array: np.ndarray, shape: tuple[int, ...], dtype: type) -> None:
    if array.shape != shape or array.dtype != dtype:
        raise ConfigError(
            f"Got {name} of shape {array.shape} and type {array.dtype}, "
            f"expected {shape} and {np.dtype(dtype)}."
        )
