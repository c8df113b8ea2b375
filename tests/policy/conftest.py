"""Scenes made of plain arrays, shared by the policy tests."""

from collections.abc import Callable

import numpy as np
import pytest
from jaxtyping import install_import_hook
from scipy.spatial.transform import Rotation

from policy.actions import ActionCandidates
from policy.network.config import SRConfig, ablation_switches
from policy.observation import Observation

# Shapes in annotations are checked in the modules that compute. The containers and configurations
# check themselves; their own messages are tested, which a type checker in front would hide.
install_import_hook(
    [
        "policy.grounding",
        *(
            f"policy.network.{name}"
            for name in (
                "alignment",
                "attention",
                "batch",
                "bias",
                "decoder",
                "dssa",
                "encoder",
                "encoding",
                "loss",
                "model",
                "morton",
                "projections",
                "selection",
            )
        ),
    ],
    "beartype.beartype",
)

WORKSPACE = (np.array([0.276, -0.224, 0.0]), np.array([0.724, 0.224, 0.4]))
CHANNELS = 16

ObservationMaker = Callable[..., Observation]
CandidatesMaker = Callable[..., ActionCandidates]
ConfigMaker = Callable[..., SRConfig]


def _unit(rows: np.ndarray) -> np.ndarray:
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


@pytest.fixture
def make_observation() -> ObservationMaker:
    def make(
        rng: np.random.Generator, num_points: int = 40, num_tokens: int = 5, **changes: np.ndarray
    ) -> Observation:
        fields = {
            "points": rng.uniform(*WORKSPACE, (num_points, 3)),
            "features": _unit(rng.normal(size=(num_points, CHANNELS))),
            "similarity": rng.uniform(0.1, 0.3, num_points),
            "confidence": rng.uniform(0.5, 1.0, num_points),
            "text_tokens": rng.normal(size=(num_tokens, CHANNELS)),
            "text_pooled": _unit(rng.normal(size=CHANNELS)),
            "workspace_min": WORKSPACE[0],
            "workspace_max": WORKSPACE[1],
        }
        return Observation(**(fields | changes))

    return make


@pytest.fixture
def make_candidates() -> CandidatesMaker:
    def make(
        rng: np.random.Generator, num_candidates: int = 7, kind: str = "pick"
    ) -> ActionCandidates:
        poses = np.tile(np.eye(4), (num_candidates, 1, 1))
        if num_candidates:
            poses[:, :3, :3] = Rotation.random(num_candidates, rng=rng).as_matrix()
        poses[:, :3, 3] = rng.uniform(*WORKSPACE, (num_candidates, 3))
        return ActionCandidates(
            kind=kind,
            Ts_world_tool=poses,
            width_m=rng.uniform(0.01, 0.08, num_candidates),
            prior=rng.uniform(size=num_candidates),
        )

    return make


@pytest.fixture
def make_config() -> ConfigMaker:
    def make(ablation: str = "sr", **changes: object) -> SRConfig:
        small = {"feature_dim": CHANNELS, "width": 32, "num_heads": 4, "max_points": 64}
        return SRConfig(**(small | ablation_switches(ablation) | changes))

    return make


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)
