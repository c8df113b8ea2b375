"""A decision of the expert, with what was seen and said when it was made."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from policy.actions import ActionCandidates, ActionKind
from policy.arrays import check_range, checked_array
from policy.errors import InvalidArrayError, InvalidDemonstrationsError
from policy.observation import Observation, PlaceSide


@dataclass(frozen=True, kw_only=True, eq=False)
class Look:
    """A cloud of visual features; what several decisions share. No instruction enters.

    Arrays are copied, checked and made read-only.

    Attributes:
        points: (N, 3) float32 in the world, metres.
        features: (N, C) float32, unit rows to half precision.
        confidence: (N,) float32, at least 0.
        workspace_min: (3,) float64 lower corner of the workspace, metres.
        workspace_max: (3,) float64 upper corner of the workspace, metres.

    Raises:
        InvalidArrayError: If a field has a wrong shape or value, or the fields don't fit.
    """

    points: np.ndarray
    features: np.ndarray
    confidence: np.ndarray
    workspace_min: np.ndarray
    workspace_max: np.ndarray

    def __post_init__(self) -> None:
        """Check the fields and replace the arrays by read-only copies."""
        shapes: dict[str, tuple[int | str, ...]] = {
            "points": ("N", 3),
            "features": ("N", "C"),
            "confidence": ("N",),
        }
        _check_fields(self, shapes, {})
        for name in ("workspace_min", "workspace_max"):
            corner = checked_array(name, getattr(self, name), (3,), dtype=np.float64)
            object.__setattr__(self, name, corner)
        check_range("confidence", self.confidence, 0.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Wording:
    """One way of saying an instruction, as a policy would be told it.

    Attributes:
        text: The instruction's part for the phase.
        tokens: (T, C) float32 features of its tokens.
        pooled: (C,) float32 feature of all of it.
        phrase_pooled: (C,) float32 feature of the phrase that `similarity` looks for; None where
            that is all of the text.
        similarity: (N,) float32 similarity of the look's points to that phrase.

    Raises:
        InvalidArrayError: If a field has a wrong shape or value, or the fields don't fit.
    """

    text: str
    tokens: np.ndarray
    pooled: np.ndarray
    phrase_pooled: np.ndarray | None
    similarity: np.ndarray

    def __post_init__(self) -> None:
        """Check the fields and replace the arrays by read-only copies."""
        if not self.text.strip():
            raise InvalidArrayError(f"text: got {self.text!r}, expected at least one word.")
        shapes: dict[str, tuple[int | str, ...]] = {
            "tokens": ("T", "C"),
            "pooled": ("C",),
            "similarity": ("N",),
        }
        if self.phrase_pooled is not None:
            shapes["phrase_pooled"] = ("C",)
        _check_fields(self, shapes, {})


@dataclass(frozen=True, kw_only=True, eq=False)
class Decision:
    """What the expert chose; it was executed, and the outcome verified as a success.

    Attributes:
        phase: Whether it picked or placed.
        relation: Word for the place relative to the reference; None for picking.
        side: Whether the relation asks for a place in or on the reference, or around it.
        wordings: The instruction, then its paraphrases; at least one.
        candidates: The K candidates that the expert chose among, all within the arm's reach.
        executed: Index of the candidate that was executed.
        valid: (K,) bool, ground truth: a grasp closes on an object of the target set, or, if it
            clears, on the object that is in the way; a place lies in a valid region.
        avoid_collision: (K,) float32, 1 where the straight approach collides, else 0.
        expert_logits: (K,) float32 scores that the expert gave.
        seed: Seed of the scene that it was made in.
        clears: Whether no candidate closes on a target, and a grasp was executed that takes away
            what is in the way.
        objects: Names, in the catalogue, of the objects that the instruction means: what may be
            picked, or what it may be placed by. For splits by object, no input of a policy.

    Raises:
        InvalidArrayError: If a field has a wrong shape or value, or the fields don't fit.
    """

    phase: ActionKind
    relation: str | None
    side: PlaceSide | None
    wordings: tuple[Wording, ...]
    candidates: ActionCandidates
    executed: int
    valid: np.ndarray
    avoid_collision: np.ndarray
    expert_logits: np.ndarray
    seed: int
    clears: bool = False
    objects: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the fields and replace the arrays by read-only copies."""
        num = len(self.candidates)
        valid = np.array(self.valid, bool)
        if valid.shape != (num,):
            raise InvalidArrayError(f"valid: got shape {valid.shape}, expected ({num},).")
        valid.flags.writeable = False
        object.__setattr__(self, "valid", valid)
        shapes: dict[str, tuple[int | str, ...]] = {
            "avoid_collision": ("K",),
            "expert_logits": ("K",),
        }
        _check_fields(self, shapes, {"K": num})
        check_range("avoid_collision", self.avoid_collision, 0.0, 1.0)
        if not self.wordings:
            raise InvalidArrayError("wordings: got none, expected at least 1.")
        if not (0 <= self.executed < num and valid[self.executed]):
            raise InvalidArrayError(
                f"executed: got {self.executed}, expected one of the valid candidates "
                f"{np.flatnonzero(valid).tolist()}."
            )
        self._check_phase()

    def _check_phase(self) -> None:
        if self.phase != self.candidates.kind:
            raise InvalidArrayError(
                f"phase: got {self.phase!r} with candidates to {self.candidates.kind}, expected "
                "the same."
            )
        is_place = self.phase == "place"
        if is_place and self.clears:
            raise InvalidArrayError("clears: got True for a place, expected it of grasps alone.")
        if is_place != (self.relation is not None) or is_place != (self.side is not None):
            raise InvalidArrayError(
                f"relation and side: got {self.relation!r} and {self.side!r} in the {self.phase} "
                "phase, expected both for placing and none for picking."
            )


@dataclass(frozen=True, kw_only=True, eq=False)
class Demonstration:
    """One sample: what was seen, what was said, what was done.

    Attributes:
        look: What was seen.
        decision: What was said and done.
        scene: Name of the scene; samples of one scene belong on one side of a split.

    Raises:
        InvalidDemonstrationsError: If look and decision don't fit.
    """

    look: Look
    decision: Decision
    scene: str

    def __post_init__(self) -> None:
        """Check that look and wordings fit."""
        num_points, channels = self.look.features.shape
        for wording in self.decision.wordings:
            got = (len(wording.similarity), wording.tokens.shape[1])
            if got != (num_points, channels):
                raise InvalidDemonstrationsError(
                    f"Scene {self.scene!r}: the wording {wording.text!r} is for {got[0]} points "
                    f"and {got[1]} channels, the look has {num_points} and {channels}."
                )

    def observation(self, wording: int = 0) -> Observation:
        """Return what a policy would have seen.

        Args:
            wording: Which of the decision's wordings it was told; 0 for the instruction itself.

        Returns:
            The observation.
        """
        look, decision = self.look, self.decision
        said = decision.wordings[wording]
        return Observation(
            points=look.points,
            features=look.features,
            similarity=said.similarity,
            confidence=look.confidence,
            text_tokens=said.tokens,
            text_pooled=said.pooled,
            workspace_min=look.workspace_min,
            workspace_max=look.workspace_max,
            phase=decision.phase,
            phrase_pooled=said.phrase_pooled,
            relation=decision.relation,
            side=decision.side,
        )


def _check_fields(
    owner: Any, shapes: dict[str, tuple[int | str, ...]], sizes: dict[str, int]
) -> None:
    """Replace the named fields of a frozen dataclass by checked copies."""
    for name, shape in shapes.items():
        array = checked_array(name, getattr(owner, name), shape, sizes=sizes)
        object.__setattr__(owner, name, array)
