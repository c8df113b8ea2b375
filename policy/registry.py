"""Policies by name."""

import difflib
from collections.abc import Callable, Collection
from pathlib import Path

from policy.base import Policy
from policy.errors import InvalidConfigError, UnknownPolicyError

Fingerprints = str | Collection[str] | None


def _load_grounding(checkpoint: Path | None, _: Fingerprints) -> Policy:
    from policy.grounding import GroundingPolicy

    _refuse_checkpoint("grounding", checkpoint)
    return GroundingPolicy()


def _load_random(checkpoint: Path | None, _: Fingerprints) -> Policy:
    from policy.baselines.random import RandomPolicy

    _refuse_checkpoint("random", checkpoint)
    return RandomPolicy()


def _load_sr(checkpoint: Path | None, encoder: Fingerprints) -> Policy:
    # torch takes seconds to import; the other policies do without it.
    from policy.sr import DEFAULT_CHECKPOINT, SRPolicy

    return SRPolicy.from_checkpoint(checkpoint or DEFAULT_CHECKPOINT, encoder=encoder)


_LOADERS: dict[str, Callable[[Path | None, Fingerprints], Policy]] = {
    "grounding": _load_grounding,
    "random": _load_random,
    "sr": _load_sr,
}

POLICY_NAMES: tuple[str, ...] = tuple(_LOADERS)

ATTENTION_POLICIES: tuple[str, ...] = ("sr",)
"""Policies that can show what they attended to: `policy.explanation.ExplainingPolicy`."""


def load_policy(
    name: str, *, checkpoint: Path | str | None = None, encoder: Fingerprints = None
) -> Policy:
    """Make a policy that is ready to score candidates.

    Args:
        name: One of `POLICY_NAMES`.
        checkpoint: Weights (.safetensors) for a learnt policy; by default those shipped with the
            package.
        encoder: Fingerprint of the encoder in use, with which a learnt policy must have been
            trained, or several that stand for it; None to take any.

    Returns:
        The policy.

    Raises:
        UnknownPolicyError: If there is no such policy.
        InvalidConfigError: If a checkpoint is given to a policy that learns nothing.
        MissingCheckpointError: If a learnt policy has no weights.
        InvalidCheckpointError: If the weights can't be read or were trained on other features.
    """
    if name not in _LOADERS:
        close = difflib.get_close_matches(name, POLICY_NAMES, n=1)
        hint = f" Did you mean {close[0]!r}?" if close else ""
        raise UnknownPolicyError(
            f"Unknown policy {name!r}. Policies: {', '.join(POLICY_NAMES)}.{hint}"
        )
    return _LOADERS[name](None if checkpoint is None else Path(checkpoint), encoder)


def _refuse_checkpoint(name: str, checkpoint: Path | None) -> None:
    if checkpoint is not None:
        raise InvalidConfigError(
            f"checkpoint: got {checkpoint} for the policy {name!r}, which has no weights. "
            "Leave it out, or use the policy 'sr'."
        )
