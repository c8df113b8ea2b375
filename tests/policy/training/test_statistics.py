import math

import pytest
import torch

from policy.network.model import SRNetwork
from policy.training.statistics import GateEntropy, branch_weights, gate_entropy, gradient_norms


def _entropy(gate: list[float]) -> float:
    entropy = GateEntropy()
    entropy(torch.nn.Identity(), (torch.zeros(0), torch.tensor([[gate]])))
    return entropy.value


def test_entropy_by_hand() -> None:
    assert _entropy([1.0, 1.0, 1.0, 1.0]) == pytest.approx(1.0)
    assert _entropy([0.0, 4.0, 0.0, 0.0]) == pytest.approx(0.0)
    # Padding, which has no weight, does not count as a point.
    assert _entropy([1.0, 1.0, 0.0, 0.0]) == pytest.approx(1.0)
    assert _entropy([1.5, 0.5, 0.0, 0.0]) == pytest.approx(
        -(0.75 * math.log(0.75) + 0.25 * math.log(0.25)) / math.log(2)
    )


@pytest.mark.parametrize(
    ("variant", "has_mask", "num_layers"), [("sr", True, 2), ("sr_a", True, 0), ("base", False, 0)]
)
def test_every_variant(
    variant: str,
    has_mask: bool,
    num_layers: int,
    make_config,
    make_observation,
    make_candidates,
    rng,
) -> None:
    from policy.network.batch import collate, make_sample

    config = make_config(variant)
    network = SRNetwork(config)
    with gate_entropy(network) as entropy:
        sample = make_sample(make_observation(rng), make_candidates(rng), config)
        network(collate([sample])).logits.sum().backward()
    assert math.isnan(entropy.value) != has_mask
    weights = branch_weights(network)
    assert weights == {f"alpha_sparse_{i}": 0.5 for i in range(num_layers)}
    norms = gradient_norms(network)
    total = math.sqrt(sum(norm**2 for norm in norms.values()))
    expected = torch.nn.utils.get_total_norm(
        [p.grad for p in network.parameters() if p.grad is not None]
    )
    assert total == pytest.approx(float(expected), rel=1e-5)
    assert {"grad_action_alignment", "grad_decoder"} <= norms.keys()
