"""What the tables of results look like: names, order, numbers."""

from collections.abc import Iterable
from math import isnan

from sr_mj.evaluation.statistics import Interval

TASKS = ("grasp", "place", "pick-place")
SPLITS = ("seen", "unseen")
COLUMNS = tuple((task, split) for task in TASKS for split in SPLITS)
"""Columns of tables of all tasks."""
TITLES = {
    "oracle": "`oracle` (reads ground truth)",
    "sr-a": "`sr-a` (SR without DSSA)",
    "base": "`base` (stage 2 only)",
    "grounding": "`grounding` (no weights)",
}
ORDER = (
    "sr", "sr-a", "base", "a2", "vlg",
    "grounding", "clip-grounding", "lerf-togo", "think-grasp", "raw-image-grid", "raw-image", "vlp",
    "random", "oracle",
)  # fmt: skip
"""Policies from top to bottom: trained, without weights, floor and ceiling."""


def percent(interval: Interval) -> str:
    """Write a rate with its interval, such as "97.3 [95, 99]"."""
    rate = "100" if interval.value == 1 else f"{interval.value * 100:.1f}"
    return f"{rate} [{interval.low * 100:.0f}, {interval.high * 100:.0f}]"


def points(interval: Interval | None) -> str:
    """Write the ends of a difference's interval, in percentage points; dashes if it has none."""
    if interval is None or isnan(interval.low):
        return "[-, -]"
    low, high = (round(end * 100) for end in (interval.low, interval.high))
    return f"[{low}, {high}]"


def markdown(heading: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Write a table."""
    heading = list(heading)
    lines = [heading, ["---"] * len(heading), *rows]
    return "\n".join("|" + "|".join(f" {c} " if c else " " for c in cells) + "|" for cells in lines)


def title(label: str) -> str:
    """Return how a table calls a policy."""
    return TITLES.get(label, f"`{label}`")
