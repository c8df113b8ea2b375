"""Clauses that say where to place."""

import re

from perception.pick_wording import ARTICLE, DETERMINER, PICK_VERB, PRONOUN, WISH
from perception.relations import PHRASES

_PLACE_VERB = (
    r"(?:let go of"
    r"|(?:put|set|drop|pop|slip|fit|plop|chuck|dump|land|shov|stack|stick|stow|tuck|push|pour|park|rest"
    r"|lay|hang|toss|throw|stand|shift|nudg|eas|balanc|perch|squeez|nestl|scoot|plonk|bung|settl|prop"
    r"|position|deposit|plac|mov|leav|releas|slid|keep|arrang|locat|relocat|situat|stor|lower|load"
    r"|serv|lin|insert)(?:e|t|p)?(?:ing)?)"
    r"(?: down)?"
)
# "Get" and "bring" also begin instructions to pick: they need a word of direction.
_CARRY_VERB = r"(?:get|bring|take|carry|transfer|deliver|transport|lift|raise)"
_DIRECTION = r"into|onto|over to (?=the |an? )|to (?=the |an? )(?!(?:the|an?) (?:spot|place) )"
# How, and how far: "put it carefully up on the box", "set it a bit closer to the mug".
_ADVERBS = (
    r"right|just|directly|straight|immediately|exactly|precisely|properly|firmly|gently|carefully"
    r"|neatly|nicely|safely|softly|slowly|quickly|quietly|lightly|loosely|tightly|flat|upright"
    r"|upside down(?= (?:i|o)n)|face down|face up"
    r"|up|down|out|off|over|back|away|along|across|high|deep|well|halfway|all the way"
    r"|(?:when|once) you(?:'re| are)|(?:to|in|at) (?:an?|the) (?:free |empty )?(?:spot|place|space)"
    r"|here|there|in (?:here|there)|anywhere|some(?:where| ?place)|close by"
    r"|quite|very|really|fairly|pretty|rather|somewhat|much|a (?:bit|little|tad|touch)"
    r"|again|once more|instead|too|standing|lying|sitting|resting"
    r"|(?:and|so|as long as)(?: that)? it(?:'s| is| sits| stands| lies| rests| ends up)"
)
_FILLER = rf"(?:(?:{_ADVERBS})\s+)*"
# What may stand before the verb: "any chance you could ...", "now carefully ...".
_PREAMBLE = (
    rf"(?:(?:{_ADVERBS}|now|then|next|first|please|kindly|just|how about|what about|any chance|of"
    r"|mind|i|we|you|me|us|to|and|go|let|let's|could|can|might|may|should|would|will|want|need|like"
    r"|love|was|were|am|hoping|wondering|if|think|do|don't|why|not|that|be|so|good|kind|enough"
    r"|great|okay|nice|easy|steady)[ ,]+)*"
)
_RELATION = rf"(?P<relation>{'|'.join(map(re.escape, PHRASES))})"
_REFERENCE = rf"{ARTICLE}(?P<reference>.+)"
# No name begins with "it": further words before the relation tell how, in words not known here.
_WHAT = (
    rf"(?:(?P<pronoun>{PRONOUN}|(?:it|them)(?: [\w'-]+){{1,4}}?)"
    rf"|{ARTICLE}(?P<x>(?!(?:it|them)\b).+?))"
)
# A bare "to" begins infinitives ("something to eat"): as a relation it needs an article.
_TO_IS_PLACE = r"(?!to (?!the |an? |that |this |my ))"
_WHERE = rf"{_FILLER}{_TO_IS_PLACE}{_RELATION}\s+{_REFERENCE}"
_LET = rf"(?:(?:{WISH}|let|have|make sure(?: that)?|see to it that|i(?:'d| would) prefer)\s+)"
_BELONGS = (
    r"(?:go(?:es)?|belongs?|fits?|lives?|(?:should|must|may|can|(?:has|needs?|wants?|is|are|ought"
    r"|have) to|will|to)"
    r" (?:go|be|stand|end up|sit|lie|live|come)(?: (?:put|placed))?)"
)
_MODAL = r"(?:can|could|may|might|should|would|will|does|must)"
_STANDS = r"(?:is|stands?|sits?|rests?|lies?|end(?:s|ed)? up|go|stay|live|be|placed|put|set|moved)"
_SPOT = r"(?:an? |some |the )?(?:\w+ )?(?:spot|place|room|space|position)"
_PLACES = tuple(
    re.compile(pattern)
    for pattern in (
        # "put on the plate": of what is in the gripper
        rf"{_PREAMBLE}(?:{_PLACE_VERB})(?P<x>(?!))?,?\s+{_FILLER}{_RELATION}\s+{_REFERENCE}",
        rf"{_PREAMBLE}(?:{_PLACE_VERB})\s+{_WHAT},?\s+{_WHERE}",
        rf"(?:{_CARRY_VERB})\s+{_WHAT}\s+(?:{_FILLER}to {_STANDS}|over(?! to))\s+{_WHERE}",
        rf"(?:{_CARRY_VERB})\s+{_WHAT}\s+{_FILLER}(?={_DIRECTION}){_RELATION}\s+{_REFERENCE}",
        # "the mug goes next to the red box", "I want the mug to be next to the red box"
        rf"(?!{_MODAL} ){_LET}?{_WHAT}\s+{_BELONGS}\s+{_WHERE}",
        # "make sure the mug is on the box": without "make sure" this would only tell how things are
        rf"{_LET}{_WHAT}\s+{_STANDS}\s+{_WHERE}",
        # "should the mug go in the box", "can this be put near the mug"
        rf"{_MODAL} {_WHAT}\s+(?:(?:be )?{_STANDS}|fit"
        r"|belong"
        rf"|come)\s+{_WHERE}",
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
        rf"(?:{_CARRY_VERB}|{WISH}|have|i(?:'d| would) (?:prefer|rather have))\s+"
        rf"(?P<pronoun>{PRONOUN})(?P<x>(?!))?\s+{_WHERE}",
        rf"(?P<pronoun>its|the) (?P<x>(?!))?(?:\w+ )?(?:spot|place|position|home"
        r"|destination) (?:is|should be"
        rf"|shall be|will be)\s+{_FILLER}{_RELATION}\s+{_REFERENCE}",
        rf"{_FILLER}{_RELATION}\s+{ARTICLE}(?P<reference>[^,]+?),?\s+(?:with"
        rf" (?P<pronoun>{PRONOUN})"
        rf"|(?:(?:that's|that is|is) where )?(?:{PRONOUN}) {_BELONGS})(?P<x>(?!))?",
        rf"(?:find|choose|look for|pick|use"
        rf"|take) {_SPOT}(?P<pronoun>)(?P<x>(?!))?\s+{_FILLER}{_RELATION}"
        rf"\s+{_REFERENCE}",
    )
)
_PLACE_FIRST = re.compile(
    rf"{_FILLER}{_RELATION}\s+{ARTICLE}(?P<reference>[^,]+?),?\s+(?:(?:please|kindly|just)\s+)?"
    rf"(?:(?:{_PLACE_VERB})|goes)\s+"
    rf"{_WHAT}"
)
_PLACE_ALONE = re.compile(
    rf"{_FILLER}{_RELATION}(?P<x>(?!))?\s+{DETERMINER}(?P<reference>[^,;.:!?]+)"
)
# "And" also stands within names ("salt and pepper shaker"): a new clause has a verb.
_NEXT_CLAUSE = re.compile(
    rf"[,;.:]|\bthen\b|\band (?:{_PLACE_VERB}|{_CARRY_VERB}|{PICK_VERB})\b"
    rf"|^(?:{PICK_VERB})\s|\b(?:that|which)$"
)


def match_place(clause: str) -> re.Match[str] | None:
    """Find what a clause says of a place.

    Args:
        clause: Without what is only polite, in lower case.

    Returns:
        A match with the groups relation, reference, and x: what to place, None if a pronoun stands
        for it. None if the clause says of no place.
    """
    # A pattern for one clause must not reach over the next: "take it and put it in the bowl".
    for pattern in (*_PLACES, _PLACE_FIRST, *_PRONOUN_PLACES):
        match = pattern.fullmatch(clause)
        if match is not None and _is_named(match["reference"]) and not _is_split(match["x"]):
            return match
    return None


def match_place_alone(sentence: str) -> re.Match[str] | None:
    """Find a place in a sentence that says nothing else, as `match_place` does: "in the bowl"."""
    return _PLACE_ALONE.fullmatch(sentence)


def _is_named(reference: str) -> bool:
    return re.search(r"\w", reference) is not None


def _is_split(phrase: str | None) -> bool:
    return phrase is not None and _NEXT_CLAUSE.search(phrase) is not None
