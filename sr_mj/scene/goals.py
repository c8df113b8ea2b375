"""Instructions: drawing one from the protocol's templates, and which objects satisfy one."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from models.objects.words import CATEGORIES, COLORS, FUNCTIONS, SHAPES, ObjectWords
from perception.language import parse_instruction
from sr_mj.errors import SceneError

# The templates and their probabilities are those of the evaluation protocol.
_TEMPLATES: dict[str, tuple[tuple[str, float], ...]] = {
    "label": (("give me the {}", 0.4),),
    "category": (("I need a {}", 0.2),),
    "look": (("grasp a {} object", 0.1), ("I want a {} object", 0.1)),
    "function": (("get something to {}", 0.2),),
}
_EMPTY_NOUN = re.compile(r"\b(objects?|things?|items?|one)$")


@dataclass(frozen=True, kw_only=True)
class PlaceGoal:
    """Where something is to be put. Ground truth: for evaluation and the oracle only.

    Attributes:
        relation: One of `perception.relations.RELATIONS`.
        references: Names of the scene's objects that the instruction may mean as reference.
    """

    relation: str
    references: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Goal:
    """An instruction and the objects that satisfy it.

    Attributes:
        text: The instruction.
        targets: Names of the scene's objects that satisfy it; empty if none does. Ground truth:
            for evaluation and the oracle only.
        place: Where to put what was picked, or None if nothing is said of it.
    """

    text: str
    targets: tuple[str, ...]
    place: PlaceGoal | None = None


def _words_of(kind: str, words: ObjectWords) -> tuple[str, ...]:
    """List the words of one kind by which an object can be asked for."""
    label = (words.label,) if words.label else ()
    category = (words.category,) if words.category else ()
    return {
        "label": label,
        "category": category,
        "look": (*words.colors, *words.shapes),
        "function": words.functions,
    }[kind]


def _satisfies(kind: str, word: str, words: ObjectWords) -> bool:
    """Tell whether an object is what a template of one kind, filled with `word`, asks for."""
    if kind == "label":
        # "Give me the cup" is as well served by any other cup, or by what else is called so.
        return word in (words.label, words.category, *words.synonyms)
    return word in _words_of(kind, words)


def draw_goal(
    objects: dict[str, ObjectWords], graspable: Sequence[str], rng: np.random.Generator
) -> Goal:
    """Draw an instruction that at least one graspable object satisfies.

    Args:
        objects: Words of every object in the scene, by name.
        graspable: Names of those that the gripper can hold as they lie.
        rng: Source of randomness.

    Returns:
        The goal, with every object that fits the drawn word as target.

    Raises:
        SceneError: If no object is graspable.
    """
    if not graspable:
        raise SceneError(
            "No object of this scene can be held by the gripper as it lies, so no goal can be "
            "drawn. Use another seed, or state a goal."
        )
    choices = [
        (kind, template, probability, words)
        for kind, templates in _TEMPLATES.items()
        for template, probability in templates
        if (words := sorted({w for name in graspable for w in _words_of(kind, objects[name])}))
    ]
    weights = np.array([probability for _, _, probability, _ in choices])
    kind, template, _, words = choices[rng.choice(len(choices), p=weights / weights.sum())]
    word = words[rng.integers(len(words))]
    targets = tuple(n for n, described in objects.items() if _satisfies(kind, word, described))
    return Goal(text=template.format(word), targets=targets)


def _mentions(text: str, word: str) -> bool:
    return re.search(rf"\b{re.escape(word.lower())}s?\b", text) is not None


def _named_targets(phrase: str, objects: dict[str, ObjectWords]) -> tuple[str, ...]:
    """Find the objects called by the longest label or synonym that occurs in the phrase."""
    names = {n for words in objects.values() for n in (words.label, *words.synonyms) if n}
    mentioned = sorted((n for n in names if _mentions(phrase, n)), key=len)
    if not mentioned:
        return ()
    name = mentioned[-1]
    return tuple(key for key, words in objects.items() if _satisfies("label", name, words))


def find_targets(text: str, objects: dict[str, ObjectWords]) -> tuple[str, ...]:
    """Find the objects that an instruction in free wording asks for.

    A label or synonym decides if one is named (the longest if several are); otherwise an object
    has to fit every general word that occurs: category, colour, shape, function. Before a noun
    that says nothing ("an orange object") words are general ones.

    Args:
        text: The instruction; only what it says of the object to grasp counts.
        objects: Words of every object in the scene, by name.

    Returns:
        Names of the targets, in the scene's order; empty if nothing fits.
    """
    # Case files of others write some labels as identifiers.
    phrase = parse_instruction(text).target_phrase.replace("_", " ")
    return _described(phrase, objects)


def find_goal(text: str, objects: dict[str, ObjectWords]) -> Goal:
    """Find everything in a scene that an instruction in free wording speaks of.

    Args:
        text: The instruction.
        objects: Words of every object in the scene, by name.

    Returns:
        The goal; `find_targets` says how objects are found.
    """
    instruction = parse_instruction(text)
    place = None
    if instruction.relation is not None and instruction.reference is not None:
        references = _described(instruction.reference, objects)
        place = PlaceGoal(relation=instruction.relation, references=references)
    return Goal(text=text, targets=find_targets(text, objects), place=place)


def _described(phrase: str, objects: dict[str, ObjectWords]) -> tuple[str, ...]:
    if not _EMPTY_NOUN.search(phrase):
        named = _named_targets(phrase, objects)
        if named:
            return named
    asked = [w for w in (*CATEGORIES, *COLORS, *SHAPES, *FUNCTIONS) if _mentions(phrase, w)]
    if not asked:
        return ()
    return tuple(n for n, words in objects.items() if all(words.fits(word) for word in asked))
