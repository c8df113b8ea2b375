import pytest
import torch

from policy.demonstrations import DemonstrationFolder
from policy.network.loss import choice_loss, decoding_loss
from policy.network.model import SRNetwork
from policy.training.draws import ExampleBatch, ExampleDrawer, collate_examples
from policy.training.objective import Objective, compute_dtype
from policy.training.store import DecisionStore


@pytest.fixture
def batch(make_train_config, scenes) -> tuple[SRNetwork, ExampleBatch]:
    config = make_train_config()
    folder = DemonstrationFolder(scenes)
    network_config = config.network_config(folder.feature_dim)
    drawer = ExampleDrawer(DecisionStore(folder, network_config, in_memory=True), config)
    torch.manual_seed(0)
    return SRNetwork(network_config), collate_examples([drawer.training(i, 0) for i in range(9)])


def test_terms_are_those_of_the_loss(batch) -> None:
    network, examples = batch
    terms = Objective(network, 0.3, torch.float32)(examples)
    output = network(examples.inputs)
    choice = float(choice_loss(output.logits, examples.targets.positive).detach())
    decoding = float(decoding_loss(output, examples.targets, network.config).detach())
    assert float(terms.choice) == pytest.approx(choice, rel=1e-6)
    assert float(terms.decoding) == pytest.approx(decoding, rel=1e-6) and decoding > 0
    assert float(terms.loss.detach()) == pytest.approx(choice + 0.3 * decoding, rel=1e-6)
    assert float(terms.valid) == pytest.approx(
        float(choice_loss(output.logits.detach(), examples.valid))
    )
    best = output.logits.argmax(dim=1)
    hits = [bool(examples.valid[i, k]) for i, k in enumerate(best)]
    assert float(terms.top1) == pytest.approx(sum(hits) / len(hits))
    assert terms.loss.requires_grad and not terms.choice.requires_grad


def test_bfloat16_is_close_and_its_losses_are_single(batch) -> None:
    network, examples = batch
    exact = Objective(network, 0.1, torch.float32)(examples)
    rough = Objective(network, 0.1, torch.bfloat16)(examples)
    assert rough.loss.dtype == torch.float32
    torch.testing.assert_close(rough.loss, exact.loss, rtol=0.05, atol=0.05)
    rough.loss.backward()
    assert all(p.grad is None or p.grad.isfinite().all() for p in network.parameters())


def test_precision_is_what_was_asked_for() -> None:
    assert compute_dtype("float32", "cpu") == torch.float32
    assert compute_dtype("bfloat16", "cpu") == torch.bfloat16
    assert compute_dtype("auto", "cpu") in (torch.float32, torch.bfloat16)
