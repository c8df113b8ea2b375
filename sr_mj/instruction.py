"""One sentence, two phases: what to say while picking, and what while placing."""

from dataclasses import dataclass

from perception.language import parse_instruction
from policy.actions import ActionKind
from policy.observation import PlaceSide


@dataclass(frozen=True, kw_only=True)
class PhaseText:
    """What an instruction says about one phase.

    Attributes:
        phase: Pick or place.
        text: The instruction's part for this phase.
        relation: One of `perception.relations.RELATIONS`; None for picking, or where the
            instruction was not understood.
        side: Whether the relation asks for a place in or on the reference, or around it.
        unwanted: What the instruction names for the other phase: not what to look for in this one.
    """

    phase: ActionKind
    text: str
    relation: str | None = None
    side: PlaceSide | None = None
    unwanted: tuple[str, ...] = ()


def names_target(text: str) -> bool:
    """Tell whether an instruction says what to pick; "put it near the bowl" does not."""
    return parse_instruction(text).target is not None


def describe_reading(text: str) -> str:
    """Tell how an instruction is read: "pick 'apple', place it near 'bowl'".

    Args:
        text: The instruction.

    Returns:
        What is looked for, in one line.
    """
    instruction = parse_instruction(text)
    parts = []
    if instruction.target is not None:
        parts.append(f"pick {instruction.target!r}")
    if instruction.relation is not None:
        parts.append(f"place it {instruction.relation} {instruction.reference!r}")
    return ", ".join(parts)


def pick_text(text: str) -> PhaseText:
    """Return the part of an instruction that says what to pick.

    Args:
        text: The instruction.

    Returns:
        The instruction itself, unless it also says where to place: then only what comes before,
        in a template's wording, since the place part names another object. That one is unwanted:
        who picks it has nothing left to place by.
    """
    instruction = parse_instruction(text)
    if instruction.relation is None or instruction.target is None:
        return PhaseText(phase="pick", text=text)
    return PhaseText(
        phase="pick", text=f"give me the {instruction.target}", unwanted=instruction.unwanted
    )


def place_text(text: str) -> PhaseText:
    """Return the part of an instruction that says where to place.

    Args:
        text: The instruction.

    Returns:
        That part, in a template's wording; the whole instruction where no relation is found.
    """
    instruction = parse_instruction(text)
    if instruction.relation is None:
        return PhaseText(phase="place", text=text)
    return PhaseText(
        phase="place",
        text=f"put it {instruction.relation} the {instruction.reference}",
        relation=instruction.relation,
        side=instruction.region,
    )
