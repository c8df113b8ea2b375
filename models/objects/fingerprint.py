"""A short hash of what decides how an object falls and lies."""

import dataclasses
import hashlib
import json

from models.objects.asset import ObjectAsset
from models.objects.mjcf_object import MjcfObject


def fingerprint(asset: ObjectAsset | MjcfObject) -> str:
    """Hash an object's geometry and mass; colours and words do not count.

    Args:
        asset: The object.

    Returns:
        16 hexadecimal digits.
    """
    digest = hashlib.sha256()
    for array in (asset.vertices, asset.faces, asset.center_of_mass, asset.inertia):
        digest.update(array.tobytes())
    plain: list = [asset.mass_kg]
    if isinstance(asset, ObjectAsset):
        plain.append(asset.rolls)
        for part in asset.collision:
            plain.append({**dataclasses.asdict(part), "vertices": part.vertices.tolist()})
    else:
        plain.append(asset.xml)
    digest.update(json.dumps(plain, sort_keys=True).encode())
    return digest.hexdigest()[:16]
