import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from policy.training.distributed import Ranks
from policy.training.logs import read_table
from policy.training.split import split_demonstrations
from policy.training.trainer import Trainer

OPTIONS = ("--threads", "1", "--width", "32", "--points", "24", "--no-tensorboard")
ALONE = Ranks(rank=0, size=1, device="cpu")


def test_alone_nothing_is_exchanged() -> None:
    module, values = torch.nn.Linear(2, 2), torch.arange(3.0)
    assert ALONE.wrap(module) is module and ALONE.sum(values) is values
    assert ALONE.any(True) and not ALONE.any(False) and ALONE.is_first


@pytest.mark.distributed
def test_two_processes_learn_like_one(scenes: Path, make_train_config, tmp_path: Path) -> None:
    from policy.demonstrations import DemonstrationFolder

    names = DemonstrationFolder(scenes).scenes
    # All but one: the second batch of every epoch leaves a process without a decision of its own.
    batch = len(split_demonstrations(names, [()] * len(names), val_share=0.25).train) - 1
    config = make_train_config(out=tmp_path / "one", batch=batch, epochs=4, lr=1e-3)
    config.out.mkdir()
    from policy.training.logs import RunLog
    from policy.training.signals import StopSignal

    trainer = Trainer(config, ALONE, {})
    with RunLog(config.out, last_step=0, tensorboard=False) as log:
        trainer.run(log, StopSignal())
    command = (
        *(sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node", "2"),
        "--local-addr=127.0.0.1",
        *("-m", "policy.train", "--data", str(scenes), "--out", str(tmp_path / "two"), *OPTIONS),
        *("--network", "num_heads=4", "num_dssa_layers=1", "--batch", str(batch), "--epochs", "4"),
        *("--val-share", "0.25", "--warmup", "5", "--lr", "1e-3", "--precision", "float32"),
    )
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    for name, columns in (
        ("steps.csv", ("loss", "choice", "decoding", "grad", "top1")),
        ("epochs.csv", ("val_loss", "val_top1", "gate_entropy", "alpha_sparse_0")),
    ):
        one, two = read_table(config.out / name), read_table(tmp_path / "two" / name)
        assert len(one) == len(two) == {"steps.csv": 8, "epochs.csv": 5}[name]
        for column in columns:
            np.testing.assert_allclose(
                [row[column] for row in two], [row[column] for row in one], atol=1e-3, rtol=0
            )
