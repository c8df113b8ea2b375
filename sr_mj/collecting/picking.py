"""Decisions to pick: several goals from every state of a heap, which is cleared step by step."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from models.objects.words import ObjectWords
from sr_mj.collecting.choices import Choice, Seen
from sr_mj.collecting.expert import Expert
from sr_mj.collecting.wordings import reword_pick
from sr_mj.instruction import PhaseText
from sr_mj.scene import Goal, Scene, find_targets
from sr_mj.scene.goals import draw_goal
from sr_mj.scene.state import SceneState

NUM_PARAPHRASES = 3

_LEAST_OBJECTS = 3
_DRAWS_PER_GOAL = 3
# So often an object is asked for by any of its names; otherwise as the protocol's templates do,
# which have names for some of the objects only.
_ANY_NAME = 0.3
# So many goals of a look ask for what is in sight but cannot be gripped yet, if there is such a
# thing. Of goals drawn at random one in fifteen does: too few to learn from.
_GOALS_FOR_BLOCKED = 2
# So often at most one grasp is stored with different instructions.
_USES = 2


@dataclass(frozen=True, kw_only=True, eq=False)
class _Grasped:
    """A grasp that was executed from the present state.

    Attributes:
        name: What it held through lift and carry; None if it failed.
        uses: How often it was stored.
    """

    name: str | None
    uses: int = 0


def words_on_table(scene: Scene) -> dict[str, ObjectWords]:
    """Return the words of the objects that lie in the workspace now, by name. Ground truth."""
    centers = {item.name: scene.data.xipos[item.body.body_id] for item in scene.objects}
    return {
        item.name: item.words
        for item in scene.objects
        if scene.workspace.contains_xy(centers[item.name]) and centers[item.name][2] > 0
    }


def collect_picks(
    expert: Expert, seed: int, rng: np.random.Generator, *, num_looks: int, num_goals: int
) -> None:
    """Collect decisions in one heap, removing one object between two looks.

    Args:
        expert: At work in the heap.
        seed: Seed of the scene.
        rng: Draws goals and wordings.
        num_looks: Most states of the heap.
        num_goals: Most decisions in each.
    """
    texts: set[str] = set()
    for _ in range(num_looks):
        words = words_on_table(expert.scene)
        if len(words) < _LEAST_OBJECTS:
            return
        seen = expert.see_grasps()
        if seen is None or not _Heap(expert, seen, words, texts, seed, rng).clear_one(num_goals):
            return


def draw_pick_goal(
    words: dict[str, ObjectWords], rng: np.random.Generator, among: Sequence[str] | None = None
) -> Goal:
    """Draw an instruction to pick one of some objects.

    Args:
        words: Words of every object in the scene, by name.
        rng: Source of randomness.
        among: Objects of which at least one must be asked for; any when None.

    Returns:
        The goal, every object that the instruction names among its targets.
    """
    among = list(words) if among is None else among
    if rng.random() >= _ANY_NAME:
        return draw_goal(words, among, rng)
    asked = words[str(rng.choice(list(among)))]
    names = [name for name in (asked.label, *asked.synonyms) if name is not None]
    text = f"give me the {rng.choice(names)}"
    return Goal(text=text, targets=find_targets(text, words))


class _Heap:
    """One state of a heap: goals are tried from it until enough have succeeded."""

    def __init__(
        self,
        expert: Expert,
        seen: Seen,
        words: dict[str, ObjectWords],
        texts: set[str],
        seed: int,
        rng: np.random.Generator,
    ) -> None:
        self._expert, self._seen, self._words = expert, seen, words
        self._texts, self._seed, self._rng = texts, seed, rng
        self._before = SceneState(expert.scene)
        self._after: SceneState | None = None
        self._done: dict[int, _Grasped] = {}

    def clear_one(self, num_goals: int) -> bool:
        """Try goals; leave the scene with one object less, and say whether that succeeded."""
        num_stored = 0
        blocked = [name for name in self._expert.blocked(self._seen) if name in self._words]
        for _ in range(min(_GOALS_FOR_BLOCKED, num_goals) if blocked else 0):
            num_stored += self._try(draw_pick_goal(self._words, self._rng, blocked))
        for _ in range(_DRAWS_PER_GOAL * num_goals):
            if num_stored >= num_goals:
                break
            num_stored += self._try(draw_pick_goal(self._words, self._rng))
        if self._after is not None:
            self._after.restore()
        return self._after is not None

    def _try(self, goal: Goal) -> bool:
        text = PhaseText(phase="pick", text=goal.text)
        # What was asked for once in this scene is not asked for again.
        if goal.text in self._texts:
            return False
        choice = self._expert.choose(self._seen, goal, text, may_clear=True)
        if choice is None:
            return False
        executed = self._known(choice)
        if executed is None:
            executed = self._execute(choice)
        if executed is None:
            return False
        self._texts.add(goal.text)
        wordings = reword_pick(goal.text, goal.targets, self._words, self._rng, NUM_PARAPHRASES)
        self._expert.store(self._seen, choice, executed, (text, *wordings), self._seed)
        return True

    def _known(self, choice: Choice) -> int | None:
        """Return the expert's first choice if it is known to do what is wanted here too."""
        index = int(choice.order[0])
        known = self._done.get(index)
        wanted = choice.scene.goal.targets
        if known is None or known.name not in wanted or known.uses >= _USES:
            return None
        self._done[index] = _Grasped(name=known.name, uses=known.uses + 1)
        return index

    def _execute(self, choice: Choice) -> int | None:
        """Grasp and go back; return the index of what succeeded."""
        order = np.array([i for i in choice.order if int(i) not in self._done], int)
        plan = self._expert.plan(self._seen, order)
        if plan is None:
            return None
        # The first object that is held goes into the bin and stays there; later ones are let be.
        acted = self._expert.act(choice, plan, keep_target=self._after is not None)
        grasped = acted[1].grasped if acted is not None and acted[1].success else None
        self._done[plan.chosen] = _Grasped(name=grasped, uses=1)
        if grasped is not None and self._after is None:
            self._after = SceneState(self._expert.scene)
        self._before.restore()
        return plan.chosen if grasped in choice.scene.goal.targets else None
