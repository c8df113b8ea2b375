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


class ArrangementError(ModelsError, ValueError):
    """A file that describes an arrangement of objects cannot be used as it is."""


class ImportRefusedError(AssetError):
    """Somebody else's object cannot be taken into a catalogue."""


class WordsFileError(AssetError):
    """A file of words does not say how people ask for the objects."""


class CatalogueFolderError(AssetError):
    """A folder is no catalogue, or an object in it is damaged."""


class MissingPackageError(ModelsError, ImportError):
    """A package that only this task needs is not installed."""
