"""Which scene is next, until enough decisions are stored."""

from collections import Counter
from collections.abc import Mapping

from policy.actions import ActionKind
from sr_mj.collecting.folder import Stock
from sr_mj.collecting.tasks import SceneTask
from sr_mj.collecting.work import SceneResult
from sr_mj.errors import SrMjError

_MOST_IN_VAIN = 40


class CollectionError(SrMjError, RuntimeError):
    """Scene after scene gives nothing: something is wrong with the set-up, not with a scene."""


class Schedule:
    """Hands out scenes, of the kind that is farther from its goal.

    Args:
        targets: Decisions wanted, by phase.
        stock: What is there already.
        run: Seed of the run.

    Attributes:
        stored: Decisions there are, by phase.
        reasons: How often what was tried ended how, successes aside.
    """

    def __init__(self, targets: Mapping[ActionKind, int], stock: Stock, run: int) -> None:
        """Begin with what is there."""
        self.targets: dict[ActionKind, int] = dict(targets)
        self.stored: Counter[str] = Counter(stock.stored)
        self.reasons: Counter[str] = Counter()
        self._done, self._run = set(stock.done), run
        self._number: dict[ActionKind, int] = dict.fromkeys(targets, 0)
        self._num_in_vain = 0

    @property
    def num_stored(self) -> int:
        """Decisions that count: of each phase at most as many as wanted."""
        return sum(min(self.stored[phase], num) for phase, num in self.targets.items())

    def next_task(self) -> SceneTask | None:
        """Return the next scene that nobody has done, or None if enough is stored."""
        missing: dict[ActionKind, float] = {
            phase: 1 - self.stored[phase] / num
            for phase, num in self.targets.items()
            if num > self.stored[phase]
        }
        if not missing:
            return None
        phase = max(missing, key=lambda name: missing[name])
        while True:
            task = SceneTask(phase=phase, number=self._number[phase], run=self._run)
            self._number[phase] += 1
            if task.name not in self._done:
                return task

    def record(self, result: SceneResult) -> None:
        """Take note of what came of a scene.

        Args:
            result: What came of it.

        Raises:
            CollectionError: If so many scenes in a row gave nothing that none will.
        """
        self._done.add(result.task.name)
        self.stored.update(result.stored)
        self.reasons.update(result.reasons)
        self._num_in_vain = 0 if result.stored else self._num_in_vain + 1
        if self._num_in_vain >= _MOST_IN_VAIN:
            raise CollectionError(
                f"{_MOST_IN_VAIN} scenes in a row gave no decision "
                f"({describe_reasons(self.reasons)}). Try python -m sr_mj.doctor."
            )


def describe_reasons(reasons: Mapping[str, int], num: int = 6) -> str:
    """List the most frequent reasons: "slip_lift 3, unreachable 1"."""
    return ", ".join(f"{name} {count}" for name, count in Counter(reasons).most_common(num))
