import math
from typing import Any

import numpy as np
import pytest
import torch

from policy.errors import InvalidArrayError
from policy.network.config import SRConfig
from policy.network.decoder import NetworkOutput
from policy.network.loss import (
    ExpertTarget,
    ExpertTargetBatch,
    choice_loss,
    collate_targets,
    decoding_loss,
)

INF = float("inf")
# Weights 1/10, 2/10, 7/10 and 1/4, 3/4, padding.
LOGITS = torch.tensor([[1.0, 2.0, 7.0], [1.0, 3.0, 0.0]]).log()


@pytest.mark.parametrize(
    ("positive", "expected"),
    [
        ([[1, 0, 0], [0, 1, 0]], (-math.log(0.1) - math.log(0.75)) / 2),
        ([[1, 1, 0], [1, 0, 0]], (-math.log(0.3) - math.log(0.25)) / 2),
        ([[1, 1, 1], [1, 1, 0]], 0.0),
        # A positive on padding has no weight.
        ([[0, 0, 1], [1, 0, 1]], (-math.log(0.7) - math.log(0.25)) / 2),
    ],
)
def test_choice_loss_by_hand(positive: list[list[int]], expected: float) -> None:
    loss = choice_loss(LOGITS, torch.tensor(positive, dtype=torch.bool))
    assert loss.item() == pytest.approx(expected, abs=1e-6)


def test_choice_loss_does_not_move_with_a_shift() -> None:
    positive = torch.tensor([[True, False, False], [False, True, False]])
    shifted = choice_loss(LOGITS + 500, positive)
    torch.testing.assert_close(shifted, choice_loss(LOGITS, positive), rtol=0, atol=1e-4)


def test_gradient_with_padding_is_finite() -> None:
    raw = torch.zeros(2, 3, requires_grad=True)
    mask = torch.tensor([[True, True, True], [True, True, False]])
    positive = torch.tensor([[True, False, False], [False, True, False]])
    choice_loss(raw.masked_fill(~mask, -INF), positive).backward()
    expected = torch.tensor([[-2 / 3, 1 / 3, 1 / 3], [1 / 2, -1 / 2, 0.0]]) / 2
    torch.testing.assert_close(raw.grad, expected)


def test_no_positive_is_an_error() -> None:
    with pytest.raises(InvalidArrayError) as caught:
        choice_loss(LOGITS, torch.tensor([[True, False, False], [False, False, True]]))
    assert str(caught.value) == (
        "positive: got 1 decisions without a positive candidate, expected at least 1 in each."
    )


def _output_and_targets() -> tuple[NetworkOutput, ExpertTargetBatch, SRConfig]:
    config = SRConfig(feature_dim=8, max_opening_m=0.1, max_refinement_rad=0.2)
    output = NetworkOutput(
        logits=torch.zeros(1, 3),
        rotvec_tool=torch.tensor([[[0.1, 0.0, 0.0], [0.0, 0.0, 0.0], [9.0, 9.0, 9.0]]]),
        opening_m=torch.tensor([[0.05, 0.02, 9.0]]),
        avoid_collision_logit=torch.tensor([[0.0, math.log(3.0), 9.0]]),
    )
    targets = ExpertTargetBatch(
        positive=torch.tensor([[True, True, False]]),
        opening_m=torch.tensor([[0.0, 0.02, 0.0]]),
        avoid_collision=torch.tensor([[1.0, 0.0, 0.0]]),
        rotvec_tool=torch.zeros(1, 3, 3),
    )
    return output, targets, config


def test_decoding_loss_by_hand() -> None:
    first = 0.5**2 + 0.5**2 - math.log(0.5)
    second = 0.0 + 0.0 - math.log(0.25)
    loss = decoding_loss(*_output_and_targets())
    assert loss.item() == pytest.approx((first + second) / 2, abs=1e-6)


def _target(num_candidates: int = 3, **changes: Any) -> ExpertTarget:
    defaults = {
        "positive": np.arange(num_candidates) == 0,
        "opening_m": np.full(num_candidates, 0.04),
        "avoid_collision": np.zeros(num_candidates),
        "rotvec_tool": np.zeros((num_candidates, 3)),
    }
    return ExpertTarget(**(defaults | changes))


def test_targets_are_padded_with_negatives() -> None:
    batch = collate_targets([_target(2), _target(4)])
    assert batch.positive.dtype == torch.bool
    assert batch.positive.tolist() == [[True, False, False, False]] * 2
    assert batch.opening_m.shape == (2, 4) and batch.rotvec_tool.shape == (2, 4, 3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"positive": np.zeros(3, dtype=bool)},
            "positive: got 0 positives in bool of shape (3,), expected bool (K,) with at least 1 "
            "positive.",
        ),
        (
            {"positive": np.array([1, 0, 0])},
            "positive: got 1 positives in int64 of shape (3,), expected bool (K,) with at least 1 "
            "positive.",
        ),
        ({"opening_m": np.zeros(2)}, "opening_m: got shape (2,), expected (K=3,)."),
        (
            {"avoid_collision": np.full(3, 2.0)},
            "avoid_collision: got values from 2 to 2, expected 0 to 1.",
        ),
    ],
)
def test_bad_targets(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidArrayError) as caught:
        _target(**changes)
    assert str(caught.value) == message


def test_no_targets() -> None:
    with pytest.raises(InvalidArrayError) as caught:
        collate_targets([])
    assert str(caught.value) == "targets: got 0, expected at least 1."
