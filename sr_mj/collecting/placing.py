"""Decisions to place: an object is handed over by the expert, then several places are tried."""

from dataclasses import dataclass, replace

import numpy as np
import shapely

from models.objects.words import ObjectWords
from perception.relations import INSIDE_RELATIONS, OUTSIDE_RELATIONS
from sr_mj.collecting.choices import Seen
from sr_mj.collecting.crowds import OPEN_CATEGORIES
from sr_mj.collecting.expert import Expert
from sr_mj.collecting.picking import NUM_PARAPHRASES, words_on_table
from sr_mj.collecting.wordings import reword_pick, reword_place
from sr_mj.instruction import PhaseText, place_text
from sr_mj.scene import Goal, PlaceGoal, Scene, find_goal
from sr_mj.scene.goals import draw_goal
from sr_mj.scene.placement import find_object, footprint
from sr_mj.scene.state import SceneState

_NUM_HAND_OVERS = 4
_DRAWS_PER_GOAL = 3
_INTO = ("in", "to")
_ONTO = tuple(relation for relation in INSIDE_RELATIONS if relation not in _INTO)
_LARGEST_SHARE = 1.4
# How a reference is called: by its label, by another name, by a word for several objects.
_NAMINGS, _NAMING_SHARES = ("title", "synonym", "general"), (0.6, 0.2, 0.2)


@dataclass(frozen=True, kw_only=True, eq=False)
class _HandOver:
    """An object in the gripper.

    Attributes:
        moved: Its name.
        seen: What was seen with it in the gripper.
    """

    moved: str
    seen: Seen


def collect_places(
    expert: Expert, seed: int, rng: np.random.Generator, *, num_rounds: int, num_goals: int
) -> None:
    """Collect decisions in one scene: pick an object, try places for it, go on with another.

    Args:
        expert: At work in the scene.
        seed: Seed of the scene.
        rng: Draws goals and wordings.
        num_rounds: Most objects that are placed.
        num_goals: Most decisions to place each.
    """
    for _ in range(num_rounds):
        handed = _hand_over(expert, seed, rng)
        if handed is None or not _place(expert, handed, seed, rng, num_goals):
            return


def _hand_over(expert: Expert, seed: int, rng: np.random.Generator) -> _HandOver | None:
    """Pick an object, store that decision, and look at what can be done with it."""
    seen = expert.see_grasps()
    if seen is None:
        return None
    words, before = words_on_table(expert.scene), SceneState(expert.scene)
    for name in rng.permutation(_movable(expert.scene, words))[:_NUM_HAND_OVERS]:
        goal = draw_goal(words, [str(name)], rng)
        # Where it goes is not known yet; that it will be put down, the expert has to know.
        goal = replace(goal, place=PlaceGoal(relation="near", references=()))
        text = PhaseText(phase="pick", text=goal.text)
        choice = expert.choose(seen, goal, text)
        plan = None if choice is None else expert.plan(seen, choice.order)
        if choice is None or plan is None:
            continue
        acted = expert.act(choice, plan, keep_target=True)
        if acted is None or not acted[1].success:
            before.restore()
            continue
        others = reword_pick(goal.text, goal.targets, words, rng, NUM_PARAPHRASES)
        expert.store(seen, choice, plan.chosen, (text, *others), seed)
        executor, outcome = acted
        assert executor.T_world_grasp is not None and outcome.grasped is not None
        after = expert.see_places(seen, executor.T_world_grasp, executor.drive.width_m)
        return None if after is None else _HandOver(moved=outcome.grasped, seen=after)
    return None


def _movable(scene: Scene, words: dict[str, ObjectWords]) -> list[str]:
    """List what may be handed over: where there is a heap, objects of the heap only."""
    kind = scene.config.kind
    apart = [item.name for item in scene.objects[: kind.num_spread]]
    heap = [name for name in words if name not in apart]
    return heap if kind.num_heaped else list(words)


def _place(
    expert: Expert, handed: _HandOver, seed: int, rng: np.random.Generator, num_goals: int
) -> bool:
    """Try places; leave the scene after one that succeeded, and say whether there was one."""
    before, after = SceneState(expert.scene), None
    num_stored = 0
    for goal in _draw_goals(expert.scene, handed.moved, rng)[: _DRAWS_PER_GOAL * num_goals]:
        text = place_text(goal.text)
        choice = expert.choose(handed.seen, goal, text)
        plan = None if choice is None else expert.plan(handed.seen, choice.order)
        if choice is None or plan is None:
            continue
        acted = expert.act(choice, plan, keep_target=False)
        if acted is not None and acted[1].success:
            after = SceneState(expert.scene)
        before.restore()
        if acted is None or not acted[1].success:
            continue
        assert goal.place is not None
        words = words_on_table(expert.scene)
        others = reword_place(goal.text, goal.place.references, words, rng, NUM_PARAPHRASES)
        expert.store(handed.seen, choice, plan.chosen, (text, *others), seed)
        num_stored += 1
        if num_stored >= num_goals:
            break
    if after is not None:
        after.restore()
    return after is not None


def _draw_goals(scene: Scene, moved: str, rng: np.random.Generator) -> list[Goal]:
    """Draw goals that may be possible, inside and outside relations in turn."""
    words = words_on_table(scene)
    pairs: dict[bool, list[tuple[tuple[str, ...], str]]] = {True: [], False: []}
    for name in words:
        if name == moved:
            continue
        pairs[False].append((OUTSIDE_RELATIONS, name))
        if _smaller_side(scene, moved) <= _LARGEST_SHARE * _smaller_side(scene, name):
            is_open = find_object(scene, name).words.category in OPEN_CATEGORIES
            pairs[True].append((_INTO if is_open else _ONTO, name))
    mixed: list[tuple[tuple[str, ...], str]] = []
    columns = [[pairs[key][i] for i in rng.permutation(len(pairs[key]))] for key in (True, False)]
    for rank in range(max(map(len, columns))):
        mixed += [column[rank] for column in columns if rank < len(column)]
    goals: dict[str, Goal] = {}
    for relations, name in mixed:
        goal = _goal(str(rng.choice(relations)), name, moved, words, rng)
        if goal is not None:
            goals.setdefault(goal.text, goal)
    return list(goals.values())


def _goal(
    relation: str,
    reference: str,
    moved: str,
    words: dict[str, ObjectWords],
    rng: np.random.Generator,
) -> Goal | None:
    """Say where to put the object; None if the words name nothing, or the object itself."""
    called = _call(words[reference], str(rng.choice(_NAMINGS, p=_NAMING_SHARES)), rng)
    goal = find_goal(f"put it {relation} the {called}", words)
    place = goal.place
    if place is None or place.relation != relation:
        return None
    if reference not in place.references or moved in place.references:
        return None
    return replace(goal, targets=(moved,))


def _call(words: ObjectWords, naming: str, rng: np.random.Generator) -> str:
    general = [word for word in (words.category,) if word]
    general += [f"{word} object" for word in (*words.colors, *words.shapes)]
    options = {"synonym": list(words.synonyms), "general": general}.get(naming, [])
    return str(rng.choice(options)) if options else words.title


def _smaller_side(scene: Scene, name: str) -> float:
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(footprint(scene, name)))
    return float(np.linalg.norm(np.diff(corners[:3], axis=0), axis=1).min())
