"""What a policy sees of the scene and the instruction."""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from policy.actions import ACTION_KINDS, ActionKind
from policy.arrays import check_range, checked_array
from policy.errors import InvalidArrayError
from policy.images import ImageSource
from policy.objects import SceneObjects

PlaceSide = Literal["inside", "outside"]
"""Where to put something down: in or on a reference, or around it."""


@dataclass(frozen=True, kw_only=True)
class Observation:
    """A cloud of semantic features and an instruction, as plain arrays.

    Nothing here needs ground truth: all of it comes from camera images and text. Arrays are
    copied, checked and made read-only.

    Attributes:
        points: (N, 3) float32 in the world, metres. N may be 0.
        features: (N, C) float32 visual features in the text's space, unit rows.
        similarity: (N,) float32 similarity of each point to the instruction.
        confidence: (N,) float32, at least 0; how well the views agree on the point.
        text_tokens: (T, C) float32 features of the instruction's tokens, padding left out.
        text_pooled: (C,) float32 feature of the whole instruction.
        workspace_min: (3,) float64 lower corner of the workspace in the world, metres.
        workspace_max: (3,) float64 upper corner of the workspace in the world, metres.
        phase: Which action is to be chosen; an instruction that says what to pick and where to
            put it is followed one phase after the other.
        phrase_pooled: (C,) float32 text feature of the phrase that `similarity` looks for: in the
            pick phase what to pick, in the place phase the reference; None where the instruction
            is not taken apart, and `similarity` is that to all of it.
        relation: Word for the place relative to the reference, such as "near"; None in the pick
            phase, or where the instruction names none.
        side: What the relation asks for: a place in or on the reference, or one around it.
        images: Describes the pictures themselves to the few policies that ask; None where there
            are none, as in demonstrations.
        objects: Segments of the cloud, if they were found already; a policy that needs them finds
            them otherwise.

    Raises:
        InvalidArrayError: If a field has a wrong shape or value, or the fields don't fit.
    """

    points: np.ndarray
    features: np.ndarray
    similarity: np.ndarray
    confidence: np.ndarray
    text_tokens: np.ndarray
    text_pooled: np.ndarray
    workspace_min: np.ndarray
    workspace_max: np.ndarray
    phase: ActionKind = "pick"
    phrase_pooled: np.ndarray | None = None
    relation: str | None = None
    side: PlaceSide | None = None
    images: ImageSource | None = None
    objects: SceneObjects | None = None

    def __post_init__(self) -> None:
        """Check the fields and replace the arrays by read-only copies."""
        sizes: dict[str, int] = {}
        shapes: dict[str, tuple[int | str, ...]] = {
            "points": ("N", 3),
            "features": ("N", "C"),
            "similarity": ("N",),
            "confidence": ("N",),
            "text_tokens": ("T", "C"),
            "text_pooled": ("C",),
        }
        for name, shape in shapes.items():
            array = checked_array(name, getattr(self, name), shape, sizes=sizes)
            object.__setattr__(self, name, array)
        if self.phrase_pooled is not None:
            phrase = checked_array("phrase_pooled", self.phrase_pooled, ("C",), sizes=sizes)
            object.__setattr__(self, "phrase_pooled", phrase)
        for name in ("workspace_min", "workspace_max"):
            corner = checked_array(name, getattr(self, name), (3,), dtype=np.float64)
            object.__setattr__(self, name, corner)
        check_range("confidence", self.confidence, 0.0)
        if not (self.workspace_min < self.workspace_max).all():
            raise InvalidArrayError(
                f"workspace: got corners {self.workspace_min.tolist()} and "
                f"{self.workspace_max.tolist()}, expected min < max on every axis."
            )
        self._check_phase()

    def _check_phase(self) -> None:
        if self.phase not in ACTION_KINDS:
            raise InvalidArrayError(f"phase: got {self.phase!r}, expected 'pick' or 'place'.")
        if self.side not in (None, *get_args(PlaceSide)):
            raise InvalidArrayError(f"side: got {self.side!r}, expected 'inside' or 'outside'.")
        if (self.relation is None) != (self.side is None):
            raise InvalidArrayError(
                f"relation and side: got {self.relation!r} and {self.side!r}, expected both or "
                "neither."
            )
        if self.phase == "pick" and self.relation is not None:
            raise InvalidArrayError(
                f"relation: got {self.relation!r} in the pick phase, expected None."
            )

    @property
    def num_points(self) -> int:
        """Number N of points."""
        return len(self.points)

    @property
    def feature_dim(self) -> int:
        """Number C of feature channels."""
        return self.features.shape[1]
