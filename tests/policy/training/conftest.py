"""Synthetic demonstrations whose right answer depends on the instruction."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jaxtyping import install_import_hook
from scipy.spatial.transform import Rotation

from policy.actions import ActionCandidates
from policy.demonstrations import Decision, Look, Wording, write_shard
from policy.training.config import NO_AUGMENTATION, TrainConfig

# Shapes in annotations are checked in the modules that compute.
install_import_hook(
    [f"policy.training.{name}" for name in ("augmentation", "split", "validation")],
    "beartype.beartype",
)

CHANNELS = 16
NUM_CONCEPTS = 5
OBJECTS = 3
GRASPS = 2
ENCODER = "synthetic-1"
LOWER, UPPER = np.array([0.276, -0.224, 0.0]), np.array([0.724, 0.224, 0.4])

SceneWriter = Callable[..., Path]
ConfigMaker = Callable[..., TrainConfig]


def _unit(rows: np.ndarray) -> np.ndarray:
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


# What concepts look like and how they are called are unrelated: only data tell which go together.
_LOOKS_LIKE = _unit(np.random.default_rng(1).normal(size=(NUM_CONCEPTS, CHANNELS)))
_CALLED = _unit(np.random.default_rng(2).normal(size=(NUM_CONCEPTS, CHANNELS)))


def _look(
    concepts: np.ndarray, num_points: int, rng: np.random.Generator
) -> tuple[Look, Any, np.ndarray]:
    """Clusters of points, one an object; the objects' centres; and which points are of which."""
    centers = rng.permutation([[0.38, -0.1], [0.5, 0.1], [0.62, -0.1], [0.38, 0.1]])[
        : len(concepts)
    ]
    centers = np.column_stack([centers + rng.normal(scale=0.01, size=centers.shape), [0.03] * 3])
    owner = rng.integers(len(concepts), size=num_points)
    noise = rng.normal(scale=0.05, size=(num_points, CHANNELS))
    look = Look(
        points=centers[owner] + rng.normal(scale=0.015, size=(num_points, 3)),
        features=_unit(_LOOKS_LIKE[concepts[owner]] + noise),
        confidence=np.ones(num_points),
        workspace_min=LOWER,
        workspace_max=UPPER,
    )
    return look, centers, owner


def _wording(
    concept: int, num_points: int, number: int, rng: np.random.Generator, bonus: np.ndarray | float
) -> Wording:
    pooled = _unit(_CALLED[concept] + rng.normal(scale=0.02 * number, size=CHANNELS))
    return Wording(
        text=f"give me concept {concept}, said in way {number}",
        tokens=np.stack([pooled, _unit(rng.normal(size=CHANNELS))]),
        pooled=pooled,
        phrase_pooled=pooled,
        similarity=rng.uniform(0.1, 0.2, num_points) + bonus,
    )


def _decision(
    target: int,
    concepts: np.ndarray,
    centers: Any,
    phase: str,
    num_points: int,
    rng: Any,
    bonus: np.ndarray | float = 0.0,
) -> Decision:
    owner = np.repeat(np.arange(len(concepts)), GRASPS)
    poses = np.tile(np.eye(4), (len(owner), 1, 1))
    poses[:, :3, :3] = Rotation.random(len(owner), rng=rng).as_matrix()
    poses[:, :3, 3] = centers[owner] + rng.normal(scale=0.005, size=(len(owner), 3))
    order = rng.permutation(len(owner))
    valid = (owner == target)[order]
    return Decision(
        phase=phase,
        relation="on" if phase == "place" else None,
        side="inside" if phase == "place" else None,
        wordings=tuple(_wording(concepts[target], num_points, n, rng, bonus) for n in range(3)),
        candidates=ActionCandidates(
            kind=phase,
            Ts_world_tool=poses[order],
            width_m=rng.uniform(0.01, 0.08, len(owner)),
            prior=rng.uniform(size=len(owner)),
        ),
        executed=int(rng.choice(np.flatnonzero(valid))),
        valid=valid,
        avoid_collision=rng.integers(2, size=len(owner)).astype(np.float32),
        expert_logits=np.where(valid, 1.0, 0.0),
        seed=0,
        clears=phase == "pick" and target == OBJECTS - 1,
        objects=(f"concept-{concepts[target]}",),
    )


@pytest.fixture(scope="session")
def write_scenes() -> SceneWriter:
    """Writes scenes of three objects, each of them asked for once for a pick and once for a place.

    The last pick of a scene counts as one that clears.

    The similarity of the points says nothing, unless `similar`: then it points at the target.
    """

    def write(
        folder: Path,
        num_scenes: int,
        *,
        num_points: int = 40,
        first: int = 0,
        similar: bool = False,
    ) -> Path:
        folder.mkdir(parents=True, exist_ok=True)
        for scene in range(first, first + num_scenes):
            rng = np.random.default_rng(scene)
            concepts = rng.permutation(NUM_CONCEPTS)[:OBJECTS]
            look, centers, owner = _look(concepts, num_points, rng)
            decisions = []
            for target in range(OBJECTS):
                bonus = 0.3 * (owner == target) if similar else 0.0
                for phase in ("pick", "place"):
                    decision = _decision(target, concepts, centers, phase, num_points, rng, bonus)
                    decisions.append((0, decision))
            write_shard(folder / f"scene-{scene:04d}.h5", {"encoder": ENCODER}, [look], decisions)
        return folder

    return write


@pytest.fixture(scope="session")
def scenes(tmp_path_factory: pytest.TempPathFactory, write_scenes: SceneWriter) -> Path:
    """Twelve scenes, 72 decisions."""
    return write_scenes(tmp_path_factory.mktemp("scenes"), 12)


@pytest.fixture
def make_train_config(scenes: Path, tmp_path: Path) -> ConfigMaker:
    def make(**changes: Any) -> TrainConfig:
        small: dict[str, Any] = {
            "data": scenes,
            "out": tmp_path / "run",
            "width": 32,
            "points": 24,
            "network": ("num_heads=4", "num_dssa_layers=1"),
            "batch": 16,
            "epochs": 2,
            "val_share": 0.25,
            "warmup": 5,
            "precision": "float32",
            "tensorboard": False,
        }
        return TrainConfig(**(small | changes))

    return make


@pytest.fixture
def plain() -> dict[str, Any]:
    """Options for learning without any augmentation."""
    return {"augmentation": NO_AUGMENTATION}
