"""Logs of a run: CSV files, and TensorBoard's event files where it is installed."""

import csv
import math
import os
import sys
from pathlib import Path
from types import TracebackType
from typing import Any, Self

STEPS_FILE = "steps.csv"
EPOCHS_FILE = "epochs.csv"


class CsvLog:
    """A table that grows by rows; its columns are those of the first row."""

    def __init__(self, path: Path, *, last_step: int) -> None:
        """Open the table.

        Args:
            path: The file; rows that it has stay, unless they are of later steps, which a run that
                was interrupted has to make again.
            last_step: Last step made; -1 if not even the untrained network's row is to stay.
        """
        rows = [row for row in read_table(path) if row["step"] <= last_step]
        part = path.with_name(f".{path.name}.{os.getpid()}.tmp")
        self._file = part.open("w", newline="")
        self._writer: csv.DictWriter[str] | None = None
        for row in rows:
            self.add({k: int(v) if k in ("step", "epoch") else v for k, v in row.items()})
        # Rows are added to the file under its new name.
        os.replace(part, path)

    def add(self, row: dict[str, Any]) -> None:
        """Add a row and write it out.

        Args:
            row: `step` and numbers; the names of the first row.
        """
        if self._writer is None:
            self._writer = csv.DictWriter(self._file, list(row))
            self._writer.writeheader()
        # Floats are written with all their digits, so that runs can be compared exactly.
        self._writer.writerow(row)
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def read_table(path: Path) -> list[dict[str, float]]:
    """Read a log.

    Args:
        path: The file; it need not exist. A last row that was cut off is left out.

    Returns:
        Its rows.
    """
    if not path.exists():
        return []
    rows = []
    with path.open(newline="") as file:
        for row in csv.DictReader(file):
            try:
                rows.append({name: float(value) for name, value in row.items()})
            except (TypeError, ValueError):
                break
    return rows


class RunLog:
    """Steps and epochs of a run, in CSV and TensorBoard."""

    def __init__(self, out: Path, *, last_step: int, tensorboard: bool) -> None:
        """Open the logs.

        Args:
            out: Folder of the run.
            last_step: Last step made; what was logged later is dropped. -1 drops all.
            tensorboard: Write event files too.
        """
        self._steps = CsvLog(out / STEPS_FILE, last_step=last_step)
        self._epochs = CsvLog(out / EPOCHS_FILE, last_step=last_step)
        self._events = _open_events(out / "tensorboard", last_step) if tensorboard else None

    def __enter__(self) -> Self:
        """Return the log."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close all files."""
        self._steps.close()
        self._epochs.close()
        if self._events is not None:
            self._events.close()

    def add_step(self, row: dict[str, Any]) -> None:
        """Log a step.

        Args:
            row: `step`, `epoch` and numbers.
        """
        self._steps.add(row)
        self._send("step", row)

    def add_epoch(self, row: dict[str, Any]) -> None:
        """Log an epoch.

        Args:
            row: `step`, `epoch` and numbers.
        """
        self._epochs.add(row)
        self._send("epoch", row)

    def _send(self, group: str, row: dict[str, Any]) -> None:
        if self._events is None:
            return
        for name, value in row.items():
            if name not in ("step", "epoch") and not math.isnan(value):
                self._events.add_scalar(f"{group}/{name}", value, row["step"])


def _open_events(folder: Path, last_step: int) -> Any:
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError:
        print(
            "TensorBoard is not installed, so no event files are written; "
            "pip install '.[train]' in a clone, or pass --no-tensorboard.",
            file=sys.stderr,
        )
        return None
    return SummaryWriter(str(folder), purge_step=last_step + 1)
