"""Words and weights that many entries share."""

from models.objects.asset import Matter
from models.objects.words import ObjectWords

MOULDED = Matter(density_kg_m3=800.0, source="moulded plastic figure; assumed")
PLASTIC = Matter(density_kg_m3=600.0, source="moulded plastic, partly hollow; assumed")
LIQUID = Matter(
    density_kg_m3=950.0, source="filled with a water-based product, with head room; assumed"
)
DRINK = Matter(density_kg_m3=1000.0, source="filled with a drink; assumed")
GLAZED = Matter(density_kg_m3=1500.0, source="glazed earthenware, porous; assumed")


def toy(
    *names: str,
    colors: tuple[str, ...],
    label: str | None = None,
    shapes: tuple[str, ...] = (),
) -> ObjectWords:
    """Describe a toy.

    Args:
        names: Noun phrases, the most usual first.
        colors: Dominant colours.
        label: The protocol's label, if it has one for this kind.
        shapes: Shape adjectives.

    Returns:
        The words.
    """
    return ObjectWords(
        label=label,
        synonyms=names,
        category="toy",
        colors=colors,
        shapes=shapes,
        functions=("play",),
    )


def thing(
    *names: str,
    colors: tuple[str, ...],
    functions: tuple[str, ...] = (),
    label: str | None = None,
    category: str | None = None,
) -> ObjectWords:
    """Describe anything else.

    Args:
        names: Noun phrases, the most usual first.
        colors: Dominant colours.
        functions: What it is for.
        label: The protocol's label, if it has one for this kind.
        category: The general label.

    Returns:
        The words.
    """
    return ObjectWords(
        label=label, synonyms=names, category=category, colors=colors, functions=functions
    )
