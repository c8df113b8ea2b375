"""Random goals with a place part, drawn as those of the fixed arrangements are."""

from dataclasses import replace

import numpy as np

from models.workspace import Workspace
from perception.relations import INSIDE_RELATIONS
from sr_mj.errors import SceneError
from sr_mj.scene import Goal, Scene, SceneConfig, find_goal, make_scene
from sr_mj.scene.config import Split
from sr_mj.scene.goals import draw_goal
from sr_mj.scene.placement import find_object, place_region
from tools.arrangements.checks import holds_when_put_down
from tools.arrangements.draws import PLACE_TEMPLATES, RELATION_ORDER, reference_pool

_LARGEST_SHARE = 1.4
# Sets these draws apart from those of random scenes, whose generators start from one integer.
_STREAM = 0xB19A
_TRIES, _TRIES_EACH = 40, 8


def make_place_scene(kind: str, split: Split, seed: int) -> Scene:
    """Make a random scene whose goal is to place something.

    Args:
        kind: "place8", where any object that can be held is handed over, or "pickplace8", where the
            goal also says which object of the heap to pick.
        split: Part of the catalogue.
        seed: Draws the scene and the goal. Every relation in turn; scenes without a goal
            that can be met are drawn again.

    Returns:
        The scene; the object stays where the goal wants it if it is put down there.

    Raises:
        SceneError: If no scene has such a goal.
    """
    rng = np.random.default_rng([_STREAM, seed])
    relations = np.roll(np.array(RELATION_ORDER, dtype=object), -seed)
    for number in range(_TRIES):
        # Other seeds than those that anybody asks for by hand.
        config = SceneConfig(scene=kind, split=split, seed=seed + 100_000 * number)
        scene = make_scene(config)
        goal = _draw_goal(scene, str(relations[number // _TRIES_EACH]), rng)
        if goal is not None:
            return replace(scene, goal=goal)
    raise SceneError(f"No scene {kind!r} near seed {seed} has an object to place by.")


def _draw_goal(scene: Scene, relation: str, rng: np.random.Generator) -> Goal | None:
    words = {item.name: item.words for item in scene.objects}
    kind = scene.config.kind
    # Where there is a heap, things are picked from it and placed by what stands apart.
    apart = [item.name for item in scene.objects[: kind.num_spread]]
    if kind.pick_zone is not None and kind.place_zone is not None:
        apart = [name for name in apart if _is_in(kind.place_zone, scene, name)]
    pool = [
        n for n in reference_pool(relation, [o.asset.name for o in scene.objects]) if n in apart
    ]
    movable = [
        item.name
        for item in scene.objects
        if item.graspable and (kind.pick_zone is None or _is_in(kind.pick_zone, scene, item.name))
    ]
    for reference in rng.permutation(pool):
        for moved in rng.permutation(movable):
            place = _template(kind.num_heaped > 0, rng).format(
                relation=relation, reference=words[str(reference)].label
            )
            goal = find_goal(place, words)
            assert goal.place is not None
            if goal.place.references != (str(reference),) or moved == reference:
                continue
            targets = (str(moved),)
            if kind.num_heaped:
                grasp = draw_goal(words, [str(moved)], rng)
                goal = find_goal(f"{grasp.text}, {place}", words)
                targets = grasp.targets
                if goal.targets != targets or set(targets) & set(apart):
                    continue
            goal = replace(goal, targets=targets)
            if all(_can_place(scene, name, goal, rng) for name in targets):
                return goal
    return None


def _is_in(zone: Workspace, scene: Scene, name: str) -> bool:
    return bool(zone.contains_xy(scene.T_world_object(name)[:3, 3]))


def _template(is_combined: bool, rng: np.random.Generator) -> str:
    return PLACE_TEMPLATES[0] if is_combined else str(rng.choice(PLACE_TEMPLATES))


def _can_place(scene: Scene, moved: str, goal: Goal, rng: np.random.Generator) -> bool:
    """Tell whether the object stays where it is put, and there is room for it there."""
    assert goal.place is not None
    (reference,) = goal.place.references
    radius = _radius(scene, moved)
    is_inside = goal.place.relation in INSIDE_RELATIONS
    if is_inside and radius > _LARGEST_SHARE * _radius(scene, reference):
        return False
    region = place_region(scene, goal.place.relation, reference, moved=moved, clearance_m=radius)
    return not region.area.is_empty and holds_when_put_down(scene, moved, region, rng)


def _radius(scene: Scene, name: str) -> float:
    """Return the radius of an object's footprint about its origin as it naturally rests."""
    vertices = find_object(scene, name).asset.vertices
    return float(np.linalg.norm(vertices[:, :2], axis=1).max())
