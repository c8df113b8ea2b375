import pytest

from perception.relations import INSIDE_RELATIONS, OUTSIDE_RELATIONS
from sr_mj.instruction import (
    PhaseText,
    describe_reading,
    names_target,
    pick_text,
    place_text,
)


@pytest.mark.parametrize("text", ["give me the pear", "get something to eat", "a violin"])
def test_an_instruction_to_pick_stays_as_it_is(text):
    assert pick_text(text) == PhaseText(phase="pick", text=text)
    assert place_text(text) == PhaseText(phase="place", text=text)
    assert names_target(text)


@pytest.mark.parametrize(
    ("relation", "side"),
    [(r, "inside") for r in INSIDE_RELATIONS] + [(r, "outside") for r in OUTSIDE_RELATIONS],
)
@pytest.mark.parametrize("template", ["put it {} the bowl", "move the object {} the bowl"])
def test_an_instruction_to_place_names_no_target(template, relation, side):
    text = template.format(relation)
    assert not names_target(text)
    assert place_text(text) == PhaseText(
        phase="place", text=f"put it {relation} the bowl", relation=relation, side=side
    )


def test_a_combined_instruction_is_divided():
    text = "I want a strawberry, put it near the apple"
    assert names_target(text)
    assert pick_text(text) == PhaseText(
        phase="pick", text="give me the strawberry", unwanted=("apple",)
    )
    assert place_text(text) == PhaseText(
        phase="place", text="put it near the apple", relation="near", side="outside"
    )


@pytest.mark.parametrize(
    ("text", "reading"),
    [
        ("Give me the pear", "pick 'pear'"),
        ("put it up on the soap", "place it on 'soap'"),
        ("I want a strawberry, put it into the mug", "pick 'strawberry', place it in 'mug'"),
        # Not understood: all of it is looked for.
        ("the weather is nice", "pick 'weather is nice'"),
    ],
)
def test_how_an_instruction_is_read_is_told(text, reading):
    assert describe_reading(text) == reading
