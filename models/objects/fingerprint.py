"""A short hash of what decides how an object falls and lies."""

import dataclasses
import hashlib
import itertools
import json
from collections.abc import Iterator

import numpy as np

from models.objects.asset import ObjectAsset
from models.objects.mjcf_object import MjcfObject

_PRODUCTS = ((0, 1), (0, 2), (1, 2))
"""Entries of an inertia matrix besides its diagonal."""


def fingerprint(asset: ObjectAsset | MjcfObject) -> str:
    """Hash an object's geometry and mass; colours and words do not count.

    Args:
        asset: The object.

    Returns:
        16 hexadecimal digits, the same whatever the sign of its zeros.
    """
    return next(_fingerprints(asset))


def matches(asset: ObjectAsset | MjcfObject, stored: str) -> bool:
    """Tell whether a fingerprint is that of an object.

    Products of inertia that round to zero keep the sign of their rounding error, which depends on
    the processor. Fingerprints of earlier versions hashed it, so that every sign is tried.

    Args:
        asset: The object.
        stored: Its fingerprint, made on this machine or another.

    Returns:
        Whether geometry and mass are those that were hashed.
    """
    return any(stored == found for found in _fingerprints(asset))


def _fingerprints(asset: ObjectAsset | MjcfObject) -> Iterator[str]:
    """Hash an object with every combination of signs of its products of inertia that are zero."""
    start = hashlib.sha256()
    for array in (asset.vertices, asset.faces, asset.center_of_mass):
        start.update(array.tobytes())
    end = json.dumps(_plain(asset), sort_keys=True).encode()
    zeros = [entry for entry in _PRODUCTS if asset.inertia[entry] == 0]
    for signs in itertools.product((0.0, -0.0), repeat=len(zeros)):
        inertia = np.array(asset.inertia)
        for (row, column), zero in zip(zeros, signs, strict=True):
            inertia[row, column] = inertia[column, row] = zero
        digest = start.copy()
        digest.update(inertia.tobytes() + end)
        yield digest.hexdigest()[:16]


def _plain(asset: ObjectAsset | MjcfObject) -> list:
    """List what is hashed besides arrays."""
    if not isinstance(asset, ObjectAsset):
        return [asset.mass_kg, asset.xml]
    parts = [
        {**dataclasses.asdict(part), "vertices": part.vertices.tolist()} for part in asset.collision
    ]
    return [asset.mass_kg, asset.rolls, *parts]
