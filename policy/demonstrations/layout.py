"""How a scene's demonstrations lie in an HDF5 file.

- `/`: attributes schema_version, encoder, feature_dim, digest
- `/meta`: JSON, what the scene was made from
- `/index`: JSON, what a reader wants to know of every decision without reading it
- `/looks/0/`: points, features, confidence, workspace (2, 3)
- `/decisions/0/`: poses, width_m, prior, valid, avoid_collision, expert_logits
- `/decisions/0/wordings/0/`: tokens, pooled, phrase_pooled, similarity
"""

import hashlib
import json
from collections.abc import Sequence
from typing import Any

import h5py
import numpy as np

from policy.actions import ActionCandidates
from policy.demonstrations.decision import Decision, Look, Wording

SCHEMA_VERSION = 3

_HALF = np.float16
_ARRAYS = ("avoid_collision", "expert_logits")


def fill(
    file: Any,
    meta: dict[str, Any],
    looks: Sequence[Look],
    decisions: Sequence[tuple[int, Decision]],
) -> None:
    """Write everything into an empty file.

    Args:
        file: The file, open for writing.
        meta: What the scene was made from.
        looks: What was seen.
        decisions: Each with the index of its look.
    """
    file.attrs["schema_version"] = SCHEMA_VERSION
    file.attrs["encoder"] = meta["encoder"]
    file.attrs["feature_dim"] = looks[0].features.shape[1]
    index = [
        {
            "look": look,
            "phase": decision.phase,
            "relation": decision.relation,
            "side": decision.side,
            "clears": decision.clears,
            "objects": list(decision.objects),
            "executed": decision.executed,
            "seed": decision.seed,
            "num_candidates": len(decision.candidates),
            "num_points": len(looks[look].points),
            "texts": [wording.text for wording in decision.wordings],
        }
        for look, decision in decisions
    ]
    file["meta"] = json.dumps(meta, sort_keys=True)
    file["index"] = json.dumps(index, sort_keys=True)
    for number, look in enumerate(looks):
        _fill_look(file.create_group(f"looks/{number}"), look)
    for number, (_, decision) in enumerate(decisions):
        _fill_decision(file.create_group(f"decisions/{number}"), decision)
    file.attrs["digest"] = compute_digest(file)


def _fill_look(group: Any, look: Look) -> None:
    group["points"] = look.points
    group["features"] = look.features.astype(_HALF)
    group["confidence"] = look.confidence
    group["workspace"] = np.stack([look.workspace_min, look.workspace_max])


def _fill_decision(group: Any, decision: Decision) -> None:
    group["poses"] = decision.candidates.Ts_world_tool
    group["width_m"] = decision.candidates.width_m
    group["prior"] = decision.candidates.prior
    group["valid"] = decision.valid
    for name in _ARRAYS:
        group[name] = getattr(decision, name)
    for number, wording in enumerate(decision.wordings):
        said = group.create_group(f"wordings/{number}")
        said["tokens"] = wording.tokens.astype(_HALF)
        said["pooled"] = wording.pooled.astype(_HALF)
        said["similarity"] = wording.similarity.astype(_HALF)
        if wording.phrase_pooled is not None:
            said["phrase_pooled"] = wording.phrase_pooled.astype(_HALF)


def read_look(group: Any) -> Look:
    """Read a look from its group."""
    workspace = group["workspace"][()]
    return Look(
        points=group["points"][()],
        features=group["features"][()],
        confidence=group["confidence"][()],
        workspace_min=workspace[0],
        workspace_max=workspace[1],
    )


def read_decision(group: Any, entry: dict[str, Any]) -> Decision:
    """Read a decision from its group and its entry in the index."""
    candidates = ActionCandidates(
        kind=entry["phase"],
        Ts_world_tool=group["poses"][()],
        width_m=group["width_m"][()],
        prior=group["prior"][()],
    )
    return Decision(
        phase=entry["phase"],
        relation=entry["relation"],
        side=entry["side"],
        clears=entry["clears"],
        objects=tuple(entry["objects"]),
        wordings=tuple(
            _read_wording(group[f"wordings/{number}"], text)
            for number, text in enumerate(entry["texts"])
        ),
        candidates=candidates,
        executed=entry["executed"],
        valid=group["valid"][()],
        seed=entry["seed"],
        **{name: group[name][()] for name in _ARRAYS},
    )


def _read_wording(group: Any, text: str) -> Wording:
    return Wording(
        text=text,
        tokens=group["tokens"][()],
        pooled=group["pooled"][()],
        phrase_pooled=group["phrase_pooled"][()] if "phrase_pooled" in group else None,
        similarity=group["similarity"][()],
    )


def compute_digest(file: Any) -> str:
    """Hash names, types, shapes and values of all datasets, and what tells encoders apart."""
    digest = hashlib.sha256(f"{file.attrs['encoder']}|{file.attrs['feature_dim']}".encode())

    def add(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            value = item.asstr()[()] if item.dtype == object else item[()]
            digest.update(f"{name}|{item.dtype}|{item.shape}|".encode())
            digest.update(value.encode() if isinstance(value, str) else value.tobytes())

    file.visititems(add)
    return digest.hexdigest()
