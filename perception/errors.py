"""Errors raised by the `perception` package."""

import difflib
from collections.abc import Iterable


class PerceptionError(Exception):
    """Base of every error raised by `perception`."""


class InvalidViewError(PerceptionError, ValueError):
    """A camera view, its intrinsics or its pose cannot be used as it is."""


class InvalidCloudError(PerceptionError, ValueError):
    """The arrays of a cloud or of text features do not fit together."""


class InvalidConfigError(PerceptionError, ValueError):
    """A configuration value is out of its range."""


class InvalidTextError(PerceptionError, ValueError):
    """An instruction or a prompt holds no words."""


class EmptyCloudError(PerceptionError, ValueError):
    """No point is left: no depth, nothing inside the workspace, or nothing that a view sees."""


class UnknownEncoderError(PerceptionError, KeyError):
    """An encoder that does not exist was asked for."""

    def __str__(self) -> str:
        """Return the message itself; `KeyError` alone would quote it."""
        return str(self.args[0]) if self.args else ""


class UnsupportedEncoderError(PerceptionError, ValueError):
    """A model of open_clip exists, but cannot be read patch by patch."""


class MissingWeightsError(PerceptionError, FileNotFoundError):
    """An encoder exists, but its weights are not on this machine."""


class InvalidWeightsError(PerceptionError, ValueError):
    """A weight file exists, but does not belong to the encoder that was asked for."""


class MissingFileError(PerceptionError, FileNotFoundError):
    """A file or folder that is to be read does not exist."""


class InvalidFileError(PerceptionError, ValueError):
    """A file exists, but one of its fields, or what it holds, cannot be used."""


class UnknownLayoutError(PerceptionError, ValueError):
    """A folder of views has a layout that no reader knows, or was asked to be read as one."""


class InvalidOptionError(PerceptionError, ValueError):
    """An option of a command line cannot be used as it is."""


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return `" Did you mean 'x'?"` for the closest known name, or an empty string.

    Args:
        name: What was asked for.
        known: The names that exist.

    Returns:
        A sentence with a leading space, or `""` where nothing is close.
    """
    by_lower = {entry.lower(): entry for entry in known}
    close = difflib.get_close_matches(name.lower(), by_lower, n=1)
    return f" Did you mean {by_lower[close[0]]!r}?" if close else ""
