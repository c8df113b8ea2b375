"""Shared by the tests of the catalogue's objects and of their variants."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from models.objects.collision import CollisionPart


@pytest.fixture(scope="session")
def reach() -> Callable[[CollisionPart, np.ndarray], float]:
    """Tells how far a part reaches along a unit direction, metres."""

    def measure(part: CollisionPart, direction: np.ndarray) -> float:
        turn = Rotation.from_quat(part.quat_wxyz, scalar_first=True)
        local, size = turn.inv().apply(direction), part.size
        reach = {
            "box": lambda: float(np.abs(local) @ size),
            "sphere": lambda: size[0],
            "ellipsoid": lambda: float(np.linalg.norm(local * size)),
            "capsule": lambda: size[0] + abs(local[2]) * size[1],
            "cylinder": lambda: size[0] * np.hypot(local[0], local[1]) + abs(local[2]) * size[1],
            "convex": lambda: float((part.vertices @ local).max()),
        }[part.kind]()
        return float(np.dot(part.position, direction)) + reach

    return measure
