from dataclasses import replace

import numpy as np
import pytest
import torch

from perception.errors import InvalidCloudError, InvalidConfigError
from perception.lifting import LiftingConfig, depth_weights, lift_features
from perception.views import CameraView

CONFIG = LiftingConfig()


def _table_points(num_points: int = 200) -> np.ndarray:
    rng = np.random.default_rng(1)
    # Free table, seen by all three cameras of the table scene.
    x, y = rng.uniform((0.57, 0.10), (0.62, 0.15), (num_points, 2)).T
    return np.stack([x, y, np.zeros(num_points)], axis=1).astype(np.float32)


def _position_map(view: CameraView, height: int = 18, width: int = 32) -> torch.Tensor:
    """A map that is linear in the pixel, and hence exact under bilinear interpolation."""
    y = (torch.arange(height) + 0.5) / height - 0.5
    x = (torch.arange(width) + 0.5) / width - 0.5
    yy, xx = torch.meshgrid(y, x, indexing="ij")
    return torch.stack([xx, yy, torch.ones_like(xx)])


@pytest.mark.parametrize(
    ("delta_m", "margin", "ratio"),
    [
        (0.0, 1.0, 1.0),
        (0.01, 1.0, np.exp(-0.5)),
        (-0.01, 1.0, np.exp(-0.5)),
        (0.02, 1.0, np.exp(-1.0)),
        (0.03, np.exp(-0.5), np.exp(-1.5)),
        (0.06, np.exp(-2.0), np.exp(-3.0)),
        (-0.02, 0.0, 0.0),  # something stands mu or more in front of the point
        (-0.5, 0.0, 0.0),
        (np.nan, 0.0, 0.0),  # nothing was measured
    ],
)
def test_weights_of_equation_1(delta_m: float, margin: float, ratio: float) -> None:
    delta = np.array([delta_m])
    assert depth_weights(delta, CONFIG)[0] == pytest.approx(margin, abs=1e-12)
    assert depth_weights(delta, LiftingConfig(weight_rule="ratio"))[0] == pytest.approx(
        ratio, abs=1e-12
    )


def test_known_features_of_a_plane_are_recovered(table_views: tuple[CameraView, ...]) -> None:
    points = _table_points()
    maps = [_position_map(view) for view in table_views]
    lifted = lift_features(points, table_views, maps, CONFIG)
    wanted = np.zeros((len(points), 3))
    for view in table_views:
        pixels, _ = view.project(points)
        x = (pixels[:, 0] + 0.5) / 640 - 0.5
        y = (pixels[:, 1] + 0.5) / 360 - 0.5
        wanted += np.stack([x, y, np.ones(len(points))], axis=1)
    wanted /= np.linalg.norm(wanted, axis=1, keepdims=True)
    np.testing.assert_allclose(lifted.features, wanted, atol=1e-5)
    np.testing.assert_allclose(lifted.confidence, 1.0)


def test_hidden_view_gives_nothing(table_views: tuple[CameraView, ...]) -> None:
    points = _table_points()
    hidden = replace(table_views[1], depth_m=table_views[1].depth_m * np.float32(0.5))
    views = (table_views[0], hidden)
    ones = torch.tensor([1.0, 0.0]).view(2, 1, 1).expand(2, 9, 16)
    twos = torch.tensor([0.0, 1.0]).view(2, 1, 1).expand(2, 9, 16)
    lifted = lift_features(points, views, [ones, twos], CONFIG)
    np.testing.assert_array_equal(lifted.features, np.tile([1.0, 0.0], (len(points), 1)))
    np.testing.assert_allclose(lifted.confidence, 0.5)


def test_unseen_points_have_no_confidence_and_no_nan(table_views: tuple[CameraView, ...]) -> None:
    points = np.array([[0.5, 0.0, 3.0], [9.0, 9.0, 0.0], [0.5, 0.0, -0.3]], np.float32)
    maps = [torch.ones(4, 9, 16) for _ in table_views]
    lifted = lift_features(points, table_views, maps, CONFIG)
    np.testing.assert_array_equal(lifted.confidence, 0.0)
    np.testing.assert_array_equal(lifted.features, 0.0)


@pytest.mark.parametrize("rule", ["margin", "ratio"])
def test_less_depth_noise_means_more_confidence(
    table_views: tuple[CameraView, ...], rule: str
) -> None:
    noise = np.random.default_rng(2).normal(size=(3, 360, 640)).astype(np.float32)
    maps = [torch.ones(4, 9, 16) for _ in table_views]
    confidences = []
    for sigma_m in (0.04, 0.02, 0.01):
        views = [
            replace(view, depth_m=np.maximum(view.depth_m + np.float32(sigma_m) * noise[i], 0))
            for i, view in enumerate(table_views)
        ]
        config = LiftingConfig(weight_rule=rule)  # pyright: ignore[reportArgumentType]
        lifted = lift_features(_table_points(), views, maps, config)
        confidences.append(lifted.confidence.mean())
    assert confidences[0] < confidences[1] < confidences[2]


def test_order_of_views_does_not_matter(table_views: tuple[CameraView, ...]) -> None:
    rng = np.random.default_rng(3)
    maps = [torch.from_numpy(rng.normal(size=(16, 9, 16)).astype(np.float32)) for _ in range(3)]
    forward = lift_features(_table_points(), table_views, maps, CONFIG)
    backward = lift_features(_table_points(), table_views[::-1], maps[::-1], CONFIG)
    np.testing.assert_allclose(forward.features, backward.features, atol=1e-6)
    np.testing.assert_allclose(forward.confidence, backward.confidence, atol=1e-7)


@pytest.mark.parametrize("rule", ["margin", "ratio"])
def test_doubling_mu_widens_the_weight(rule: str) -> None:
    """Eq. (1) knows only the ratio of deviation and mu."""
    delta = np.linspace(-0.03, 0.15, 1000)
    one, two = (LiftingConfig(mu_m=mu, weight_rule=rule) for mu in (0.02, 0.04))  # pyright: ignore[reportArgumentType]
    np.testing.assert_allclose(depth_weights(2 * delta, two), depth_weights(delta, one), atol=1e-12)
    assert (depth_weights(delta, two) >= depth_weights(delta, one)).all()


def test_one_tensor_and_a_list_of_maps_give_the_same(
    table_views: tuple[CameraView, ...],
) -> None:
    rng = np.random.default_rng(4)
    inner = torch.from_numpy(rng.normal(size=(3, 9, 16, 8)).astype(np.float32))
    stacked = inner.permute(0, 3, 1, 2)
    listed = [feature_map.contiguous() for feature_map in stacked]
    points = _table_points(1500)  # more than one chunk
    one = lift_features(points, table_views, stacked, CONFIG)
    other = lift_features(points, table_views, listed, CONFIG)
    assert one.features.tobytes() == other.features.tobytes()


def test_bfloat16_turns_features_by_less_than_half_a_degree(
    table_views: tuple[CameraView, ...],
) -> None:
    rng = np.random.default_rng(5)
    maps = torch.from_numpy(rng.normal(size=(3, 64, 9, 16)).astype(np.float32))
    full = lift_features(_table_points(), table_views, maps, CONFIG)
    half = lift_features(_table_points(), table_views, maps, LiftingConfig(precision="bfloat16"))
    assert half.features.dtype == np.float32
    chord = np.linalg.norm(full.features.astype(float) - half.features, axis=1)
    assert np.degrees(2 * np.arcsin(chord / 2)).max() < 0.5
    np.testing.assert_array_equal(full.confidence, half.confidence)


def test_only_the_cells_of_points_are_described(table_views: tuple[CameraView, ...]) -> None:
    generator = torch.Generator().manual_seed(6)
    cells = torch.randn(3, 18, 32, 5, generator=generator).permute(0, 3, 1, 2)
    projection = torch.randn(5, 8, generator=generator)
    seen = []

    def describe(rows: torch.Tensor) -> torch.Tensor:
        seen.append(len(rows))
        return torch.tanh(rows @ projection)

    points = _table_points()
    lifted = lift_features(points, table_views, cells, CONFIG, describe)
    everything = describe(cells.permute(0, 2, 3, 1)).permute(0, 3, 1, 2)
    whole = lift_features(points, table_views, everything, CONFIG)
    np.testing.assert_allclose(lifted.features, whole.features, atol=1e-6)
    np.testing.assert_array_equal(lifted.confidence, whole.confidence)
    assert 0 < seen[0] < 200 < 3 * 18 * 32
    unseen = np.array([[9.0, 9.0, 0.0]], np.float32)
    np.testing.assert_array_equal(
        lift_features(unseen, table_views, cells, CONFIG, describe).features, 0.0
    )


def test_maps_may_differ_in_size(table_views: tuple[CameraView, ...]) -> None:
    fine = [_position_map(view, 18, 32) for view in table_views]
    mixed = [fine[0], _position_map(table_views[1], 9, 16), _position_map(table_views[2], 36, 64)]
    np.testing.assert_allclose(
        lift_features(_table_points(), table_views, mixed, CONFIG).features,
        lift_features(_table_points(), table_views, fine, CONFIG).features,
        atol=1e-6,
    )


def test_bad_maps(table_views: tuple[CameraView, ...]) -> None:
    points = _table_points(5)
    with pytest.raises(InvalidCloudError) as caught:
        lift_features(points, table_views, [torch.ones(4, 9, 16)], CONFIG)
    assert str(caught.value) == "Got 1 feature maps for 3 views; expected one each."
    with pytest.raises(InvalidCloudError) as caught:
        lift_features(points, table_views[:2], [torch.ones(4, 9, 16), torch.ones(5, 9, 16)], CONFIG)
    assert str(caught.value) == (
        "Feature maps are (4, 9, 16), (5, 9, 16); expected (C, h, w) with one C for all."
    )


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"mu_m": 0.0}, "mu_m is 0.0, expected more than 0 m."),
        ({"weight_rule": "half"}, "Unknown weight_rule 'half'. Rules: margin, ratio."),
        ({"precision": "int8"}, "Unknown precision 'int8'. Precisions: float32, bfloat16."),
    ],
)
def test_bad_config(fields: dict[str, object], message: str) -> None:
    with pytest.raises(InvalidConfigError) as caught:
        LiftingConfig(**fields)  # pyright: ignore[reportArgumentType]
    assert str(caught.value) == message
