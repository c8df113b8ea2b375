"""Arrays that are checked once and then read-only, for the values passed between stages."""

from typing import Any

import numpy as np

from policy.errors import InvalidArrayError


def checked_array(
    name: str,
    value: Any,
    shape: tuple[int | str, ...],
    *,
    dtype: type[np.generic] = np.float32,
    sizes: dict[str, int] | None = None,
) -> np.ndarray:
    """Copy a value into a finite, contiguous, read-only array of the given shape.

    Args:
        name: Name for the error message.
        value: Anything that `numpy.asarray` takes; real numbers only.
        shape: Expected shape; a string stands for a size that is free at its first use.
        dtype: Type of the result.
        sizes: Sizes of the named dimensions met so far. New names are added, so that one
            dictionary shared by several calls makes their dimensions agree.

    Returns:
        A read-only copy.

    Raises:
        InvalidArrayError: If the value isn't numeric, has another shape, or isn't finite.
    """
    sizes = {} if sizes is None else sizes
    array = np.asarray(value)
    if array.dtype.kind not in "fiu":
        raise InvalidArrayError(f"{name}: got dtype {array.dtype}, expected real numbers.")
    if not _matches(array.shape, shape, sizes):
        raise InvalidArrayError(
            f"{name}: got shape {array.shape}, expected {_describe(shape, sizes)}."
        )
    sizes.update(
        {key: n for key, n in zip(shape, array.shape, strict=True) if isinstance(key, str)}
    )
    array = np.array(array, dtype=dtype, order="C")
    num_bad = array.size - int(np.count_nonzero(np.isfinite(array)))
    if num_bad:
        raise InvalidArrayError(
            f"{name}: got {num_bad} values that are NaN or infinite, expected finite values."
        )
    array.flags.writeable = False
    return array


def check_range(name: str, array: np.ndarray, low: float, high: float = np.inf) -> None:
    """Check that every value lies in a closed interval.

    Args:
        name: Name for the error message.
        array: Finite array of any shape.
        low: Smallest value allowed.
        high: Largest value allowed; infinity for none.

    Raises:
        InvalidArrayError: If a value lies outside.
    """
    if array.size and (array.min() < low or array.max() > high):
        expected = f"at least {low:g}" if np.isinf(high) else f"{low:g} to {high:g}"
        raise InvalidArrayError(
            f"{name}: got values from {array.min():g} to {array.max():g}, expected {expected}."
        )


def _matches(got: tuple[int, ...], shape: tuple[int | str, ...], sizes: dict[str, int]) -> bool:
    if len(got) != len(shape):
        return False
    known = [
        sizes.get(key, n) if isinstance(key, str) else key
        for key, n in zip(shape, got, strict=True)
    ]
    return tuple(known) == got


def _describe(shape: tuple[int | str, ...], sizes: dict[str, int]) -> str:
    parts = [f"{key}={sizes[key]}" if key in sizes else str(key) for key in shape]
    return f"({', '.join(parts)}{',' if len(parts) == 1 else ''})"
