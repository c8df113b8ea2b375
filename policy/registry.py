"""Policies by name."""

import difflib
from collections.abc import Callable, Collection
from importlib import import_module
from pathlib import Path
from typing import Any

from policy.base import Policy
from policy.errors import InvalidConfigError, UnknownPolicyError

Fingerprints = str | Collection[str] | None
_Loader = Callable[[Path | None, Fingerprints], Policy]

# Imported on first use: torch takes seconds, and only the learnt policies need it.
_WITHOUT_WEIGHTS = {
    "grounding": "policy.grounding.GroundingPolicy",
    "random": "policy.baselines.random.RandomPolicy",
    "clip-grounding": "policy.baselines.clip_grounding.ClipGroundingPolicy",
    "lerf-togo": "policy.baselines.lerf_togo.LerfTogoPolicy",
    "think-grasp": "policy.baselines.think_grasp.ThinkGraspPolicy",
    "vlp": "policy.baselines.vlp.VlpPolicy",
    "raw-image": "policy.baselines.raw_image.RawImagePolicy",
    "raw-image-grid": "policy.baselines.raw_image.RawImageGridPolicy",
}
_LEARNT = {
    "a2": "policy.baselines.a2.A2Policy",
    "vlg": "policy.baselines.vlg.VLGPolicy",
    "base": "policy.baselines.ablations.BasePolicy",
    "sr-a": "policy.baselines.ablations.SRAPolicy",
    "sr": "policy.sr.SRPolicy",
}


def _find(home: str) -> Any:
    module, _, name = home.rpartition(".")
    return getattr(import_module(module), name)


def _without_weights(name: str) -> _Loader:
    def load(checkpoint: Path | None, _: Fingerprints) -> Policy:
        if checkpoint is not None:
            raise InvalidConfigError(
                f"checkpoint: got {checkpoint} for the policy {name!r}, which has no weights. "
                "Leave it out, or use the policy 'sr'."
            )
        return _find(_WITHOUT_WEIGHTS[name])()

    return load


def _learnt(name: str) -> _Loader:
    def load(checkpoint: Path | None, encoder: Fingerprints) -> Policy:
        return _find(_LEARNT[name]).from_checkpoint(checkpoint, encoder=encoder)

    return load


_LOADERS: dict[str, _Loader] = {
    **{name: _without_weights(name) for name in _WITHOUT_WEIGHTS},
    **{name: _learnt(name) for name in _LEARNT},
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
        InvalidCheckpointError: If the weights can't be read, were trained on other features, or
            are those of another variant of the network.
    """
    if name not in _LOADERS:
        close = difflib.get_close_matches(name, POLICY_NAMES, n=1)
        hint = f" Did you mean {close[0]!r}?" if close else ""
        raise UnknownPolicyError(
            f"Unknown policy {name!r}. Policies: {', '.join(POLICY_NAMES)}.{hint}"
        )
    return _LOADERS[name](None if checkpoint is None else Path(checkpoint), encoder)
