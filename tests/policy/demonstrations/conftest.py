"""Demonstrations made of plain arrays."""

from collections.abc import Callable

import numpy as np
import pytest

from policy.demonstrations import Decision, Look, Wording

CHANNELS = 16
WORKSPACE = (np.array([0.276, -0.224, 0.0]), np.array([0.724, 0.224, 0.4]))


def _unit(rows):
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


@pytest.fixture
def make_look(rng) -> Callable[..., Look]:
    def make(num_points=30, channels=CHANNELS, **changes):
        fields = {
            "points": rng.uniform(*WORKSPACE, (num_points, 3)),
            "features": _unit(rng.normal(size=(num_points, channels))),
            "confidence": rng.uniform(0.5, 1, num_points),
            "workspace_min": WORKSPACE[0],
            "workspace_max": WORKSPACE[1],
        }
        return Look(**(fields | changes))

    return make


@pytest.fixture
def make_wording(rng) -> Callable[..., Wording]:
    def make(num_points=30, channels=CHANNELS, **changes):
        fields = {
            "text": "give me the pear",
            "tokens": rng.normal(size=(5, channels)),
            "pooled": _unit(rng.normal(size=channels)),
            "phrase_pooled": _unit(rng.normal(size=channels)),
            "similarity": rng.uniform(0.1, 0.3, num_points),
        }
        return Wording(**(fields | changes))

    return make


@pytest.fixture
def make_decision(rng, make_wording, make_candidates) -> Callable[..., Decision]:
    def make(phase="pick", num_candidates=7, num_points=30, **changes):
        fields = {
            "phase": phase,
            "relation": "near" if phase == "place" else None,
            "side": "outside" if phase == "place" else None,
            "wordings": (
                make_wording(num_points),
                make_wording(num_points, text="the pear, please", phrase_pooled=None),
            ),
            "candidates": make_candidates(rng, num_candidates, phase),
            "executed": 2,
            "valid": np.arange(num_candidates) % 2 == 0,
            "avoid_collision": (np.arange(num_candidates) % 3 == 0) + 0.0,
            "expert_logits": rng.normal(size=num_candidates),
            "objects": ("pear",),
            "seed": 7,
        }
        return Decision(**(fields | changes))

    return make
