"""Phrases to look for in what people say freely: noun phrases and needs, by rules.

`perception.language` finds the clause that says what to pick. Here such a clause is reduced to
what a picture can show: carriers go ("is there any ... on this table"), needs become the evaluation
protocol's words for them ("I am thirsty" -> "something to drink"), and empty nouns become "object".
"""

import re

# The protocol asks for functions in these words, and encoders know them best.
_FUNCTION = "something to {}"
_NEEDS = tuple(
    (re.compile(pattern), _FUNCTION.format(function))
    for pattern, function in (
        (
            r"\b(?:clean(?:s|ed|ing|er|ers)?|wash(?:ing|es|ed)?|wip(?:e|es|ing)|scrub(?:bing)?"
            r"|dirty|filthy|stains?|spill(?:ed|s)?|spilt|hygien\w+|sticky|rinse|shower|lather)\b",
            "clean",
        ),
        (
            r"\b(?:hold(?:s|ing)?|stor(?:e|es|ing|age)|contain(?:s|ing)?|keep|kept|carry|pour"
            r"|collect)\b|\b(?:put|place|drop|throw|lay|fit)(?:ting|s)?\b.*\b(?:in|into|inside)\b"
            r"|\broom for\b|\bfill(?:ed)?\b",
            "hold other things",
        ),
        (
            r"\b(?:play(?:s|ed|ing)?|fun|bored|boring|boredom|entertain\w*|amus\w+"
            r"|(?:kids?|child|children|toddlers?|baby)\b(?!.*\beat))\b",
            "play",
        ),
        (
            r"\b(?:drink(?:s|ing|able)?|thirst\w*|sip(?:ping)?|beverages?|parched|dehydrated)\b",
            "drink",
        ),
        (
            r"\b(?:eat(?:s|ing|able)?|edible|hung(?:ry|er)|starv\w+|famished|peckish|appetite|snack"
            r"|food|bite|nibble|munch|chew|stomach|breakfast|lunch|dinner|supper|meal)\b",
            "eat",
        ),
    )
)
_GENERIC = {
    "food": "eat", "foods": "eat", "snack": "eat", "snacks": "eat", "meal": "eat", "bite": "eat",
    "bite to eat": "eat", "treat": "eat", "food item": "eat", "eatables": "eat",
    "drink": "drink", "drinks": "drink", "beverage": "drink", "beverages": "drink",
    "refreshment": "drink", "sip": "drink", "plaything": "play", "playthings": "play",
    "cleaner": "clean", "cleaning product": "clean", "cleaning supplies": "clean",
    "cleaning agent": "clean", "cleaning item": "clean", "hygiene product": "clean",
}  # fmt: skip

_DETERMINER = (
    r"(?:an?|the|some|any|this|that|these|those|my|your|our|one of (?:the|these|those|your|my)"
    r"|any of (?:the|these|those)|one|another|whichever|(?:kind|sort|type) of|(?:piece|bit) of)\s+"
)
_LEADING = re.compile(rf"^(?:{_DETERMINER})+")
_INDEFINITE = re.compile(
    r"^(?:something|anything|some ?thing|any ?thing|whatever|what|somewhere|things?|objects?|items?"
    r"|stuff|ones?)\b\s*(?:else\b\s*)?(?P<rest>.*)$"
)
_EMPTY_NOUN = re.compile(r"\s+(?:things?|objects?|items?|stuff|ones?|articles?|pieces?)$")
_ATTRIBUTE = re.compile(
    r"^(?:(?:that|which)(?: is|'s| are| looks?| seems?| has| comes)?|is|looks?|in|of|with"
    r"|it is)*\s*"
    r"(?:(?:in|of|with)\s+)?(?:an?\s+|the\s+)?(?:colou?red\s+)?(?P<what>[a-z][a-z -]*?)"
    r"(?:[ -](?:colou?r(?:ed)?|shaped?|in (?:colou?r|shape|form)|look))?$"
)
_IS_LIKE = re.compile(r"\b(?:that|which) (?:is|looks) (?P<what>[a-z]+)$")
# "A sponge to clean with": the noun alone says what to look for.
_PURPOSE = re.compile(
    r"\s+(?:(?:that|which|so|so that)\s+)?(?:i|we|you|one|someone|somebody|people) (?:can|could"
    r"|may|"
    r"might|will|want|need|would|use|like)\b.*$|\s+to [a-z]+\b.*$|\s+for (?:me|us|my|him|her"
    r"|them)\b.*$"
    r"|\s+(?:for|with) (?:which|[a-z]+ing)\b.*$|\s+with me$"
)
_PLACES = (
    r"(?:table(?:top)?|desk|scene|workspace|worktop|surface|pile|heap|clutter|mess|bunch|lot|tray"
    r"|collection|group|selection|set|things|objects|items|stuff|ones|counter|picture|view|room)"
)
_HERE = re.compile(
    r"[ ,]+(?:(?:that|which) (?:is|are|lies?|sits?|stands?) |lying |sitting |standing |there )?"
    rf"(?:(?:on|in|from|of|off|at|among|amongst|between) (?:the|this|that|these|those|your|my|our)"
    rf"(?: \w+)? {_PLACES}|in front of (?:you|me|us)|(?:with)?in (?:my |your )?(?:reach|sight|view)"
    r"|(?:around |over |right |up |down |out )?(?:here|there)|around|nearby|anywhere|somewhere"
    r"|(?:that |which )?(?:you|we|i) (?:can )?(?:see|find|have|spot|got)(?: here| there)?"
    r"|at hand|available|left|next|first|again|quickly|instead|at all|today|already|of yours)$"
)
_CONDITION = re.compile(
    r"[ ,]+(?:because|since|as i|so that i|so i|if|when|while|before|after|but|otherwise)\b.*$"
)

_BE = r"(?:is|are|'s|'re|was|were)"
_CARRIERS = tuple(
    re.compile(pattern)
    for pattern in (
        rf"(?:{_BE} there|{_BE} any of (?:these|those|the [a-z]+))\s+(?P<x>.+)",
        r"(?:do|did|have|has|can|could|would|will) (?:you|we|i) (?:happen to )?(?:have|got|see"
        r"|find|spot"
        r"|know where|notice|by any chance have|offer|get)\s+(?:me\s+)?(?P<x>.+)",
        rf"(?:(?:i|we) )?(?:wonder|ask|ask myself|am wondering|'m wondering|was wondering|tell me"
        rf"|do you know|check|see)? ?(?:if|whether|where)\s+(?:there {_BE}|{_BE}|you have|we have"
        r"|i (?:can|could|might) (?:find|get|have)|did (?:you|i) (?:put|leave))?\s*(?P<x>.+?)"
        rf"(?: {_BE}| went| has gone| could be)?",
        rf"which (?:one |object |thing |item )?(?:of (?:these|those|them|the)(?: [a-z]+)? )?{_BE}"
        r"\s+(?P<x>.+)",
        r"(?:got|how about|what about|time for|it's time for|it is time for|maybe|perhaps|ideally"
        r"|any"
        r" (?:chance|hope) (?:of|for|to (?:get|have)|i (?:can|could) (?:get|have)))\s+(?P<x>.+)",
        r"(?:i|we)(?:'m| am|'re| are) (?:\w+ly |just |now )?(?:after|looking for|searching for"
        r"|missing"
        r"|craving|in need of|in search of|short of|in the mood for|dying for|hoping for"
        r"|interested in|longing for)\s+(?P<x>.+)",
        r"(?:i|we)(?:'d|'ll)? ?(?:\w+ly |just |now |also )?(?:could|can|would|might|should|must"
        r"|will|have to"
        r"|do)? ?(?:\w+ly |just )?(?:use|do with|go for|take|feel like|fancy|crave|require|prefer"
        r"|miss"
        r"|wish for|wish i had|be happy with|be glad (?:of|about)|appreciate|desire|lost|choose"
        r"|love"
        r"|like|need|want)\s+(?:to (?:have|get|hold|grab|see|use|be (?:given|handed"
        r"|shown))\s+)?(?P<x>.+)",
        r"(?:what|all|the (?:thing|object|item|one)(?: that)?) (?:i|we)(?:'d"
        r"| would)? ?(?:\w+ly )?(?:need|want"
        r"|like|am after|are after|'m after|asked for)(?: now| next)? (?:is|would be)\s+(?P<x>.+)",
        r"(?P<x>.+?)(?:,? that)? (?:would|will|could) (?:be|come in|do|help|suit)\b.*",
        r"(?P<x>.+?) (?:is|are) (?:what (?:i|we) (?:need|want|am after|'m after|would like)\b.*"
        r"|needed"
        r"|wanted|required|next|missing|what .+)",
        r"(?:the |your )?(?:next |first |last )?(?:target|goal|object|item|choice|task"
        r"|wish)(?: now)? (?:is|:)"
        r"\s+(?P<x>.+)",
    )
)
_CLAUSE_START = re.compile(
    r"(?:to|i|we|you|he|she|they|it is|it was|if|that (?:i|we|you)"
    r"|(?:is|are|am|do|does|can|could|would|will|should|may) (?:i|we|you|it|this|that|there|the))\b"
)
_CLAUSES = re.compile(r"\s*(?:[,;.:!?]|\s-+\s|\bso\b(?! that)|\bbut\b|\band\b|\bthen\b)\s*")


def split_clauses(sentence: str) -> list[str]:
    """Split a sentence where one clause ends and another may begin.

    Args:
        sentence: In lower case.

    Returns:
        The clauses in their order, without empty ones.
    """
    return [clause for clause in _CLAUSES.split(sentence) if clause]


def asked_for(clause: str) -> str | None:
    """Find the noun phrase in a question or a wish: "is there any food here" -> "any food here".

    Args:
        clause: One clause in lower case, without courtesies.

    Returns:
        The noun phrase as it stands there; None if no rule fits.
    """
    for carrier in _CARRIERS:
        match = carrier.fullmatch(clause)
        if match is not None and is_noun(match["x"]):
            return match["x"]
    return None


def is_noun(phrase: str) -> bool:
    """Tell whether a phrase may name a thing: "to scrub the floor" and "could i" do not.

    Args:
        phrase: In lower case.

    Returns:
        Whether it does not begin like a clause.
    """
    return _CLAUSE_START.match(phrase) is None


def find_need(text: str) -> str | None:
    """Find a need in words that name no object: "i am hungry" -> "something to eat".

    Args:
        text: In lower case.

    Returns:
        The protocol's phrase for what helps, or None.
    """
    for pattern, phrase in _NEEDS:
        if pattern.search(text):
            return phrase
    return None


def reduce_phrase(phrase: str) -> str:
    """Reduce a noun phrase to what a picture can show.

    "any food on this table" -> "something to eat"; "something that looks round" -> "round object";
    "sponge i can clean with" -> "sponge".

    Args:
        phrase: In lower case.

    Returns:
        The shorter phrase; never empty.
    """
    noun = _trimmed(phrase)
    indefinite = _INDEFINITE.match(noun)
    if indefinite is not None:
        return _reduce_indefinite(noun, indefinite["rest"])
    noun = _PURPOSE.sub("", noun) or noun
    if noun in _GENERIC:
        return _FUNCTION.format(_GENERIC[noun])
    like = _IS_LIKE.search(noun)
    if like is not None:
        noun = f"{like['what']} {noun[: like.start()].strip()}"
    short = _EMPTY_NOUN.sub("", noun)
    if short != noun and short:
        short = re.sub(r"[ -](?:colou?red|shaped)$", "", short)
        return f"{short} object"
    return noun


def _trimmed(phrase: str) -> str:
    """Return the phrase without determiners, and without tails that say nothing of the object."""
    phrase = _CONDITION.sub("", phrase).strip(" ,") or phrase
    before = None
    while phrase != before:
        before = phrase
        phrase = _HERE.sub("", phrase).strip(" ,") or phrase
    return _LEADING.sub("", phrase) or phrase


def _reduce_indefinite(noun: str, rest: str) -> str:
    """Reduce "something ...": a function, or how it looks."""
    need = find_need(rest)
    if need is not None:
        return need
    attribute = _ATTRIBUTE.fullmatch(rest)
    if attribute is not None and len(attribute["what"].split()) <= 2:
        return f"{_EMPTY_NOUN.sub('', attribute['what'])} object"
    return noun
