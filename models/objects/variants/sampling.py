"""Drawing variants: a family, a recipe's parameters, the rule of novelty, the asset."""

import difflib

import numpy as np

from models.errors import AssetError, UnknownNameError
from models.objects.asset import ObjectAsset, assemble, closed_mesh
from models.objects.variants import (
    animals,
    desk,
    food,
    goods,
    home,
    pantry,
    sports,
    tableware,
    tools,
    toys,
    workshop,
)
from models.objects.variants.draft import Draft, Recipe
from models.objects.variants.novelty import is_novel

SPLIT = "sampled"
RECIPES: dict[str, Recipe] = {
    **food.RECIPES,
    **goods.RECIPES,
    **tableware.RECIPES,
    **home.RECIPES,
    **pantry.RECIPES,
    **desk.RECIPES,
    **tools.RECIPES,
    **workshop.RECIPES,
    **toys.RECIPES,
    **sports.RECIPES,
    **animals.RECIPES,
}
FAMILIES: tuple[str, ...] = tuple(RECIPES)
# Families that hold many kinds of things are drawn so many times as often as the others.
_WEIGHTS = {"quadruped": 5, "carton": 5, "bottle": 5, "can": 3, "tube": 3, "spray_can": 2} | {
    "cup": 3,
    "bowl": 2,
    "mug": 2,
    "citrus": 2,
    "drupe": 2,
    "drink_can": 2,
    "jar": 2,
}
_MAX_DRAWS = 200
_MAX_BUILDS = 20


def draw(rng: np.random.Generator, *, family: str | None = None) -> Draft:
    """Draw a variant without building it.

    Args:
        rng: Source of randomness; its state decides everything.
        family: One of `FAMILIES`; by default drawn too.

    Returns:
        A variant that keeps the rule of `models.objects.variants.novelty`.

    Raises:
        UnknownNameError: If there is no such family.
        AssetError: If the family's recipe gives nothing new.
    """
    if family is None:
        weights = np.array([_WEIGHTS.get(name, 1) for name in FAMILIES], float)
        family = FAMILIES[int(rng.choice(len(FAMILIES), p=weights / weights.sum()))]
    if family not in RECIPES:
        close = difflib.get_close_matches(family, FAMILIES, n=1)
        hint = f" Did you mean {close[0]!r}?" if close else ""
        known = ", ".join(FAMILIES)
        raise UnknownNameError(f"Unknown family {family!r}. Families: {known}.{hint}")
    return draw_novel(rng, RECIPES[family])


def draw_novel(rng: np.random.Generator, recipe: Recipe) -> Draft:
    """Draw from a recipe until the variant is new.

    Args:
        rng: Source of randomness.
        recipe: Draws a variant.

    Returns:
        The first variant that keeps the rule of `models.objects.variants.novelty`.

    Raises:
        AssetError: If 200 variants in a row do not keep it.
    """
    for _ in range(_MAX_DRAWS):
        draft = recipe(rng)
        if is_novel(draft.shape):
            return draft
    raise AssetError(
        f"None of {_MAX_DRAWS} variants of family {draft.family!r} differs enough from the unseen "
        "objects; widen the ranges of its recipe."
    )


def sample(rng: np.random.Generator, *, family: str | None = None) -> ObjectAsset:
    """Draw and build a variant: endless further objects for training and demonstrations.

    No variant equals an object of the unseen split: geometry differs by more than 4 % in at
    least one parameter, and none of the unseen objects' titles is printed on it; see
    `models.objects.variants.novelty`.

    Args:
        rng: Source of randomness; equal states give equal bytes in every process.
        family: One of `models.objects.families.FAMILIES`; by default drawn too.

    Returns:
        An asset of split "sampled" whose name depends on its parameters alone.

    Raises:
        UnknownNameError: If there is no such family.
        AssetError: If the family's recipe gives nothing new, or no closed mesh.

    Example:
        >>> sample(np.random.default_rng(0), family="mug").family
        'mug'
    """
    for _ in range(_MAX_BUILDS):
        draft = draw(rng, family=family)
        asset = assemble(
            draft.shape(),
            name=draft.name,
            family=draft.family,
            split=SPLIT,
            words=draft.words,
            matter=draft.matter,
        )
        # Rounding to the stored precision can fold a sliver of a triangle; such a draw is left.
        if closed_mesh(asset.vertices, asset.faces).is_watertight:
            return asset
    raise AssetError(
        f"None of {_MAX_BUILDS} variants of family {family!r} has a closed mesh; "
        "make the family's thinnest triangles larger."
    )
