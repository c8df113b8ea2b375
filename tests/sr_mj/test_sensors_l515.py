from dataclasses import fields, replace

import numpy as np
import pytest
from scipy import stats

from models.cameras import PinholeSensor
from sr_mj.errors import ConfigError
from sr_mj.sensors.l515 import (
    L515NoiseConfig,
    apply_depth_noise,
    apply_rgb_noise,
    shot_noise_sigma,
)

SENSOR = PinholeSensor(
    width=320, height=240, fx=228.5, fy=228.5, cx=160, cy=120, range_m=(0.25, 9.0)
)
NARROW = replace(SENSOR, fx=5000.0, fy=5000.0)
SHAPE = (SENSOR.height, SENSOR.width)
OFF = L515NoiseConfig.off()
ALL_ON = L515NoiseConfig()
SWITCHES = [field.name for field in fields(L515NoiseConfig) if field.default is True]


def frozen(array: np.ndarray) -> np.ndarray:
    """Make an array read-only, so that writing into an input raises."""
    array.flags.writeable = False
    return array


def flat(depth_m: float) -> np.ndarray:
    return frozen(np.full(SHAPE, depth_m, np.float32))


def grey(level: int | tuple[int, int, int] = 200) -> np.ndarray:
    return frozen(np.broadcast_to(np.array(level, np.uint8), (*SHAPE, 3)).copy())


def stripes(near_m: float = 0.7, far_m: float = 0.9, width: int = 16) -> np.ndarray:
    columns = np.arange(SENSOR.width) // width % 2
    return frozen(np.tile(np.where(columns, far_m, near_m), (SENSOR.height, 1)).astype(np.float32))


def tilted(angle_deg: float, sensor: PinholeSensor, distance_m: float = 0.7) -> np.ndarray:
    """A plane through (0, 0, distance), whose normal leans away from the optical axis."""
    v = (np.arange(sensor.height) - sensor.cy) / sensor.fy
    normal_y, normal_z = np.sin(np.radians(angle_deg)), np.cos(np.radians(angle_deg))
    depth_m = distance_m * normal_z / (normal_y * v + normal_z)
    return frozen(np.tile(depth_m[:, None], (1, sensor.width)).astype(np.float32))


def scene() -> tuple[np.ndarray, np.ndarray]:
    """Depth with edges, a slope, no return and out-of-range pixels; colours with dark regions."""
    depth_m = stripes() + np.linspace(0, 0.2, SENSOR.height, dtype=np.float32)[:, None]
    depth_m[:20] = 0
    depth_m[20:30] = 0.1
    depth_m[30:40] = 12
    rgb = grey(120).copy()
    rgb[100:160] = 3
    return frozen(depth_m), frozen(rgb)


def only(*switches: str, **values: float) -> L515NoiseConfig:
    return replace(OFF, **dict.fromkeys(switches, True), **values)


def noisy(
    depth_m: np.ndarray,
    config: L515NoiseConfig,
    *,
    rgb: np.ndarray | None = None,
    sensor: PinholeSensor = SENSOR,
    seed: int = 0,
) -> np.ndarray:
    rgb = grey() if rgb is None else rgb
    return apply_depth_noise(depth_m, rgb, sensor, config, np.random.default_rng(seed))


def assert_rate(hits: np.ndarray, rate: float) -> None:
    """Four standard errors, or nothing at all where the rate is 0 or 1."""
    assert hits.mean() == pytest.approx(rate, abs=4 * np.sqrt(rate * (1 - rate) / hits.size))


def test_off_changes_no_bit_and_returns_new_arrays():
    depth_m, rgb = scene()
    out = noisy(depth_m, OFF, rgb=rgb)
    out_rgb = apply_rgb_noise(rgb, OFF, np.random.default_rng(0))
    assert out.tobytes() == depth_m.tobytes()
    assert out_rgb.tobytes() == rgb.tobytes()
    assert not np.shares_memory(out, depth_m)
    assert not np.shares_memory(out_rgb, rgb)


def test_off_switches_off_everything_that_can_be():
    assert [name for name in SWITCHES if getattr(OFF, name)] == []
    assert len(SWITCHES) == 8


@pytest.mark.parametrize("config", [ALL_ON, *(only(name) for name in SWITCHES)])
def test_same_seed_same_bytes_and_inputs_are_left_alone(config):
    depth_m, rgb = scene()  # read-only: writing into them would raise
    first, second = (noisy(depth_m, config, rgb=rgb, seed=3) for _ in range(2))
    assert first.tobytes() == second.tobytes()
    assert first.dtype == np.float32
    assert np.isfinite(first).all()
    assert (first >= 0).all()
    colors = [apply_rgb_noise(rgb, config, np.random.default_rng(3)) for _ in range(2)]
    assert colors[0].tobytes() == colors[1].tobytes()


def test_other_seeds_give_other_noise():
    depth_m, rgb = scene()
    assert (
        noisy(depth_m, ALL_ON, rgb=rgb, seed=1) != noisy(depth_m, ALL_ON, rgb=rgb, seed=2)
    ).any()


def test_the_generator_advances_by_the_same_amount_whatever_is_on():
    depth_m, rgb = scene()
    states = []
    for config in (OFF, ALL_ON):
        rng = np.random.default_rng(5)
        apply_depth_noise(depth_m, rgb, SENSOR, config, rng)
        apply_rgb_noise(rgb, config, rng)
        states.append(rng.integers(2**63))
    assert states[0] == states[1]


def test_switching_one_part_off_keeps_the_draws_of_the_others():
    depth_m = stripes()
    axial = noisy(depth_m, only("axial_noise"))
    both = noisy(depth_m, only("axial_noise", "flying_pixels"))
    inside = np.arange(SENSOR.width) % 16
    untouched = (inside > 0) & (inside < 15)
    np.testing.assert_array_equal(axial[:, untouched], both[:, untouched])


@pytest.mark.parametrize(
    ("depth_m", "sigma_m"), [(0.7, 0.0020125), (1.0, 0.0025), (5.0, 0.009), (9.0, 0.0155)]
)
def test_axial_noise_has_the_manufacturer_s_standard_deviation(depth_m, sigma_m):
    error = noisy(flat(depth_m), only("axial_noise")).astype(float) - np.float32(depth_m)
    assert error.std() == pytest.approx(sigma_m, rel=4 / np.sqrt(2 * error.size))
    assert abs(error.mean()) < 4 * sigma_m / np.sqrt(error.size)
    assert stats.kstest(error.ravel() / sigma_m, "norm").pvalue > 1e-3


def test_axial_noise_makes_no_returns_out_of_nothing():
    assert not noisy(flat(0.0), only("axial_noise")).any()


@pytest.mark.parametrize("sigma_px", [0.8, 1.5])
def test_lateral_jitter_swaps_sides_as_often_as_a_rounded_gaussian_does(sigma_px):
    depth_m = stripes()
    out = noisy(depth_m, only("lateral_jitter", lateral_sigma_px=sigma_px))
    assert set(np.unique(out)) <= {np.float32(0.7), np.float32(0.9)}
    swapped = out != depth_m
    column = np.arange(SENSOR.width)
    from_edge = np.minimum(column % 16, 15 - column % 16)
    inner = (column >= 16) & (column < SENSOR.width - 16)  # the image's border has no neighbour
    for pixels in (0, 1):
        # A shift of k + 1 pixels or more, after rounding: beyond k + 0.5 standard normally.
        rate = stats.norm.sf((pixels + 0.5) / sigma_px)
        # Shifts never reach across a whole stripe, so only the nearer edge counts.
        assert_rate(swapped[:, inner & (from_edge == pixels)], rate)
    assert not swapped[:, from_edge > 1].any()


def test_flying_pixels_lie_evenly_between_the_two_sides_of_an_edge():
    depth_m = stripes()
    out = noisy(depth_m, only("flying_pixels"))
    column = np.arange(SENSOR.width)
    beside = np.isin(column % 16, (0, 15)) & (column > 0) & (column < SENSOR.width - 1)
    flies = out != depth_m
    assert_rate(flies[:, beside], ALL_ON.flying_rate)
    assert not flies[:, ~beside].any()
    share = (out[flies] - 0.7) / 0.2
    assert stats.kstest(share, "uniform").pvalue > 1e-3


def test_nothing_flies_between_a_surface_and_no_return():
    depth_m = stripes(far_m=0.0)
    np.testing.assert_array_equal(noisy(depth_m, only("flying_pixels", flying_rate=1.0)), depth_m)


@pytest.mark.parametrize("angle_deg", [0, 60, 69, 72, 79, 86, 89])
def test_grazing_surfaces_drop_out_as_often_as_the_ramp_says(angle_deg):
    out = noisy(tilted(angle_deg, NARROW), only("grazing_dropout"), sensor=NARROW)
    v = (np.arange(NARROW.height) - NARROW.cy) / NARROW.fy
    # The ray leans by atan(v) towards the normal; what leans along x is below 0.1 degrees here.
    incidence_deg = np.abs(angle_deg - np.degrees(np.arctan(v)))
    rate = np.clip((incidence_deg - 70) / 18, 0, 1).mean()
    assert_rate(out == 0, float(rate))


@pytest.mark.parametrize(
    ("color", "rate"),
    [
        ((0, 0, 0), 0.5),
        ((20, 20, 20), 0.5 * (1 - ((20 / 255 + 0.055) / 1.055) ** 2.4 / 0.03)),
        ((0, 0, 120), 0.5 * (1 - 0.0722 * ((120 / 255 + 0.055) / 1.055) ** 2.4 / 0.03)),
        ((49, 49, 49), 0.0),
        ((0, 0, 255), 0.0),
        ((255, 255, 255), 0.0),
    ],
)
def test_dark_surfaces_drop_out_by_luminance(color, rate):
    out = noisy(flat(0.7), only("dark_dropout"), rgb=grey(color))
    assert_rate(out == 0, rate)


@pytest.mark.parametrize(
    ("depth_m", "is_seen"),
    [(0.0, False), (0.249, False), (0.25, True), (9.0, True), (9.01, False), (66.0, False)],
)
def test_nothing_returns_from_outside_the_range(depth_m, is_seen):
    out = noisy(flat(depth_m), only("range_limits"))
    assert (out == (np.float32(depth_m) if is_seen else 0)).all()


def test_quantised_depth_lies_on_the_grid_and_is_the_nearest_of_it():
    rng = np.random.default_rng(1)
    depth_m = frozen(rng.uniform(0.25, 9, SHAPE).astype(np.float32))
    out = noisy(depth_m, only("quantisation"))
    unit = np.float32(0.00025)
    np.testing.assert_array_equal(np.rint(out / unit) * unit, out)
    assert np.abs(out.astype(float) - depth_m).max() <= 0.000125 * (1 + 1e-2)


@pytest.mark.parametrize("level", [16, 64, 128, 224])
def test_shot_noise_has_the_standard_deviation_of_its_grey_level(level):
    out = apply_rgb_noise(grey(level), only("shot_noise"), np.random.default_rng(2)).astype(float)
    rounded = np.hypot(shot_noise_sigma(6000)[level], np.sqrt(1 / 12))
    assert out.std() == pytest.approx(rounded, rel=0.02)
    assert abs(out.mean() - level) < 4 * rounded / np.sqrt(out.size)


def test_shot_noise_follows_photon_statistics():
    sigma = shot_noise_sigma(6000)
    assert sigma[128] == pytest.approx(1.6, abs=0.05)
    assert sigma[0] == 0
    # Four times the light, half the noise.
    np.testing.assert_allclose(shot_noise_sigma(24000), sigma / 2, rtol=1e-6)
    # At white n = full well, and the slope of the sRGB curve is 1.055 / 2.4.
    assert sigma[255] == pytest.approx(255 * 1.055 / 2.4 / np.sqrt(6000), rel=1e-6)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"axial_sigma_per_m": -0.1}, "Got axial_sigma_per_m -0.1, expected at least 0."),
        ({"lateral_sigma_px": float("nan")}, "Got lateral_sigma_px nan, expected at least 0."),
        ({"flying_rate": 1.5}, "Got flying_rate 1.5, expected 0 to 1."),
        ({"dark_rate": -1}, "Got dark_rate -1, expected 0 to 1."),
        ({"depth_unit_m": 0.0}, "Got depth_unit_m 0.0, expected more than 0."),
        ({"full_well_electrons": 0}, "Got full_well_electrons 0, expected more than 0."),
        ({"grazing_limit_deg": 91.0}, "Got grazing_limit_deg 91.0, expected 0 to 90."),
        (
            {"grazing_onset_deg": 88.0},
            "Got grazing_onset_deg 88.0, expected a value from 0 to below grazing_limit_deg "
            "(88.0).",
        ),
    ],
)
def test_values_out_of_range_are_refused(values, message):
    with pytest.raises(ConfigError) as error:
        L515NoiseConfig(**values)
    assert str(error.value) == message


@pytest.mark.parametrize(
    ("depth_m", "rgb", "message"),
    [
        (
            np.zeros(SHAPE),
            grey(),
            "Got depth_m of shape (240, 320) and type float64, expected (240, 320) and float32.",
        ),
        (
            np.zeros((320, 240), np.float32),
            grey(),
            "Got depth_m of shape (320, 240) and type float32, expected (240, 320) and float32.",
        ),
        (
            np.zeros(SHAPE, np.float32),
            np.zeros((*SHAPE, 4), np.uint8),
            "Got rgb of shape (240, 320, 4) and type uint8, expected (240, 320, 3) and uint8.",
        ),
    ],
)
def test_images_that_do_not_fit_are_refused(depth_m, rgb, message):
    with pytest.raises(ConfigError) as error:
        noisy(depth_m, ALL_ON, rgb=rgb)
    assert str(error.value) == message
