"""The arrangements of this package: `grasp-seen-03`, `place-unseen-00`, ..."""

import difflib
from importlib import resources
from pathlib import Path

from models.arrangements.arrangement import Arrangement, read_arrangement
from models.errors import UnknownNameError

SUITES = ("grasp", "place", "pick-place", "heavy30")


def data_folder() -> Path:
    """Return the folder with the arrangements' files."""
    return Path(str(resources.files("models.arrangements"))) / "data"


def arrangement_names(suite: str | None = None, split: str | None = None) -> tuple[str, ...]:
    """List the arrangements.

    Args:
        suite: One of `SUITES`, or None for all.
        split: "seen", "unseen", or None for both.

    Returns:
        Names, sorted.
    """
    names = sorted(path.stem for path in data_folder().glob("*.json"))
    prefixes = tuple(
        f"{s}-{p}-"
        for s in SUITES
        if suite in (None, s)
        for p in ("seen", "unseen")
        if split in (None, p)
    )
    return tuple(name for name in names if name.startswith(prefixes))


def load_arrangement(name: str) -> Arrangement:
    """Load an arrangement.

    Args:
        name: One of `arrangement_names()`.

    Returns:
        The arrangement.

    Raises:
        UnknownNameError: If there is no such arrangement.
        ArrangementError: If its file was damaged.
    """
    if name not in arrangement_names():
        close = difflib.get_close_matches(name, arrangement_names(), n=1)
        hint = f" Did you mean {close[0]!r}?" if close else ""
        raise UnknownNameError(f"Unknown arrangement {name!r}. Arrangements: {summary()}.{hint}")
    return read_arrangement(data_folder() / f"{name}.json")


def summary() -> str:
    """Name all arrangements in short: `grasp-seen-00 to grasp-seen-09, ...`."""
    groups = [arrangement_names(s, p) for s in SUITES for p in ("seen", "unseen")]
    return ", ".join(
        group[0] if len(group) == 1 else f"{group[0]} to {group[-1]}" for group in groups if group
    )
