"""Errors of command lines: one line and status 2, whatever a user got wrong."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from sr_mj.cli import USAGE_ERROR, run_command
from sr_mj.errors import ConfigError


@dataclass(frozen=True)
class Options:
    """No options."""


def status_of(body: Callable[[Options], int], monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr("sys.argv", ["command"])
    with pytest.raises(SystemExit) as exit_info:
        run_command(Options, body, description="")
    code = exit_info.value.code
    assert isinstance(code, int)
    return code


def write_into_a_file(options: Options) -> int:
    (Path(__file__) / "below").mkdir(parents=True)
    return 0


def fail(options: Options) -> int:
    raise ConfigError("Attempts is 0; expected 1 to 99.")


def fill_a_disk(options: Options) -> int:
    with Path("/dev/full").open("w") as file:
        file.write("more than it holds")
    return 0


@pytest.mark.parametrize(
    ("body", "line"),
    [
        (fill_a_disk, "error: No space left on device; make room and try again.\n"),
        (fail, "error: Attempts is 0; expected 1 to 99.\n"),
        (write_into_a_file, f"error: {Path(__file__) / 'below'}: Not a directory.\n"),
    ],
)
def test_mistakes_end_in_one_line(
    body: Callable[[Options], int],
    line: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert status_of(body, monkeypatch) == USAGE_ERROR
    assert capsys.readouterr() == ("", line)


def test_faults_of_the_program_keep_their_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(options: Options) -> int:
        raise OSError("no file involved")

    with pytest.raises(OSError, match="no file involved"):
        status_of(broken, monkeypatch)


def test_the_status_is_the_commands(monkeypatch: pytest.MonkeyPatch) -> None:
    assert status_of(lambda options: 3, monkeypatch) == 3
