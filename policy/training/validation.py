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
from policy.training.statistics import gate_entropy

_PHASES = ("pick", "place")
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
            valid), `val_decoding`; each also with `_pick` and `_place` where there are such
            decisions; and `gate_entropy` for a network whose stage 1 makes a mask.
        """
        was_training = objective.training
        objective.eval()
        sums = torch.zeros(len(_PHASES), len(_TERMS) + 2, dtype=torch.float64)
        with gate_entropy(objective.network) as entropy:
            for phase, chosen in self._batches()[self.ranks.rank :: self.ranks.size]:
                examples = [self.drawer.validation(int(index)) for index in chosen]
                terms = objective(collate_examples(examples).to(self.ranks.device))
                means = [terms.choice, terms.valid, terms.top1, terms.decoding]
                row = torch.tensor([*map(float, means), entropy.value, 1.0], dtype=torch.float64)
                sums[phase] += len(chosen) * row
        objective.train(was_training)
        return _report(self.ranks.sum(sums).cpu().numpy())

    def reference(self) -> dict[str, dict[str, float]]:
        """Measure what needs no training, on the same decisions.

        Returns:
            `val_top1` and its parts for the policies grounding and random.
        """
        rng = np.random.default_rng(0)
        results: dict[str, dict[str, float]] = {}
        phases = self.drawer.store.folder.phases
        for policy in (GroundingPolicy(), RandomPolicy()):
            hits = {phase: [] for phase in _PHASES}
            for index in self.indices:
                demonstration = self.drawer.store.demonstration(int(index))
                decision = demonstration.decision
                scores = policy.score(demonstration.observation(), decision.candidates, rng)
                hits[phases[index]].append(bool(decision.valid[scores.best]))
            every = [hit for phase in _PHASES for hit in hits[phase]]
            results[policy.name] = {"val_top1": float(np.mean(every))} | {
                f"val_top1_{phase}": float(np.mean(hits[phase])) for phase in _PHASES if hits[phase]
            }
        return results

    def _batches(self) -> list[tuple[int, np.ndarray]]:
        """Batches of one phase each, so that phases can be told apart afterwards."""
        folder = self.drawer.store.folder
        phases = np.array(folder.phases)
        return [
            (number, batch)
            for number, phase in enumerate(_PHASES)
            for batch in sorted_batches(
                self.indices[phases[self.indices] == phase], folder.num_candidates, batch=self.batch
            )
        ]


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


def _report(sums: Float[np.ndarray, "phases columns"]) -> dict[str, float]:
    total = sums.sum(axis=0)
    report = {f"val_{term}": total[i] / total[-1] for i, term in enumerate(_TERMS)}
    for phase, row in zip(_PHASES, sums, strict=True):
        if row[-1]:
            report |= {f"val_{term}_{phase}": row[i] / row[-1] for i, term in enumerate(_TERMS)}
    if not math.isnan(total[-2]):
        report["gate_entropy"] = total[-2] / total[-1]
    return {name: float(value) for name, value in report.items()}
