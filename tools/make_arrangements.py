"""Make the fixed arrangements, or check that those stored still come out the same.

    python -m tools.make_arrangements --suites grasp place
    python -m tools.make_arrangements --check

Existing files are kept unless --again is given, so that an interrupted run goes on where it was.
"""

import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from sr_mj.cli import run_command

Suite = Literal["grasp", "place", "pick-place", "heavy30"]


@dataclass(frozen=True, kw_only=True)
class MakeConfig:
    """Options of `python -m tools.make_arrangements`."""

    suites: tuple[Suite, ...] = ("grasp", "place", "pick-place", "heavy30")
    """Suites to make or check."""
    check: bool = False
    """Drop the objects of the stored arrangements again and compare."""
    again: bool = False
    """Make those that exist once more."""
    out: Path | None = None
    """Folder; the package's own by default."""


def _check(config: MakeConfig) -> int:
    from models.arrangements.library import arrangement_names
    from sr_mj.scene import SceneConfig
    from sr_mj.scene.arranged import describe, reproduce

    failures = 0
    for name in (n for suite in config.suites for n in arrangement_names(suite)):
        scene_config = SceneConfig(arrangement=name)
        differences = reproduce(scene_config)
        failures += bool(differences)
        print(f"{name}: {'differs' if differences else 'the same bits'}", flush=True)
        for difference in differences:
            print(f"  {describe(scene_config.arranged, difference)}")  # pyright: ignore
    return int(failures > 0)


def make(config: MakeConfig) -> int:
    """Make or check arrangements; returns the exit status."""
    from sr_mj.gl import select_backend

    select_backend()
    if config.check:
        return _check(config)
    from models.arrangements.arrangement import write_arrangement
    from models.arrangements.library import data_folder
    from sr_mj.assemble import lifter_for
    from tools.arrangements.suites import make_arrangement, slots

    folder = config.out or data_folder()
    folder.mkdir(parents=True, exist_ok=True)
    lifters = {}
    for slot in slots(config.suites):
        path = folder / f"{slot.name}.json"
        if path.exists() and not config.again:
            continue
        workspace = slot.kind.workspace
        lifter = lifters.setdefault(workspace, None) or lifter_for(workspace, "embedded")
        lifters[workspace] = lifter
        start = time.perf_counter()
        arrangement, note = make_arrangement(slot, lifter)
        write_arrangement(arrangement, path)
        print(
            f"{slot.name}: {arrangement.goal.text!r}, draw {arrangement.seed}, {note} "
            f"[{time.perf_counter() - start:.0f} s]",
            flush=True,
        )
    if config.out is None:
        _write_paraphrases()
    return 0


def _write_paraphrases() -> None:
    """Write other wordings of all goals beside the arrangements."""
    from models.arrangements.library import arrangement_names, data_folder, load_arrangement
    from tools.arrangements.wording import other_wordings

    goals = sorted({load_arrangement(name).goal.text for name in arrangement_names()})
    table = {goal: other_wordings(goal) for goal in goals}
    path = data_folder().parent / "paraphrases.json"
    path.write_text(json.dumps(table, indent=1) + "\n")
    print(f"{path.name}: {len(table)} goals")


if __name__ == "__main__":
    sys.exit(run_command(MakeConfig, make, description=__doc__ or ""))
