"""Scenes made of plain arrays and small networks, shared by the policy tests."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from jaxtyping import install_import_hook
from scipy.spatial.transform import Rotation

from policy.actions import ActionCandidates
from policy.network.config import NetworkConfig, SRConfig, ablation_switches
from policy.observation import Observation

# What is imported here is imported before shapes are checked: the networks come in fixtures.
if TYPE_CHECKING:
    from policy.network.base import CandidateNetwork
    from policy.network.batch import DecisionSample
    from policy.network.loss import ExpertTargetBatch

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
                "evidence",
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
ConfigMaker = Callable[..., Any]
SampleMaker = Callable[[NetworkConfig], list["DecisionSample"]]
TargetMaker = Callable[[list["DecisionSample"]], "ExpertTargetBatch"]
NetworkMaker = Callable[[NetworkConfig], "CandidateNetwork"]

# Switches of what the paper does not have.
PAPER_ONLY = (
    "prior",
    "phrase",
    "side",
    "similarity",
    "candidate_bias",
    "mask_readout",
    "mask_nearness",
)
SR_NETWORKS: list[tuple[str, dict[str, Any]]] = [
    ("base", {}),
    ("sr_a", {}),
    ("sr", {}),
    ("sr", {"sparsifier": "relu"}),
    ("sr", {"sparsifier": "softmax"}),
    ("sr", {"self_attention": "full"}),
    ("sr", {"query_fourier": False, "num_encoder_layers": 0}),
    ("sr", {"language_attention": "points"}),
    ("base", {"mask_readout": True, "mask_nearness": True}),
    ("sr", dict.fromkeys(PAPER_ONLY, False)),
]
BASELINES: list[tuple[str, dict[str, Any]]] = [
    ("a2", {}),
    ("a2", {"prior": False, "side": False, "local_heads": False, "num_layers": 2}),
    ("vlg", {}),
    ("vlg", {"prior": False, "side": False, "phrase": False, "local_heads": False}),
]


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
    """Makes small configurations: of SR and its ablations, or of the baselines a2 and vlg."""
    from policy.baselines.a2 import A2Config
    from policy.baselines.vlg import VLGConfig

    baselines = {"a2": A2Config, "vlg": VLGConfig}

    def make(kind: str = "sr", **changes: Any) -> NetworkConfig:
        small = {"feature_dim": CHANNELS, "width": 32, "num_heads": 4, "max_points": 64}
        if kind in baselines:
            return baselines[kind](**(small | changes))
        return SRConfig(**(small | ablation_switches(kind) | changes))

    return make


def _name(variant: tuple[str, dict[str, Any]]) -> str:
    return "-".join([variant[0], *map(str, variant[1].values())])


@pytest.fixture(params=SR_NETWORKS, ids=_name)
def sr_config(request: pytest.FixtureRequest, make_config: ConfigMaker) -> SRConfig:
    kind, changes = request.param
    return make_config(kind, **changes)


@pytest.fixture(params=BASELINES, ids=_name)
def baseline_config(request: pytest.FixtureRequest, make_config: ConfigMaker) -> Any:
    kind, changes = request.param
    return make_config(kind, **changes)


@pytest.fixture(params=[*SR_NETWORKS, *BASELINES], ids=_name)
def any_config(request: pytest.FixtureRequest, make_config: ConfigMaker) -> Any:
    kind, changes = request.param
    return make_config(kind, **changes)


@pytest.fixture
def make_network() -> NetworkMaker:
    """Makes networks away from the special values at the start, which would hide mistakes."""
    import torch

    from policy.network.kinds import make_network

    def make(config: NetworkConfig) -> "CandidateNetwork":
        torch.manual_seed(0)
        network = make_network(config)
        with torch.no_grad():
            for parameter in network.parameters():
                parameter.add_(torch.randn_like(parameter) * 0.05)
        return network.eval()

    return make


@pytest.fixture
def make_samples(
    rng: np.random.Generator, make_observation: ObservationMaker, make_candidates: CandidatesMaker
) -> SampleMaker:
    """Makes three decisions of different sizes, two picks and a place."""
    from policy.network.batch import make_sample

    def make(config: NetworkConfig) -> list["DecisionSample"]:
        sizes = [(40, 5, 7, "pick"), (23, 2, 3, "place"), (64, 8, 1, "pick")]
        return [
            make_sample(
                make_observation(rng, num_points, num_tokens, phrase_pooled=rng.normal(size=16)),
                make_candidates(rng, num_candidates, kind),
                config,
            )
            for num_points, num_tokens, num_candidates, kind in sizes
        ]

    return make


@pytest.fixture
def make_targets(rng: np.random.Generator) -> TargetMaker:
    """Makes what the network should have said of each decision."""
    from policy.network.loss import ExpertTarget, collate_targets

    def make(samples: list["DecisionSample"]) -> "ExpertTargetBatch":
        targets = []
        for num in (len(sample.poses) for sample in samples):
            targets.append(
                ExpertTarget(
                    positive=np.arange(num) == rng.integers(num),
                    opening_m=rng.uniform(0, 0.085, num),
                    avoid_collision=rng.integers(0, 2, num),
                    rotvec_tool=rng.normal(0, 0.05, (num, 3)),
                )
            )
        return collate_targets(targets)

    return make


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)
