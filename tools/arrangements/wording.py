"""Other wordings of goals, as people speak who have never seen the protocol's templates."""

import re

from models.objects.words import CATEGORIES, COLORS, FUNCTIONS, SHAPES
from perception.language import parse_instruction

# What stands for {} has its article: "the pear", "a fruit".
_LABEL = (
    "could you hand me {}",
    "{} is what I am after",
    "would you pass {} over to me, please",
    "find {} among all this and pick it up",
    "I would like to have {}",
    "can you see {}? Take that one",
)
_CATEGORY = (
    "any {} on the table will do",
    "is there some {} you could pass me",
    "pick whichever {} is easiest to reach",
    "could you find me one {}, no matter which",
    "bring over some kind of {}",
    "one {} please, I don't mind which",
)
_ADJECTIVE = {
    "round": (
        "something shaped like a ball, please",
        "find a thing that would roll away",
        "hand over anything spherical",
        "could you pass me an item that is round",
        "take whatever has no corners at all",
        "I would like one of the ball-shaped ones",
    ),
    None: (
        "anything {} is fine",
        "could you pass me an item that is {}",
        "pick whatever looks {} to you",
        "find something {} and take it",
        "one of the {} ones, please",
        "I am looking for a thing whose colour is {}",
    ),
}
_FUNCTION = {
    "eat": (
        "I am hungry, find me a snack",
        "is there any food on this table",
        "hand me a bite of something",
        "which of these is edible? Give me that",
        "I could do with some food",
        "pass me a thing I can put in my mouth and chew",
    ),
    "drink": (
        "I am thirsty, what can I sip from",
        "find me what people hold when they have tea",
        "is there anything for my coffee",
        "pass me whatever I could sip water from",
        "something for a thirsty person, please",
        "I could do with a beverage",
    ),
    "play": (
        "the children are bored, find them something",
        "hand me what a child would have fun with",
        "pick whatever belongs in a toy chest",
        "we want to have fun, what is there for a game",
        "is there anything here for my kid",
        "pass me a plaything",
    ),
    "hold other things": (
        "I need somewhere to keep my keys",
        "find me what I can put nuts into",
        "what could I fill with small parts? Take that",
        "hand me a vessel of some kind",
        "something hollow to store my things in, please",
        "is there anything I could put buttons in",
    ),
    "clean": (
        "everything is dirty, find me a remedy",
        "what would you wash with? Hand it over",
        "I made a mess and have to get rid of the stains",
        "find me a thing for washing",
        "is there any detergent around",
        "pass me whatever makes things spotless",
    ),
}
_PLACE = {
    "in": ("inside {}", "into {}", "within {}"),
    "on": ("onto {}", "so that it rests upon {}", "up on {}"),
    "near": ("not far from {}", "in the neighbourhood of {}", "by {}"),
}
_PLACE_VERBS = (
    "let it end up {}",
    "could you set it down {}",
    "I would like to have it {}",
    "its place is {}",
    "leave it {}, please",
    "lay it {}",
)
_KIND_OF_RELATION = {
    **dict.fromkeys(("in", "to"), "in"),
    **dict.fromkeys(("on", "on top of", "upside"), "on"),
    **dict.fromkeys(("near", "around", "next to", "beside", "close to", "surrounding to"), "near"),
}


def other_wordings(goal: str) -> tuple[str, ...]:
    """Reword a goal made from the protocol's templates.

    Args:
        goal: The instruction.

    Returns:
        Six other wordings, for a pick, a place, or both.
    """
    instruction = parse_instruction(goal)
    if instruction.relation is None:
        return _pick(goal)
    places = _place(instruction.relation, str(instruction.reference))
    if ", " not in goal:
        return places
    picks = _pick(goal.rpartition(", ")[0])
    return tuple(f"{pick}, and {place}" for pick, place in zip(picks, places, strict=True))


def _pick(goal: str) -> tuple[str, ...]:
    if match := re.fullmatch(r"give me the (.+)", goal):
        return tuple(form.format(f"the {match[1]}") for form in _LABEL)
    if match := re.fullmatch(rf"I need a ({'|'.join(CATEGORIES)})", goal):
        return tuple(form.format(match[1]) for form in _CATEGORY)
    if match := re.fullmatch(rf"get something to ({'|'.join(FUNCTIONS)})", goal):
        return _FUNCTION[match[1]]
    if match := re.fullmatch(rf"(?:grasp|I want) a ({'|'.join((*COLORS, *SHAPES))}) object", goal):
        return tuple(form.format(match[1]) for form in _ADJECTIVE.get(match[1], _ADJECTIVE[None]))
    raise ValueError(f"No template of the protocol makes {goal!r}; give one that does.")


def _place(relation: str, reference: str) -> tuple[str, ...]:
    phrases = _PLACE[_KIND_OF_RELATION[relation]]
    return tuple(
        verb.format(phrases[i % len(phrases)].format(f"the {reference}"))
        for i, verb in enumerate(_PLACE_VERBS)
    )
