"""Files that an object's description names: found, and never outside its folder."""

from collections.abc import Sequence
from pathlib import Path, PureWindowsPath

from models.errors import ImportRefusedError


def resolve_inside(
    reference: str, *, named_by: Path, bases: Sequence[Path], root: Path, remedy: str
) -> Path:
    """Find a file that another file names.

    Args:
        reference: The name as it stands there.
        named_by: The file it stands in.
        bases: Folders to look in, in this order.
        root: Folder that must contain the file.
        remedy: What to do if it is missing.

    Returns:
        The file.

    Raises:
        ImportRefusedError: If it is missing, absolute, or outside `root`, through links too.
    """
    if Path(reference).is_absolute() or PureWindowsPath(reference).drive:
        raise ImportRefusedError(
            f"{named_by} names {reference!r} by an absolute path; make it relative to the file."
        )
    tidy = reference.replace("\\", "/")
    inside = root.resolve()
    found = [base / tidy for base in bases if (base / tidy).is_file()]
    within = [path for path in found if path.resolve().is_relative_to(inside)]
    if within:
        return within[0]
    leaves = found or not any((base / tidy).resolve().is_relative_to(inside) for base in bases)
    if leaves:
        raise ImportRefusedError(
            f"{named_by} names {reference!r}, which leaves {root}; copy the file into the folder, "
            "or name a folder that contains both with --root."
        )
    raise ImportRefusedError(f"{named_by} names {reference!r}, which does not exist; {remedy}")
