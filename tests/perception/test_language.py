import pytest

from perception.errors import InvalidTextError
from perception.language import RELATIONS, parse_instruction


@pytest.mark.parametrize(
    ("text", "target"),
    [
        ("give me the pear", "pear"),
        ("Give me the tomato soup can.", "tomato soup can"),
        ("I need a fruit", "fruit"),
        ("I need an apple", "apple"),
        ("grasp a round object", "round object"),
        ("I want a yellow object", "yellow object"),
        ("get something to eat", "something to eat"),
        ("get something to hold other things", "something to hold other things"),
        ("I want some sugar", "sugar"),
        # Free wording falls back to the whole sentence.
        ("Could you hand over that thing?", "could you hand over that thing"),
        ("pear", "pear"),
        ("the apple, please", "the apple, please"),
    ],
)
def test_pick_templates(text: str, target: str) -> None:
    instruction = parse_instruction(text)
    assert (instruction.target, instruction.relation, instruction.reference) == (target, None, None)
    assert instruction.target_phrase == target


@pytest.mark.parametrize("relation", RELATIONS)
@pytest.mark.parametrize("template", ["put it {} the", "place this {} the", "move the object {} a"])
def test_place_templates(template: str, relation: str) -> None:
    instruction = parse_instruction(f"{template.format(relation)} red bowl")
    assert (instruction.target, instruction.relation, instruction.reference) == (
        None,
        relation,
        "red bowl",
    )
    assert instruction.target_phrase == "red bowl"


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("I want a strawberry, put it near the apple", ("strawberry", "near", "apple")),
        ("give me the cup, move the object next to the box", ("cup", "next to", "box")),
        ("get something to eat, place this on top of the plate",
         ("something to eat", "on top of", "plate")),
        ("grasp a round object, and put it in the red mug", ("round object", "in", "red mug")),
        ("put the lemon near the flat screwdriver", ("lemon", "near", "flat screwdriver")),
    ],
)  # fmt: skip
def test_combined_templates(text: str, parts: tuple[str, str, str]) -> None:
    instruction = parse_instruction(text)
    assert (instruction.target, instruction.relation, instruction.reference) == parts
    assert instruction.target_phrase == parts[0]


@pytest.mark.parametrize("text", ["", "   ", "?!", "\n"])
def test_empty_instructions(text: str) -> None:
    with pytest.raises(InvalidTextError) as caught:
        parse_instruction(text)
    assert str(caught.value) == f"Empty instruction {text!r}: expected at least one word."
