"""Which objects and goals an arrangement gets."""

from collections.abc import Sequence

import numpy as np
import shapely

from models.objects.asset import ObjectAsset
from models.objects.catalogue import load_object, object_names, object_words
from models.objects.words import ObjectWords
from perception.relations import INSIDE_RELATIONS
from sr_mj.scene.build import narrowest_width
from sr_mj.scene.goals import find_targets

# The ten goals of the paper's table 2, in the wording of the protocol's templates, and five of the
# same templates for unseen objects.
GRASP_GOALS = {
    "seen": (
        "I need a fruit",
        "get something to hold other things",
        "give me the pear",
        "give me the thera med",
        "I need a cup",
        "grasp a round object",
        "get something to drink",
        "I want a round object",
        "get something to eat",
        "give me the cup",
    ),
    "unseen": (
        "give me the black marker",
        "I need a container",
        "grasp a red object",
        "get something to clean",
        "give me the shampoo",
    ),
}
PLACE_TEMPLATES = (
    "put it {relation} the {reference}",
    "place this {relation} the {reference}",
    "move the object {relation} the {reference}",
)
# Every relation in turn, inside and outside alternating.
RELATION_ORDER = (
    *("in", "near", "on", "around", "to", "next to", "on top of", "beside"),
    *("upside", "close to", "surrounding to"),
)
# Into open vessels only; the other inside relations take objects with a flat top.
INTO_RELATIONS = ("in", "to")
_MAX_TARGETS = 3
_LEAST_SUPPORT_M, _HIGHEST_SUPPORT_M, _TOP_M = 0.045, 0.13, 0.004
_LEVEL_COS, _LEAST_COVER = 0.97, 0.5
OPEN_CATEGORIES = ("container", "cup")


def words_of(names: Sequence[str]) -> dict[str, ObjectWords]:
    """Return the words of catalogue objects by name."""
    return {name: object_words(name) for name in names}


def cast_for(goal: str, split: str, num_objects: int, rng: np.random.Generator) -> tuple[str, ...]:
    """Draw objects for a grasp goal: one to three that satisfy it, the rest that do not.

    Args:
        goal: The instruction.
        split: Part of the catalogue.
        num_objects: How many in all.
        rng: Source of randomness.

    Returns:
        Names in the catalogue, in random order.
    """
    names = object_names(split)
    fitting = find_targets(goal, words_of(names))
    others = [name for name in names if name not in fitting]
    num_targets = int(rng.integers(1, min(_MAX_TARGETS, len(fitting)) + 1))
    drawn = [
        *rng.choice(fitting, num_targets, replace=False),
        *rng.choice(others, num_objects - num_targets, replace=False),
    ]
    return tuple(str(drawn[i]) for i in rng.permutation(num_objects))


def cast_at_random(split: str, num_objects: int, rng: np.random.Generator) -> tuple[str, ...]:
    """Draw objects of a split, each at most once."""
    return tuple(str(n) for n in rng.choice(object_names(split), num_objects, replace=False))


def cast_around(
    relation: str, split: str, num_objects: int, rng: np.random.Generator
) -> tuple[str, ...]:
    """Draw objects of a split, one of which a relation can be to; it comes first.

    Args:
        relation: The relation.
        split: Part of the catalogue.
        num_objects: How many in all.
        rng: Source of randomness.

    Returns:
        Names in the catalogue.
    """
    names = object_names(split)
    reference = str(rng.choice(reference_pool(relation, names)))
    others = [name for name in names if name != reference]
    return (reference, *(str(n) for n in rng.choice(others, num_objects - 1, replace=False)))


def reference_pool(relation: str, names: Sequence[str]) -> list[str]:
    """List the objects that a relation can be to: labelled, and open or flat as need be.

    Args:
        relation: The relation.
        names: Objects to choose from.

    Returns:
        Names.
    """
    words = words_of(names)
    return [name for name in names if words[name].label is not None and _admits(relation, name)]


def _admits(relation: str, name: str) -> bool:
    if relation in INTO_RELATIONS:
        return object_words(name).category in OPEN_CATEGORIES
    return relation not in INSIDE_RELATIONS or has_flat_top(load_object(name))


def has_flat_top(asset: ObjectAsset) -> bool:
    """Tell whether an object that stands as it naturally rests could carry another.

    Args:
        asset: The object.

    Returns:
        Whether it is broad and low enough, and its level surface near the top covers half
        of its outline seen from above.
    """
    low, high = asset.vertices.min(axis=0), asset.vertices.max(axis=0)
    corners = asset.vertices[asset.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1) / 2
    level = cross[:, 2] > 2 * area * _LEVEL_COS
    on_top = level & (corners[:, :, 2].min(axis=1) > high[2] - _TOP_M)
    outline = shapely.MultiPoint(asset.vertices[:, :2]).convex_hull
    return bool(
        narrowest_width(asset.vertices) >= _LEAST_SUPPORT_M
        and high[2] - low[2] <= _HIGHEST_SUPPORT_M
        and area[on_top].sum() >= _LEAST_COVER * outline.area
    )
