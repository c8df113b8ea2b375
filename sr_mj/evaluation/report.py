"""Turns lines of results into a report: markdown, CSV, and one HTML page."""

from collections.abc import Sequence
from pathlib import Path

from models.importing.store import write_atomically
from sr_mj.errors import ConfigError
from sr_mj.evaluation.mixture import is_same_result, mixtures
from sr_mj.evaluation.page import page
from sr_mj.evaluation.paper import paper_tables
from sr_mj.evaluation.plan import Episode
from sr_mj.evaluation.results import Lines, read_lines
from sr_mj.evaluation.summary import by_group, by_policy
from sr_mj.evaluation.table import Table
from sr_mj.evaluation.tables import (
    attempt_table,
    cause_table,
    comparison_table,
    goal_table,
    overview_table,
    second_table,
    success_table,
)

Seconds = dict[Episode, dict[str, float]]

_TITLE = "Evaluation"
_TOO_LONG = ("goals", "attempts")
"""Tables that the page and CSV files have, but markdown does not."""
TABLES = (
    *("overview", "success", "differences", "causes"),
    *("paper-1", "paper-2", "paper-3", "paper-4", *_TOO_LONG, "seconds"),
)
"""Names of all tables; a report has those of them that have rows."""


def merge_results(paths: Sequence[Path]) -> tuple[Lines, Seconds, tuple[Path, ...]]:
    """Read the results of several evaluations.

    Args:
        paths: Folders or files of lines, see `read_lines`.

    Returns:
        All lines, all times, and the folders where pictures may be.

    Raises:
        ConfigError: If a path has no results, or two have different results of one episode. The
            same result of other code or packages is no other; the first is taken.
    """
    lines: Lines = {}
    seconds: Seconds = {}
    for path in paths:
        found, times = read_lines(path)
        if not found:
            raise ConfigError(
                f"There are no results in {str(path)!r}; give a folder that "
                "python -m sr_mj.eval wrote, or its episodes.jsonl.gz."
            )
        for episode, record in found.items():
            if not is_same_result(lines.setdefault(episode, record), record):
                raise ConfigError(
                    f"{str(path)!r} has another result of {episode.key} than the paths before it; "
                    "leave one of them out."
                )
        seconds = times | seconds
    folders = (path if path.is_dir() else path.parent for path in paths)
    return lines, seconds, tuple(folder / "pictures" for folder in folders)


def write_report(out: Path, lines: Lines, seconds: Seconds, pictures: Sequence[Path] = ()) -> str:
    """Write `report.md`, `report.html` and a CSV file for every table.

    Args:
        out: An existing folder.
        lines: All results.
        seconds: Times, where they are known.
        pictures: Folders that may hold pictures of episodes.

    Returns:
        The table of success as markdown, and where the rest is, for the terminal.
    """
    # Episodes end in any order; a report is the same whatever it was.
    lines = {episode: lines[episode] for episode in sorted(lines)}
    success = success_table(lines)
    tables = [
        overview_table(lines),
        success,
        comparison_table(lines),
        cause_table(lines),
        *paper_tables(lines),
        goal_table(lines),
        attempt_table(lines),
        second_table(lines, seconds),
    ]
    tables = [table for table in tables if table.rows]
    intro, notes = _about(lines), warnings_about(lines)
    short = [table for table in tables if table.name not in _TOO_LONG]
    folder = out / "tables"
    folder.mkdir(exist_ok=True)
    for name in TABLES:
        # Of an earlier report, made of other results.
        (folder / f"{name}.csv").unlink(missing_ok=True)
    for table in tables:
        write_atomically(folder / f"{table.name}.csv", table.csv().encode())
    html = page(_TITLE, intro, notes, tables, lines, pictures)
    write_atomically(out / "report.html", html.encode())
    write_atomically(out / "report.md", _markdown(intro, notes, short).encode())
    shown = "\n".join(success.markdown().splitlines()[4:])
    told = "".join(f"Note: {note}\n" for note in notes)
    return f"{shown}\n{told}Report {out / 'report.html'}, {out / 'report.md'}, {folder}"


def _markdown(intro: Sequence[str], notes: Sequence[str], tables: Sequence[Table]) -> str:
    paragraphs = [f"# {_TITLE}", *intro, *(f"**Note.** {note}" for note in notes)]
    return "\n\n".join(paragraphs) + "\n\n" + "\n".join(t.markdown() for t in tables)


def _about(lines: Lines) -> list[str]:
    """Say what was run, with what."""
    records = list(lines.values())
    texts = [
        f"{len(records)} episodes in {len({r['scene'] for r in records})} kinds of scene or "
        f"arrangements, {len({r['seed'] for r in records})} seeds, policies "
        f"{', '.join(by_policy(records))}."
    ]
    for names, what in (
        (("generator", "cameras", "max_attempts", "keep_unreachable"), "Options"),
        (("encoder", "encoder_fingerprint"), "Encoder"),
        (("revision",), "Code"),
    ):
        found = dict.fromkeys(
            ", ".join(f"{n} {r.get(n, 'not known')}" for n in names) for r in records
        )
        texts.append(f"{what}: {'; '.join(found)}.")
    packages = dict.fromkeys(
        ", ".join(f"{name} {version}" for name, version in (r.get("versions") or {}).items())
        for r in records
    )
    texts.append(f"Packages: {'; '.join(packages)}.")
    return texts


def warnings_about(lines: Lines) -> list[str]:
    """Return what keeps the figures from being comparable, or complete.

    Args:
        lines: All results.

    Returns:
        Sentences; none if all is well.
    """
    records = list(lines.values())
    notes = []
    privileged = sorted({r["policy"] for r in records if r["privileged"]})
    if privileged:
        notes.append(f"{', '.join(privileged)}: reads ground truth, which no robot has.")
    errors = sum(r["error"] is not None for r in records)
    if errors:
        notes.append(f"{errors} episodes ended in an exception; they count as failures.")
    for group, of_group in by_group(lines).items():
        sets = {
            label: {(r["scene"], r["seed"]) for r in own}
            for label, own in by_policy(of_group).items()
        }
        if len(set(map(frozenset, sets.values()))) > 1:
            counts = ", ".join(f"{label} {len(pairs)}" for label, pairs in sets.items())
            notes.append(
                f"{group.task}, {group.split}, {group.condition}: the policies did not run the "
                f"same episodes ({counts}); only paired differences compare like with like."
            )
    return [*notes, *mixtures(lines)]
