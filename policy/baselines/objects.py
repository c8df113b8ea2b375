"""From segments to objects: what each looks like, where it is, how large it is."""

import numpy as np
from jaxtyping import Float, Int

from policy.baselines.segments import MIN_POINTS, segment
from policy.objects import SceneObjects


def object_labels(points: Float[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
    """Divide a cloud into objects.

    Args:
        points: (N, 3) the whole cloud, metres; a thinned one falls apart. N may be 0.

    Returns:
        (N,) labels 0..S-1; -1 for points of segments too small for an object, unless all are.
    """
    labels = segment(points)
    is_object = np.bincount(labels) >= MIN_POINTS
    if not is_object.any():
        return labels
    return np.where(is_object, np.cumsum(is_object) - 1, -1)[labels]


def pool_objects(
    points: Float[np.ndarray, "N 3"],
    features: Float[np.ndarray, "N C"],
    similarity: Float[np.ndarray, " N"],
    labels: Int[np.ndarray, " N"],
) -> SceneObjects:
    """Describe the objects of a cloud.

    Args:
        points: (N, 3) the cloud, metres.
        features: (N, C) its features.
        similarity: (N,) its similarities.
        labels: (N,) from `object_labels`.

    Returns:
        One row an object. Features are plain means: a factor on a channel is one on its mean.
    """
    num_objects = int(labels.max(initial=-1)) + 1
    rows = [np.flatnonzero(labels == i) for i in range(num_objects)]
    boxes = [_box(points[row].astype(np.float64)) for row in rows]
    return SceneObjects(
        features=np.reshape([features[row].mean(axis=0) for row in rows], (-1, features.shape[1])),
        similarity=label_means(similarity, labels),
        positions=np.reshape([position for position, _ in boxes], (-1, 3)),
        sizes=np.reshape([size for _, size in boxes], (-1, 3)),
    )


def find_objects(
    points: Float[np.ndarray, "N 3"],
    features: Float[np.ndarray, "N C"],
    similarity: Float[np.ndarray, " N"],
) -> SceneObjects:
    """Find and describe the objects of a cloud.

    Args:
        points: (N, 3) the whole cloud, metres.
        features: (N, C) its features.
        similarity: (N,) its similarities.

    Returns:
        One row an object.
    """
    return pool_objects(points, features, similarity, object_labels(points))


def label_means(
    values: Float[np.ndarray, " N"], labels: Int[np.ndarray, " N"]
) -> Float[np.ndarray, " S"]:
    """Average a value over each object.

    Args:
        values: (N,) one value a point.
        labels: (N,) from `object_labels`.

    Returns:
        (S,) means.
    """
    inside = labels >= 0
    return np.bincount(labels[inside], values[inside].astype(np.float64)) / np.bincount(
        labels[inside]
    )


def _box(points: Float[np.ndarray, "M 3"]) -> tuple[np.ndarray, np.ndarray]:
    """Middle of an upright box around points, and its length, width and height."""
    # The axes that the points spread along most and least, seen from above.
    axes = np.linalg.eigh(np.cov(points[:, :2].T, bias=True))[1]
    along = np.column_stack([points[:, :2] @ axes[:, ::-1], points[:, 2]])
    low, high = along.min(axis=0), along.max(axis=0)
    middle = (low + high) / 2
    return np.append(axes[:, ::-1] @ middle[:2], middle[2]), high - low
