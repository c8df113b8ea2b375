import numpy as np
import pytest

from perception.cloud import FeatureCloud, GeometryCloud
from perception.encoders.base import TextFeatures
from perception.errors import InvalidCloudError


def _feature_arrays(num_points: int = 4, feature_dim: int = 5) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(0)
    features = rng.normal(size=(num_points, feature_dim)).astype(np.float32)
    return {
        "points": rng.normal(size=(num_points, 3)).astype(np.float32),
        "colors": np.zeros((num_points, 3), np.float32),
        "normals": np.tile(np.float32([0, 0, 1]), (num_points, 1)),
        "features": features / np.linalg.norm(features, axis=1, keepdims=True),
        "confidence": np.ones(num_points, np.float32),
        "similarity": np.arange(num_points, dtype=np.float32),
    }


def test_take_keeps_the_order_asked_for() -> None:
    cloud = FeatureCloud(**_feature_arrays())
    taken = cloud.take(np.array([3, 1]))
    assert len(taken) == 2
    np.testing.assert_array_equal(taken.similarity, [3.0, 1.0])
    np.testing.assert_array_equal(taken.features, cloud.features[[3, 1]])


def test_empty_clouds_are_allowed() -> None:
    assert len(FeatureCloud(**_feature_arrays(0))) == 0


def test_arrays_are_read_only() -> None:
    cloud = FeatureCloud(**_feature_arrays())
    with pytest.raises(ValueError, match="read-only"):
        cloud.features[0] = 0


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        (
            "normals",
            np.zeros((4, 3), np.float32),
            "FeatureCloud: 4 of 4 rows of normals are not of unit length; normalise them first.",
        ),
        (
            "features",
            np.full((4, 5), 0.5, np.float32),
            "FeatureCloud: 4 of 4 rows of features are not of unit length; normalise them first.",
        ),
        (
            "confidence",
            np.ones(3, np.float32),
            "FeatureCloud: confidence is float32 (3,), expected float32 (4,).",
        ),
        (
            "features",
            np.zeros(4, np.float32),
            "FeatureCloud: features is float32 (4,), expected float32 (4, C).",
        ),
        (
            "similarity",
            np.full(4, np.nan, np.float32),
            "FeatureCloud: similarity has 4 values that are not finite, expected none.",
        ),
    ],
)
def test_bad_feature_clouds(name: str, value: np.ndarray, message: str) -> None:
    with pytest.raises(InvalidCloudError) as caught:
        FeatureCloud(**{**_feature_arrays(), name: value})
    assert str(caught.value) == message


def test_bad_geometry_cloud() -> None:
    with pytest.raises(InvalidCloudError) as caught:
        GeometryCloud(
            points=np.zeros((2, 2), np.float32),
            colors=np.zeros((2, 3), np.float32),
            normals=np.zeros((2, 3), np.float32),
        )
    assert str(caught.value) == (
        "GeometryCloud: points is float32 (2, 2), expected float32 (2, 3)."
    )


def test_bad_text_features() -> None:
    with pytest.raises(InvalidCloudError) as caught:
        TextFeatures(pooled=np.ones(4, np.float32), tokens=np.ones((3, 5), np.float32))
    assert str(caught.value) == ("TextFeatures: tokens is float32 (3, 5), expected float32 (T, 4).")
