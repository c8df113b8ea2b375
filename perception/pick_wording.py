"""Clauses that say what to pick."""

import re

from perception.free_wording import is_noun

DETERMINER = (
    r"(?:an?|the|some|this|that|these|those|my|your|our|any|one of (?:the|these|those|my|your)|one)"
    r"\s+"
)
ARTICLE = rf"(?:{DETERMINER})?"
_HELD = (
    r"(?:you(?:'re| are) holding|you (?:have|hold|got)"
    r"|(?:is |are )?in (?:your|the) (?:hand|gripper))"
)
PRONOUN = (
    r"(?:it|this|that|them|they|him|her|this one|that one"
    rf"|(?:the|this|that|your) (?:object|item|thing)(?: {_HELD})?"
    rf"|what(?:ever)? {_HELD}|what's in your (?:hand|gripper))"
)
WISH = (
    r"(?:i|we)(?:'d| would)? (?:really )?(?:need|want|like|love|am looking for)"
    r"(?: to have| to get)?"
)
PICK_VERB = (
    r"(?:giv|hand|pass|bring|gett|fetch|find|show|throw|toss|slid|pick|grab|dig|lend|offer|select"
    r"|choos|buy|tak|reach|retriev|give|slide|get|take|choose|retrieve)(?:ing)?(?: out| up| over)?"
    r" (?:me|us)"
    r"|(?:(?:get|take|catch) (?:a )?hold of|grasp|get|grab|take|pick up|pick out|pick|lift up|lift"
    r"|fetch|find|choose|select|reach for"
    r"|locate|seize|collect|hand over|pass over|hand|pass|look for|search for|look around for|bring"
    r"|remove|hold|give|show|deliver|retrieve|spot|identify|point (?:me )?(?:to|at|out)|go for"
    r"|track down|hunt for|dig out|see|grip|catch|clutch|touch|raise|snatch)"
    r"|(?:grabb|tak|pick|lift|fetch|grasp|pass|hand|gett|find|bring|giv|look|search)ing(?: me| up"
    r"| over| for| out)?"
    rf"|{WISH}|(?:may|can|could|might) (?:i|we) (?:please )?(?:have|get|borrow|see)"
    r"|let me (?:have|see)"
    r"|where(?:'s| is| are| did (?:you|i|we) put| can i find| would i find| do (?:we|you) keep)"
)
_PICK = re.compile(rf"(?:{PICK_VERB})\s+{ARTICLE}(?P<x>.+)")
# "pick the pear up", "take the pear out of the bowl": neither tail says what to look for.
_PICK_TAIL = re.compile(
    r"\s+(?:up|over|out)$|\s+(?:out of|off of|off|from)\s.+$"
    r"|\s+(?:that|which) (?:is|are|lies|stands|sits) (?:in|on|at|near|next|by|under|behind)\b.+$"
)
CLAUSE_END = re.compile(r"\s*(?:[,;.:!?]|\b(?:because|since|as i|so that|so i)\b)")


def picked(clause: str) -> str | None:
    """Return the phrase that names what to pick, or None if the clause says nothing of the kind."""
    match = _PICK.fullmatch(clause)
    if match is None or not is_noun(match["x"]):
        return None
    return _PICK_TAIL.sub("", CLAUSE_END.split(match["x"])[0]) or None
