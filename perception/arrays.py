"""Checking of arrays at the border of the package: once, with one clear line, then read-only."""

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from perception.errors import PerceptionError


def checked_array(
    owner: str,
    name: str,
    value: ArrayLike,
    *,
    shape: tuple[int | str, ...],
    dtype: DTypeLike,
    error: type[PerceptionError],
) -> np.ndarray:
    """Return `value` as a read-only, C-contiguous array of the wanted type.

    Floating-point input is converted between widths; integers and floats are never mixed, since a
    depth image in millimetres or an image in 0..1 is a mistake of the caller, not a matter of type.

    Args:
        owner: What the array belongs to, for the message.
        name: Name of the array, for the message.
        value: The array.
        shape: Wanted shape; a string stands for any length and names it in the message.
        dtype: Wanted type.
        error: The error to raise.

    Returns:
        The array; a view of `value` where neither type nor layout had to change.

    Raises:
        PerceptionError: `error`, if kind, shape or values are wrong.
    """
    array = np.asarray(value)
    wanted = np.dtype(dtype)
    wanted_text = f"({', '.join(str(n) for n in shape)}{',' if len(shape) == 1 else ''})"
    both_float = wanted.kind == "f" and array.dtype.kind == "f"
    same_kind = both_float or array.dtype == wanted
    same_shape = array.ndim == len(shape) and all(
        isinstance(want, str) or want == got for want, got in zip(shape, array.shape, strict=True)
    )
    if not (same_kind and same_shape):
        raise error(
            f"{owner}: {name} is {array.dtype} {array.shape}, expected {wanted} {wanted_text}."
        )
    if wanted.kind == "f" and not np.isfinite(array).all():
        bad = int(array.size - np.isfinite(array).sum())
        raise error(f"{owner}: {name} has {bad} values that are not finite, expected none.")
    checked = np.ascontiguousarray(array, dtype=wanted).view()
    checked.flags.writeable = False
    return checked
