from pathlib import Path

import pytest

from policy.training.logs import CsvLog, RunLog, read_table


def _write(path: Path, steps: range, *, last_step: int) -> None:
    log = CsvLog(path, last_step=last_step)
    for step in steps:
        log.add({"step": step, "epoch": 1, "loss": step / 3})
    log.close()


def test_rows_of_steps_that_are_made_again_are_dropped(tmp_path: Path) -> None:
    path, unbroken = tmp_path / "a.csv", tmp_path / "b.csv"
    _write(path, range(1, 9), last_step=0)
    _write(path, range(6, 12), last_step=5)
    _write(unbroken, range(1, 12), last_step=0)
    assert path.read_text() == unbroken.read_text()
    assert read_table(path)[3] == {"step": 4, "epoch": 1, "loss": 4 / 3}


def test_a_row_that_was_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    _write(path, range(1, 4), last_step=0)
    path.write_text(path.read_text() + "4,1")
    _write(path, range(4, 5), last_step=3)
    assert [row["step"] for row in read_table(path)] == [1, 2, 3, 4]


def test_without_a_saved_state_nothing_stays(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    for _ in range(2):
        _write(path, range(0, 3), last_step=-1)
        assert [row["step"] for row in read_table(path)] == [0, 1, 2]


def test_no_table() -> None:
    assert read_table(Path("nowhere.csv")) == []


def test_event_files_hold_the_same_numbers(tmp_path: Path) -> None:
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    with RunLog(tmp_path, last_step=0, tensorboard=True) as log:
        for step in (1, 2):
            log.add_step({"step": step, "epoch": 1, "loss": step / 4, "gate_entropy": float("nan")})
        log.add_epoch({"step": 2, "epoch": 1, "val_loss": 0.5})
    events = EventAccumulator(str(tmp_path / "tensorboard"))
    events.Reload()
    assert sorted(events.Tags()["scalars"]) == ["epoch/val_loss", "step/loss"]
    assert [(e.step, e.value) for e in events.Scalars("step/loss")] == [(1, 0.25), (2, 0.5)]
    assert events.Scalars("epoch/val_loss")[0].value == pytest.approx(0.5)
