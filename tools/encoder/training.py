"""Trains the grounding head on cells of rendered pictures; the trunk stays as it is."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor
from tqdm import tqdm

from perception.encoders.embedded import EmbeddedEncoder
from perception.encoders.head import GroundingHead
from tools.encoder.features import CELLS_PER_OBJECT
from tools.encoder.phrases import (
    IGNORED,
    POSITIVE,
)
from tools.encoder.pictures import OTHER_ID, TABLE_ID
from tools.encoder.training_set import TrainingSet


@dataclass(frozen=True, kw_only=True)
class TrainingConfig:
    """Settings of the training.

    Attributes:
        steps: Optimiser steps.
        num_objects: Objects a step, six cells each.
        num_background: Cells of the table and of what is no object, a step.
        learning_rate: Highest rate; it rises over 200 steps and falls along a cosine.
        weight_decay: AdamW's.
        logit_scale: Factor of the cosines in the softmax.
        mixture_share: Weight of the class-name mixture in the features.
        distillation: Weight of the term that keeps the projection near the mixture.
        dropout: Share of cell features set to zero.
        num_false_concepts: Concepts a step that hold for none of its objects.
        general_weight: Weight of an object's colours, category, ... when it finds its texts; a name
            counts as one.
        general_text_weight: The same when texts find their objects.
        start_from: `head.pt` of an earlier run to go on from; None starts from random weights.
        seed: Seed of everything.
    """

    steps: int = 4000
    num_objects: int = 128
    num_background: int = 192
    learning_rate: float = 1e-3
    weight_decay: float = 0.02
    logit_scale: float = 20.0
    mixture_share: float = 0.25
    distillation: float = 0.1
    dropout: float = 0.1
    num_false_concepts: int = 250
    general_weight: float = 1.0
    general_text_weight: float = 1.0
    start_from: Path | None = None
    seed: int = 0


class ScaledHead(torch.nn.Module):
    """A head whose inputs are standardised while it trains, and folded afterwards."""

    def __init__(self, head: GroundingHead, cells: Tensor) -> None:
        """Estimate mean and deviation of the inputs.

        Args:
            head: The head, with random weights.
            cells: Cells to estimate from.
        """
        super().__init__()
        sample = cells[:: max(1, len(cells) // 20_000)].float()
        self.head = head
        self.register_buffer("mean", sample.mean(dim=0))
        self.register_buffer("deviation", sample.std(dim=0).clamp_min(1e-2))
        self.mean: Tensor
        self.deviation: Tensor

    def project(self, cells: Tensor, dropout: float) -> Tensor:
        """Apply the projection to standardised inputs; see `GroundingHead.project`."""
        scaled = ((cells - self.mean) / self.deviation).clamp(-8, 8)
        return self.head.project(F.dropout(scaled, dropout, self.training).bfloat16())

    @torch.no_grad()
    def load_folded(self, state: dict[str, Tensor]) -> None:
        """Go on from a head's state with mean and deviation folded in; undoes `folded`."""
        hidden = state["hidden.weight"].float()
        bias = state["hidden.bias"] + hidden @ self.mean
        own = {**state, "hidden.weight": hidden * self.deviation, "hidden.bias": bias}
        own["mixture_share"] = self.head.mixture_share.clone()
        self.head.load_state_dict(own)

    @torch.no_grad()
    def folded(self) -> dict[str, Tensor]:
        """Return the head's state with mean and deviation folded into its first layer."""
        state = {name: tensor.clone() for name, tensor in self.head.state_dict().items()}
        state["hidden.weight"] = self.head.hidden.weight / self.deviation
        state["hidden.bias"] = self.head.hidden.bias - state["hidden.weight"] @ self.mean
        return state


def train(data: TrainingSet, encoder: EmbeddedEncoder, config: TrainingConfig, run: Path) -> Path:
    """Train a head, or go on where an interrupted run stopped.

    Args:
        data: The training set.
        encoder: Holds the class-name mixture, from which the head starts.
        config: Settings.
        run: Folder for the log, the checkpoint and the result.

    Returns:
        File with the head's state.
    """
    torch.manual_seed(config.seed)
    run.mkdir(parents=True, exist_ok=True)
    head = GroundingHead(num_classes=1000, text_dim=data.phrases.shape[1])
    head.mixture.load_state_dict(encoder.head.mixture.state_dict())
    head.mixture.requires_grad_(False)
    head.mixture_share.fill_(config.mixture_share)
    model = ScaledHead(head, data.cells)
    if config.start_from is not None:
        model.load_folded(torch.load(config.start_from, weights_only=True))
    optimizer = torch.optim.AdamW(
        [p for p in model.parameters() if p.requires_grad],
        lr=config.learning_rate,
        weight_decay=config.weight_decay,
    )
    first = _resume(run / "checkpoint.pt", model, optimizer)
    with (run / "log.csv").open("a" if first else "w", newline="") as file:
        log = csv.writer(file)
        for step in tqdm(range(first, config.steps), initial=first, total=config.steps):
            # A generator of its own for every step: resuming changes nothing.
            rng = np.random.default_rng([config.seed, step])
            torch.manual_seed(config.seed * 1_000_003 + step)
            for group in optimizer.param_groups:
                group["lr"] = config.learning_rate * _schedule(step, config.steps)
            losses = step_losses(model, data, config, rng)
            loss = losses["objects"] + losses["texts"] + config.distillation * losses["mixture"]
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            if step % 50 == 0:
                log.writerow([step, *(f"{value.item():.4f}" for value in losses.values())])
                file.flush()
            if (step + 1) % 500 == 0:
                state = {"model": model.state_dict(), "optimizer": optimizer.state_dict()}
                torch.save({**state, "step": step + 1}, run / "checkpoint.pt")
    torch.save(model.folded(), run / "head.pt")
    return run / "head.pt"


def _resume(path: Path, model: ScaledHead, optimizer: torch.optim.Optimizer) -> int:
    if not path.exists():
        return 0
    saved = torch.load(path, weights_only=True)
    model.load_state_dict(saved["model"])
    optimizer.load_state_dict(saved["optimizer"])
    return int(saved["step"])


def _schedule(step: int, steps: int) -> float:
    return min(1.0, (step + 1) / 200) * 0.5 * (1 + math.cos(math.pi * step / steps))


def step_losses(
    model: ScaledHead, data: TrainingSet, config: TrainingConfig, rng: np.random.Generator
) -> dict[str, Tensor]:
    """Compute the losses of one step.

    Args:
        model: The head.
        data: The training set.
        config: Settings.
        rng: Chooses objects, cells and phrases.

    Returns:
        "objects": every object and cell finds its texts; "texts": every text finds its objects
        and cells among all others and the background; "mixture": distance from the mixture.
    """
    groups = _choose(len(data.groups), config.num_objects, rng)
    spots = _choose(len(data.background), config.num_background, rng)
    rows = np.concatenate([data.groups[groups].ravel(), data.background[spots]])
    rows = torch.from_numpy(rows)
    mixture = data.mixtures[rows].float()
    trained = F.normalize(model.project(data.cells[rows].float(), config.dropout), dim=-1)
    share = config.mixture_share
    features = F.normalize((1 - share) * trained + share * mixture, dim=-1)
    num_cells = len(groups) * CELLS_PER_OBJECT
    pooled = features[:num_cells].view(len(groups), CELLS_PER_OBJECT, -1).mean(dim=1)
    everything = torch.cat([F.normalize(pooled, dim=-1), features])

    labels = _labels(data, groups, spots)
    chosen = _choose_concepts(labels, config.num_false_concepts, rng)
    labels = labels[chosen]
    counts = np.diff(data.starts)[chosen]
    texts = data.phrases[torch.from_numpy(data.starts[chosen] + rng.integers(0, counts))]
    logits = config.logit_scale * (texts.bfloat16() @ everything.bfloat16().T).float()
    logits = logits.masked_fill(labels == IGNORED, -1e4)
    is_true = labels == POSITIVE
    is_general = torch.from_numpy(data.is_general[chosen])
    of_positive = torch.where(is_general, config.general_weight, 1.0)
    of_text = torch.where(is_general, config.general_text_weight, 1.0)
    return {
        "objects": _multi_positive(logits.T, is_true.T * of_positive, torch.ones(len(logits.T))),
        "texts": _multi_positive(logits, is_true.float(), of_text),
        "mixture": (1 - (trained * mixture).sum(dim=1)).mean(),
    }


def _choose(available: int, wanted: int, rng: np.random.Generator) -> np.ndarray:
    return rng.choice(available, min(available, wanted), replace=False)


def _labels(data: TrainingSet, groups: np.ndarray, spots: np.ndarray) -> Tensor:
    """Label objects, their cells and background cells with every concept."""
    of_object = data.labels[:, torch.from_numpy(data.objects[groups])]
    of_cell = of_object.repeat_interleave(CELLS_PER_OBJECT, dim=1)
    of_place = torch.zeros((len(data.labels), len(spots)), dtype=torch.int8)
    for row, place in enumerate((TABLE_ID, OTHER_ID)):
        of_place[row] = torch.from_numpy((data.places[spots] == place).astype(np.int8))
    return torch.cat([of_object, of_cell, of_place], dim=1)


def _choose_concepts(labels: Tensor, num_false: int, rng: np.random.Generator) -> np.ndarray:
    """Choose the concepts that hold for something, and some that hold for nothing here."""
    holds = (labels == POSITIVE).any(dim=1).numpy()
    false = rng.permutation(np.flatnonzero(~holds))[:num_false]
    return np.concatenate([np.flatnonzero(holds), false])


def _multi_positive(logits: Tensor, weights: Tensor, of_row: Tensor) -> Tensor:
    """Cross-entropy of every row against its weighted positives; rows without positives, none."""
    has_any = weights.sum(dim=1) > 0
    logits, weights, of_row = logits[has_any], weights[has_any], of_row[has_any]
    log_p = torch.log_softmax(logits, dim=1)
    losses = -(log_p * weights).sum(dim=1) / weights.sum(dim=1)
    return (losses * of_row).sum() / of_row.sum()
