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
    is_noun,
    reduce_phrase,
    split_clauses,
)
from perception.relations import INSIDE_RELATIONS, PHRASES, canonical_relation

_DETERMINER = (
    r"(?:an?|the|some|this|that|these|those|my|your|our|any|one of (?:the|these|those|my|your)|one)"
    r"\s+"
)
_ARTICLE = rf"(?:{_DETERMINER})?"
_PRONOUN = r"(?:it|this|that|them|this one|that one|(?:the|this|that) (?:object|item|thing))"
_COURTESY = re.compile(
    r"^(?:(?:hey|hi|hello|ok|okay|(?:dear )?robot|now|so|well|first|next(?! to)|then|and|please"
    r"|kindly|just"
    r"|excuse me|sorry|good (?:morning|evening|day)|if possible|quick(?:ly)?|maybe|perhaps)\b[ ,]*"
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
    r"|let's |let us |go ahead and |go and |go |try to |feel free to |start by |make sure to "
    r"|help me (?:to )?|do me a favou?r and )"
)
_AFTERTHOUGHT = re.compile(
    r"[ ,]*\b(?:please|thanks|thank you|thanks a lot|(?:right )?now|for me|to me|over here|robot"
    r"|buddy"
    r"|if you (?:can|could|please|would|don't mind|find one|see one|wouldn't mind)|if possible"
    r"|(?:if|when) (?:you|there) (?:is|are|have) (?:one|any|some|a minute|a moment|time)"
    r"|will you|would you|can you|could you|right away|as soon as possible|okay|ok|when you can"
    r"|in the (?:gripper|hand)|(?:with|in) your (?:gripper|hand))$"
)
_WISH = (
    r"(?:i|we)(?:'d| would)? (?:really )?(?:need|want|like|love|am looking for)"
    r"(?: to have| to get)?"
)
_PICK_VERB = (
    r"(?:giv|hand|pass|bring|gett|fetch|find|show|throw|toss|slid|pick|grab|dig|lend|offer|select"
    r"|choos|buy|tak|reach|retriev|give|slide|get|take|choose|retrieve)(?:ing)?(?: out| up| over)?"
    r" (?:me|us)"
    r"|(?:get (?:a )?hold of|grasp|get|grab|take|pick up|pick out|pick|lift up|lift|fetch|find"
    r"|choose|select|reach for"
    r"|locate|seize|collect|hand over|pass over|hand|pass|look for|search for|look around for|bring"
    r"|remove|hold|give|show|deliver|retrieve|spot|identify|point (?:me )?(?:to|at|out)|go for"
    r"|track down|hunt for|dig out|see|grip|catch|clutch|touch|raise|snatch)"
    r"|(?:grabb|tak|pick|lift|fetch|grasp|pass|hand|gett|find|bring|giv|look|search)ing(?: me| up"
    r"| over| for| out)?"
    rf"|{_WISH}|(?:may|can|could|might) (?:i|we) (?:please )?(?:have|get|borrow|see)"
    r"|let me (?:have|see)"
    r"|where(?:'s| is| are| did (?:you|i|we) put| can i find| would i find| do (?:we|you) keep)"
)
_PICK = re.compile(rf"(?:{_PICK_VERB})\s+{_ARTICLE}(?P<x>.+)")
# "pick the pear up", "take the pear out of the bowl": neither tail says what to look for.
_PICK_TAIL = re.compile(
    r"\s+(?:up|over|out)$|\s+(?:out of|off of|off|from)\s.+$"
    r"|\s+(?:that|which) (?:is|are|lies|stands|sits) (?:in|on|at|near|next|by|under|behind)\b.+$"
)
_CLAUSE_END = re.compile(r"\s*(?:[,;.:!?]|\b(?:because|since|as i|so that|so i)\b)")
_LONGEST_NAME = 4
_STATEMENT = re.compile(r"\b(?:i|we|am|is|are|was|were|has|have|do|does|could|what|how|where)\b")
_PLACE_VERB = (
    r"(?:put|place|move|set|lay|drop|leave|stick|pop|position|deposit|rest|stack|release|stand"
    r"|shift|push|slide|keep|park|toss|throw|slip|tuck|plop|arrange|locate|relocate|situate|store"
    r"|lower"
    r"|let go of|pour|fit|hang|line up|keeping|putting|placing|moving|setting|laying|dropping"
    r"|leaving)"
    r"(?: down)?"
)
# "Get" and "bring" also begin instructions to pick: they need a word of direction.
_CARRY_VERB = r"(?:get|bring|take|carry|transfer|deliver|transport)"
_DIRECTION = r"into|onto|over to (?=the |an? )|to (?=the |an? )"
_FILLER = (
    r"(?:(?:right|just|directly|somewhere|down|over|back|close by|anywhere|immediately|straight"
    r"|there"
    r"|gently|carefully|neatly|safely|away|so (?:that )?it (?:is|sits|stands|lies|rests"
    r"|ends up))\s+)*"
)
_RELATION = rf"(?P<relation>{'|'.join(map(re.escape, PHRASES))})"
_REFERENCE = rf"{_ARTICLE}(?P<reference>.+)"
_WHAT = rf"(?:(?P<pronoun>{_PRONOUN})|{_ARTICLE}(?P<x>.+?))"
# A bare "to" begins infinitives ("something to eat"): as a relation it needs an article.
_TO_IS_PLACE = r"(?!to (?!the |an? |that |this |my ))"
_LET = rf"(?:(?:{_WISH}|let|have|make sure(?: that)?|see to it that|i(?:'d| would) prefer)\s+)"
_BELONGS = (
    r"(?:goes|belongs|fits|(?:should|must|has to|needs to|is to|ought to|will|to)"
    r" (?:go|be|stand|end up|sit|lie|come)(?: (?:put|placed))?)"
)
_STANDS = (
    r"(?:is|stands|sits|rests|lies|ends up|stand|sit|lie|go|rest|stay|live|be|end up|placed|put|set"
    r"|moved)"
)
_SPOT = r"(?:an? |some |the )?(?:\w+ )?(?:spot|place|room|space|position)"
_PLACES = tuple(
    re.compile(pattern)
    for pattern in (
        rf"(?:{_PLACE_VERB})\s+{_WHAT}\s+{_FILLER}{_TO_IS_PLACE}{_RELATION}\s+{_REFERENCE}",
        rf"(?:{_CARRY_VERB})\s+{_WHAT}\s+{_FILLER}(?={_DIRECTION}){_RELATION}\s+{_REFERENCE}",
        # "the mug goes next to the red box", "I want the mug to be next to the red box"
        rf"{_LET}?{_WHAT}\s+{_BELONGS}\s+{_FILLER}{_TO_IS_PLACE}{_RELATION}\s+{_REFERENCE}",
        # "make sure the mug is on the box": without "make sure" this would only tell how things are
        rf"{_LET}{_WHAT}\s+{_STANDS}\s+{_FILLER}{_TO_IS_PLACE}{_RELATION}\s+{_REFERENCE}",
        # "should the mug go in the box", "can this be put near the mug"
        rf"(?:can|could|may|might|should|would|will|does|must) {_WHAT}\s+(?:(?:be )?{_STANDS}|fit"
        r"|belong"
        rf"|come)\s+{_FILLER}{_TO_IS_PLACE}{_RELATION}\s+{_REFERENCE}",
        # "find a free spot for it near the apple", "the place for the mug is next to the box"
        rf"(?:(?:find|choose|look for|pick|make|use|take"
        rf"|clear) )?{_SPOT} for {_WHAT}\s+(?:is )?{_FILLER}"
        rf"{_RELATION}\s+{_REFERENCE}",
    )
)
# Only with a pronoun: "bring the mug next to the box" says which mug to bring.
_PRONOUN_PLACES = tuple(
    re.compile(pattern)
    for pattern in (
        rf"(?:{_CARRY_VERB}|{_WISH}|have|i(?:'d| would) (?:prefer|rather have))\s+"
        rf"(?P<pronoun>{_PRONOUN})(?P<x>(?!))?\s+{_FILLER}{_TO_IS_PLACE}{_RELATION}\s+{_REFERENCE}",
        rf"(?P<pronoun>its|the) (?P<x>(?!))?(?:\w+ )?(?:spot|place|position|home"
        r"|destination) (?:is|should be"
        rf"|shall be|will be)\s+{_FILLER}{_RELATION}\s+{_REFERENCE}",
        rf"{_FILLER}{_RELATION}\s+{_ARTICLE}(?P<reference>[^,]+?),?\s+(?:with"
        rf" (?P<pronoun>{_PRONOUN})"
        rf"|(?:{_PRONOUN}) (?:goes|should go|must go|belongs))(?P<x>(?!))?",
        rf"(?:find|choose|look for|pick|use"
        rf"|take) {_SPOT}(?P<pronoun>)(?P<x>(?!))?\s+{_FILLER}{_RELATION}"
        rf"\s+{_REFERENCE}",
    )
)
_PLACE_FIRST = re.compile(
    rf"{_FILLER}{_RELATION}\s+{_ARTICLE}(?P<reference>[^,]+?),?\s+(?:(?:{_PLACE_VERB})|goes)\s+"
    rf"{_WHAT}"
)
_JOINTS = re.compile(
    r"\s*(?:[,;.:!?]|\band\b|\bthen\b)\s*(?:(?:and|then|after that|afterwards)\b,?\s*)*"
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
    pick_part, match = place
    target = _place_target(match) if not pick_part else _pick_target(_without_courtesies(pick_part))
    if target is not None and re.fullmatch(_PRONOUN, target):
        target = None
    return Instruction(
        text=stripped,
        target=target,
        relation=canonical_relation(match["relation"]),
        reference=reduce_phrase(_without_courtesies(match["reference"])),
    )


def _place_target(match: re.Match[str]) -> str | None:
    return None if match["x"] is None else reduce_phrase(match["x"])


def _find_place(sentence: str) -> tuple[str, re.Match[str]] | None:
    """Find the part that says where to place; return what stands before it, and the match."""
    whole = _match_place(sentence)
    if whole is not None and whole["x"] is not None:
        return "", whole
    for joint in _JOINTS.finditer(sentence):
        match = _match_place(_without_courtesies(sentence[joint.end() :]))
        if match is not None and joint.start() > 0:
            # With a noun of its own the place part is complete; what stood before is a preamble.
            return ("" if match["x"] else sentence[: joint.start()]), match
    return None if whole is None else ("", whole)


def _match_place(clause: str) -> re.Match[str] | None:
    # A pattern for one clause must not reach over the next: "take it and put it in the bowl".
    for pattern in (*_PLACES, _PLACE_FIRST, *_PRONOUN_PLACES):
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


def _pick_target(sentence: str) -> str:
    """Return the phrase that names what to pick, or the whole sentence."""
    phrase = _picked(sentence)
    if phrase is None:
        clauses = map(_without_courtesies, split_clauses(sentence))
        phrases = (_picked(clause) or asked_for(clause) for clause in clauses)
        # "Where is the mug, hand it to me": the noun counts.
        phrase = next((p for p in phrases if p and not re.fullmatch(_PRONOUN, p)), None)
    if phrase is not None:
        return reduce_phrase(phrase)
    noun = re.sub(rf"^{_DETERMINER}", "", sentence)
    if len(noun.split()) > _LONGEST_NAME or _STATEMENT.search(sentence):
        return find_need(sentence) or noun or sentence
    return reduce_phrase(noun) if noun else sentence


def _picked(clause: str) -> str | None:
    match = _PICK.fullmatch(clause)
    if match is None or not is_noun(match["x"]):
        return None
    return _PICK_TAIL.sub("", _CLAUSE_END.split(match["x"])[0])
