"""What the training minimises: objects find their words, words their objects."""

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from tools.encoder.phrases import IGNORED, POSITIVE
from tools.encoder.pictures import OTHER_ID, TABLE_ID
from tools.encoder.training_set import Batch, TrainingSet, choose_concepts


def matching_losses(
    features: Tensor,
    batch: Batch,
    data: TrainingSet,
    *,
    logit_scale: float,
    num_false_concepts: int,
    general_weight: float,
    general_text_weight: float,
    rng: np.random.Generator,
) -> tuple[Tensor, Tensor]:
    """Compare objects, cells and texts in both directions.

    Args:
        features: (C, 384) unit features of the batch's cells.
        batch: The batch.
        data: The training set.
        logit_scale: Factor of the cosines in the softmax.
        num_false_concepts: Concepts that hold for none of the objects.
        general_weight: Weight of an object's colours, category, ... when it finds its texts; a
            name counts as one.
        general_text_weight: The same when texts find their objects.
        rng: Chooses concepts and phrases.

    Returns:
        Loss of every object and cell that looks for its texts, and of every text that looks for
        its objects and cells among all others and the background.
    """
    num_cells, num_objects = len(batch.owners), len(batch.objects)
    sums = features.new_zeros(num_objects, features.shape[1])
    pooled = F.normalize(sums.index_add(0, batch.owners, features[:num_cells]), dim=-1)
    everything = torch.cat([pooled, features])
    labels = _labels(data, batch)
    chosen = choose_concepts(labels, num_false_concepts, rng)
    labels = labels[chosen]
    counts = np.diff(data.starts)[chosen]
    texts = data.phrases[torch.from_numpy(data.starts[chosen] + rng.integers(0, counts))]
    logits = logit_scale * (texts.bfloat16() @ everything.bfloat16().T).float()
    logits = logits.masked_fill(labels == IGNORED, -1e4)
    is_true = labels == POSITIVE
    is_general = torch.from_numpy(data.is_general[chosen])
    of_positive = torch.where(is_general, general_weight, 1.0)
    of_text = torch.where(is_general, general_text_weight, 1.0)
    return (
        _multi_positive(logits.T, is_true.T * of_positive, torch.ones(len(logits.T))),
        _multi_positive(logits, is_true.float(), of_text),
    )


def _labels(data: TrainingSet, batch: Batch) -> Tensor:
    """Label objects, their cells and background cells with every concept."""
    of_object = data.labels[:, batch.objects]
    of_place = torch.zeros((len(data.labels), len(batch.places)), dtype=torch.int8)
    for row, place in enumerate((TABLE_ID, OTHER_ID)):
        of_place[row] = torch.from_numpy((batch.places == place).astype(np.int8))
    return torch.cat([of_object, of_object[:, batch.owners], of_place], dim=1)


def _multi_positive(logits: Tensor, weights: Tensor, of_row: Tensor) -> Tensor:
    """Cross-entropy of every row against its weighted positives; rows without positives, none."""
    has_any = weights.sum(dim=1) > 0
    logits, weights, of_row = logits[has_any], weights[has_any], of_row[has_any]
    log_p = torch.log_softmax(logits, dim=1)
    losses = -(log_p * weights).sum(dim=1) / weights.sum(dim=1)
    return (losses * of_row).sum() / of_row.sum()


def distillation_loss(logits: Tensor, original: Tensor, temperature: float) -> Tensor:
    """Measure how far class probabilities have moved from those of the original tower.

    Args:
        logits: (C, 1000) class logits of the tower in training.
        original: (C, 1000) those of the original.
        temperature: Softens both.

    Returns:
        Mean Kullback-Leibler divergence, nats.
    """
    log_p = torch.log_softmax(logits.float() / temperature, dim=-1)
    target = torch.log_softmax(original.float() / temperature, dim=-1)
    return F.kl_div(log_p, target, log_target=True, reduction="batchmean")
