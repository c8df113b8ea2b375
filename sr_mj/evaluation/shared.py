"""What episodes share that begin alike and run one after the other."""

import time
from collections.abc import Callable
from dataclasses import replace

from perception.lifter import MultiViewLifter
from policy.base import Policy
from sr_mj.beginning import Beginning, HandOver
from sr_mj.episode import begin_episode, hand_over
from sr_mj.evaluation.plan import Episode
from sr_mj.evaluation.setting import BLANK
from sr_mj.perturbation import PosePerturbation
from sr_mj.pipeline import Pipeline
from sr_mj.scene import Scene


class SharedScene:
    """A scene, its cameras, what is handed over in it, and the first look at it.

    None of these depends on the policy, nor on what a condition changes later. Every episode begins
    in the same state, to the bit, and its record is the one that it would have alone.

    Args:
        episode: One of the episodes that share it.
        scene: The scene.
        pipeline: Its stages; lifter, policy and errors of the pose are those of the episode.
        lifter: Makes the perception stage of an encoder.
        max_attempts: Grasps that may be tried.
        made_s: Seconds that it took to make the scene.
    """

    def __init__(
        self,
        episode: Episode,
        scene: Scene,
        pipeline: Pipeline,
        lifter: Callable[[str], MultiViewLifter],
        max_attempts: int,
        made_s: float,
    ) -> None:
        """Take over what was made; nothing is looked at yet."""
        self._episode, self.scene, self._pipeline = episode, scene, pipeline
        self._lifter, self._max_attempts = lifter, max_attempts
        self._handed: HandOver | None = None
        self._handed_s = made_s
        self._beginnings: dict[str, Beginning] = {}
        self._begun_s: dict[str, float] = {}

    def fits(self, episode: Episode) -> bool:
        """Tell whether an episode takes place here."""
        return episode.beginning == self._episode.beginning

    def begin(
        self, encoder: str, policy: Policy, perturbation: PosePerturbation | None
    ) -> tuple[Pipeline, Beginning]:
        """Prepare an episode.

        Args:
            encoder: What its policy looks through.
            policy: The policy.
            perturbation: Error of the poses that it executes, None for none.

        Returns:
            The stages, and where the episode begins.
        """
        if encoder not in self._beginnings:
            handed = self._hand_over()
            start = time.perf_counter()
            self._beginnings[encoder] = begin_episode(
                self.scene,
                self._with(encoder),
                seed=self._episode.seed,
                max_attempts=self._max_attempts,
                handed=handed,
            )
            self._begun_s[encoder] = self._handed_s + time.perf_counter() - start
        pipeline = replace(self._with(encoder), policy=policy, perturbation=perturbation)
        return pipeline, self._beginnings[encoder]

    def seconds(self, encoder: str) -> float:
        """Return what scene, hand-over and first look took: what an episode alone would wait."""
        return self._begun_s[encoder]

    def _hand_over(self) -> HandOver:
        if self._handed is None:
            start = time.perf_counter()
            # The oracle, which hands over, needs no features.
            self._handed = hand_over(
                self.scene,
                self._with(BLANK),
                seed=self._episode.seed,
                max_attempts=self._max_attempts,
            )
            self._handed_s += time.perf_counter() - start
        return self._handed

    def _with(self, encoder: str) -> Pipeline:
        return replace(self._pipeline, lifter=self._lifter(encoder))
