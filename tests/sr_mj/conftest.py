"""Poses and clouds in plain numbers, shared by the tests of planning."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

PoseMaker = Callable[..., np.ndarray]
BlockMaker = Callable[..., np.ndarray]


@pytest.fixture(scope="session")
def pose_down() -> PoseMaker:
    """Makes poses of a tool that points straight down."""

    def make(x: float, y: float, z: float, yaw: float = 0.0) -> np.ndarray:
        pose = np.eye(4)
        turn = Rotation.from_euler("z", yaw) * Rotation.from_euler("x", np.pi)
        pose[:3, :3] = turn.as_matrix()
        pose[:3, 3] = x, y, z
        return pose

    return make


@pytest.fixture(scope="session")
def block() -> BlockMaker:
    """Makes points that fill a box."""

    def make(low: Sequence[float], high: Sequence[float], step: float = 0.006) -> np.ndarray:
        axes = [np.arange(a, b, step) for a, b in zip(low, high, strict=True)]
        return np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3).astype(np.float32)

    return make
