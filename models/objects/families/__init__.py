"""Parametric families: each function shapes and paints one kind of object.

A family is a pure function of its parameters (dimensions, colours, printed words, `seed`): the
same parameters give the same bytes. Lengths are in metres.

`sample(rng)` draws endless further variants; `FAMILIES` names the families that it draws from.

Example:
    >>> import numpy as np
    >>> from models.objects import families
    >>> families.sample(np.random.default_rng(0), family="mug").split
    'sampled'
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from models.objects.variants.sampling import FAMILIES, sample

__all__ = ["FAMILIES", "sample"]


def __getattr__(name: str) -> Any:
    """Import what draws variants on first use: it imports every family in turn."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from models.objects.variants import sampling

    return getattr(sampling, name)
