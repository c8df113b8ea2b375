"""The unit of work: a scene, with a seed that nothing but demonstrations uses."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sr_mj.errors import ConfigError

if TYPE_CHECKING:
    from policy.actions import ActionKind

FIRST_SEED = 10_000_000
"""Seeds from here on belong to demonstrations; arrangements, tests and benchmarks stay below."""

MAX_RUNS = 1000

_SCENES_OF_A_KIND = 500_000


@dataclass(frozen=True, kw_only=True)
class SceneTask:
    """The unit of work: one scene, all of whose decisions are collected at once.

    Attributes:
        phase: What the scene is for. Where something is placed, it was picked before, and that is
            a decision to pick.
        number: Which of the run's scenes of this kind it is.
        run: Which run it belongs to; runs have no scene in common.

    Raises:
        ConfigError: If a number is out of range.
    """

    phase: "ActionKind"
    number: int
    run: int = 0

    def __post_init__(self) -> None:
        """Check the ranges, which keep the seeds of runs and kinds apart."""
        if not 0 <= self.run < MAX_RUNS:
            raise ConfigError(f"Seed is {self.run}; expected 0 to {MAX_RUNS - 1}.")
        if not 0 <= self.number < _SCENES_OF_A_KIND:
            raise ConfigError(
                f"Scene {self.number} of a run; expected 0 to {_SCENES_OF_A_KIND - 1}. Use another "
                "seed for more."
            )

    @property
    def seed(self) -> int:
        """Seed of the scene and of all that is drawn for it."""
        kinds = 2 * self.run + (self.phase == "place")
        return FIRST_SEED + kinds * _SCENES_OF_A_KIND + self.number

    @property
    def name(self) -> str:
        """Name of the scene and of its file."""
        return f"{self.phase}-{self.seed:010d}"
