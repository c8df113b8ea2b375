"""One scene's demonstrations as one HDF5 file, which is either complete or not there."""

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py

from policy.demonstrations.decision import Decision, Demonstration, Look
from policy.demonstrations.layout import (
    SCHEMA_VERSION,
    compute_digest,
    fill,
    read_decision,
    read_look,
)
from policy.errors import InvalidArrayError, InvalidDemonstrationsError, PolicyError

SUFFIX = ".h5"

_TEMPORARY = ".{name}.{pid}.tmp"


@dataclass(frozen=True, kw_only=True)
class Shard:
    """What can be known of a shard without reading its arrays.

    Attributes:
        path: The file.
        encoder: Fingerprint of the encoder of features and texts.
        feature_dim: Channels C of the features.
        digest: Hash of all that the file holds.
        meta: What the scene was made from.
        index: For every decision: look, phase, num_candidates, num_points and more.
    """

    path: Path
    encoder: str
    feature_dim: int
    digest: str
    meta: dict[str, Any]
    index: tuple[dict[str, Any], ...]

    @property
    def scene(self) -> str:
        """Name of the scene."""
        return self.path.stem

    def __len__(self) -> int:
        """Return the number of decisions."""
        return len(self.index)


def write_shard(
    path: Path,
    meta: dict[str, Any],
    looks: Sequence[Look],
    decisions: Sequence[tuple[int, Decision]],
) -> None:
    """Write a scene's demonstrations; the file appears complete or not at all.

    Features, texts and similarities are kept in half precision.

    Args:
        path: The file, ending in .h5; its stem is the scene's name. It is replaced if it exists.
        meta: What the scene was made from, JSON values; `encoder` must be the fingerprint of the
            encoder.
        looks: What was seen.
        decisions: Each with the index of its look; at least one.

    Raises:
        InvalidArrayError: If there is no decision, the encoder is missing, or look and decision
            don't fit.
    """
    if not decisions or not isinstance(meta.get("encoder"), str):
        raise InvalidArrayError(
            f"{path}: got {len(decisions)} decisions and encoder {meta.get('encoder')!r}, expected "
            "at least 1 decision and the encoder's fingerprint in meta."
        )
    for look, decision in decisions:
        Demonstration(look=looks[look], decision=decision, scene=path.stem)
    temporary = path.with_name(_TEMPORARY.format(name=path.name, pid=os.getpid()))
    try:
        with h5py.File(temporary, "w") as file:
            fill(file, meta, looks, decisions)
        _flush(temporary)
        os.replace(temporary, path)
        _flush(path.parent)
    finally:
        temporary.unlink(missing_ok=True)


def read_shard(path: Path) -> Shard:
    """Read what a shard says of itself.

    Args:
        path: The file.

    Returns:
        Its description.

    Raises:
        InvalidDemonstrationsError: If it is no shard, or of another schema.
    """
    with _opened(path) as file:
        version = int(file.attrs["schema_version"])
        if version != SCHEMA_VERSION:
            raise InvalidDemonstrationsError(
                f"{path}: got schema {version}, expected {SCHEMA_VERSION}. Collect the "
                "demonstrations again with this version, or use the version that wrote them."
            )
        return Shard(
            path=path,
            encoder=str(file.attrs["encoder"]),
            feature_dim=int(file.attrs["feature_dim"]),
            digest=str(file.attrs["digest"]),
            meta=json.loads(file["meta"].asstr()[()]),
            index=tuple(json.loads(file["index"].asstr()[()])),
        )


def read_demonstration(shard: Shard, number: int) -> Demonstration:
    """Read one decision with its look.

    Args:
        shard: The shard.
        number: Which of its decisions.

    Returns:
        The demonstration, in single precision.

    Raises:
        InvalidDemonstrationsError: If the file is damaged.
    """
    entry = shard.index[number]
    with _opened(shard.path) as file:
        look = read_look(file[f"looks/{entry['look']}"])
        decision = read_decision(file[f"decisions/{number}"], entry)
    return Demonstration(look=look, decision=decision, scene=shard.scene)


def find_problems(path: Path) -> list[str]:
    """Read all of a shard and compare it with its digest.

    Args:
        path: The file.

    Returns:
        What is wrong with it, a line each; empty if nothing is.
    """
    try:
        shard = read_shard(path)
        with _opened(path) as file:
            digest = compute_digest(file)
        if digest != shard.digest:
            return [f"{path}: the content has changed since it was written."]
        for number in range(len(shard)):
            demonstration = read_demonstration(shard, number)
            width = demonstration.look.features.shape[1]
            if width != shard.feature_dim:
                return [f"{path}: {width} channels, {shard.feature_dim} by its attributes."]
    except PolicyError as error:
        return [str(error)]
    return []


class _opened:
    """A shard open for reading; whatever is wrong inside it ends in one clear error."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def __enter__(self) -> Any:
        try:
            # Shards never change; some network file systems know no locks.
            self._file = h5py.File(self._path, "r", locking=False)
        except OSError as error:
            raise self._damaged(error) from error
        return self._file

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        self._file.close()
        is_known = isinstance(error, InvalidDemonstrationsError)
        if isinstance(error, (OSError, KeyError, ValueError, TypeError)) and not is_known:
            raise self._damaged(error) from error

    def _damaged(self, error: Exception) -> InvalidDemonstrationsError:
        reason = str(error).strip("\"'").splitlines()[0]
        return InvalidDemonstrationsError(
            f"{self._path}: got a file that can't be read ({reason}), expected a shard of "
            "demonstrations. Delete it, and collect again what is missing."
        )


def _flush(path: Path) -> None:
    """Make sure that a file or folder is on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
