"""What the scenes of demonstrations are made of: objects of the seen split only."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from models.arrangements.library import arrangement_names, load_arrangement
from models.objects.catalogue import object_names, object_words
from sr_mj.collecting.tasks import SceneTask
from sr_mj.scene.config import SceneConfig, SceneKind

SPLIT = "seen"
OPEN_CATEGORIES = ("container", "cup")
"""What things can be put into."""

_STREAM = 0xDE30
# Half of the scenes are as full as those of the evaluation, the others have fewer objects: heaps
# shrink while they are cleared.
_FULL = 0.5
_FEWEST_HEAPED, _FEWEST_BESIDE, _FEWEST_SPREAD = 6, 3, 5
_PICK_PLACE = 0.45
_WITH_VESSEL = 0.6


@dataclass(frozen=True, kw_only=True)
class CrowdConfig(SceneConfig):
    """A random scene with another number of objects than its kind has.

    Attributes:
        num_heaped: Objects of the heap.
        num_spread: Objects set down apart from each other.
    """

    num_heaped: int = 0
    num_spread: int = 0

    @property
    def kind(self) -> SceneKind:
        """The scene's entry in the registry, with these numbers."""
        return replace(super().kind, num_heaped=self.num_heaped, num_spread=self.num_spread)


def task_rng(task: SceneTask) -> np.random.Generator:
    """Return the source of randomness for what is drawn before and in a scene, layout aside."""
    return np.random.default_rng([_STREAM, task.seed])


def draw_crowd(task: SceneTask, rng: np.random.Generator) -> CrowdConfig:
    """Draw kind, number and names of a scene's objects; how they fall, the seed decides.

    Picking: heaps as in cluttered15. Placing: as in place8 or pickplace8, most with something to
    put things in among the objects that stand apart.

    Args:
        task: The scene.
        rng: Source of randomness.

    Returns:
        The scene's configuration; never that of an arrangement, nor of the same set of objects.
    """
    kind = "cluttered15"
    if task.phase == "place":
        kind = "pickplace8" if rng.random() < _PICK_PLACE else "place8"
    full = SceneConfig(scene=kind).kind
    heaped, spread = full.num_heaped, full.num_spread
    if rng.random() > _FULL:
        if heaped:
            fewest = _FEWEST_BESIDE if spread else _FEWEST_HEAPED
            heaped = int(rng.integers(fewest, heaped + 1))
        else:
            spread = int(rng.integers(_FEWEST_SPREAD, spread + 1))
    num = heaped + spread
    names = _draw_names(num, task.phase == "place", rng)
    while frozenset(names) in arranged_casts():
        names = _draw_names(num, task.phase == "place", rng)
    return CrowdConfig(
        scene=kind,
        split=SPLIT,
        seed=task.seed,
        objects=names,
        num_heaped=heaped,
        num_spread=spread,
    )


@cache
def arranged_casts() -> frozenset[frozenset[str]]:
    """Return the sets of objects that the stored arrangements are made of."""
    return frozenset(
        frozenset(item.object for item in load_arrangement(name).objects)
        for name in arrangement_names()
    )


def _draw_names(num: int, for_placing: bool, rng: np.random.Generator) -> tuple[str, ...]:
    names = rng.permutation(object_names(SPLIT))
    if for_placing and rng.random() < _WITH_VESSEL:
        is_open = np.array([object_words(n).category in OPEN_CATEGORIES for n in names])
        # Those that stand apart come first.
        first = int(np.flatnonzero(is_open)[0])
        names = np.concatenate([names[first : first + 1], np.delete(names, first)])
    return tuple(map(str, names[:num]))
