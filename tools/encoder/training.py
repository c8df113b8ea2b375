"""Trains the grounding head, and the image tower's last stages with it, on rendered pictures."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor, nn
from tqdm import tqdm

from perception.encoders.embedded import EmbeddedEncoder, EmbeddedEncoderConfig
from perception.encoders.head import GroundingHead
from tools.encoder.lattice import LastStages
from tools.encoder.losses import distillation_loss, matching_losses
from tools.encoder.training_set import Batch, TrainingSet, draw_batch


@dataclass(frozen=True, kw_only=True)
class TrainingConfig:
    """Settings of the training.

    Attributes:
        steps: Optimiser steps.
        num_pictures: Pictures a step.
        learning_rate: Highest rate of the head; it rises over 100 steps and falls along a cosine.
        stage_learning_rate: That of the tower's last stages; 0 leaves them as they are.
        weight_decay: AdamW's.
        logit_scale: Factor of the cosines in the softmax.
        mixture_share: Weight of the class-name mixture in the features.
        anchor: Weight of the term that keeps the projection near the mixture.
        distillation: Weight of the term that keeps the class probabilities of the tower as ImageNet
            taught them; 0 lets them go.
        dropout: Share of cell features set to zero.
        num_false_concepts: Concepts a step that hold for none of its objects.
        general_weight: Weight of general words; see `matching_losses`.
        general_text_weight: The same for texts.
        averaging: Decay of the running average of the weights, which is what is kept.
        save_every: Steps between checkpoints.
        seed: Seed of everything.
    """

    steps: int = 1400
    num_pictures: int = 16
    learning_rate: float = 1e-3
    stage_learning_rate: float = 2e-4
    weight_decay: float = 0.02
    logit_scale: float = 20.0
    mixture_share: float = 0.25
    anchor: float = 0.1
    distillation: float = 0.5
    dropout: float = 0.1
    num_false_concepts: int = 250
    general_weight: float = 2.0
    general_text_weight: float = 4.0
    averaging: float = 0.995
    save_every: int = 100
    seed: int = 0


class TrainedPart(nn.Module):
    """Everything that is trained: last stages and head, whose inputs are standardised meanwhile."""

    def __init__(self, encoder: EmbeddedEncoder, config: TrainingConfig) -> None:
        """Start from the encoder's tower and mixture, and a random projection.

        Args:
            encoder: The original encoder.
            config: Settings.
        """
        super().__init__()
        self.temperature = encoder.config.temperature
        self.stages = LastStages(encoder.trunk)
        self.stages.requires_grad_(config.stage_learning_rate > 0)
        for weight in (*self.stages.depth, *self.stages.depth_bias):
            # Their gradient would cost more than all the rest.
            weight.requires_grad_(False)
        self.head = GroundingHead(num_classes=1000, text_dim=encoder.feature_dim)
        self.head.mixture.load_state_dict(encoder.head.mixture.state_dict())
        self.head.mixture.requires_grad_(False)
        self.head.mixture_share.fill_(config.mixture_share)
        size = self.head.hidden.in_features
        self.register_buffer("mean", torch.zeros(size))
        self.register_buffer("deviation", torch.ones(size))
        self.mean: Tensor
        self.deviation: Tensor

    def final(self, batch: Batch) -> Tensor:
        """Return the (C, 1280) final features of a batch's cells."""
        maps = self.stages(batch.parts.bfloat16(), batch.phase)
        return self.stages.finish(maps.reshape(-1, maps.shape[-1])[batch.cells])

    def project(self, cells: Tensor, dropout: float) -> Tensor:
        """Apply the projection to standardised inputs; see `GroundingHead.project`."""
        scaled = ((cells.float() - self.mean) / self.deviation).clamp(-8, 8)
        return self.head.project(F.dropout(scaled, dropout, self.training).bfloat16())

    @torch.no_grad()
    def standardise(self, data: TrainingSet, num_pictures: int, rng: np.random.Generator) -> None:
        """Estimate mean and deviation of the head's inputs from 20 batches."""
        batches = [draw_batch(data, num_pictures, rng) for _ in range(20)]
        sample = torch.cat([self.cells(batch, self.final(batch)) for batch in batches])
        self.mean.copy_(sample.float().mean(dim=0))
        self.deviation.copy_(sample.float().std(dim=0).clamp_min(1e-2))

    @staticmethod
    def cells(batch: Batch, final: Tensor) -> Tensor:
        """Put together what the head reads: (C, 1480)."""
        return torch.cat([final, batch.part_cells.bfloat16(), batch.rest_cells.bfloat16()], dim=1)


def untrained_encoder() -> EmbeddedEncoder:
    """Load the encoder that training starts from: the original tower and the mixture alone."""
    return EmbeddedEncoder(EmbeddedEncoderConfig(mixture_share=1.0, precision="float32"))


def train(data: TrainingSet, encoder: EmbeddedEncoder, config: TrainingConfig, run: Path) -> Path:
    """Train, or go on where an interrupted run stopped.

    Args:
        data: The training set.
        encoder: The encoder without any training, from which it starts.
        config: Settings.
        run: Folder for the log, the checkpoint and the result.

    Returns:
        File with the state of a `TrainedPart`.
    """
    torch.manual_seed(config.seed)
    run.mkdir(parents=True, exist_ok=True)
    original = LastStages(encoder.trunk).requires_grad_(False)
    model = TrainedPart(encoder, config)
    model.standardise(data, config.num_pictures, np.random.default_rng([config.seed, 10**9]))
    optimizer = _make_optimizer(model, config)
    average = {name: tensor.clone() for name, tensor in model.state_dict().items()}
    first = _resume(run / "checkpoint.pt", model, optimizer, average)
    rates = [group["lr"] for group in _make_optimizer(model, config).param_groups]
    with (run / "log.csv").open("a" if first else "w", newline="") as file:
        log = csv.writer(file)
        for step in tqdm(range(first, config.steps), initial=first, total=config.steps):
            # A generator of its own for every step: resuming changes nothing.
            rng = np.random.default_rng([config.seed, step])
            torch.manual_seed(config.seed * 1_000_003 + step)
            for group, rate in zip(optimizer.param_groups, rates, strict=True):
                group["lr"] = rate * _schedule(step, config.steps)
            losses = step_losses(model, original, data, config, rng)
            optimizer.zero_grad()
            sum(losses.values(), torch.zeros(())).backward()
            nn.utils.clip_grad_norm_(model.parameters(), 5.0)
            optimizer.step()
            _move_average(average, model, min(config.averaging, (step + 1) / (step + 10)))
            if step % 20 == 0:
                log.writerow([step, *(f"{value.item():.4f}" for value in losses.values())])
                file.flush()
            if (step + 1) % config.save_every == 0:
                _save(
                    run / "checkpoint.pt",
                    {
                        "model": model.state_dict(),
                        "optimizer": optimizer.state_dict(),
                        "average": average,
                        "step": step + 1,
                    },
                )
                _save(run / "trained.pt", average)
    _save(run / "trained.pt", average)
    return run / "trained.pt"


def step_losses(
    model: TrainedPart,
    original: LastStages,
    data: TrainingSet,
    config: TrainingConfig,
    rng: np.random.Generator,
) -> dict[str, Tensor]:
    """Compute the weighted losses of one step.

    Args:
        model: What is trained.
        original: The last stages as they were.
        data: The training set.
        config: Settings.
        rng: Chooses pictures, cells and phrases.

    Returns:
        "objects", "texts": see `matching_losses`; "anchor": distance of the projection from the
        mixture; "distillation": see `distillation_loss`, where it is asked for.
    """
    batch = draw_batch(data, config.num_pictures, rng)
    final = model.final(batch)
    trained = F.normalize(model.project(model.cells(batch, final), config.dropout), dim=-1)
    mixture = model.head.mixture(final, model.temperature)
    share = config.mixture_share
    features = F.normalize((1 - share) * trained + share * mixture, dim=-1)
    objects, texts = matching_losses(
        features,
        batch,
        data,
        logit_scale=config.logit_scale,
        num_false_concepts=config.num_false_concepts,
        general_weight=config.general_weight,
        general_text_weight=config.general_text_weight,
        rng=rng,
    )
    anchor = (1 - (trained * mixture.detach()).sum(dim=1)).mean()
    losses = {"objects": objects, "texts": texts, "anchor": config.anchor * anchor}
    if config.stage_learning_rate > 0 and config.distillation > 0:
        with torch.no_grad():
            maps = original(batch.parts.bfloat16(), batch.phase)
            before = original.finish(maps.reshape(-1, maps.shape[-1])[batch.cells])
            target = model.head.mixture.class_logits(before)
        divergence = distillation_loss(
            model.head.mixture.class_logits(final), target, model.temperature
        )
        losses["distillation"] = config.distillation * divergence
    return losses


def _make_optimizer(model: TrainedPart, config: TrainingConfig) -> torch.optim.Optimizer:
    groups = [
        {"params": [p for p in model.head.parameters() if p.requires_grad]},
        {
            "params": [p for p in model.stages.parameters() if p.requires_grad],
            "lr": config.stage_learning_rate,
        },
    ]
    return torch.optim.AdamW(
        [group for group in groups if group["params"]],
        lr=config.learning_rate,
        weight_decay=config.weight_decay,
    )


@torch.no_grad()
def _move_average(average: dict[str, Tensor], model: nn.Module, decay: float) -> None:
    for name, tensor in model.state_dict().items():
        average[name].lerp_(tensor, 1 - decay)


def _save(path: Path, state: dict[str, object]) -> None:
    part = path.with_suffix(".part")
    torch.save(state, part)
    part.replace(path)


def _resume(
    path: Path, model: nn.Module, optimizer: torch.optim.Optimizer, average: dict[str, Tensor]
) -> int:
    if not path.exists():
        return 0
    saved = torch.load(path, weights_only=True)
    model.load_state_dict(saved["model"])
    optimizer.load_state_dict(saved["optimizer"])
    average.update(saved["average"])
    return int(saved["step"])


def _schedule(step: int, steps: int) -> float:
    return min(1.0, (step + 1) / 100) * 0.5 * (1 + math.cos(math.pi * step / steps))
