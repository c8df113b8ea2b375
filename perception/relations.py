"""The relations of place goals: those of the evaluation protocol, and other words for them."""

INSIDE_RELATIONS = ("on top of", "upside", "on", "in", "to")
OUTSIDE_RELATIONS = ("surrounding to", "close to", "next to", "beside", "around", "near")
# The longest goes first, or "on" would be found in "on top of".
RELATIONS = tuple(sorted((*INSIDE_RELATIONS, *OUTSIDE_RELATIONS), key=len, reverse=True))

# The protocol knows no directions: left of, right of, behind and in front of mean "next to".
_SYNONYMS = {
    "on top of": ("atop", "on the top of", "to the top of", "on top"),
    "on": ("onto", "upon", "on to"),
    "in": ("into", "inside of", "inside", "within", "in to", "to the inside of",
           "on the inside of"),
    "to": ("over to", "towards", "toward"),
    "surrounding to": ("surrounding",),
    "close to": ("close by", "not far from", "not too far from", "closely to", "closer to",
                 "in close proximity to", "in proximity to", "as close as possible to",
                 "as close as you can to", "as near as possible to", "as close to", "as near to"),
    "next to": (
        "adjacent to", "by the side of", "at the side of", "on the side of", "to the side of",
        "to the left of", "to the right of", "on the left of", "on the right of", "left of",
        "right of", "behind", "in front of", "against",
    ),
    "beside": ("besides", "alongside", "along side", "side by side with"),
    "around": ("round", "round about", "somewhere around"),
    "near": ("nearby to", "nearby", "near to", "nearer to", "nearer", "in the vicinity of",
             "in the neighbourhood of", "in the neighborhood of", "neighbouring",
             "neighboring", "within reach of",
             "within a few centimetres of", "within a few centimeters of", "by", "at"),
}  # fmt: skip
_CANONICAL = {phrase: name for name, phrases in _SYNONYMS.items() for phrase in phrases}
_CANONICAL |= {name: name for name in RELATIONS}

PHRASES = tuple(sorted(_CANONICAL, key=len, reverse=True))


def canonical_relation(phrase: str) -> str:
    """Return the protocol's word for a relation.

    Args:
        phrase: One of `PHRASES`, such as "onto".

    Returns:
        One of `RELATIONS`, such as "on".
    """
    return _CANONICAL[phrase]
