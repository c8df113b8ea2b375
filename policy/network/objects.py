"""Segments of several clouds as a network takes them."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import torch
from torch import Tensor

from policy.errors import InvalidArrayError
from policy.network.padding import pad
from policy.objects import SceneObjects


@dataclass(frozen=True, kw_only=True)
class ObjectBatch:
    """Segments of B decisions, padded to a common number S, at least 1.

    Attributes:
        features: (B, S, C) mean visual features.
        similarity: (B, S) mean similarity to the instruction.
        positions: (B, S, 3) normalised positions.
        sizes: (B, S, 3) normalised sizes.
        mask: (B, S) True for real segments.
    """

    features: Tensor
    similarity: Tensor
    positions: Tensor
    sizes: Tensor
    mask: Tensor

    def to(self, device: torch.device | str) -> "ObjectBatch":
        """Copy every tensor to a device."""
        return ObjectBatch(**{f.name: getattr(self, f.name).to(device) for f in fields(self)})


def collate_objects(objects: Sequence[SceneObjects | None]) -> ObjectBatch | None:
    """Pad the segments of several decisions to a common number.

    Args:
        objects: Those of each decision, normalised; None for a network that looks at points.

    Returns:
        The padded segments, on the CPU; None if no decision has any to be looked at.

    Raises:
        InvalidArrayError: If some decisions have segments and others don't.
    """
    present = [found for found in objects if found is not None]
    if not present:
        return None
    if len(present) < len(objects):
        raise InvalidArrayError(
            f"samples: got objects in {len(present)} of {len(objects)}, expected all or none."
        )
    features, mask = pad([found.features for found in present])
    return ObjectBatch(
        features=features,
        similarity=pad([found.similarity for found in present])[0],
        positions=pad([found.positions for found in present])[0],
        sizes=pad([found.sizes for found in present])[0],
        mask=mask,
    )
