import json
import re
from pathlib import Path

import numpy as np
import pytest

from perception.errors import InvalidTextError
from perception.language import parse_instruction
from perception.relations import INSIDE_RELATIONS, PHRASES, RELATIONS, canonical_relation


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
        # Paraphrases.
        ("Could you hand over that banana?", "banana"),
        ("would you mind passing me the scissors?", "scissors"),
        ("May I have the pear, please", "pear"),
        ("pick the strawberry up", "strawberry"),
        ("take the lemon out of the bowl", "lemon"),
        ("give me the pear that is in the bowl", "pear"),
        ("bring the mug to me", "mug"),
        ("give me the scissors right now please", "scissors"),
        ("where is the power drill", "power drill"),
        ("I'd like the salt and pepper shaker", "salt and pepper shaker"),
        ("bring me something to eat, thanks!", "something to eat"),
        ("get something that is red", "red object"),
        ("give me the can on the table", "can"),  # everything is
        ("the apple, please", "apple"),
        ("pear", "pear"),
        ("place mat", "place mat"),
        ("the chess set on the box", "chess set on the box"),
        ("I am hungry.", "something to eat"),
        # Anything else falls back to the whole sentence.
        ("the weather is nice", "weather is nice"),
        ("by the way, give me the mug", "mug"),
        ("put it", "put it"),
    ],
)
def test_pick_wordings(text: str, target: str) -> None:
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


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("put the strawberry by the apple", ("strawberry", "near", "apple")),
        ("could you hand me that banana and drop it in the bowl", ("banana", "in", "bowl")),
        ("the mug goes next to the red box", ("mug", "next to", "red box")),
        ("the strawberry should go in the red mug", ("strawberry", "in", "red mug")),
        ("I want the mug to be next to the red box", ("mug", "next to", "red box")),
        ("I'd like the soap placed on top of the box", ("soap", "on top of", "box")),
        ("make sure the mug is near the box", ("mug", "near", "box")),
        ("next to the box, put the mug", ("mug", "next to", "box")),
        ("would you mind placing the mug on the box?", ("mug", "on", "box")),
        ("Please pick up the lemon, then place it beside the mug.", ("lemon", "beside", "mug")),
        ("Fetch me the tape. Leave it to the left of the scissors.", ("tape", "next to", "scissors")),
        ("grab something to drink and set it down near the plate please",
         ("something to drink", "near", "plate")),
        ("put something to drink near the apple", ("something to drink", "near", "apple")),
        ("get the banana into the bowl", ("banana", "in", "bowl")),
        ("Can you please bring the cup over to the plate?", ("cup", "to", "plate")),
        ("stack the soap onto the dish", ("soap", "on", "dish")),
        ("set the knife alongside the plate", ("knife", "beside", "plate")),
        ("put the salt and pepper shaker in front of the cup",
         ("salt and pepper shaker", "next to", "cup")),
        ("take it and put it inside the bowl", (None, "in", "bowl")),
        ("move this over to the bowl", (None, "to", "bowl")),
        # Words that tell how belong to neither object.
        ("give me the pear, lay it up on the tape", ("pear", "on", "tape")),
        ("I would like to have it up on the soap", (None, "on", "soap")),
        ("put it ever so lightly on the soap", (None, "on", "soap")),
        ("set the mug down a bit closer to the box", ("mug", "close to", "box")),
        ("put the red cup upside down on the box", ("red cup", "on", "box")),
        # Somebody says it before and after, or leaves it out.
        ("any chance you could stick that in the mug, please", (None, "in", "mug")),
        ("perfect! now put it near the can, then go home", (None, "near", "can")),
        ("next to the apple", (None, "next to", "apple")),
        ("put on the plate", (None, "on", "plate")),
        ("what you are holding goes in the bowl", (None, "in", "bowl")),
        ("great, you've got it; put it in the bowl", (None, "in", "bowl")),
        # What was named before: the reference, or what to pick.
        ("see that cup? put it down right by it", (None, "near", "cup")),
        ("do you see the red box? put the pear next to it", ("pear", "next to", "red box")),
        ("there is a marker on the table. stick it in the mug", ("marker", "in", "mug")),
        ("I think the peach is ripe, put it in the bowl", ("peach", "in", "bowl")),
    ],
)  # fmt: skip
def test_composite_paraphrases(text: str, parts: tuple[str | None, str, str]) -> None:
    instruction = parse_instruction(text)
    assert (instruction.target, instruction.relation, instruction.reference) == parts


@pytest.mark.parametrize(
    ("text", "unwanted"),
    [
        ("get something to drink, put it near the apple", ("apple",)),
        ("put the cup next to the cup", ()),
        ("put it near the bowl", ()),
        ("give me the bowl", ()),
    ],
)
def test_the_reference_is_not_what_to_look_for(text: str, unwanted: tuple[str, ...]) -> None:
    assert parse_instruction(text).unwanted == unwanted


@pytest.mark.parametrize("relation", RELATIONS)
def test_region(relation: str) -> None:
    region = parse_instruction(f"put it {relation} the bowl").region
    assert region == ("inside" if relation in INSIDE_RELATIONS else "outside")
    assert parse_instruction("give me the bowl").region is None


def test_every_phrase_means_a_relation() -> None:
    assert set(map(canonical_relation, PHRASES)) == set(RELATIONS)
    for phrase in PHRASES:
        parts = parse_instruction(f"put the mug {phrase} the bowl")
        assert (parts.target, parts.reference) == ("mug", "bowl")
        assert parts.relation == canonical_relation(phrase)


def test_sentences_written_without_knowing_the_rules() -> None:
    entries = json.loads(Path(__file__).with_name("place_wordings.json").read_text())
    wrong = {e["text"] for e in entries if not is_understood(e)}
    assert len(entries) == 416
    assert wrong == {e["text"] for e in entries if not e["is_understood"]}


def is_understood(entry: dict[str, str | None]) -> bool:
    parts = parse_instruction(str(entry["text"]))
    found = (parts.target, parts.region, parts.reference)
    return found == (entry["target"], entry["region"], entry["reference"])


@pytest.mark.parametrize(
    "text",
    [
        "put the cup " * 300,
        "and, " * 500,
        "put " + "a" * 3000,
        "please now " * 300,
        "now then and so it is " * 100 + "put it",
        "put it " + "really quite " * 300,
    ],
)
def test_long_texts_end_soon(text: str) -> None:
    assert parse_instruction(text).text == text.strip()


@pytest.mark.parametrize("text", ["put it near because I said so", "put it on the, thanks"])
def test_a_reference_is_never_empty(text: str) -> None:
    assert parse_instruction(text).reference


def test_no_part_of_any_sentence_is_empty() -> None:
    entries = json.loads(Path(__file__).with_name("place_wordings.json").read_text())
    words = sorted({w for e in entries for w in re.findall(r"[\w'-]+|[,.;!?]", e["text"].lower())})
    rng = np.random.default_rng(0)
    for length in rng.integers(1, 20, size=5000):
        text = " ".join(rng.choice([*words, *PHRASES], size=length))
        if not re.search(r"\w", text):
            continue
        parts = parse_instruction(text)
        assert parts.target_phrase.strip()
        assert "" not in (parts.target, parts.reference), text
        assert (parts.relation is None) == (parts.reference is None), text


@pytest.mark.parametrize("text", ["", "   ", "?!", "\n"])
def test_empty_instructions(text: str) -> None:
    with pytest.raises(InvalidTextError) as caught:
        parse_instruction(text)
    assert str(caught.value) == f"Empty instruction {text!r}: expected at least one word."
