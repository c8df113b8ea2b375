"""Write the tables of README.md and docs/results.md from the lines of results.

    python -m tools.results_tables            # after new results
    python -m tools.results_tables --check    # do the documents say what the lines say?

A table stands between `<!-- results: NAME -->` and `<!-- end -->`; NAME is one of `BLOCKS`. What
the lines do not have is left empty.
"""

import re
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sr_mj.cli import run_command
from sr_mj.evaluation.published import TABLE_1, TABLE_3, kind_of_policy
from sr_mj.evaluation.results import Lines, read_lines
from sr_mj.evaluation.summary import Group, Score, by_group, by_policy, compare, score
from tools import condition_tables
from tools.goal_tables import grasp_goals
from tools.random_tables import random_table
from tools.table_text import COLUMNS, ORDER, SPLITS, TASKS, markdown, percent, points, title

Cells = dict[tuple[str, str], dict[str, Score]]
"""Scores by policy, for every task and kind of objects."""


@dataclass(frozen=True, kw_only=True)
class TablesConfig:
    """Options of `python -m tools.results_tables`."""

    results: tuple[Path, ...] = (
        Path("docs/results/arrangements"),
        Path("docs/results/weightless"),
        Path("docs/results/conditions"),
        Path("docs/results/held-out-cluttered15"),
        Path("docs/results/held-out-place8"),
        Path("docs/results/held-out-pickplace8-seen"),
        Path("docs/results/held-out-pickplace8-unseen"),
    )
    """Folders of results that are counted together."""
    documents: tuple[Path, ...] = (Path("README.md"), Path("docs/results.md"))
    """Documents to fill in."""
    check: bool = False
    """Write nothing; exit with status 1 if a table differs."""


def clean_scores(lines: Lines) -> Cells:
    """Count successes under plain conditions, of policies that ran all episodes of a suite."""
    cells = {}
    for group, found in _clean(lines).items():
        every = max(map(len, found.values()))
        cells[group.task, group.split] = {
            label: score(label, own) for label, own in found.items() if len(own) == every
        }
    return cells


def overview(lines: Lines) -> str:
    """Return success of all policies in all tasks; with steps where several attempts are made."""
    cells = clean_scores(lines)
    labels = [label for label in ORDER if all(label in cells.get((t, s), {}) for t, s in COLUMNS)]
    heading = ["policy", *(f"{task}, {split}" for task, split in COLUMNS)]
    rows = [
        [title(label), *(_with_steps(cells[key][label], key[0]) for key in COLUMNS)]
        for label in labels
    ]
    paper = [_published(task, "sr", split) for task, split in COLUMNS]
    rows.append(["*SR in the paper: other features, objects, simulator*", *paper])
    return markdown(heading, rows)


def task_table(task: str) -> Callable[[Lines], str]:
    """Return a function that makes the table of one task, beside the paper's figures.

    Args:
        task: Task.

    Returns:
        From lines to the table. Policies that did not run every episode are left out.
    """

    def table(lines: Lines) -> str:
        cells = clean_scores(lines)
        present = [
            label for label in ORDER if any(label in cells.get((task, s), {}) for s in SPLITS)
        ]
        has_steps = task != "place"
        heading = ["policy"]
        for split in SPLITS:
            heading += [split, *(["steps"] if has_steps else []), "paper"]
        rows = []
        for label in present:
            row = [title(label)]
            for split in SPLITS:
                found = cells.get((task, split), {}).get(label)
                row.append(percent(found.success) if found else "")
                if has_steps:
                    row.append(f"{found.steps:.2f}" if found else "")
                row.append(_published(task, label, split).replace(", ", " / ").strip("*"))
            rows.append(row)
        return markdown(heading, rows)

    return table


def differences(lines: Lines) -> str:
    """Return what SR does better than each other policy, with both intervals."""
    cells: dict[tuple[str, str], dict[str, str]] = {}
    scores = clean_scores(lines)
    for group, policies in _clean(lines).items():
        found = {}
        known = scores[group.task, group.split]
        for c in compare({label: own for label, own in policies.items() if label in known}):
            if c.policy != "sr":
                continue
            value = f"{c.success.value * 100:.1f}".replace("-0.0", "0.0")
            found[c.against] = f"{value} {points(c.success)}, {points(c.success_elsewhere)}"
        cells[group.task, group.split] = found
    labels = [label for label in ORDER if any(label in found for found in cells.values())]
    labels = [label for label in labels if label not in ("sr", "random", "oracle")]
    rows = [
        [f"`{label}`", *(cells.get(key, {}).get(label, "") for key in COLUMNS)] for label in labels
    ]
    return markdown(["", *(f"{task}, {split}" for task, split in COLUMNS)], rows)


BLOCKS: dict[str, Callable[[Lines], str]] = {
    "overview": overview,
    **{task: task_table(task) for task in TASKS},
    "differences": differences,
    "grasp-goals": grasp_goals,
    "random-cluttered15": random_table("cluttered15", "seen"),
    "random-place8": random_table("place8", "seen"),
    "random-pickplace8-seen": random_table("pickplace8", "seen"),
    "random-pickplace8-unseen": random_table("pickplace8", "unseen"),
    "noise": condition_tables.noise,
    "perturbation": condition_tables.perturbation,
    "heavy30": condition_tables.heavy30,
    "paraphrase": condition_tables.paraphrase,
}


def fill_in(text: str, lines: Lines) -> str:
    """Put tables where a document wants them.

    Args:
        text: The document.
        lines: What the tables are made from.

    Returns:
        The document with its tables.

    Raises:
        KeyError: If it asks for a table that does not exist.
    """

    def replaced(match: re.Match[str]) -> str:
        return f"{match[1]}\n{BLOCKS[match[2]](lines)}\n\n{match[3]}"

    return re.sub(r"(<!-- results: ([\w-]+) -->\n).*?(<!-- end -->)", replaced, text, flags=re.S)


def read_all(folders: Iterable[Path]) -> Lines:
    """Read the lines of several folders; of an episode that two have, that of the later one."""
    lines: Lines = {}
    for folder in folders:
        lines |= read_lines(folder)[0]
    return lines


def _clean(lines: Lines) -> dict[Group, dict[str, list[dict[str, Any]]]]:
    return {
        group: by_policy(records)
        for group, records in by_group(lines).items()
        if group.condition == "clean" and group.task in TASKS
    }


def _with_steps(found: Score, task: str) -> str:
    steps = f", {found.steps:.1f}" if task == "grasp" else ""
    return percent(found.success) + steps


def _published(task: str, label: str, split: str) -> str:
    """Return the paper's success and steps in italics, or an empty text."""
    for row in (*TABLE_1, *TABLE_3):
        if row.task == task and row.policy == kind_of_policy(label):
            success, steps = (
                (row.seen, row.seen_steps) if split == "seen" else (row.unseen, row.unseen_steps)
            )
            return f"*{success:.1f}*" if steps is None else f"*{success:.1f}, {steps:.2f}*"
    return ""


def main(config: TablesConfig) -> int:
    """Fill in the documents, or compare them."""
    lines = read_all(config.results)
    differing = []
    for document in config.documents:
        text = document.read_text()
        filled = fill_in(text, lines)
        if filled != text:
            differing.append(str(document))
            if not config.check:
                document.write_text(filled)
    if config.check and differing:
        print(
            f"error: Tables in {', '.join(differing)} are not those of the lines; run "
            "`python -m tools.results_tables`.",
            file=sys.stderr,
        )
        return 1
    print(
        f"{len(lines)} lines; "
        + (f"changed: {', '.join(differing)}" if differing else "nothing changed")
    )
    return 0


if __name__ == "__main__":
    run_command(TablesConfig, main, __doc__ or "")
