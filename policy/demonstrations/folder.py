"""Reads a folder of shards as one sequence of demonstrations."""

import hashlib
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from policy.demonstrations.decision import Demonstration
from policy.demonstrations.shard import (
    SUFFIX,
    Shard,
    find_problems,
    read_demonstration,
    read_shard,
)
from policy.errors import InvalidDemonstrationsError, MissingDemonstrationsError

_SHOWN = 12


class DemonstrationFolder:
    """The demonstrations of a folder, in the order of their scenes' names.

    Files are opened for each access, so that several processes can read one folder. What is written
    later is not seen.

    Attributes:
        path: The folder.
        shards: Its scenes.
        encoder: Fingerprint of the encoder of features and texts.
        feature_dim: Channels C of the features.
    """

    def __init__(self, path: Path | str) -> None:
        """Read what every shard says of itself.

        Args:
            path: The folder.

        Raises:
            MissingDemonstrationsError: If there is no such folder, or no shard in it.
            InvalidDemonstrationsError: If a shard is damaged or of another schema, or the shards
                come from different encoders.
        """
        self.path = Path(path)
        if not self.path.is_dir():
            raise MissingDemonstrationsError(
                f"{self.path}: got no folder, expected demonstrations. Make them with "
                "python -m sr_mj.collect --out FOLDER."
            )
        paths = sorted(self.path.glob(f"[!.]*{SUFFIX}"))
        if not paths:
            raise MissingDemonstrationsError(
                f"{self.path}: got a folder without demonstrations, expected *{SUFFIX}. Make them "
                "with python -m sr_mj.collect --out FOLDER."
            )
        self.shards: tuple[Shard, ...] = tuple(read_shard(path) for path in paths)
        self.encoder, self.feature_dim = self._common_encoder()
        self._starts = np.cumsum([0, *map(len, self.shards)])

    def __len__(self) -> int:
        """Return the number of demonstrations."""
        return int(self._starts[-1])

    def __getitem__(self, index: int) -> Demonstration:
        """Read one demonstration.

        Args:
            index: From 0, or from the end if negative.

        Returns:
            The demonstration.

        Raises:
            IndexError: If there are fewer.
            InvalidDemonstrationsError: If its file was damaged.
        """
        position = index + len(self) if index < 0 else index
        if not 0 <= position < len(self):
            raise IndexError(f"index: got {index}, expected less than {len(self)} demonstrations.")
        number = int(np.searchsorted(self._starts, position, side="right")) - 1
        return read_demonstration(self.shards[number], position - int(self._starts[number]))

    @cached_property
    def scenes(self) -> tuple[str, ...]:
        """Name of every demonstration's scene."""
        return tuple(shard.scene for shard in self.shards for _ in shard.index)

    @cached_property
    def phases(self) -> tuple[str, ...]:
        """What every demonstration does: pick or place."""
        return self._entries("phase")

    @cached_property
    def clears(self) -> tuple[bool, ...]:
        """Whether every demonstration takes away what is in the way of a target."""
        return self._entries("clears")

    @cached_property
    def objects(self) -> tuple[list[str], ...]:
        """Objects of the catalogue that every demonstration's instruction means."""
        return self._entries("objects")

    @cached_property
    def num_candidates(self) -> tuple[int, ...]:
        """Number K of candidates of every demonstration."""
        return self._entries("num_candidates")

    @cached_property
    def num_points(self) -> tuple[int, ...]:
        """Number N of points of every demonstration."""
        return self._entries("num_points")

    @cached_property
    def digest(self) -> str:
        """Hash of all that the folder holds: of the shards' names and their own hashes."""
        lines = "".join(f"{shard.scene} {shard.digest}\n" for shard in self.shards)
        return hashlib.sha256(lines.encode()).hexdigest()

    def verify(self) -> list[str]:
        """Read everything and compare it with what was written.

        Returns:
            What is wrong, a line each; empty if nothing is.
        """
        return [line for shard in self.shards for line in find_problems(shard.path)]

    def _entries(self, name: str) -> tuple[Any, ...]:
        return tuple(entry[name] for shard in self.shards for entry in shard.index)

    def _common_encoder(self) -> tuple[str, int]:
        kinds = {(shard.encoder, shard.feature_dim): shard.scene for shard in self.shards}
        if len(kinds) > 1:
            found = ", ".join(
                f"{encoder[:_SHOWN]} with {width} channels ({scene})"
                for (encoder, width), scene in kinds.items()
            )
            raise InvalidDemonstrationsError(
                f"{self.path}: got demonstrations of {len(kinds)} encoders, {found}; expected one. "
                "Keep each encoder's demonstrations in a folder of its own."
            )
        return next(iter(kinds))
