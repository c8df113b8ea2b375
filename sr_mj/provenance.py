"""Where a result comes from: versions, revision, configuration."""

import dataclasses
import json
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

_PACKAGES = (
    "sr-mj",
    "mujoco",
    "dm-control",
    "open3d",
    "torch",
    "torchvision",
    "numpy",
    "open-clip-torch",
    "mink",
    "daqp",
)


def package_versions() -> dict[str, str]:
    """Return the installed version of every package that results depend on."""
    versions = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = "not installed"
    return versions


def git_revision() -> str | None:
    """Return the revision of the checkout that this code runs from, `+` appended if it changed.

    Returns:
        None where the code was installed without its repository, or git is missing.
    """
    folder = Path(__file__).resolve().parent.parent
    if not (folder / ".git").exists():
        return None
    try:
        described = subprocess.run(
            ["git", "-C", str(folder), "describe", "--always", "--abbrev=12", "--dirty=+"],
            capture_output=True,
            text=True,
            check=True,
        )
    except (OSError, subprocess.CalledProcessError):
        return None
    return described.stdout.strip()


def to_json(value: Any) -> str:
    """Write frozen dataclasses, paths and enums as indented JSON.

    Args:
        value: What to write.

    Returns:
        JSON text with a final newline.
    """

    def plain(item: Any) -> Any:
        if dataclasses.is_dataclass(item) and not isinstance(item, type):
            return dataclasses.asdict(item)
        return str(item)

    return json.dumps(value, default=plain, indent=2) + "\n"
