"""The folder in which an evaluation keeps its lines, so that it can be killed at any moment."""

import fcntl
import gzip
import json
import os
import zlib
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from sr_mj.errors import ConfigError
from sr_mj.evaluation.form import check_entry, check_line, check_times
from sr_mj.evaluation.lines import Done
from sr_mj.evaluation.plan import Episode

LINES = "episodes.jsonl.gz"
SECONDS = "seconds.jsonl.gz"
SNAPSHOTS = ("view", "choice", "outcome")
"""Names of the pictures of an episode."""
_JOURNAL = "journal.jsonl"
_ERRORS = "errors.txt"

Lines = dict[Episode, dict[str, Any]]


class ResultFolder:
    """Lines of results, written as episodes end, and put in order at the end.

    While episodes run, each is appended to a journal with its times. `finish` writes
    `episodes.jsonl.gz`, sorted and without times, so that its bytes depend on the episodes alone,
    and their times into `seconds.jsonl.gz`. Used as a context, which locks the folder.

    Args:
        path: The folder; made if need be.
        resume: Whether earlier results in it are kept. Otherwise there must not be any.

    Raises:
        ConfigError: If there are results that are not to be resumed, somebody else writes here,
            or a file is damaged.
    """

    def __init__(self, path: Path, *, resume: bool = False) -> None:
        """Open the folder."""
        if path.exists() and not path.is_dir():
            raise ConfigError(f"--out {str(path)!r} is a file; give a folder.")
        if path.exists() and any(path.iterdir()) and not resume:
            raise ConfigError(
                f"Output folder {str(path)!r} is not empty; add --resume to go on with what is in "
                "it, or choose a new one."
            )
        path.mkdir(parents=True, exist_ok=True)
        self.path = path
        self._journal = _locked(path / _JOURNAL)
        self.lines, self.seconds = read_lines(path)
        _cut_torn_line(self._journal)

    def __enter__(self) -> "ResultFolder":
        """Keep the folder locked."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Close and unlock; a journal that has nothing left to say goes."""
        if not self._journal.tell():
            (self.path / _JOURNAL).unlink()
        # What did not fit on a full disk was told when it was written.
        with suppress(OSError):
            self._journal.close()

    def add(self, done: Done) -> None:
        """Write down what came of an episode; it is on the disk when this returns."""
        self.lines[done.episode] = done.record
        self.seconds[done.episode] = done.seconds
        line = _to_json({"record": done.record, "seconds": done.seconds})
        self._journal.write(line.encode())
        self._journal.flush()
        os.fsync(self._journal.fileno())
        if done.traceback is not None:
            with (self.path / _ERRORS).open("a") as file:
                file.write(f"{done.episode.key}\n{done.traceback.rstrip()}\n\n")

    def finish(self) -> None:
        """Write all lines in canonical order, and empty the journal."""
        order = sorted(self.lines)
        _write_lines(self.path / LINES, (self.lines[episode] for episode in order))
        times = ({**e.record(), "seconds": self.seconds.get(e, {})} for e in order)
        _write_lines(self.path / SECONDS, times)
        self._journal.truncate(0)
        self._journal.seek(0)


def read_lines(path: Path) -> tuple[Lines, dict[Episode, dict[str, float]]]:
    """Read all results of a folder, or one file of lines.

    Args:
        path: A folder that `ResultFolder` wrote, finished or not, or a file `*.jsonl` or
            `*.jsonl.gz` of its lines.

    Returns:
        Lines and times of every episode; a line cut short at the end of a folder's journal is left
        out, anywhere else it is an error.

    Raises:
        ConfigError: If a file cannot be read, or holds something else.
    """
    lines: Lines = {}
    seconds: dict[Episode, dict[str, float]] = {}
    is_folder = path.is_dir()
    folder = path if is_folder else path.parent
    if not is_folder or (path / LINES).exists():
        for record in _read_file(path / LINES if is_folder else path, check_line):
            lines[Episode.of_record(record)] = record
    if (folder / SECONDS).exists():
        for record in _read_file(folder / SECONDS, check_times):
            seconds[Episode.of_record(record)] = record["seconds"]
    if is_folder and (path / _JOURNAL).exists():
        # The journal comes last: it is newer than the files if both have an episode.
        for entry in _read_file(path / _JOURNAL, check_entry, is_cut=True):
            episode = Episode.of_record(entry["record"])
            lines[episode], seconds[episode] = entry["record"], entry["seconds"]
    return lines, seconds


def snapshot_path(stem: Path, name: str) -> Path:
    """Return the file of one of `SNAPSHOTS`.

    Args:
        stem: Folder of the pictures and the episode's key.
        name: Which picture.

    Returns:
        The path.
    """
    # The key may hold a dot, so that `with_suffix` would cut it.
    return stem.with_name(f"{stem.name}-{name}.jpg")


def _read_file(
    path: Path, check: Callable[[Any], None], *, is_cut: bool = False
) -> list[dict[str, Any]]:
    """Read a file of lines; whether what follows the last line break `is_cut`."""
    try:
        data = path.read_bytes()
        data = gzip.decompress(data) if path.suffix == ".gz" else data
        # Before anything is decoded: the cut may go through a letter.
        data = data[: data.rfind(b"\n") + 1] if is_cut else data
        return [_read_line(n, line, check) for n, line in enumerate(data.splitlines(), start=1)]
    except (OSError, EOFError, ValueError, zlib.error) as error:
        raise ConfigError(
            f"Results {str(path)!r} cannot be read ({error}); give a folder that "
            "python -m sr_mj.eval wrote, or its episodes.jsonl.gz."
        ) from None


def _read_line(number: int, line: bytes, check: Callable[[Any], None]) -> dict[str, Any]:
    try:
        value = json.loads(line)
        check(value)
    except ValueError as error:
        raise ValueError(f"line {number}: {error}") from None
    return value


def _locked(path: Path) -> IO[bytes]:
    file = path.open("a+b")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        file.close()
        raise ConfigError(
            f"Another evaluation is writing to {str(path.parent)!r}; wait for it, or choose "
            "another --out."
        ) from None
    return file


def _cut_torn_line(journal: IO[bytes]) -> None:
    journal.seek(0)
    data = journal.read()
    journal.truncate(data.rfind(b"\n") + 1)
    journal.seek(0, os.SEEK_END)


def _to_json(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False) + "\n"


def _write_lines(path: Path, values: Iterable[dict[str, Any]]) -> None:
    """Write a compressed file whose bytes depend on the values alone; whole or not at all."""
    text = "".join(map(_to_json, values))
    scratch = path.with_name(f".{path.name}.new")
    with scratch.open("wb") as file:
        file.write(gzip.compress(text.encode(), mtime=0))
        file.flush()
        os.fsync(file.fileno())
    scratch.replace(path)
