"""From a demonstration to what the network learns from."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from torch import Tensor

from policy.demonstrations import Decision
from policy.network.batch import DecisionBatch, DecisionSample, collate, make_sample
from policy.network.loss import ExpertTarget, ExpertTargetBatch, collate_targets
from policy.network.padding import pad
from policy.training.augmentation import augment
from policy.training.config import PickPositives, TrainConfig
from policy.training.store import DecisionStore


@dataclass(frozen=True, kw_only=True, eq=False)
class Example:
    """One decision with its answers.

    Attributes:
        sample: What the network sees.
        target: What it should say.
        valid: (K,) bool, the candidates that count as a success.
    """

    sample: DecisionSample
    target: ExpertTarget
    valid: np.ndarray


@dataclass(frozen=True, kw_only=True, eq=False)
class ExampleBatch:
    """B examples, padded.

    Attributes:
        inputs: What the network sees.
        targets: What it should say.
        valid: (B, K) bool, False on padding.
    """

    inputs: DecisionBatch
    targets: ExpertTargetBatch
    valid: Tensor

    def __len__(self) -> int:
        """Return the number B of examples."""
        return len(self.valid)

    def to(self, device: str) -> "ExampleBatch":
        """Copy every tensor to a device."""
        return ExampleBatch(
            inputs=self.inputs.to(device),
            targets=self.targets.to(device),
            valid=self.valid.to(device),
        )


class ExampleDrawer:
    """Draws examples for training, and the fixed ones for validation.

    Every draw has a random generator of its own, made from seed, epoch and demonstration: neither
    the batch that it lands in, nor the process that makes it, nor an interruption changes it.
    """

    def __init__(self, store: DecisionStore, config: TrainConfig) -> None:
        """Make the drawer.

        Args:
            store: Where decisions come from.
            config: Says how to change them, and what is positive.
        """
        self.store = store
        self.config = config
        max_points = store.config.max_points
        # So many that as many as the network takes are left.
        self._num_before = math.ceil(max_points / (1 - config.augmentation.point_dropout))

    def training(self, index: int, epoch: int) -> Example:
        """Draw one example, wording and augmentation included.

        Args:
            index: Of the demonstration in the folder.
            epoch: Number of the epoch.

        Returns:
            The example.
        """
        config = self.config
        rng = np.random.default_rng([config.seed, epoch, index])
        decision = self.store.decision(index)
        wording = 0
        is_other = rng.random() < config.augmentation.paraphrases
        if is_other and len(decision.wordings) > 1:
            wording = int(rng.integers(1, len(decision.wordings)))
        observation, candidates = self.store.thinned(index, wording, self._num_before)
        observation, candidates = augment(
            observation,
            candidates,
            config.augmentation,
            rng,
            max_points=self.store.config.max_points,
        )
        kept = kept_candidates(len(candidates), decision.executed, config.max_candidates, rng)
        return Example(
            sample=make_sample(observation, candidates.take(kept), self.store.config),
            target=make_target(decision, kept, config.pick_positives),
            valid=decision.valid[kept],
        )

    def validation(self, index: int) -> Example:
        """Make the example that the network would see in use.

        Args:
            index: Of the demonstration in the folder.

        Returns:
            The example: the instruction's own wording, nothing changed, every candidate.
        """
        decision = self.store.decision(index)
        observation, candidates = self.store.thinned(index, 0, self.store.config.max_points)
        return Example(
            sample=make_sample(observation, candidates, self.store.config),
            target=make_target(decision, np.arange(len(candidates)), self.config.pick_positives),
            valid=decision.valid,
        )


def collate_examples(examples: Sequence[Example]) -> ExampleBatch:
    """Pad examples to common sizes.

    Args:
        examples: At least one.

    Returns:
        The batch, on the CPU.
    """
    return ExampleBatch(
        inputs=collate([example.sample for example in examples]),
        targets=collate_targets([example.target for example in examples]),
        valid=pad([example.valid for example in examples])[0],
    )


def kept_candidates(
    num_candidates: int, executed: int, max_candidates: int, rng: np.random.Generator
) -> np.ndarray:
    """Choose candidates at random, the executed one among them.

    Args:
        num_candidates: Number K of candidates.
        executed: Index of the one that must stay.
        max_candidates: Most that may stay; 0 for all.
        rng: Draws the others.

    Returns:
        Ascending indices.
    """
    if not max_candidates or num_candidates <= max_candidates:
        return np.arange(num_candidates)
    others = np.delete(np.arange(num_candidates), executed)
    chosen = rng.choice(others, max_candidates - 1, replace=False)
    return np.sort(np.append(chosen, executed))


def make_target(
    decision: Decision, kept: np.ndarray, pick_positives: PickPositives
) -> ExpertTarget:
    """Say what the expert says about candidates.

    Args:
        decision: What was done.
        kept: (M,) indices of the candidates, the executed one among them.
        pick_positives: Right answers of a pick; of a place, every valid candidate is right.

    Returns:
        The target. The executed pose was that of its candidate, so no rotation is asked for; the
        opening is each candidate's contact width.
    """
    if decision.phase == "pick" and pick_positives == "closest":
        positive = kept == decision.executed
    else:
        positive = decision.valid[kept]
    return ExpertTarget(
        positive=positive,
        opening_m=decision.candidates.width_m[kept],
        avoid_collision=decision.avoid_collision[kept],
        rotvec_tool=np.zeros((len(kept), 3), np.float32),
    )
