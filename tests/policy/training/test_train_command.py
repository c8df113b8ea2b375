import importlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from PIL import Image

from policy import train
from policy.training.logs import read_table

OPTIONS = (
    *("--width", "32", "--points", "24", "--network", "num_heads=4", "num_dssa_layers=1"),
    *("--batch", "16", "--val-share", "0.25", "--precision", "float32", "--threads", "1"),
    "--no-tensorboard",
)


def _main(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> int:
    monkeypatch.setattr(sys, "argv", ["policy.train", *map(str, arguments)])
    with pytest.raises(SystemExit) as caught:
        train.main()
    assert isinstance(caught.value.code, int)
    return caught.value.code


def test_help_loads_nothing_heavy() -> None:
    code = "import sys, policy.train; sys.exit('torch' in sys.modules or 'h5py' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_mistakes_get_one_line(
    scenes: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    full = tmp_path / "full"
    full.mkdir()
    (full / "something").touch()
    good = ("--data", scenes, "--out", tmp_path / "run")
    nowhere = tmp_path / "nowhere"
    cases = [
        (("--data", nowhere, "--out", tmp_path / "run"), f"{nowhere}: got no folder, expected"),
        (("--data", scenes, "--out", full), f"out: got {full}, which is not empty; expected a new"),
        ((*good, "--epochs", "0"), "epochs: got 0, expected at least 1."),
        ((*good, "--network", "x=1"), "network: got 'x=1', expected NAME=VALUE with one of"),
        (("plot", full), f"runs: got {full}, which has no epochs.csv with epochs; expected"),
    ]
    for arguments, start in cases:
        assert _main(monkeypatch, *arguments) == 2
        error = capsys.readouterr().err
        assert error.startswith(f"error: {start}") and error.count("\n") == 1
    assert not (tmp_path / "run").exists()


def test_a_killed_run_goes_on_and_is_drawn(
    scenes: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def arguments(out: Path) -> list[str]:
        return [
            "--data",
            str(scenes),
            "--out",
            str(out),
            *OPTIONS,
            "--epochs",
            "40",
            "--patience",
            "0",
        ]

    killed = tmp_path / "killed"
    command = [sys.executable, "-m", "policy.train", *arguments(killed), "--save-every-s", "0"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while len(read_table(killed / "steps.csv")) < 6 and process.poll() is None:
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    num_killed = len(read_table(killed / "steps.csv"))

    # A signal that is obeyed after the step under way.
    resume = [*arguments(killed), "--resume", "--save-every-s", "0"]
    monkeypatch.setattr(
        "policy.training.trainer.save_state", _interrupting("policy.training.trainer.save_state")
    )
    assert _main(monkeypatch, *resume) == 128 + signal.SIGTERM
    monkeypatch.undo()
    assert "go on with --resume" in capsys.readouterr().out
    rows = read_table(killed / "steps.csv")
    assert [row["step"] for row in rows] == list(range(1, len(rows) + 1))
    assert num_killed - 1 <= len(rows) < 4 * 40

    picture = tmp_path / "curves.png"
    assert _main(monkeypatch, "plot", killed, killed, "--out", picture) == 0
    with Image.open(picture) as image:
        assert image.width > image.height > 500


def test_a_run_killed_before_its_first_saved_state_begins_anew(
    scenes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "run"
    arguments = ("--data", scenes, "--out", out, *OPTIONS, "--epochs", "1")
    assert _main(monkeypatch, *arguments) == 0
    whole = {name: read_table(out / name) for name in ("steps.csv", "epochs.csv")}
    # As the kill would have left it: logs, but no state.
    (out / "state.safetensors").unlink()
    assert _main(monkeypatch, *arguments, "--resume") == 0
    for name, rows in whole.items():
        again = read_table(out / name)
        assert [row["step"] for row in again] == [row["step"] for row in rows]
    assert [row["epoch"] for row in read_table(out / "epochs.csv")] == [0, 1]


def _interrupting(name: str):
    """The real function, after whose first call the process gets SIGTERM."""
    module, _, attribute = name.rpartition(".")
    original, left = getattr(importlib.import_module(module), attribute), [signal.SIGTERM]

    def save(*arguments: object) -> None:
        original(*arguments)
        if left:
            os.kill(os.getpid(), left.pop())

    return save
