"""Other ways of saying the expert's instructions, for training only.

None of them is a sentence of `models.arrangements.paraphrases`, by which wording is evaluated.
"""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from models.objects.words import CATEGORIES, COLORS, FUNCTIONS, SHAPES, ObjectWords
from sr_mj.instruction import PhaseText, place_text
from sr_mj.scene import find_goal, find_targets

_LABEL = (
    "pick up the {}",
    "get me the {}",
    "please take the {}",
    "I want the {}",
    "bring me the {}",
    "grasp the {}",
    "where is the {}",
    "fetch the {} for me",
)
_CATEGORY = (
    "give me a {}",
    "pick up a {}",
    "get me one {}",
    "please take a {}",
    "I would like a {}",
    "bring me a {}",
    "grasp a {}",
)
_LOOK = (
    "give me a {} object",
    "pick up a {} thing",
    "get me something {}",
    "please take a {} item",
    "bring me a {} object",
    "I need something {}",
)
_FUNCTION = (
    "give me something to {}",
    "I need something to {}",
    "find something to {}",
    "bring me something to {}",
    "I want something to {}",
    "please pick up something to {}",
)
_PLACE = (
    "place this {relation} the {reference}",
    "move the object {relation} the {reference}",
    "set it {relation} the {reference}",
    "drop it {relation} the {reference}",
    "position it {relation} the {reference}",
)
_OTHER_NAME = 0.5
_LOOKS = "|".join((*COLORS, *SHAPES))
_FORMS = (
    (re.compile(r"give me the (.+)"), _LABEL),
    (re.compile(rf"I need a ({'|'.join(CATEGORIES)})"), _CATEGORY),
    (re.compile(rf"(?:grasp|I want) a ({_LOOKS}) object"), _LOOK),
    (re.compile(rf"get something to ({'|'.join(FUNCTIONS)})"), _FUNCTION),
)


def reword_pick(
    text: str,
    targets: Sequence[str],
    words: Mapping[str, ObjectWords],
    rng: np.random.Generator,
    num: int,
) -> tuple[PhaseText, ...]:
    """Reword an instruction to pick, made from a template of the protocol.

    Args:
        text: The instruction.
        targets: Names of the objects that satisfy it.
        words: Words of every object in the scene, by name.
        rng: Source of randomness.
        num: Most wordings.

    Returns:
        Other wordings that name the same objects of this scene; a synonym may take the place of a
        label.
    """
    found = ((match[1], forms) for form, forms in _FORMS if (match := form.fullmatch(text)))
    word, forms = next(found)
    names = [word]
    if forms is _LABEL:
        titles = (words[name] for name in targets)
        names += [n for title in titles for n in (title.label, *title.synonyms) if n]
    said = [(str(form).format(n), str(form).format(word)) for form, n in _mixed(forms, names, rng)]
    # A synonym may name more objects than the label, or fewer.
    same = (t for pair in said for t in _first(pair, lambda t: _is_for(t, targets, words)))
    return tuple(PhaseText(phase="pick", text=t) for t in dict.fromkeys(same))[:num]


def reword_place(
    text: str,
    references: Sequence[str],
    words: Mapping[str, ObjectWords],
    rng: np.random.Generator,
    num: int,
) -> tuple[PhaseText, ...]:
    """Reword an instruction to place.

    An episode says "put it ..." whatever the wording; here verbs and names of the reference vary.

    Args:
        text: The instruction.
        references: Names of the objects that may be meant as reference.
        words: Words of every object in the scene, by name.
        rng: Source of randomness.
        num: Most wordings.

    Returns:
        Other wordings with the same relation that name the same references in this scene.
    """
    said = place_text(text)
    word = said.text.split(f" {said.relation} the ", 1)[1]
    titles = (words[name] for name in references)
    names = [word, *(n for title in titles for n in (title.label, *title.synonyms) if n)]
    texts = [
        tuple(str(form).format(relation=said.relation, reference=n) for n in (name, word))
        for form, name in _mixed((*_PLACE, "put it {relation} the {reference}"), names, rng)
    ]

    def is_same(other: str) -> bool:
        return other != said.text and _means(other, said.relation, references, words)

    same = (t for pair in texts for t in _first(pair, is_same))
    return tuple(
        PhaseText(phase="place", text=t, relation=said.relation, side=said.side)
        for t in dict.fromkeys(same)
    )[:num]


def _means(
    text: str, relation: str | None, references: Sequence[str], words: Mapping[str, ObjectWords]
) -> bool:
    place = find_goal(text, dict(words)).place
    return (
        place is not None and place.relation == relation and place.references == tuple(references)
    )


def _is_for(text: str, targets: Sequence[str], words: Mapping[str, ObjectWords]) -> bool:
    return find_targets(text, dict(words)) == tuple(targets)


def _mixed(
    forms: Sequence[str], names: Sequence[str], rng: np.random.Generator
) -> list[tuple[str, str]]:
    """Shuffle forms and give each a name; the first name is drawn half of the time, at least."""
    return [
        (str(form), str(rng.choice(names)) if rng.random() < _OTHER_NAME else names[0])
        for form in rng.permutation(forms)
    ]


def _first(texts: Iterable[str], is_good: Callable[[str], bool]) -> list[str]:
    return next(([text] for text in texts if is_good(text)), [])
