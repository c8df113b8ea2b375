"""What an instruction is about: target, relation and reference, by rules.

Three steps: courtesies go ("could you ...", "please"), the sentence is split into what to pick and
where to place, and each part is matched with patterns. The patterns cover the templates of the
evaluation protocol (those of A2, quoted as data) and the ways in which people paraphrase them. In
any other wording `perception.free_wording` looks for a noun phrase or a need; only if it finds none
is the whole sentence left, which a text encoder can still make something of.
"""

import re
from dataclasses import dataclass
from typing import Literal

from perception.errors import InvalidTextError
from perception.free_wording import (
    asked_for,
    find_need,
    reduce_phrase,
    split_clauses,
)
from perception.pick_wording import CLAUSE_END, DETERMINER, PRONOUN, picked
from perception.place_wording import match_place, match_place_alone
from perception.relations import INSIDE_RELATIONS, canonical_relation

_COURTESY = re.compile(
    r"^(?:(?:hey|hi|hello|ok|okay|(?:dear )?robot|now|so|well|first|next(?! to)|then|and|please"
    r"|kindly|just"
    r"|excuse me|sorry|good (?:morning|evening|day)|if possible|quick(?:ly)?|maybe|perhaps)\b[ ,]*"
    r"|(?:great|good|perfect|excellent|awesome|cool|nice|fine|well done|al(?:l )?right|yes"
    r"|thanks?(?: you)?)"
    r"(?: (?:job|work|one|boy|robot))?(?:\s*[,.!;:]+\s*|\s+(?=now\b))"
    r"|(?:would you|do you) mind "
    r"|(?:could|can|would|will|won't|can't|couldn't) you (?:please |kindly |just |maybe |possibly "
    r"|perhaps |also |then )*(?:be able to |go and )?(?!see|have|spot|find any)(?=\w)"
    r"|are you able to |(?:is it|would it be) possible (?:for you )?to |do you think you (?:could"
    r"|can) "
    r"|i(?:'m| am| was)? ?wonder(?:ing)? (?:if|whether) you (?:could|can|would) |why don't you "
    r"|it would be (?:\w+ )?(?:if you (?:could|would)|of you to|for you to) |how about you "
    r"|i(?:'d| would) (?:really )?(?:appreciate it|be \w+|love it) if you (?:could|would|can) "
    r"|if you (?:don't mind|could|can|would|please)[ ,]+|when(?:ever)? you (?:can"
    r"|have \w+ \w+)[ ,]+"
    r"|be (?:so kind|a dear|so good|kind enough|good enough)(?: as)? (?:to|and) "
    r"|(?:i(?:'d| would) like|i want|i need|i expect|i ask) you to "
    r"|you (?:should|have to|need to|must|may|can|are to) "
    r"|(?:your|the|my) (?:\w+ )?(?:task|job|goal|wish|request|step) is (?:for you )?to "
    r"|(?:it's )?time to "
    r"|let's |let us |go ahead and |go and |go (?!for\b)|try to |feel free to |start by "
    r"|make sure to "
    r"|help me (?:to )?|do me a favou?r and )"
)
_AFTERTHOUGHT = re.compile(
    r"[ ,]*\b(?:please|thanks|thank you|thanks a lot|(?:right )?now|for me|to me|over here|robot"
    r"|buddy|love|dear|mate|cheers|nice and (?:slow|easy|steady|gentl)\w*"
    r"|if you (?:can|could|please|would|don't mind|find one|see one|wouldn't mind)|if possible"
    r"|(?:if|when) (?:you|there) (?:is|are|have) (?:one|any|some|a minute|a moment|time)"
    r"|will you|would you|can you|could you|right away|as soon as possible|as you can|as possible"
    r"|okay|ok|when you can"
    r"|in the (?:gripper|hand)|(?:with|in) your (?:gripper|hand))$"
)
# Words for what was named before: "see the mug? put the pear next to it".
_ANAPHOR = rf"there|here|{PRONOUN}"
_NOUN = re.compile(rf"\b{DETERMINER}(?P<x>[a-z][a-z' -]*?)(?:$| (?:is|are|was|looks?)\b)")
_LONGEST_NAME = 4
_STATEMENT = re.compile(r"\b(?:i|we|am|is|are|was|were|has|have|do|does|could|what|how|where)\b")
_JOINTS = re.compile(
    r"\s*(?:[,;.:!?]|\band\b|\bthen\b)\s*(?:(?:and|then|after that|afterwards)\b,?\s*)*"
)


@dataclass(frozen=True, kw_only=True)
class Instruction:
    """An instruction taken apart.

    Attributes:
        text: The instruction as it was given, without surrounding white space.
        target: Phrase that names what to pick, or the whole sentence where no rule applies; None
            where the sentence only says where to place.
        relation: One of `perception.relations.RELATIONS`, or None without a place goal.
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

    @property
    def unwanted(self) -> tuple[str, ...]:
        """What is spoken of besides the target phrase, and is something else: the reference."""
        if self.target is None or self.reference in (None, self.target):
            return ()
        return (self.reference,)

    @property
    def region(self) -> Literal["inside", "outside"] | None:
        """Where to place: in or on the reference, or around it; None without a place goal."""
        if self.relation is None:
            return None
        return "inside" if self.relation in INSIDE_RELATIONS else "outside"


def parse_instruction(text: str) -> Instruction:
    """Take an instruction apart.

    "give me the pear" -> target "pear"; "get something to eat" -> "something to eat"; "could you
    hand me that banana and drop it into the bowl" -> "banana", relation "in", reference "bowl".

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
    sentence = _without_courtesies(re.sub(r"\s+", " ", stripped.lower().replace("\u2019", "'")))
    place = _find_place(sentence)
    if place is None:
        return Instruction(text=stripped, target=_pick_target(sentence))
    before, match = place
    target = match["x"] and reduce_phrase(match["x"])
    said = _without_courtesies(match["reference"])
    reference = reduce_phrase(CLAUSE_END.split(said)[0] or said)
    named = _named(before)
    if named and re.fullmatch(_ANAPHOR, reference):
        reference = named
    else:
        target = target or named
    return Instruction(
        text=stripped,
        target=target,
        relation=canonical_relation(match["relation"]),
        reference=reference,
    )


def _find_place(sentence: str) -> tuple[str, re.Match[str]] | None:
    """Find the part that says where to place; return what stands before it, and the match."""
    whole = match_place(sentence)
    if whole is not None and whole["x"] is not None:
        return "", whole
    for joint in _JOINTS.finditer(sentence):
        match = match_place(_without_courtesies(sentence[joint.end() :]))
        if match is not None and joint.start() > 0:
            return sentence[: joint.start()], match
    alone = whole or match_place_alone(sentence)
    return None if alone is None else ("", alone)


def _without_courtesies(clause: str) -> str:
    """Return the clause without what is only polite, before and after."""
    clause, before = clause.strip(" .,;:!?"), None
    while clause != before:
        before = clause
        shorter = _AFTERTHOUGHT.sub("", _COURTESY.sub("", clause)).strip(" .,;:!?")
        clause = shorter or clause
    return clause


def _pick_target(sentence: str) -> str:
    """Return the phrase that names what to pick, or the whole sentence."""
    phrase = _picked_anywhere(sentence)
    if phrase is not None:
        return reduce_phrase(phrase)
    noun = re.sub(rf"^{DETERMINER}", "", sentence)
    if len(noun.split()) > _LONGEST_NAME or _STATEMENT.search(sentence):
        return find_need(sentence) or noun or sentence
    return reduce_phrase(noun) if noun else sentence


def _named(part: str) -> str | None:
    """Return what is named before the part that says where to place; None if nothing is.

    "Pick up the pear" and "see that pear?" name something, "great, you've got it" does not.
    """
    part = _without_courtesies(part)
    phrase = _picked_anywhere(part)
    if phrase is not None and not _is_pronoun(phrase):
        return reduce_phrase(phrase)
    if not part:
        return None
    if find_need(part) is None:
        clauses = map(_without_courtesies, reversed(split_clauses(part)))
        nouns = (_NOUN.search(clause) for clause in clauses)
        if (noun := next(filter(None, nouns), None)) is not None:
            return reduce_phrase(noun["x"])
        if re.search(rf"\b{PRONOUN}\b", part):
            return None
    return _pick_target(part)


def _picked_anywhere(sentence: str) -> str | None:
    """Return what a sentence or one of its clauses says to pick."""
    phrase = picked(sentence)
    if phrase is not None:
        return phrase
    clauses = map(_without_courtesies, split_clauses(sentence))
    phrases = (picked(clause) or asked_for(clause) for clause in clauses)
    # "Where is the mug, hand it to me": the noun counts.
    return next((p for p in phrases if p and not _is_pronoun(p)), None)


def _is_pronoun(phrase: str) -> bool:
    return re.fullmatch(PRONOUN, phrase) is not None
