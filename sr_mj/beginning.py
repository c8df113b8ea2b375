"""How an episode begins, whichever policy then decides: what it is handed, and its first look."""

from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from sr_mj.attempt import Attempt
from sr_mj.execution import Executor
from sr_mj.pipeline import EpisodeRngs
from sr_mj.scene.state import SceneState
from sr_mj.situation import DescribeHeld, Situation


@dataclass(frozen=True, kw_only=True, eq=False)
class HandOver:
    """A scene in which an episode can begin, with what was done to get there.

    Attributes:
        attempts: The oracle's, to pick what the policy is to place; none if it picks itself.
        describe_held: Tells what was handed over; None if nothing was.
        state: State of the simulation.
        T_world_grasp: Pose (4, 4) of the tool at which the robot closed on something, or None.
        rngs: All sources of randomness as they are now.
    """

    attempts: tuple[Attempt, ...]
    describe_held: DescribeHeld | None
    state: SceneState
    T_world_grasp: np.ndarray | None
    rngs: EpisodeRngs


@dataclass(frozen=True, kw_only=True, eq=False)
class Beginning:
    """What precedes an episode's first decision.

    Several policies can go on from it one after the other: each finds the same state, the same
    first look and the same randomness as if it had begun the episode itself.

    Attributes:
        hand_over: The scene, and what was handed over.
        first: What the first decision is about; None if the hand-over failed.
        rngs: All sources of randomness after the first look.
    """

    hand_over: HandOver
    first: Situation | None
    rngs: EpisodeRngs

    def enter(self, executor: Executor) -> EpisodeRngs:
        """Bring the scene back to this state.

        Args:
            executor: Of the same scene.

        Returns:
            Sources of randomness that nobody else draws from.
        """
        self.hand_over.state.restore()
        executor.T_world_grasp = self.hand_over.T_world_grasp
        return deepcopy(self.rngs)
