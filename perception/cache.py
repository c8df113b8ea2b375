"""A small cache that forgets what was used longest ago, and hashes of what arrays contain."""

import hashlib
from collections import OrderedDict
from typing import Generic, TypeVar

import numpy as np

from perception.views import CameraView

Value = TypeVar("Value")


class LruCache(Generic[Value]):
    """Remembers the values of the last keys."""

    def __init__(self, capacity: int) -> None:
        """Create an empty cache.

        Args:
            capacity: Number of values to remember; 0 remembers none.
        """
        self.capacity = capacity
        self._values: OrderedDict[str, Value] = OrderedDict()

    def get(self, key: str) -> Value | None:
        """Return the value of a key, or None if it is not remembered.

        Args:
            key: The key.

        Returns:
            The value, which thereby becomes the one used last.
        """
        if key not in self._values:
            return None
        self._values.move_to_end(key)
        return self._values[key]

    def put(self, key: str, value: Value) -> None:
        """Remember a value, forgetting what was used longest ago if there are too many.

        Args:
            key: The key.
            value: The value.
        """
        self._values[key] = value
        self._values.move_to_end(key)
        while len(self._values) > self.capacity:
            self._values.popitem(last=False)


def hash_image(rgb: np.ndarray) -> str:
    """Return a hash of an image's size and pixels.

    Args:
        rgb: (H, W, 3) uint8.

    Returns:
        Hexadecimal digits.
    """
    return hashlib.sha256(str(rgb.shape).encode() + rgb.tobytes()).hexdigest()


def hash_view(view: CameraView) -> str:
    """Return a hash of all that a view holds.

    Args:
        view: The view.

    Returns:
        Hexadecimal digits.
    """
    digest = hashlib.sha256(f"{view.name}|{view.intrinsics}".encode())
    for array in (view.rgb, view.depth_m, view.T_world_cam_cv):
        digest.update(array.tobytes())
    return digest.hexdigest()
