"""`Entry`, a line of the catalogue."""

from dataclasses import dataclass
from functools import partial

from models.objects.asset import Matter, Shape
from models.objects.words import ObjectWords


@dataclass(frozen=True, kw_only=True, eq=False)
class Entry:
    """One object of the catalogue, not built yet.

    Attributes:
        name: Unique name, letters, digits and underscores.
        shape: Builds the geometry: a family with its parameters bound.
        words: How people ask for it.
        matter: Mass or density.
    """

    name: str
    shape: partial[Shape]
    words: ObjectWords
    matter: Matter

    @property
    def family(self) -> str:
        """Name of the family."""
        return self.shape.func.__name__


def ycb(number: str, mass_kg: float) -> Matter:
    """Weigh an object of the YCB set.

    Args:
        number: Its number in the set.
        mass_kg: The mass published in B. Calli et al., "Benchmarking in Manipulation Research",
            IEEE Robotics & Automation Magazine 22(3), 2015, table of objects. The set's fruits are
            plastic models, hence lighter than real fruit.
    """
    return Matter(source=f"published mass of YCB {number}", mass_kg=mass_kg)
