"""Demonstrations as training reads them: thinned to the points that the network will see."""

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from policy.actions import ActionCandidates
from policy.demonstrations import Decision, Demonstration, DemonstrationFolder, Look
from policy.network.config import NetworkConfig
from policy.network.selection import select_points
from policy.objects import SceneObjects, label_means, object_labels, pool_objects
from policy.observation import Observation

# A wording's texts and similarities, a decision's candidates; measured on cluttered scenes.
_BYTES_A_DECISION = 150_000


@dataclass(frozen=True, kw_only=True, eq=False)
class _HalfLook:
    """A look whose features take half the memory."""

    look: Look
    features: np.ndarray

    @classmethod
    def of(cls, look: Look) -> "_HalfLook":
        empty = np.empty((len(look.points), 0), np.float32)
        return cls(look=replace(look, features=empty), features=look.features.astype(np.float16))

    def take(self, chosen: np.ndarray) -> Look:
        return replace(
            self.look,
            points=self.look.points[chosen],
            features=self.features[chosen],
            confidence=self.look.confidence[chosen],
        )


class DecisionStore:
    """Hands out the decisions of a folder, with as many points as asked for.

    Choosing points costs 7 ms, more than all else, and depends on look and wording alone; the
    choices are remembered. So are the segments of a look, for a network that looks at objects.
    Looks are remembered if they fit into memory.
    """

    def __init__(
        self, folder: DemonstrationFolder, config: NetworkConfig, *, in_memory: bool
    ) -> None:
        """Make the store; nothing is read yet.

        Args:
            folder: The demonstrations.
            config: Says which points the network takes.
            in_memory: Keep what was read.
        """
        self.folder = folder
        self.config = config
        self.in_memory = in_memory
        self._look_keys = [
            (shard.scene, entry["look"]) for shard in folder.shards for entry in shard.index
        ]
        self._looks: dict[tuple[str, int], _HalfLook] = {}
        self._decisions: dict[int, Decision] = {}
        self._chosen: dict[tuple[int, int, int], np.ndarray] = {}
        self._objects: dict[tuple[str, int], tuple[np.ndarray, SceneObjects]] = {}

    def decision(self, index: int) -> Decision:
        """Return what was said and done.

        Args:
            index: Of the demonstration in the folder.

        Returns:
            The decision.
        """
        return self._read(index)[1]

    def demonstration(self, index: int) -> Demonstration:
        """Return a demonstration with all of its points, as the folder does."""
        return self.folder[index]

    def thinned(
        self, index: int, wording: int, max_points: int
    ) -> tuple[Observation, ActionCandidates]:
        """Return a decision with the points that the network would choose.

        Args:
            index: Of the demonstration in the folder.
            wording: Which of its wordings.
            max_points: Largest number of points.

        Returns:
            Observation and candidates. With the network's own number of points, a sample made of
            them is that of the whole cloud.
        """
        look, decision = self._read(index)
        said = decision.wordings[wording]
        key = (index, wording, max_points)
        chosen = self._chosen.get(key)
        if chosen is None:
            chosen = select_points(
                look.look.points,
                said.similarity,
                max_points=max_points,
                method=self.config.point_selection,
            ).astype(np.int32)
            self._chosen[key] = chosen
        thin = replace(decision, wordings=(replace(said, similarity=said.similarity[chosen]),))
        demonstration = Demonstration(look=look.take(chosen), decision=thin, scene="")
        observation = demonstration.observation()
        if self.config.uses_objects:
            objects = self._objects_of(self._look_keys[index], look, said.similarity)
            observation = replace(observation, objects=objects)
        return observation, decision.candidates

    def _objects_of(
        self, key: tuple[str, int], look: _HalfLook, similarity: np.ndarray
    ) -> SceneObjects:
        """Objects of the whole look; only their similarity depends on the wording."""
        found = self._objects.get(key)
        if found is None:
            points, features = look.look.points, look.features.astype(np.float32)
            labels = object_labels(points)
            found = labels, pool_objects(points, features, similarity, labels)
            self._objects[key] = found
        labels, objects = found
        return replace(objects, similarity=label_means(similarity, labels))

    def _read(self, index: int) -> tuple[_HalfLook, Decision]:
        key = self._look_keys[index]
        if key in self._looks and index in self._decisions:
            return self._looks[key], self._decisions[index]
        demonstration = self.folder[index]
        look = self._looks.get(key) or _HalfLook.of(demonstration.look)
        if self.in_memory:
            self._looks[key] = look
            self._decisions[index] = demonstration.decision
        return look, demonstration.decision


def memory_needed(folder: DemonstrationFolder) -> int:
    """Estimate what a store takes that keeps everything.

    Args:
        folder: The demonstrations.

    Returns:
        Bytes.
    """
    looks = {
        (shard.scene, entry["look"]): entry["num_points"]
        for shard in folder.shards
        for entry in shard.index
    }
    per_point = 2 * folder.feature_dim + 16
    return sum(looks.values()) * per_point + len(folder) * _BYTES_A_DECISION


def memory_free() -> int:
    """Return the bytes of memory that can be had without swapping."""
    meminfo = Path("/proc/meminfo")
    if meminfo.exists():
        for line in meminfo.read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
    return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
