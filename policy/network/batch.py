"""One decision as the network takes it, and padded batches of them."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import torch
from jaxtyping import Int
from torch import Tensor

from policy.actions import ActionCandidates
from policy.arrays import check_range, checked_array
from policy.errors import InvalidArrayError
from policy.network.config import NetworkConfig
from policy.network.objects import ObjectBatch, collate_objects
from policy.network.padding import pad
from policy.network.selection import select_points
from policy.objects import SceneObjects, find_objects
from policy.observation import Observation

PHASES = ("pick", "place", "place inside", "place outside")
"""What is to be chosen; "place" alone where the instruction's relation was not understood."""


@dataclass(frozen=True, kw_only=True)
class DecisionSample:
    """One decision: a thinned cloud, an instruction, candidates. Arrays are read-only.

    Attributes:
        positions: (N, 3) float32 positions; the workspace spans [-1, 1].
        features: (N, C) float32 visual features.
        similarity: (N,) float32 similarity to the instruction.
        tokens: (T, C) float32 features of the instruction's tokens.
        pooled: (C,) float32 feature of the whole instruction.
        phrase: (C,) float32 feature of the phrase that the similarity looks for.
        poses: (K, 7) float32 candidates: normalised position, quaternion x, y, z, w.
        prior: (K,) float32 geometric quality, 0 (bad) to 1 (good).
        phase: Index into `PHASES`.
        objects: Segments of the cloud, normalised, for a network that looks at them.

    Raises:
        InvalidArrayError: If a field has a wrong shape or value, or the fields don't fit.
    """

    positions: np.ndarray
    features: np.ndarray
    similarity: np.ndarray
    tokens: np.ndarray
    pooled: np.ndarray
    phrase: np.ndarray
    poses: np.ndarray
    prior: np.ndarray
    phase: int
    objects: SceneObjects | None = None

    def __post_init__(self) -> None:
        """Check the fields and replace the arrays by read-only copies."""
        sizes: dict[str, int] = {}
        shapes: dict[str, tuple[int | str, ...]] = {
            "positions": ("N", 3),
            "features": ("N", "C"),
            "similarity": ("N",),
            "tokens": ("T", "C"),
            "pooled": ("C",),
            "phrase": ("C",),
            "poses": ("K", 7),
            "prior": ("K",),
        }
        for name, shape in shapes.items():
            array = checked_array(name, getattr(self, name), shape, sizes=sizes)
            object.__setattr__(self, name, array)
        check_range("prior", self.prior, 0.0, 1.0)
        if self.objects is not None and self.objects.features.shape[1] != sizes["C"]:
            raise InvalidArrayError(
                f"objects: got features of {self.objects.features.shape[1]} channels, expected "
                f"{sizes['C']} as in features."
            )
        if self.phase not in range(len(PHASES)):
            names = ", ".join(f"{i} ({name})" for i, name in enumerate(PHASES))
            raise InvalidArrayError(f"phase: got {self.phase!r}, expected one of {names}.")


@dataclass(frozen=True, kw_only=True)
class DecisionBatch:
    """B decisions padded to common sizes N, T and K, each at least 1.

    Attributes:
        positions: (B, N, 3) normalised positions.
        features: (B, N, C) visual features.
        similarity: (B, N) similarity to the instruction.
        point_mask: (B, N) True for real points.
        tokens: (B, T, C) token features.
        token_mask: (B, T) True for real tokens.
        pooled: (B, C) feature of the instruction.
        phrase: (B, C) feature of the phrase that is looked for.
        poses: (B, K, 7) normalised candidates.
        prior: (B, K) geometric quality of the candidates.
        candidate_mask: (B, K) True for real candidates.
        phase: (B,) int64, index into `PHASES`.
        objects: Segments of the clouds, for a network that looks at them; else None.
    """

    positions: Tensor
    features: Tensor
    similarity: Tensor
    point_mask: Tensor
    tokens: Tensor
    token_mask: Tensor
    pooled: Tensor
    phrase: Tensor
    poses: Tensor
    prior: Tensor
    candidate_mask: Tensor
    phase: Tensor
    objects: ObjectBatch | None = None

    def to(self, device: torch.device | str) -> "DecisionBatch":
        """Copy every tensor to a device."""
        copies: dict[str, Any] = {}
        for f in fields(self):
            value = getattr(self, f.name)
            copies[f.name] = None if value is None else value.to(device)
        return DecisionBatch(**copies)

    def take_points(self, order: Int[Tensor, "batch points"]) -> "DecisionBatch":
        """Reorder the points of every decision.

        Args:
            order: For each decision a permutation of its points, padding included.

        Returns:
            The same decisions with their points in that order.
        """
        index = order[..., None]
        return replace(
            self,
            positions=self.positions.take_along_dim(index, dim=1),
            features=self.features.take_along_dim(index, dim=1),
            similarity=self.similarity.take_along_dim(order, dim=1),
            point_mask=self.point_mask.take_along_dim(order, dim=1),
        )


def make_sample(
    observation: Observation,
    candidates: ActionCandidates,
    config: NetworkConfig,
    *,
    chosen: Int[np.ndarray, " M"] | None = None,
) -> DecisionSample:
    """Thin the cloud and normalise positions to the workspace.

    Args:
        observation: The scene's feature cloud and the instruction.
        candidates: K candidates.
        config: Limits the points, says which to take and whether objects are looked at.
        chosen: Indices of the points to take instead, such as those of an earlier call of
            `choose_points`.

    Returns:
        The decision as the network takes it.

    Raises:
        InvalidArrayError: If the features have another size than the network's.
    """
    if observation.feature_dim != config.feature_dim:
        raise InvalidArrayError(
            f"features: got {observation.feature_dim} channels, expected {config.feature_dim} as "
            "in the network. Use the encoder that the network was trained with."
        )
    if chosen is None:
        chosen = choose_points(observation, config)
    center = (observation.workspace_max + observation.workspace_min) / 2
    half = (observation.workspace_max - observation.workspace_min) / 2
    phrase = observation.phrase_pooled
    side = observation.side if candidates.kind == "place" else None
    objects = None
    if config.uses_objects:
        objects = observation.objects
        if objects is None:
            objects = find_objects(observation.points, observation.features, observation.similarity)
        objects = objects.normalised(center, half)
    poses = candidates.as_pose7()
    poses[:, :3] = (candidates.positions - center) / half
    return DecisionSample(
        positions=(observation.points[chosen] - center) / half,
        features=observation.features[chosen],
        similarity=observation.similarity[chosen],
        tokens=observation.text_tokens,
        pooled=observation.text_pooled,
        phrase=observation.text_pooled if phrase is None else phrase,
        poses=poses,
        prior=candidates.prior,
        phase=PHASES.index(" ".join((candidates.kind, *filter(None, [side])))),
        objects=objects,
    )


def choose_points(observation: Observation, config: NetworkConfig) -> Int[np.ndarray, " M"]:
    """Choose the points of a cloud that the network gets to see.

    Args:
        observation: The scene's feature cloud.
        config: Limits the points and says which to take.

    Returns:
        Their indices.
    """
    return select_points(
        observation.points,
        observation.similarity,
        max_points=config.max_points,
        method=config.point_selection,
    )


def collate(samples: Sequence[DecisionSample]) -> DecisionBatch:
    """Pad decisions to common sizes.

    Args:
        samples: At least one decision, all with the same number of channels.

    Returns:
        The batch, on the CPU.

    Raises:
        InvalidArrayError: If there are no samples or their channels differ.
    """
    if not samples:
        raise InvalidArrayError("samples: got 0, expected at least 1.")
    channels = sorted({sample.features.shape[1] for sample in samples})
    if len(channels) > 1:
        raise InvalidArrayError(f"samples: got features of {channels} channels, expected one size.")
    positions, point_mask = pad([sample.positions for sample in samples])
    tokens, token_mask = pad([sample.tokens for sample in samples])
    poses, candidate_mask = pad([sample.poses for sample in samples])
    return DecisionBatch(
        positions=positions,
        features=pad([sample.features for sample in samples])[0],
        similarity=pad([sample.similarity for sample in samples])[0],
        point_mask=point_mask,
        tokens=tokens,
        token_mask=token_mask,
        pooled=torch.from_numpy(np.stack([sample.pooled for sample in samples])),
        phrase=torch.from_numpy(np.stack([sample.phrase for sample in samples])),
        poses=poses,
        prior=pad([sample.prior for sample in samples])[0],
        candidate_mask=candidate_mask,
        phase=torch.tensor([sample.phase for sample in samples]),
        objects=collate_objects([sample.objects for sample in samples]),
    )
