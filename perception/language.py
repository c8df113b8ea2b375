"""What an instruction is about: target, relation and reference, by rules.

Three steps: courtesies go ("could you ...", "please"), the sentence is split into what to pick and
where to place, and each part is matched with patterns. The patterns cover the templates of the
evaluation protocol (those of A2, quoted as data) and the ways in which people paraphrase them; any
other wording falls back to the whole sentence, which a text encoder can still make something of.
"""

import re
from dataclasses import dataclass
from typing import Literal

from perception.errors import InvalidTextError
from perception.relations import INSIDE_RELATIONS, PHRASES, canonical_relation

_DETERMINER = r"(?:an?|the|some|this|that|these|those|my|your|our|any|one of the|one)\s+"
_ARTICLE = rf"(?:{_DETERMINER})?"
_PRONOUN = r"(?:it|this|that|them|this one|that one|(?:the|this|that) (?:object|item|thing))"
_COURTESY = re.compile(
    r"^(?:(?:hey|hi|hello|ok|okay|robot|now|so|well|first|please|kindly|just)\b[ ,]*"
    r"|(?:would you|do you) mind "
    r"|(?:could|can|would|will) you (?:please |kindly |just |maybe )*(?=\w)"
    r"|be so kind (?:as to|and) "
    r"|(?:i(?:'d| would) like|i want|i need) you to |you (?:should|have to|need to|must) "
    r"|let's |go ahead and |try to |help me (?:to )?)"
)
_AFTERTHOUGHT = re.compile(
    r"[ ,]*\b(?:please|thanks|thank you|(?:right )?now|for me|to me|over here"
    r"|if you (?:can|could|please)|will you|would you|right away)$"
)
_WISH = (
    r"(?:i|we)(?:'d| would)? (?:really )?(?:need|want|like|love|am looking for)"
    r"(?: to have| to get)?"
)
_PICK_VERB = (
    r"(?:give|hand|pass|bring|get|fetch|find|show)(?:ing)? (?:me|us)"
    r"|(?:grasp|get|grab|take|pick up|pick out|pick|lift up|lift|fetch|find|choose|select|reach for"
    r"|locate|seize|collect|hand over|pass over|look for|bring|remove|hold)"
    r"|(?:grabb|tak|pick|lift|fetch|grasp|pass|hand)ing(?: me| up| over)?"
    rf"|{_WISH}|(?:may|can|could) (?:i|we) (?:please )?have|let me have|where is|where's"
)
_PICK = re.compile(rf"(?:{_PICK_VERB})\s+{_ARTICLE}(?P<x>.+)")
# "pick the pear up", "take the pear out of the bowl": neither tail says what to look for.
_PICK_TAIL = re.compile(
    r"\s+(?:up|over|out)$|\s+(?:out of|off of|off|from)\s.+$"
    r"|\s+(?:that|which) (?:is|are|lies|stands|sits) (?:in|on|at|near|next|by|under|behind)\b.+$"
)
_PLACE_VERB = (
    r"(?:put|place|move|set|lay|drop|leave|stick|pop|position|deposit|rest|stack|release|stand"
    r"|shift|push|slide|putting|placing|moving|setting|laying|dropping|leaving)(?: down)?"
)
# "Get" and "bring" also begin instructions to pick: they need a word of direction.
_CARRY_VERB = r"(?:get|bring|take|carry|transfer|deliver|transport)"
_DIRECTION = r"into|onto|over to (?=the |an? )|to (?=the |an? )"
_FILLER = r"(?:(?:right|just|directly|somewhere|down|over|back|close by|anywhere)\s+)*"
_RELATION = rf"(?P<relation>{'|'.join(map(re.escape, PHRASES))})"
_REFERENCE = rf"{_ARTICLE}(?P<reference>.+)"
_WHAT = rf"(?:(?P<pronoun>{_PRONOUN})|{_ARTICLE}(?P<x>.+?))"
# A bare "to" begins infinitives ("something to eat"): as a relation it needs an article.
_TO_IS_PLACE = r"(?!to (?!the |an? |that |this |my ))"
_LET = rf"(?:(?:{_WISH}|let|have|make sure(?: that)?)\s+)"
_BELONGS = (
    r"(?:goes|belongs|fits|(?:should|must|has to|needs to|is to|ought to|will|to)"
    r" (?:go|be|stand|end up|sit|lie|come)(?: (?:put|placed))?)"
)
_STANDS = r"(?:is|stands|sits|stand|sit|lie|go|placed|put|set|moved)"
_PLACES = tuple(
    re.compile(pattern)
    for pattern in (
        rf"(?:{_PLACE_VERB})\s+{_WHAT}\s+{_FILLER}{_TO_IS_PLACE}{_RELATION}\s+{_REFERENCE}",
        rf"(?:{_CARRY_VERB})\s+{_WHAT}\s+{_FILLER}(?={_DIRECTION}){_RELATION}\s+{_REFERENCE}",
        # "the mug goes next to the red box", "I want the mug to be next to the red box"
        rf"{_LET}?{_WHAT}\s+{_BELONGS}\s+{_FILLER}{_TO_IS_PLACE}{_RELATION}\s+{_REFERENCE}",
        # "make sure the mug is on the box": without "make sure" this would only tell how things are
        rf"{_LET}{_WHAT}\s+{_STANDS}\s+{_FILLER}{_TO_IS_PLACE}{_RELATION}\s+{_REFERENCE}",
    )
)
_PLACE_FIRST = re.compile(
    rf"{_FILLER}{_RELATION}\s+{_ARTICLE}(?P<reference>[^,]+?),?\s+(?:(?:{_PLACE_VERB})|goes)\s+"
    rf"{_WHAT}"
)
_JOINTS = re.compile(
    r"\s*(?:[,;.:!]|\band\b|\bthen\b)\s*(?:(?:and|then|after that|afterwards)\b,?\s*)*"
)
# "And" also stands within names ("salt and pepper shaker"): a new clause has a verb.
_NEXT_CLAUSE = re.compile(
    rf"[,;.:]|\bthen\b|\band (?:{_PLACE_VERB}|{_CARRY_VERB}|{_PICK_VERB})\b"
    rf"|^(?:{_PICK_VERB})\s|\b(?:that|which)$"
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
    pick_part, match = place
    target = _pick_target(_without_courtesies(pick_part)) if pick_part else match["x"]
    if target is not None and re.fullmatch(_PRONOUN, target):
        target = None
    return Instruction(
        text=stripped,
        target=target,
        relation=canonical_relation(match["relation"]),
        reference=_without_courtesies(match["reference"]),
    )


def _find_place(sentence: str) -> tuple[str, re.Match[str]] | None:
    """Find the part that says where to place; return what stands before it, and the match."""
    whole = _match_place(sentence)
    if whole is not None and not whole["pronoun"]:
        return "", whole
    for joint in _JOINTS.finditer(sentence):
        match = _match_place(_without_courtesies(sentence[joint.end() :]))
        if match is not None and joint.start() > 0:
            # With a noun of its own the place part is complete; what stood before is a preamble.
            return ("" if match["x"] else sentence[: joint.start()]), match
    return None if whole is None else ("", whole)


def _match_place(clause: str) -> re.Match[str] | None:
    # A pattern for one clause must not reach over the next: "take it and put it in the bowl".
    for pattern in (*_PLACES, _PLACE_FIRST):
        match = pattern.fullmatch(clause)
        if match is not None and not _is_split(match["x"]):
            return match
    return None


def _is_split(phrase: str | None) -> bool:
    return phrase is not None and _NEXT_CLAUSE.search(phrase) is not None


def _without_courtesies(clause: str) -> str:
    """Return the clause without what is only polite, before and after."""
    clause, before = clause.strip(" .,;:!?"), None
    while clause != before:
        before = clause
        shorter = _AFTERTHOUGHT.sub("", _COURTESY.sub("", clause)).strip(" .,;:!?")
        clause = shorter or clause
    return clause


def _pick_target(clause: str) -> str:
    match = _PICK.fullmatch(clause)
    phrase = match["x"] if match else re.sub(rf"^{_DETERMINER}", "", clause)
    return (_PICK_TAIL.sub("", phrase) if match else phrase) or clause
