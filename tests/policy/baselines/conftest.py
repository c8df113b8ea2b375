"""Tables with blocks on them, seen as clouds of feature points 8 mm apart."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from jaxtyping import install_import_hook

from policy.actions import ActionCandidates
from policy.observation import Observation

# Not `segments`: its inner loop calls a function for every pair of neighbours.
install_import_hook(
    [
        f"policy.baselines.{name}"
        for name in ("clip_grounding", "lerf_togo", "one_phase", "raw_image", "think_grasp", "vlp")
    ],
    "beartype.beartype",
)

VOXEL_M = 0.008
BlocksMaker = Callable[..., Observation]
GraspsMaker = Callable[..., ActionCandidates]


@dataclass(frozen=True, kw_only=True)
class Block:
    """A box with upright sides.

    Attributes:
        x: Middle, metres.
        y: Middle, metres.
        size: Edges along x and y, metres.
        bottom: Height of the lower face, metres.
        top: Height of the upper face, metres.
        similarity: Similarity of its points to the phrase.
    """

    x: float
    y: float
    size: tuple[float, float] = (0.056, 0.056)
    bottom: float = 0.008
    top: float = 0.048
    similarity: float = 0.2

    def points(self) -> np.ndarray:
        """(P, 3) points of the upper face and the sides, metres."""
        axes = [
            np.arange(middle - size / 2, middle + size / 2 + 1e-6, VOXEL_M)
            for middle, size in ((self.x, self.size[0]), (self.y, self.size[1]))
        ]
        heights = np.arange(self.top, self.bottom - 1e-6, -VOXEL_M)
        x, y, z = (a.ravel() for a in np.meshgrid(*axes, heights, indexing="ij"))
        is_edge = (x == axes[0][0]) | (x == axes[0][-1]) | (y == axes[1][0]) | (y == axes[1][-1])
        return np.stack([x, y, z], axis=1)[is_edge | (z == heights[0])]


@pytest.fixture
def make_blocks(make_observation: Any) -> BlocksMaker:
    def make(
        blocks: Sequence[Block], *, noise: float = 0.0, target: int = 0, **changes: object
    ) -> Observation:
        """Points on each block have a feature of their own; the phrase is that of the target."""
        rng = np.random.default_rng(0)
        clouds = [block.points() for block in blocks]
        owner = np.repeat(np.arange(len(blocks)), [len(cloud) for cloud in clouds])
        prototypes = np.eye(16)
        features = prototypes[owner] + noise * rng.normal(size=(len(owner), 16))
        features /= np.linalg.norm(features, axis=1, keepdims=True)
        similarity = np.array([block.similarity for block in blocks])[owner]
        fields = {
            "points": np.concatenate(clouds),
            "features": features,
            "similarity": similarity + noise * 0.1 * rng.normal(size=len(owner)),
            "confidence": np.ones(len(owner)),
            "phrase_pooled": prototypes[target],
        }
        return make_observation(rng, len(owner), **(fields | changes))

    return make


@pytest.fixture
def make_grasps() -> GraspsMaker:
    def make(
        positions: Sequence[Sequence[float]] | np.ndarray,
        prior: np.ndarray | Sequence[float] | float = 0.5,
        kind: str = "pick",
    ) -> ActionCandidates:
        poses = np.tile(np.eye(4), (len(positions), 1, 1))
        poses[:, :3, 3] = np.reshape(positions, (-1, 3))
        return ActionCandidates(
            kind=kind,  # pyright: ignore[reportArgumentType]
            Ts_world_tool=poses,
            width_m=np.full(len(positions), 0.04),
            prior=np.broadcast_to(prior, len(positions)),
        )

    return make


@pytest.fixture
def empty(make_observation: Any) -> Observation:
    """An observation without points."""
    rows = {name: np.zeros(0) for name in ("similarity", "confidence")}
    clouds = {"points": np.zeros((0, 3)), "features": np.zeros((0, 16))}
    return make_observation(np.random.default_rng(0), 0, **rows, **clouds)


@pytest.fixture
def block() -> type[Block]:
    return Block
