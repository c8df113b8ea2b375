"""Errors raised by the `policy` package."""


class PolicyError(Exception):
    """Base of every error raised by `policy`."""


class InvalidArrayError(PolicyError, ValueError):
    """An array has the wrong shape, type or values."""


class InvalidConfigError(PolicyError, ValueError):
    """A configuration value is out of range or contradicts another one."""


class UnknownPolicyError(PolicyError, KeyError):
    """A policy that does not exist was asked for."""

    def __str__(self) -> str:
        """Return the message itself; `KeyError` alone would quote it."""
        return str(self.args[0]) if self.args else ""


class CandidateIndexError(PolicyError, IndexError):
    """An index does not name one of the candidates."""


class NoCandidatesError(PolicyError, ValueError):
    """The best of zero candidates was asked for."""


class MissingImagesError(PolicyError, ValueError):
    """A policy looks at pictures, and the observation has none."""


class MissingCheckpointError(PolicyError, FileNotFoundError):
    """A policy needs weights that are not there."""


class InvalidCheckpointError(PolicyError, ValueError):
    """Weights or their card cannot be read, or do not fit the network."""


class MissingDemonstrationsError(PolicyError, FileNotFoundError):
    """A folder has no demonstrations in it, or does not exist."""


class InvalidDemonstrationsError(PolicyError, ValueError):
    """Demonstrations are damaged, of another version, or do not fit each other."""
