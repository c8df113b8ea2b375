"""Candidate actions, and the scores that a policy gives them."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from policy.arrays import check_range, checked_array
from policy.errors import CandidateIndexError, InvalidArrayError, NoCandidatesError

ActionKind = Literal["pick", "place"]
ACTION_KINDS: tuple[str, ...] = get_args(ActionKind)

# float32 poses chained over a few products stay well inside this.
_ROTATION_TOLERANCE = 1e-4


@dataclass(frozen=True, kw_only=True)
class ActionCandidates:
    """Poses of the tool among which a policy chooses.

    The tool frame has its origin midway between the finger pads, +z along the approach and x
    along the closing direction. Arrays are copied, checked and made read-only.

    Attributes:
        kind: What the gripper does at the pose: "pick" closes it, "place" opens it.
        Ts_world_tool: (K, 4, 4) float64 poses of the tool in the world, metres. K may be 0.
        width_m: (K,) float32 finger opening needed at the contact, metres.
        prior: (K,) float32 geometric quality, 0 (bad) to 1 (good).

    Raises:
        InvalidArrayError: If a field has a wrong shape or value.
    """

    kind: ActionKind
    Ts_world_tool: np.ndarray
    width_m: np.ndarray
    prior: np.ndarray

    def __post_init__(self) -> None:
        """Check the fields and replace the arrays by read-only copies."""
        if self.kind not in ACTION_KINDS:
            raise InvalidArrayError(f"kind: got {self.kind!r}, expected 'pick' or 'place'.")
        sizes: dict[str, int] = {}
        poses = checked_array(
            "Ts_world_tool", self.Ts_world_tool, ("K", 4, 4), dtype=np.float64, sizes=sizes
        )
        width_m = checked_array("width_m", self.width_m, ("K",), sizes=sizes)
        prior = checked_array("prior", self.prior, ("K",), sizes=sizes)
        _check_poses(poses)
        check_range("width_m", width_m, 0.0)
        check_range("prior", prior, 0.0, 1.0)
        object.__setattr__(self, "Ts_world_tool", poses)
        object.__setattr__(self, "width_m", width_m)
        object.__setattr__(self, "prior", prior)

    def __len__(self) -> int:
        """Return the number K of candidates."""
        return len(self.Ts_world_tool)

    @property
    def positions(self) -> np.ndarray:
        """(K, 3) float64 tool centre points in the world, metres."""
        return self.Ts_world_tool[:, :3, 3]

    def as_pose7(self) -> np.ndarray:
        """Write the poses as the paper does (3.4.1): position and unit quaternion.

        Returns:
            (K, 7) float32: x, y, z in metres, then the quaternion as x, y, z, w. q and -q are
            the same rotation; the one with w >= 0 is returned, so that equal poses get equal rows.
        """
        pose7 = np.zeros((len(self), 7), dtype=np.float32)
        if len(self):
            pose7[:, :3] = self.positions
            rotation = Rotation.from_matrix(self.Ts_world_tool[:, :3, :3])
            pose7[:, 3:] = rotation.as_quat(canonical=True)
        return pose7

    def take(self, indices: np.ndarray) -> "ActionCandidates":
        """Select candidates.

        Args:
            indices: (M,) integers in 0..K-1; repeats are allowed.

        Returns:
            The selected candidates in the given order.

        Raises:
            CandidateIndexError: If an index isn't a whole number from 0 to K-1.
        """
        chosen = np.asarray(indices)
        chosen = chosen.astype(np.int64) if chosen.size == 0 else chosen
        if chosen.ndim != 1 or chosen.dtype.kind not in "iu":
            raise CandidateIndexError(
                f"indices: got {chosen.dtype} of shape {chosen.shape}, expected integers (M,)."
            )
        if chosen.size and (chosen.min() < 0 or chosen.max() >= len(self)):
            raise CandidateIndexError(
                f"indices: got {chosen.min()} to {chosen.max()}, expected 0 to {len(self) - 1} "
                f"for {len(self)} candidates."
            )
        return ActionCandidates(
            kind=self.kind,
            Ts_world_tool=self.Ts_world_tool[chosen],
            width_m=self.width_m[chosen],
            prior=self.prior[chosen],
        )


@dataclass(frozen=True, kw_only=True)
class ActionDecoding:
    """What a learnt policy reads out for every candidate besides its score (paper, 3.4.2).

    Attributes:
        rotvec_tool: (K, 3) float32 small correction of the orientation as a rotation vector in
            the tool frame, radians: R_world_tool_new = R_world_tool · exp(rotvec).
        opening_m: (K,) float32 finger opening before the contact, metres.
        avoid_collision: (K,) float32 probability that the approach needs collision avoidance.

    Raises:
        InvalidArrayError: If a field has a wrong shape or value.
    """

    rotvec_tool: np.ndarray
    opening_m: np.ndarray
    avoid_collision: np.ndarray

    def __post_init__(self) -> None:
        """Check the fields and replace the arrays by read-only copies."""
        sizes: dict[str, int] = {}
        rotvec = checked_array("rotvec_tool", self.rotvec_tool, ("K", 3), sizes=sizes)
        opening_m = checked_array("opening_m", self.opening_m, ("K",), sizes=sizes)
        avoid = checked_array("avoid_collision", self.avoid_collision, ("K",), sizes=sizes)
        check_range("opening_m", opening_m, 0.0)
        check_range("avoid_collision", avoid, 0.0, 1.0)
        object.__setattr__(self, "rotvec_tool", rotvec)
        object.__setattr__(self, "opening_m", opening_m)
        object.__setattr__(self, "avoid_collision", avoid)


@dataclass(frozen=True, kw_only=True)
class ActionScores:
    """Scores of the candidates of one decision.

    Attributes:
        logits: (K,) float32, larger is better.
        decoding: What else the policy read out for each candidate; None for most policies.

    Raises:
        InvalidArrayError: If a field has a wrong shape or value.
    """

    logits: np.ndarray
    decoding: ActionDecoding | None = field(default=None)

    def __post_init__(self) -> None:
        """Check the logits and replace them by a read-only copy."""
        logits = checked_array("logits", self.logits, ("K",))
        object.__setattr__(self, "logits", logits)
        if self.decoding is not None and len(self.decoding.opening_m) != len(logits):
            raise InvalidArrayError(
                f"decoding: got {len(self.decoding.opening_m)} candidates, expected {len(logits)} "
                "as in logits."
            )

    def __len__(self) -> int:
        """Return the number K of candidates."""
        return len(self.logits)

    @cached_property
    def probabilities(self) -> np.ndarray:
        """(K,) float32 weights w of the candidates: the softmax of the logits."""
        if not len(self):
            return self.logits
        shifted = np.exp(self.logits.astype(np.float64) - self.logits.max())
        # Eq. (14): the weights of all candidates sum to one.
        return checked_array("probabilities", shifted / shifted.sum(), ("K",))

    @property
    def best(self) -> int:
        """Index of the candidate with the largest logit; the first one among equals.

        Raises:
            NoCandidatesError: If there are no candidates.
        """
        if not len(self):
            raise NoCandidatesError(
                "best: got 0 candidates, expected at least 1. Check len(candidates) first."
            )
        return int(np.argmax(self.logits))


def _check_poses(poses: Float[np.ndarray, "K 4 4"]) -> None:
    rotations = poses[:, :3, :3]
    residual = np.abs(rotations @ rotations.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    is_proper = (residual < _ROTATION_TOLERANCE) & (np.linalg.det(rotations) > 0)
    is_rigid = is_proper & (poses[:, 3] == [0, 0, 0, 1]).all(axis=1)
    if not is_rigid.all():
        first = int(np.flatnonzero(~is_rigid)[0])
        raise InvalidArrayError(
            f"Ts_world_tool: got {np.count_nonzero(~is_rigid)} of {len(poses)} poses that aren't "
            f"rigid (first: {first}), expected a rotation, a translation and the row 0 0 0 1."
        )
