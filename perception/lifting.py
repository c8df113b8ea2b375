"""Lifting of image features to points, weighted by how well depth agrees (section 3.2.2, eq. 1-3).

The weighted sum over views and the four bilinear neighbours is one sum of rows of the feature
maps, 4 K rows a point, which `embedding_bag` computes without any copy of the maps if they come as
one tensor with channels innermost. docs/fusion.md has the measurements.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
import torch.nn.functional as F
from jaxtyping import Float, Float32
from torch import Tensor

from perception.errors import InvalidCloudError, InvalidConfigError
from perception.views import CameraView

WeightRule = Literal["margin", "ratio"]
MapPrecision = Literal["float32", "bfloat16"]
Describe = Callable[[Tensor], Tensor]

# Points at a time: their features (1.5 MB at 768 channels) stay in a core's cache until normalised.
_CHUNK = 512
_TINY = 1e-12


@dataclass(frozen=True, kw_only=True)
class LiftingConfig:
    """Settings of the lifting.

    Attributes:
        mu_m: mu of eq. (1), metres. A view whose measured depth deviates by more counts less, and
            one that measured a surface nearer than the point by more than this does not count.
        weight_rule: Reading of eq. (1). "margin": exp(-max(0, |delta| - mu) / mu), full weight up
            to mu. "ratio": exp(-|delta| / mu).
        precision: In what maps of features are kept and summed (cells keep the encoder's own type
            until they are described). bfloat16 halves their memory and the time
            of the sum; features turn by less than half a degree.
    """

    mu_m: float = 0.02
    weight_rule: WeightRule = "margin"
    precision: MapPrecision = "float32"

    def __post_init__(self) -> None:
        """Check the ranges."""
        if not self.mu_m > 0:
            raise InvalidConfigError(f"mu_m is {self.mu_m}, expected more than 0 m.")
        if self.weight_rule not in ("margin", "ratio"):
            raise InvalidConfigError(
                f"Unknown weight_rule {self.weight_rule!r}. Rules: margin, ratio."
            )
        if self.precision not in ("float32", "bfloat16"):
            raise InvalidConfigError(
                f"Unknown precision {self.precision!r}. Precisions: float32, bfloat16."
            )

    @property
    def dtype(self) -> torch.dtype:
        """The type that `precision` names."""
        return torch.bfloat16 if self.precision == "bfloat16" else torch.float32


@dataclass(frozen=True, kw_only=True, eq=False)
class LiftedFeatures:
    """Features of points.

    Attributes:
        features: (N, C) float32, unit length, or zero where `confidence` is 0.
        confidence: (N,) float32 in 0..1: mean over all views of v * omega; 0 = seen by no view.
    """

    features: Float32[np.ndarray, "n c"]
    confidence: Float32[np.ndarray, " n"]


def depth_weights(
    delta_m: Float[np.ndarray, "*any"], config: LiftingConfig
) -> Float[np.ndarray, "*any"]:
    """Weigh a view by the deviation of measured from expected depth: v * omega of eq. (1) and (3).

    Args:
        delta_m: Deviations d_meas - d_true, metres, any shape; NaN = no measurement.
        config: Settings.

    Returns:
        Weights in 0..1 of the same shape; 0 where nothing was measured or something in front hides
        the point.
    """
    # The printed eq. (1) lacks the minus sign, yet the text says exponentially *decaying*; and as
    # printed, max(0, |x|) does nothing: the margin mu is the reading that gives it a meaning.
    deviation = np.abs(delta_m)
    if config.weight_rule == "margin":
        deviation = np.maximum(0.0, deviation - config.mu_m)
    omega = np.exp(-deviation / config.mu_m)
    is_visible = delta_m > -config.mu_m  # false for NaN
    return np.where(is_visible, omega, 0.0)


def lift_features(
    points: Float[np.ndarray, "n 3"],
    views: Sequence[CameraView],
    feature_maps: Sequence[Tensor] | Tensor,
    config: LiftingConfig,
    describe: Describe | None = None,
) -> LiftedFeatures:
    """Lift feature maps to points.

    Args:
        points: (N, 3) float32 world coordinates, metres.
        views: K views.
        feature_maps: One (C, h, w) map for each view, whose cells divide the image evenly, or all
            of them as (K, C, h, w). One tensor of the configured precision with channels innermost
            in memory (`torch.channels_last`) is used as it is; anything else is copied once.
        config: Settings.
        describe: Turns cells (M, C) of the maps, of any type, into features (M, D), for encoders
            that describe cells one by one: then only the cells that points fall into are described.
            None takes the cells as features.

    Returns:
        Features and confidence of every point.

    Raises:
        InvalidCloudError: If the number of maps or their channels do not fit.
    """
    _check_maps(views, feature_maps)
    rows, weights, first_row = [], [], 0
    for view, feature_map in zip(views, feature_maps, strict=True):
        _, height, width = feature_map.shape
        pixels, view_weights = _observe(points, view, config)
        cells, shares = _bilinear(pixels, view, height, width)
        rows.append(first_row + cells)
        weights.append(view_weights[:, None] * shares)
        first_row += height * width
    weight = np.concatenate(weights, axis=1)
    total = weight.sum(axis=1)
    # A point without any weight keeps zeros instead of 0 / 0.
    weight /= np.where(total > 0, total, 1.0)[:, None]
    table, row = _as_table(feature_maps), np.concatenate(rows, axis=1)
    if describe is not None:
        table, row = _describe_used(table, row, weight, describe)
    features = _sum_rows(
        table.to(config.dtype),
        torch.from_numpy(row),
        torch.from_numpy(weight).to(config.dtype),
    )
    confidence = total / len(views)
    return LiftedFeatures(features=features, confidence=confidence.astype(np.float32))


def _as_table(feature_maps: Sequence[Tensor] | Tensor) -> Tensor:
    """Return the cells of all maps as rows, (cells, C)."""
    if isinstance(feature_maps, Tensor):
        return feature_maps.permute(0, 2, 3, 1).flatten(0, 2)
    return torch.cat([m.permute(1, 2, 0).flatten(0, 1) for m in feature_maps])


def _describe_used(
    table: Tensor, rows: np.ndarray, weight: np.ndarray, describe: Describe
) -> tuple[Tensor, np.ndarray]:
    """Return the features of the rows that have weight, and where `rows` are among them."""
    is_used = np.zeros(len(table), bool)
    is_used[rows[weight > 0]] = True
    is_used[0] = True  # where no row has weight, the sums still need one
    position = np.cumsum(is_used) - 1  # that of a row without weight does not matter
    return describe(table[torch.from_numpy(is_used)]), position[rows]


def _sum_rows(table: Tensor, rows: Tensor, weights: Tensor) -> np.ndarray:
    """Return the weighted sums of rows, (N, C) float32, scaled to unit length where not zero."""
    # numpy asks for large pages, torch does not: for 60 MB the faults alone would cost 20 ms.
    features = np.empty((len(rows), table.shape[1]), np.float32)
    for start in range(0, len(rows), _CHUNK):
        part = slice(start, start + _CHUNK)
        # Eq. (2) and (3) at once.
        summed = F.embedding_bag(rows[part], table, per_sample_weights=weights[part], mode="sum")
        unit = torch.from_numpy(features[part]).copy_(summed)
        unit /= torch.linalg.vector_norm(unit, dim=1, keepdim=True).clamp_min_(_TINY)
    return features


def _observe(
    points: np.ndarray, view: CameraView, config: LiftingConfig
) -> tuple[np.ndarray, np.ndarray]:
    """Return (N, 2) pixels, zero where not in the image, and (N,) weights v * omega."""
    pixels, d_true = view.project(points)
    nearest = np.floor(np.where(d_true[:, None] > 0, pixels, -1.0) + 0.5)
    image_size = (view.intrinsics.width, view.intrinsics.height)
    is_inside = (nearest >= 0) & (nearest < image_size)
    is_inside = is_inside[:, 0] & is_inside[:, 1]  # np.all over two columns takes ten times as long
    column, row = np.where(is_inside[:, None], nearest, 0).astype(np.int64).T
    # The nearest pixel, not an interpolation: at an edge that would invent a depth between two
    # surfaces.
    d_meas = np.where(is_inside, view.depth_m[row, column], 0.0)
    delta = np.where(d_meas > 0, d_meas - d_true, np.nan)
    return np.where(is_inside[:, None], pixels, 0.0), depth_weights(delta, config)


def _bilinear(
    pixels: np.ndarray, view: CameraView, height: int, width: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return (N, 4) indices of the cells around each pixel and their (N, 4) shares (eq. 2)."""
    scale = (width / view.intrinsics.width, height / view.intrinsics.height)
    grid = (pixels + 0.5) * scale - 0.5
    grid = np.clip(grid, 0.0, (width - 1.0, height - 1.0))  # no extrapolation at the border
    low = grid.astype(np.int32)  # not negative: rounds down
    (x, y), (fx, fy) = low.T, (grid - low).T
    x1, y1 = np.minimum(x + 1, width - 1), np.minimum(y + 1, height - 1) * width
    y = y * width
    cells = np.stack([y + x, y + x1, y1 + x, y1 + x1], axis=1)
    shares = np.stack(
        [(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy],
        axis=1,
    )
    return cells, shares


def _check_maps(views: Sequence[CameraView], feature_maps: Sequence[Tensor] | Tensor) -> None:
    if len(views) != len(feature_maps):
        raise InvalidCloudError(
            f"Got {len(feature_maps)} feature maps for {len(views)} views; expected one each."
        )
    channels = {m.shape[0] for m in feature_maps if m.ndim == 3}
    if len(channels) != 1 or any(m.ndim != 3 for m in feature_maps):
        shapes = ", ".join(str(tuple(m.shape)) for m in feature_maps)
        raise InvalidCloudError(
            f"Feature maps are {shapes}; expected (C, h, w) with one C for all."
        )
