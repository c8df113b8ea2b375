"""The words by which people ask for an object."""

from dataclasses import dataclass

CATEGORIES = ("fruit", "container", "toy", "cup", "sugar")
COLORS = (
    "red",
    "yellow",
    "orange",
    "green",
    "blue",
    "purple",
    "pink",
    "brown",
    "black",
    "white",
    "gray",
)
SHAPES = ("round",)
FUNCTIONS = ("eat", "drink", "play", "hold other things", "clean")

# The general words with which the evaluation protocol asks in each split. Objects carry more
# (every colour, every function that holds), for instructions in free wording.
PROTOCOL_GENERAL_WORDS: dict[str, tuple[str, ...]] = {
    "seen": (
        *("fruit", "container", "toy", "cup", "yellow", "red", "round"),
        *("eat", "drink", "play", "hold other things"),
    ),
    "unseen": ("sugar", "container", "yellow", "red", "clean"),
}


@dataclass(frozen=True, kw_only=True)
class ObjectWords:
    """The language of one object, in the vocabulary of the evaluation protocol.

    Attributes:
        label: The specific noun phrase of the protocol ("red mug"); None for an object that is
            asked for by its category only.
        synonyms: Other noun phrases a person would use; never empty when `label` is None.
        category: The general label ("fruit"), one of `CATEGORIES`, or None.
        colors: Dominant colours, most dominant first, each one of `COLORS`.
        shapes: Shape adjectives, each one of `SHAPES`.
        functions: What the object is for, each one of `FUNCTIONS`.
    """

    label: str | None
    synonyms: tuple[str, ...] = ()
    category: str | None = None
    colors: tuple[str, ...] = ()
    shapes: tuple[str, ...] = ()
    functions: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """A phrase for people: the label, else the first synonym."""
        return self.label if self.label is not None else self.synonyms[0]

    def fits(self, word: str) -> bool:
        """Tell whether a word of the protocol (label, category, adjective, function) applies."""
        return word in (self.label, self.category, *self.colors, *self.shapes, *self.functions)
