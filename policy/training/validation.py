"""How good a network is on scenes that it has not seen."""

import math
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float

from policy.baselines.random import RandomPolicy
from policy.grounding import GroundingPolicy
from policy.training.config import StopOn
from policy.training.distributed import Ranks
from policy.training.draws import ExampleDrawer, collate_examples
from policy.training.objective import Objective
from policy.training.order import sorted_batches
from policy.training.split import Split
from policy.training.statistics import gate_entropy

_KINDS = ("pick", "clear", "place")
_TERMS = ("loss", "valid", "top1", "decoding")


@dataclass(frozen=True, kw_only=True)
class Validator:
    """Measures networks on held-out decisions.

    Attributes:
        drawer: Makes the examples.
        indices: Held-out demonstrations.
        batch: Decisions a batch.
        ranks: Processes that share the work.
    """

    drawer: ExampleDrawer
    indices: np.ndarray
    batch: int
    ranks: Ranks

    @torch.inference_mode()
    def measure(self, objective: Objective) -> dict[str, float]:
        """Measure a network.

        Args:
            objective: The network with its loss; its mode is left as it was.

        Returns:
            `val_loss` (cross-entropy with the positives of training), `val_valid` (with all valid
            candidates as positives), `val_top1` (share of decisions whose best candidate is
            valid), `val_decoding`; each also with `_pick`, `_clear` (picks of what is in the way of
            a target) and `_place` where there are such decisions; and `gate_entropy` for a network
            whose stage 1 makes a mask.
        """
        was_training = objective.training
        objective.eval()
        sums = torch.zeros(len(_KINDS), len(_TERMS) + 2, dtype=torch.float64)
        with gate_entropy(objective.network) as entropy:
            for kind, chosen in self._batches()[self.ranks.rank :: self.ranks.size]:
                examples = [self.drawer.validation(int(index)) for index in chosen]
                terms = objective(collate_examples(examples).to(self.ranks.device))
                means = [terms.choice, terms.valid, terms.top1, terms.decoding]
                row = torch.tensor([*map(float, means), entropy.value, 1.0], dtype=torch.float64)
                sums[kind] += len(chosen) * row
        objective.train(was_training)
        return _report(self.ranks.sum(sums).cpu().numpy())

    def reference(self) -> dict[str, dict[str, float]]:
        """Measure what needs no training, on the same decisions.

        Returns:
            `val_top1` and its parts for the policies grounding and random.
        """
        rng = np.random.default_rng(0)
        results: dict[str, dict[str, float]] = {}
        kinds = self._kinds()
        for policy in (GroundingPolicy(), RandomPolicy()):
            hits = {kind: [] for kind in _KINDS}
            for index in self.indices:
                demonstration = self.drawer.store.demonstration(int(index))
                decision = demonstration.decision
                scores = policy.score(demonstration.observation(), decision.candidates, rng)
                hits[str(kinds[index])].append(bool(decision.valid[scores.best]))
            every = [hit for kind in _KINDS for hit in hits[kind]]
            results[policy.name] = {"val_top1": float(np.mean(every))} | {
                f"val_top1_{kind}": float(np.mean(hits[kind])) for kind in _KINDS if hits[kind]
            }
        return results

    def _kinds(self) -> np.ndarray:
        """Return what every demonstration of the folder is, one of `_KINDS`."""
        folder = self.drawer.store.folder
        return np.where(folder.clears, "clear", folder.phases)

    def _batches(self) -> list[tuple[int, np.ndarray]]:
        """Batches of one kind each, so that kinds can be told apart afterwards."""
        folder, kinds = self.drawer.store.folder, self._kinds()
        return [
            (number, batch)
            for number, kind in enumerate(_KINDS)
            for batch in sorted_batches(
                self.indices[kinds[self.indices] == kind], folder.num_candidates, batch=self.batch
            )
        ]


@dataclass(frozen=True, kw_only=True)
class HeldOut:
    """Everything that is held out: decisions of other scenes, and those that mean new objects.

    Attributes:
        val: Measures on other scenes.
        new: Measures on new objects, if any are held out.
    """

    val: Validator
    new: Validator | None

    @classmethod
    def of(cls, split: Split, drawer: ExampleDrawer, *, batch: int, ranks: Ranks) -> "HeldOut":
        """Measure on what a split holds out.

        Args:
            split: The split.
            drawer: Makes the examples.
            batch: Decisions a batch.
            ranks: Processes that share the work.

        Returns:
            Both validators.
        """
        val, new = (
            Validator(drawer=drawer, indices=indices, batch=batch, ranks=ranks)
            for indices in (split.val, split.new)
        )
        return cls(val=val, new=new if len(split.new) else None)

    def measure(self, objective: Objective) -> dict[str, float]:
        """Measure a network.

        Args:
            objective: The network with its loss.

        Returns:
            What `Validator.measure` does, and the same of new objects as `new_...`.
        """
        metrics = self.val.measure(objective)
        return metrics if self.new is None else metrics | _as_new(self.new.measure(objective))

    def reference(self) -> dict[str, dict[str, float]]:
        """Measure what needs no training.

        Returns:
            What `Validator.reference` does, and the same of new objects as `new_...`.
        """
        reference = self.val.reference()
        if self.new is None:
            return reference
        found = self.new.reference()
        return {name: own | _as_new(found[name]) for name, own in reference.items()}


def _as_new(metrics: dict[str, float]) -> dict[str, float]:
    return {
        name.replace("val_", "new_"): value
        for name, value in metrics.items()
        if name.startswith("val_")
    }


def stop_score(metrics: dict[str, float], stop_on: StopOn) -> float:
    """Read the score that decides which epoch is best.

    Args:
        metrics: From `Validator.measure`.
        stop_on: Which of them.

    Returns:
        The score; lower is better.
    """
    value = metrics[f"val_{stop_on}"]
    return -value if stop_on == "top1" else value


def _report(sums: Float[np.ndarray, "kinds columns"]) -> dict[str, float]:
    total = sums.sum(axis=0)
    report = {f"val_{term}": total[i] / total[-1] for i, term in enumerate(_TERMS)}
    for kind, row in zip(_KINDS, sums, strict=True):
        if row[-1]:
            report |= {f"val_{term}_{kind}": row[i] / row[-1] for i, term in enumerate(_TERMS)}
    if not math.isnan(total[-2]):
        report["gate_entropy"] = total[-2] / total[-1]
    return {name: float(value) for name, value in report.items()}
