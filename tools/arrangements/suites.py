"""Draws arrangements of each suite until one can be solved."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from models.arrangements.arrangement import ArrangedGoal, Arrangement
from models.objects.catalogue import load_object
from perception.lifter import MultiViewLifter
from perception.relations import INSIDE_RELATIONS
from sr_mj.errors import SceneError
from sr_mj.scene import Goal, PlaceGoal, Scene, SceneConfig, find_goal, make_scene
from sr_mj.scene.arranged import record_layout
from sr_mj.scene.compose import compose_scene
from sr_mj.scene.config import SCENE_KINDS, SceneKind
from sr_mj.scene.goals import draw_goal
from sr_mj.scene.layout import Layout, draw_drops, fall, stays
from sr_mj.scene.placement import find_object, place_region
from tools.arrangements.checks import holds_when_put_down, oracle_attempts
from tools.arrangements.draws import (
    GRASP_GOALS,
    PLACE_TEMPLATES,
    RELATION_ORDER,
    cast_around,
    cast_at_random,
    cast_for,
    words_of,
)

COUNTS = {
    "grasp": {"seen": 10, "unseen": 5},
    "place": {"seen": 20, "unseen": 10},
    "pick-place": {"seen": 8, "unseen": 4},
    "heavy30": {"seen": 3, "unseen": 2},
}
KINDS = {
    "grasp": "cluttered15",
    "place": "place8",
    "pick-place": "pickplace8",
    "heavy30": "heavy30",
}
_TRIES = 200
_DROP_TRIES = 3
_LARGEST_SHARE = 1.4
# Sets these draws apart from those of random scenes, whose generators start from one integer.
_STREAM = 0xA11A


@dataclass(frozen=True, kw_only=True)
class Slot:
    """An arrangement to be made.

    Attributes:
        suite: Suite.
        split: Split.
        index: Number within both.
    """

    suite: str
    split: str
    index: int

    @property
    def name(self) -> str:
        """Name of the arrangement."""
        return f"{self.suite}-{self.split}-{self.index:02d}"

    @property
    def kind(self) -> SceneKind:
        """Kind of its scene."""
        return SCENE_KINDS[KINDS[self.suite]]


def slots(suites: tuple[str, ...]) -> tuple[Slot, ...]:
    """List the arrangements of suites."""
    return tuple(
        Slot(suite=suite, split=split, index=index)
        for suite in suites
        for split, count in COUNTS[suite].items()
        for index in range(count)
    )


def make_arrangement(slot: Slot, lifter: MultiViewLifter) -> tuple[Arrangement, str]:
    """Draw until an arrangement settles at the first drop and can be solved.

    Args:
        slot: Which one.
        lifter: Perception stage for its workspace.

    Returns:
        The arrangement, and how it was found solvable.

    Raises:
        SceneError: If no draw can be solved.
    """
    make: Callable[..., tuple[Arrangement, str] | None] = {
        "grasp": _try_grasp,
        "heavy30": _try_grasp,
        "place": _try_place,
        "pick-place": _try_pick_place,
    }[slot.suite]
    for seed in range(_TRIES):
        suite = list(COUNTS).index(slot.suite)
        rng = np.random.default_rng([_STREAM, suite, slot.split == "unseen", slot.index, seed])
        found = make(slot, rng, lifter)
        if found is not None:
            arrangement, note = found
            return replace(arrangement, seed=seed), note
    raise SceneError(f"No draw of {slot.name} can be solved; change what is drawn.")


def _layouts(slot: Slot, objects: tuple[str, ...], rng: np.random.Generator) -> Iterator[Layout]:
    """Yield layouts in which every object stays where it fell."""
    assets = tuple(load_object(name) for name in objects)
    composed = compose_scene(assets, "sr")
    for _ in range(_DROP_TRIES):
        drops = draw_drops(composed.bodies, slot.kind, rng)
        qpos = fall(composed, drops, slot.kind)
        if stays(composed, qpos, slot.kind):
            yield Layout(assets=assets, composed=composed, qpos=qpos, drops=drops)


def _arrangement(slot: Slot, layout: Layout, goal: Goal) -> Arrangement:
    place = goal.place
    return Arrangement(
        name=slot.name,
        suite=slot.suite,
        split=slot.split,
        scene=KINDS[slot.suite],
        goal=ArrangedGoal(
            text=goal.text,
            targets=goal.targets,
            relation=place and place.relation,
            references=place.references if place else (),
        ),
        objects=record_layout(layout),
        mujoco=mujoco.__version__,
    )


def _scene(arrangement: Arrangement) -> Scene:
    return make_scene(SceneConfig(arrangement=arrangement))


def _try_grasp(
    slot: Slot, rng: np.random.Generator, lifter: MultiViewLifter
) -> tuple[Arrangement, str] | None:
    if slot.suite == "grasp":
        goal_text = GRASP_GOALS[slot.split][slot.index]
        objects = cast_for(goal_text, slot.split, slot.kind.num_objects, rng)
    else:
        objects = cast_at_random(slot.split, slot.kind.num_objects, rng)
        goal_text = draw_goal(words_of(objects), objects, rng).text
    for layout in _layouts(slot, objects, rng):
        arrangement = _arrangement(slot, layout, find_goal(goal_text, words_of(objects)))
        attempts = oracle_attempts(_scene(arrangement), lifter, seed=0)
        if attempts is not None:
            return arrangement, f"oracle holds a target at attempt {attempts}"
    return None


def _try_place(
    slot: Slot, rng: np.random.Generator, lifter: MultiViewLifter
) -> tuple[Arrangement, str] | None:
    del lifter  # nothing is looked at
    relation = RELATION_ORDER[slot.index % len(RELATION_ORDER)]
    objects = cast_around(relation, slot.split, slot.kind.num_objects, rng)
    reference = objects[0]
    goal = _place_goal(relation, reference, objects, rng)
    for layout in _layouts(slot, objects, rng):
        draft = _arrangement(slot, layout, goal)
        scene = _scene(draft)
        for moved in rng.permutation([o.name for o in scene.objects if o.graspable]):
            # "It" is whatever can be held, and stays.
            if moved != reference and _can_place(scene, str(moved), goal, rng):
                final = replace(draft, goal=replace(draft.goal, targets=(str(moved),)))
                return final, f"{moved} stays {relation} {reference} when put down there"
    return None


def _place_goal(
    relation: str, reference: str, objects: tuple[str, ...], rng: np.random.Generator
) -> Goal:
    words = words_of(objects)
    template = PLACE_TEMPLATES[rng.integers(len(PLACE_TEMPLATES))]
    return find_goal(template.format(relation=relation, reference=words[reference].label), words)


def _can_place(scene: Scene, moved: str, goal: Goal, rng: np.random.Generator) -> bool:
    """Tell whether the object stays where it is put, and there is room for it there."""
    assert goal.place is not None
    if len(goal.place.references) != 1 or moved in goal.place.references:
        return False
    radius = _radius(scene, moved)
    if goal.place.relation in INSIDE_RELATIONS and not _bears(scene, goal.place, radius):
        return False
    region = place_region(
        scene, goal.place.relation, goal.place.references[0], moved=moved, clearance_m=radius
    )
    return not region.area.is_empty and holds_when_put_down(scene, moved, region, rng)


def _radius(scene: Scene, name: str) -> float:
    """Return the radius of an object's footprint about its origin as it naturally rests."""
    vertices = find_object(scene, name).asset.vertices
    return float(np.linalg.norm(vertices[:, :2], axis=1).max())


def _bears(scene: Scene, place: PlaceGoal, radius: float) -> bool:
    """Tell whether something of this radius does not stick out too far from its reference."""
    return radius <= _LARGEST_SHARE * _radius(scene, place.references[0])


def _try_pick_place(
    slot: Slot, rng: np.random.Generator, lifter: MultiViewLifter
) -> tuple[Arrangement, str] | None:
    relation = RELATION_ORDER[slot.index % len(RELATION_ORDER)]
    # The first ones are set apart in the place zone, among them the reference.
    objects = cast_around(relation, slot.split, slot.kind.num_objects, rng)
    spread, heaped = objects[: slot.kind.num_spread], objects[slot.kind.num_spread :]
    words = words_of(objects)
    grasp = draw_goal(words, heaped, rng)
    if set(grasp.targets) & set(spread):
        return None
    reference = objects[0]
    place_text = f"put it {relation} the {words[reference].label}"
    goal = find_goal(f"{grasp.text}, {place_text}", words)
    if goal.targets != grasp.targets:
        return None
    for layout in _layouts(slot, objects, rng):
        arrangement = _arrangement(slot, layout, goal)
        scene = _scene(arrangement)
        if not all(_can_place(scene, target, goal, rng) for target in goal.targets):
            continue
        attempts = oracle_attempts(scene, lifter, seed=0)
        if attempts is not None:
            return arrangement, (
                f"oracle holds a target at attempt {attempts}; every target stays {relation} "
                f"{reference} when put down there"
            )
    return None
