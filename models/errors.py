"""Errors raised by the `models` package."""


class ModelsError(Exception):
    """Base of every error raised by `models`."""


class UnknownNameError(ModelsError, KeyError):
    """A name (object, preset, family) that does not exist was asked for."""

    def __str__(self) -> str:
        """Return the message itself; `KeyError` alone would quote it."""
        return str(self.args[0]) if self.args else ""


class AssetError(ModelsError, ValueError):
    """A mesh, texture or description cannot be used as it is."""
