"""Tables of random scenes, each of which was run once."""

from collections.abc import Callable
from math import isnan
from typing import Any

from sr_mj.evaluation.results import Lines
from sr_mj.evaluation.summary import Comparison, Group, by_group, by_policy, compare, score
from tools.table_text import ORDER, markdown, percent, points, title

ONE_ATTEMPT = ("place8",)
"""Scenes in which something is handed over, and nothing else counts as a step."""


def random_table(scene: str, split: str) -> Callable[[Lines], str]:
    """Return a function that makes the table of one kind of scene and objects.

    Args:
        scene: Kind of random scene.
        split: Objects.

    Returns:
        From lines to success, steps, and what SR does better. Policies that did not run every
        scene are left out.
    """
    group = Group(task=f"random-{scene}", split=split, condition="clean")

    def table(lines: Lines) -> str:
        policies = by_policy(by_group(lines).get(group, []))
        num_scenes = max(map(len, policies.values()), default=0)
        found = {label: own for label, own in policies.items() if len(own) == num_scenes}
        better = {c.against: c for c in compare(found) if c.policy == "sr"} if found else {}
        heading = ["policy", f"{num_scenes} scenes", "steps", "SR minus this: success", "steps"]
        rows = [_row(label, found[label], better) for label in ORDER if label in found]
        if scene in ONE_ATTEMPT:
            heading, *rows = ([*row[:2], row[3]] for row in (heading, *rows))
        return markdown(heading, rows)

    return table


def _row(label: str, own: list[dict[str, Any]], better: dict[str, Comparison]) -> list[str]:
    found = score(label, own)
    row = [title(label), percent(found.success), f"{found.steps:.2f}"]
    if (c := better.get(label)) is None:
        return [*row, "", ""]
    success = f"{c.success.value * 100:.1f} {points(c.success_elsewhere)}".replace("-0.0", "0.0")
    ends = (c.steps.low, c.steps.high)
    shown = ", ".join("-" if isnan(end) else f"{end:.2f}" for end in ends)
    return [*row, success, f"{c.steps.value:.2f} [{shown}]"]
