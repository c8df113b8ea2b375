"""What an instruction is about: target, relation and reference, by rules.

The rules cover the templates of the evaluation protocol (those of A2, quoted as data); any other
wording falls back to the whole sentence, which a text encoder can still make something of.
"""

import re
from dataclasses import dataclass

from perception.errors import InvalidTextError

INSIDE_RELATIONS = ("on top of", "upside", "on", "in", "to")
OUTSIDE_RELATIONS = ("surrounding to", "close to", "next to", "beside", "around", "near")
# The longest goes first, or "on" would be found in "on top of".
RELATIONS = tuple(sorted((*INSIDE_RELATIONS, *OUTSIDE_RELATIONS), key=len, reverse=True))

_RELATION = "|".join(re.escape(relation) for relation in RELATIONS)
_ARTICLE = r"(?:(?:an?|the|some)\s+)?"
_PICK_PATTERN = re.compile(
    rf"(?:please\s+)?(?:give me|i need|i want|grasp|get|pick up)\s+{_ARTICLE}(?P<x>.+)"
)
# The pronouns of the templates stand for what was picked and are no target of their own.
_PLACE_PATTERN = re.compile(
    rf"(?:please\s+)?(?:put|place|move)\s+(?:(?P<pronoun>it|this|the object)|{_ARTICLE}(?P<x>.+?))"
    rf"\s+(?P<relation>{_RELATION})\s+{_ARTICLE}(?P<reference>.+)"
)


@dataclass(frozen=True, kw_only=True)
class Instruction:
    """An instruction taken apart.

    Attributes:
        text: The instruction as it was given, without surrounding white space.
        target: Phrase that names what to pick, or the whole sentence where no rule applies; None
            where the sentence only says where to place.
        relation: One of `RELATIONS`, or None without a place goal.
        reference: Phrase that names the object to place by, or None.
    """

    text: str
    target: str | None
    relation: str | None = None
    reference: str | None = None

    @property
    def target_phrase(self) -> str:
        """What to look for first: the target, or the reference where only a place is named."""
        return self.target or self.reference or self.text


def parse_instruction(text: str) -> Instruction:
    """Take an instruction apart.

    "give me the pear" -> target "pear"; "get something to eat" -> "something to eat"; "I want a
    strawberry, put it near the apple" -> "strawberry", relation "near", reference "apple".

    Args:
        text: The instruction.

    Returns:
        Its parts, in lower case except for `text`.

    Raises:
        InvalidTextError: If there are no words.
    """
    stripped = text.strip()
    if not re.search(r"\w", stripped):
        raise InvalidTextError(f"Empty instruction {text!r}: expected at least one word.")
    sentence = re.sub(r"\s+", " ", stripped.lower()).rstrip(" .!?")
    pick_part, comma, place_part = sentence.rpartition(", ")
    place = _PLACE_PATTERN.fullmatch(place_part.removeprefix("and ").removeprefix("then "))
    if place is None:
        return Instruction(text=stripped, target=_pick_target(sentence))
    target = _pick_target(pick_part) if comma else place["x"]
    return Instruction(
        text=stripped, target=target, relation=place["relation"], reference=place["reference"]
    )


def _pick_target(sentence: str) -> str:
    match = _PICK_PATTERN.fullmatch(sentence)
    return match["x"] if match else sentence
