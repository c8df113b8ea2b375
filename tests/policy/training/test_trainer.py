import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors.torch import load_file

from policy.errors import InvalidCheckpointError
from policy.network.checkpoint import load_checkpoint
from policy.network.mixing import mixing_weights
from policy.network.model import SRNetwork
from policy.training.config import TrainConfig
from policy.training.distributed import Ranks
from policy.training.logs import RunLog, read_table
from policy.training.objective import Objective
from policy.training.signals import StopSignal
from policy.training.trainer import Trainer

ALONE = Ranks(rank=0, size=1, device="cpu")
TIMES = {"data_s", "step_s", "seconds"}


class StopAfter(StopSignal):
    """A signal that comes after so many steps."""

    def __init__(self, num_steps: int) -> None:
        super().__init__()
        self.left = num_steps

    @property
    def is_set(self) -> bool:
        self.left -= 1
        return self.left < 0


def train(config: TrainConfig, num_steps: int = 10**6) -> tuple[Trainer, bool]:
    config.out.mkdir(parents=True, exist_ok=True)
    trainer = Trainer(config, ALONE, {"command": "test"})
    with RunLog(config.out, last_step=trainer.progress.step, tensorboard=False) as log:
        return trainer, trainer.run(log, StopAfter(num_steps))


def _numbers(path: Path) -> list[dict[str, float]]:
    rows = [{k: v for k, v in row.items() if k not in TIMES} for row in read_table(path)]
    # NaN is not equal to itself.
    return [{k: -1.0 if math.isnan(v) else v for k, v in row.items()} for row in rows]


@pytest.fixture(autouse=True)
def one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def test_learns_what_words_mean(write_scenes, make_train_config, plain, tmp_path: Path) -> None:
    """Names say nothing of looks, and every scene is asked for each of its objects in turn."""
    data = write_scenes(tmp_path / "many", 48)
    network = ("num_heads=4", "num_dssa_layers=1", "num_encoder_layers=0")
    options = {"lr": 5e-3, "pick_positives": "target", "val_share": 0.15, "network": network}
    config = make_train_config(data=data, epochs=8, **options, **plain)
    trainer, is_complete = train(config)
    rows = read_table(config.out / "epochs.csv")
    assert is_complete and rows[0]["val_top1"] < 0.6
    # The training scenes are known by heart; the held-out ones are understood.
    assert max(row["train_top1"] for row in rows[1:]) > 0.98
    assert max(row["val_top1"] for row in rows) >= 0.9
    card = json.loads((config.out / "best.json").read_text())
    metrics = card["training"]["metrics"]
    assert metrics["val_loss"] == min(row["val_loss"] for row in rows)
    # Of three picks of a scene one counts as clearing; there are as many places as picks.
    kinds = [metrics[f"val_top1_{kind}"] for kind in ("pick", "clear", "place")]
    assert metrics["val_top1"] == pytest.approx(np.average(kinds, weights=[2, 1, 3]), abs=1e-6)
    reference = card["training"]["reference"]
    assert metrics["val_top1"] > reference["grounding"]["val_top1"] + 0.2
    assert card["encoder"] == "synthetic-1"
    assert card["training"]["data"]["digest"] == trainer.folder.digest
    # What was kept is what was measured, but for rounding to half precision.
    kept = load_checkpoint(config.out / "best.safetensors", SRNetwork, encoder="synthetic-1")
    again = trainer.held_out.measure(Objective(kept, config.decoding_weight, torch.float32))
    assert again["val_loss"] == pytest.approx(metrics["val_loss"], abs=0.01)


def test_what_was_never_meant_is_told_apart(
    write_scenes, make_train_config, plain, tmp_path: Path
) -> None:
    """Of five concepts one is held out: how it looks can be learnt from nothing."""
    data = write_scenes(tmp_path / "many", 48)
    network = ("num_heads=4", "num_dssa_layers=1", "num_encoder_layers=0")
    options = {"lr": 5e-3, "pick_positives": "target", "val_share": 0.15, "network": network}
    config = make_train_config(data=data, epochs=8, new_share=0.36, **options, **plain)
    trainer, _ = train(config)
    objects = trainer.folder.objects
    assert {name for index in trainer.split.new for name in objects[index]} == {"concept-0"}
    rows = read_table(config.out / "epochs.csv")
    assert rows[-1]["val_top1"] > 0.8 and rows[-1]["new_top1"] < 0.6
    card = json.loads((config.out / "best.json").read_text())["training"]
    assert card["data"]["decisions"]["new"] == len(trainer.split.new)
    assert set(card["reference"]["random"]) >= {"val_top1", "new_top1", "new_top1_place"}


def test_frozen_projections_stay_as_they_begin(make_train_config, tmp_path: Path) -> None:
    kept = {}
    for is_frozen in (False, True):
        network = ("num_heads=4", f"frozen_projections={is_frozen}".lower())
        config = make_train_config(out=tmp_path / str(is_frozen), epochs=1, network=network)
        trainer = Trainer(config, ALONE, {})
        stage = trainer.network.language_alignment
        before = {name: w.detach().clone() for name, w in stage.named_parameters()}
        train(config)
        trained = load_checkpoint(config.out / "best.safetensors", SRNetwork)
        kept[is_frozen] = before, dict(trained.language_alignment.named_parameters())
    assert all(torch.equal(kept[False][0][name], w) for name, w in kept[True][0].items())
    for is_frozen, (before, after) in kept.items():
        for name in ("query.weight", "key.weight"):
            # Weights are kept in half precision.
            is_same = torch.equal(before[name].half(), after[name].half())
            assert is_same == is_frozen
        assert not torch.equal(before["value.weight"].half(), after["value.weight"].half())


def test_an_interrupted_run_is_like_an_unbroken_one(make_train_config, tmp_path: Path) -> None:
    options: dict[str, Any] = {"epochs": 2, "averaging": 0.9, "schedule": "cosine"}
    whole = make_train_config(out=tmp_path / "whole", **options)
    assert train(whole)[1]
    broken = tmp_path / "broken"
    # In the first epoch, again, and in the second.
    for num_steps in (1, 1, 3):
        config = make_train_config(out=broken, resume=True, **options)
        assert not train(config, num_steps)[1]
    assert train(make_train_config(out=broken, resume=True, **options))[1]
    for name in ("steps.csv", "epochs.csv"):
        assert _numbers(broken / name) == _numbers(whole.out / name)
    for name in ("best.safetensors", "state.safetensors"):
        first, second = load_file(broken / name), load_file(whole.out / name)
        assert first.keys() == second.keys()
        assert all(torch.equal(first[key], second[key]) for key in first)


def test_resuming_a_complete_run_changes_nothing(make_train_config) -> None:
    train(make_train_config(epochs=1))
    before = _numbers(make_train_config().out / "epochs.csv")
    trainer, is_complete = train(make_train_config(epochs=1, resume=True))
    assert is_complete and trainer.progress.epoch == 1
    assert _numbers(trainer.config.out / "epochs.csv") == before


def test_resuming_with_other_options(make_train_config) -> None:
    train(make_train_config(epochs=1))
    with pytest.raises(InvalidCheckpointError, match=r"got a run with lr=0\.0001, expected 0\.5"):
        Trainer(make_train_config(epochs=1, lr=0.5, resume=True), ALONE, {})
    with pytest.raises(InvalidCheckpointError, match="got a run with width=32, expected 16"):
        Trainer(make_train_config(epochs=1, width=16, resume=True), ALONE, {})


def test_stops_early_and_keeps_the_best(make_train_config) -> None:
    config = make_train_config(epochs=50, patience=2, stop_on="top1", lr=1e-12)
    trainer, is_complete = train(config)
    assert is_complete and trainer.progress.epoch == 2 and trainer.progress.best_epoch == 0
    assert json.loads((config.out / "best.json").read_text())["training"]["epoch"] == 0


@pytest.mark.parametrize("variant", ["sr_a", "base"])
def test_the_ablations_train(variant: str, make_train_config) -> None:
    config = make_train_config(variant=variant, epochs=1, precision="bfloat16")
    train(config)
    rows = read_table(config.out / "steps.csv")
    assert all(math.isfinite(row["loss"]) and row["grad"] > 0 for row in rows)
    kept = load_checkpoint(config.out / "best.safetensors", SRNetwork)
    assert kept.config.one_align == (variant != "base")


def test_validation_is_held_out_by_scene(make_train_config) -> None:
    trainer = Trainer(make_train_config(), ALONE, {})
    scenes = np.array(trainer.folder.scenes)
    assert not set(scenes[trainer.split.train]) & set(scenes[trainer.held_out.val.indices])


@pytest.mark.parametrize("factor", [1.0, 20.0])
def test_mixing_weights_learn_at_a_rate_of_their_own(
    factor: float, make_train_config, plain
) -> None:
    """The first step of Adam is as long as the learning rate, wherever there is a gradient."""
    config = make_train_config(lr=1e-3, warmup=0, mixing_rate=factor, clip=0.0, **plain)
    before = dict(Trainer(config, ALONE, {}).network.named_parameters())
    trainer, is_complete = train(config, num_steps=0)
    assert not is_complete and trainer.progress.step == 1
    mixing = mixing_weights(trainer.network)
    assert {"language_alignment.similarity_sharpness", "evidence.prior_weight"} <= mixing.keys()
    for name, parameter in trainer.network.named_parameters():
        step = (parameter - before[name]).abs().max().item()
        expected = 1e-3 * (factor if name in mixing else 1.0)
        assert step <= expected * 1.01
        if name in ("evidence.prior_weight", "decoder.query"):
            assert step >= expected * 0.9
