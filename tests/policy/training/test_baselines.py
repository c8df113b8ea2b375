"""The trained baselines go through the same training as the SR network."""

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
import torch

from policy.baselines.a2 import A2Network
from policy.baselines.vlg import VLGConfig, VLGNetwork
from policy.demonstrations import DemonstrationFolder
from policy.errors import InvalidConfigError
from policy.network.base import CandidateNetwork
from policy.network.batch import DecisionSample, make_sample
from policy.network.checkpoint import load_checkpoint
from policy.training import plot
from policy.training import store as store_module
from policy.training.distributed import Ranks
from policy.training.draws import ExampleDrawer
from policy.training.logs import RunLog, read_table
from policy.training.objective import Objective
from policy.training.signals import StopSignal
from policy.training.store import DecisionStore
from policy.training.trainer import Trainer

ALONE = Ranks(rank=0, size=1, device="cpu")
NETWORKS = {"a2": A2Network, "vlg": VLGNetwork}


@pytest.fixture(autouse=True)
def one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="module")
def similar_scenes(tmp_path_factory: pytest.TempPathFactory, write_scenes) -> Path:
    """Dense objects, to which the similarity points: 16 scenes, 96 decisions."""
    folder = tmp_path_factory.mktemp("similar")
    return write_scenes(folder, 16, num_points=120, similar=True)


@pytest.mark.parametrize(("variant", "epochs"), [("a2", 4), ("vlg", 8)])
def test_learns_what_is_asked_for(
    variant: str, epochs: int, similar_scenes: Path, make_train_config, plain
) -> None:
    config = make_train_config(
        data=similar_scenes,
        variant=variant,
        points=40,
        network=("num_heads=4",),
        lr=5e-3,
        epochs=epochs,
        val_share=0.15,
        pick_positives="target",
        **plain,
    )
    config.out.mkdir()
    trainer = Trainer(config, ALONE, {"command": "test"})
    with RunLog(config.out, last_step=0, tensorboard=False) as log:
        assert trainer.run(log, StopSignal())
    rows = read_table(config.out / "epochs.csv")
    assert rows[0]["val_top1"] < 0.7
    assert max(row["train_top1"] for row in rows[1:]) > 0.85
    assert max(row["val_top1"] for row in rows) >= 0.8
    # Nothing is logged that the network does not have.
    assert not any(name.startswith(("alpha", "gate")) for name in rows[0])
    card = json.loads((config.out / "best.json").read_text())
    assert card["kind"] == variant and card["training"]["options"]["variant"] == variant
    kept = load_checkpoint(config.out / "best.safetensors", NETWORKS[variant])
    assert json.loads(json.dumps(asdict(kept.config))) == card["config"]
    again = trainer.held_out.measure(Objective(kept, config.decoding_weight, torch.float32))
    assert again["val_loss"] == pytest.approx(card["training"]["metrics"]["val_loss"], abs=0.02)
    assert plot._title(config.out) == {"a2": "A², seed 0", "vlg": "VLG, seed 0"}[variant]


def test_goes_on_where_it_stopped(make_train_config, tmp_path: Path) -> None:
    def train(out: Path, epochs: int) -> CandidateNetwork:
        config = make_train_config(
            out=out,
            resume=True,
            epochs=epochs,
            variant="vlg",
            network=("num_heads=4",),
            train_share=0.4,
        )
        out.mkdir(exist_ok=True)
        trainer = Trainer(config, ALONE, {})
        with RunLog(out, last_step=trainer.progress.step, tensorboard=False) as log:
            trainer.run(log, StopSignal())
        return trainer.network

    whole = train(tmp_path / "whole", 2)
    train(tmp_path / "broken", 1)
    broken = train(tmp_path / "broken", 2)
    for one, two in zip(whole.parameters(), broken.parameters(), strict=True):
        assert torch.equal(one, two)


def _equal(one: DecisionSample, two: DecisionSample) -> None:
    for name in ("positions", "features", "similarity", "poses", "prior", "tokens", "phrase"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    assert one.objects is not None and two.objects is not None
    for name in ("features", "similarity", "positions", "sizes"):
        np.testing.assert_array_equal(getattr(one.objects, name), getattr(two.objects, name))


@pytest.mark.parametrize("in_memory", [True, False])
def test_objects_are_found_once_a_look(
    in_memory: bool,
    similar_scenes: Path,
    make_train_config,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls = []

    def counted(points: np.ndarray) -> np.ndarray:
        calls.append(len(points))
        return labels(points)

    labels = store_module.object_labels
    monkeypatch.setattr(store_module, "object_labels", counted)
    config = make_train_config(variant="vlg", network=("num_heads=4",))
    folder = DemonstrationFolder(similar_scenes)
    network_config = config.network_config(folder.feature_dim)
    drawer = ExampleDrawer(DecisionStore(folder, network_config, in_memory=in_memory), config)
    # Six decisions on each of two looks, as they are and augmented in two epochs.
    for index in range(12):
        drawn = drawer.validation(index).sample
        # What the network would see in use, where it is given the whole cloud.
        whole = folder[index]
        expected = make_sample(whole.observation(), whole.decision.candidates, network_config)
        _equal(drawn, expected)
        for epoch in (0, 1):
            changed = drawer.training(index, epoch).sample.objects
            assert changed is not None and len(changed) == len(drawn.objects or ())
            np.testing.assert_allclose(changed.sizes, (drawn.objects or changed).sizes)
            assert not np.array_equal(changed.positions, (drawn.objects or changed).positions)
    assert calls == [120, 120]


def test_networks_of_points_get_no_objects(similar_scenes: Path, make_train_config) -> None:
    folder = DemonstrationFolder(similar_scenes)
    for variant, network in (("sr", ()), ("a2", ("num_heads=4",))):
        config = make_train_config(variant=variant, network=network)
        network_config = config.network_config(folder.feature_dim)
        store = DecisionStore(folder, network_config, in_memory=True)
        assert ExampleDrawer(store, config).training(0, 0).sample.objects is None
        assert store.thinned(0, 0, 10)[0].objects is None


def test_settings_are_those_of_the_network(make_train_config) -> None:
    config = make_train_config(variant="vlg", network=("num_layers=3", "phrase=false"))
    network_config = config.network_config(16)
    assert isinstance(network_config, VLGConfig)
    assert (network_config.num_layers, network_config.phrase) == (3, False)
    assert (network_config.width, network_config.max_points) == (32, 24)
    with pytest.raises(InvalidConfigError, match="network: got 'num_dssa_layers=1', expected NAME"):
        make_train_config(variant="a2").network_config(16)
