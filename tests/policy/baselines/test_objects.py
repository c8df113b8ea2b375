import math
from dataclasses import replace

import numpy as np
import pytest

from policy.errors import InvalidArrayError
from policy.objects import SceneObjects, find_objects, object_labels
from policy.training.augmentation import ChannelChange


@pytest.fixture
def scene(make_blocks, block):
    """A square block, a long one of two voxels' height, and a speck."""
    return make_blocks(
        [
            block(x=0.4, y=-0.1, similarity=0.3),
            block(x=0.6, y=0.1, size=(0.024, 0.104), top=0.024, similarity=0.1),
            block(x=0.4, y=0.15, size=(0.008, 0.008), bottom=0.008, top=0.016, similarity=0.9),
        ],
        noise=0.02,
    )


def _find(observation) -> SceneObjects:
    return find_objects(observation.points, observation.features, observation.similarity)


def test_objects_of_blocks(scene) -> None:
    objects = _find(scene)
    order = np.argsort(objects.positions[:, 0])
    assert len(objects) == 2  # the speck has fewer points than an object
    np.testing.assert_allclose(
        objects.positions[order], [[0.4, -0.1, 0.028], [0.6, 0.1, 0.016]], atol=1e-6
    )
    np.testing.assert_allclose(
        objects.sizes[order], [[0.056, 0.056, 0.04], [0.104, 0.024, 0.016]], atol=0.025
    )
    np.testing.assert_allclose(objects.sizes[order[1]], [0.104, 0.024, 0.016], atol=1e-6)
    np.testing.assert_allclose(objects.similarity[order], [0.3, 0.1], atol=0.005)
    assert objects.features[order].argmax(axis=1).tolist() == [0, 1]


def test_what_is_seen_moved_is_what_was_seen_and_moved(scene) -> None:
    """Turning and changing channels afterwards is doing so first; segments are found once."""
    angle = 0.7
    T = np.eye(4)
    T[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    T[:3, 3] = [0.05, -0.03, 0.0]
    change = ChannelChange(order=np.roll(np.arange(16), 3), factor=np.linspace(-1, 2, 16))
    moved = replace(
        scene, points=scene.points @ T[:3, :3].T + T[:3, 3], features=change(scene.features)
    )
    first, second = _find(moved), _find(scene).moved(T)
    second = replace(second, features=change(second.features))
    one, two = (np.argsort(found.positions[:, 0]) for found in (first, second))
    np.testing.assert_allclose(first.features[one], second.features[two], atol=1e-6)
    np.testing.assert_allclose(first.similarity[one], second.similarity[two], atol=1e-6)
    # The square block has no axes of its own; the long one keeps its box.
    np.testing.assert_allclose(first.positions[one][1], second.positions[two][1], atol=1e-4)
    np.testing.assert_allclose(first.sizes[one][1], second.sizes[two][1], atol=1e-4)


def test_normalised_to_the_workspace(scene) -> None:
    objects = _find(scene)
    half = np.array([0.224, 0.224, 0.2])
    units = objects.normalised(np.array([0.5, 0.0, 0.2]), half)
    np.testing.assert_allclose(
        units.positions, (objects.positions - [0.5, 0, 0.2]) / half, atol=1e-6
    )
    np.testing.assert_allclose(units.sizes, objects.sizes / half, atol=1e-6)


def test_points_are_objects_if_nothing_larger_is(make_blocks, block, empty) -> None:
    lone = np.array([[0.4, 0.0, 0.1], [0.5, 0.0, 0.1], [0.5, 0.004, 0.1]])
    assert sorted(object_labels(lone).tolist()) == [0, 1, 1]
    assert len(_find(empty)) == 0
    assert _find(empty).features.shape == (0, 16)


def test_specks_have_no_label(scene) -> None:
    labels = object_labels(scene.points)
    assert set(labels.tolist()) == {-1, 0, 1}
    assert (scene.similarity[labels == -1] > 0.8).all()


def test_bad_objects() -> None:
    good = {
        "features": np.zeros((2, 4)),
        "similarity": np.zeros(2),
        "positions": np.zeros((2, 3)),
        "sizes": np.ones((2, 3)),
    }
    with pytest.raises(InvalidArrayError) as caught:
        SceneObjects(**(good | {"similarity": np.zeros(3)}))
    assert str(caught.value) == "objects.similarity: got shape (3,), expected (S=2,)."
    with pytest.raises(InvalidArrayError, match=r"objects\.sizes: got values from -1 to -1"):
        SceneObjects(**(good | {"sizes": -np.ones((2, 3))}))
