"""Errors raised by the `sr_mj` package."""

import difflib
from collections.abc import Iterable


class SrMjError(Exception):
    """Base of every error raised by `sr_mj`."""


class UnknownNameError(SrMjError, KeyError):
    """A name (scene, suite, camera, policy) that does not exist was asked for."""

    def __str__(self) -> str:
        """Return the message itself; `KeyError` alone would quote it."""
        return str(self.args[0]) if self.args else ""


class ConfigError(SrMjError, ValueError):
    """A configuration value, or an argument, is not usable."""


class SceneError(SrMjError, RuntimeError):
    """A scene could not be built, or does not fit what is asked of it."""


class RenderError(SrMjError, RuntimeError):
    """Nothing can be rendered: no graphics library works, or the renderer is closed."""


def unknown_name_message(kind: str, name: str, names: Iterable[str]) -> str:
    """Say that a name does not exist, which names do, and which one was probably meant.

    Args:
        kind: What the name is a name of, in the singular and in lower case: `"scene"`.
        name: The name that was asked for.
        names: The names that exist.

    Returns:
        One line, for example `Unknown scene 'cluttered51'. Scenes: cluttered15, place8. Did you
        mean 'cluttered15'?`.
    """
    known = list(names)
    listed = ", ".join(known) or "none"
    close = difflib.get_close_matches(name, known, n=1)
    hint = f" Did you mean {close[0]!r}?" if close else ""
    return f"Unknown {kind} {name!r}. {kind[:1].upper()}{kind[1:]}s: {listed}.{hint}"
