"""A picture of loss and success over the epochs of several runs (figure 8 of the paper)."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from policy.errors import InvalidConfigError
from policy.training.logs import EPOCHS_FILE, read_table

_VARIANTS = {"sr": "SR", "sr_a": "SR-A", "base": "BASE", "a2": "A²", "vlg": "VLG"}


def draw_curves(runs: Sequence[Path], out: Path) -> None:
    """Draw one column a run: losses above, share of valid choices below.

    Args:
        runs: Folders of runs.
        out: The picture.

    Raises:
        InvalidConfigError: If there is no run, or a folder has no completed epoch.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    if not runs:
        raise InvalidConfigError("runs: got none, expected at least one folder of a run.")
    tables = []
    for run in runs:
        rows = read_table(run / EPOCHS_FILE)
        if not rows:
            raise InvalidConfigError(
                f"runs: got {run}, which has no {EPOCHS_FILE} with epochs; expected the --out of "
                "a training."
            )
        tables.append(rows)
    figure, axes = pyplot.subplots(
        2,
        len(runs),
        figsize=(4.2 * len(runs), 6),
        sharex="col",
        sharey="row",
        squeeze=False,
        layout="constrained",
    )
    for column, (run, rows) in enumerate(zip(runs, tables, strict=True)):
        loss, hits = axes[:, column]
        _lines(loss, rows, {"train_choice": "training", "val_loss": "validation"})
        _lines(
            hits,
            rows,
            {
                "val_top1": "all",
                "val_top1_pick": "pick",
                "val_top1_clear": "clear",
                "val_top1_place": "place",
            },
        )
        loss.set_title(_title(run))
        hits.set_xlabel("epoch")
        hits.set_ylim(0, 1)
    axes[0, 0].set_ylabel("cross-entropy of the choice")
    axes[1, 0].set_ylabel("best candidate is valid (validation)")
    out.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(out, dpi=150)
    pyplot.close(figure)


def _lines(axis: Any, rows: list[dict[str, float]], columns: dict[str, str]) -> None:
    epochs = [row["epoch"] for row in rows]
    for name, label in columns.items():
        if name in rows[0]:
            axis.plot(epochs, [row[name] for row in rows], label=label)
    axis.grid(alpha=0.3)
    axis.legend()


def _title(run: Path) -> str:
    """Name the variant, as its card does."""
    card = run / "best.json"
    if not card.exists():
        return run.name
    options = json.loads(card.read_text())["training"]["options"]
    return f"{_VARIANTS[options['variant']]}, seed {options['seed']}"
