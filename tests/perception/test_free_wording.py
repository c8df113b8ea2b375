"""Instructions in free wording, none of them a template."""

import pytest

from perception.free_wording import find_need, reduce_phrase
from perception.language import parse_instruction

EAT, DRINK, PLAY = "something to eat", "something to drink", "something to play"
HOLD, CLEAN = "something to hold other things", "something to clean"


@pytest.mark.parametrize(
    ("text", "target"),
    [
        # Names in questions and wishes.
        ("Is there a lemon on your desk?", "lemon"),
        ("Are there any scissors lying around here?", "scissors"),
        ("do you see the toy airplane anywhere", "toy airplane"),
        ("can you see a power drill among these things?", "power drill"),
        ("Have you got a knife for me?", "knife"),
        ("How about the peach?", "peach"),
        ("I'm after the red mug.", "red mug"),
        ("we are searching for the toothpaste", "toothpaste"),
        ("I could really use the tape", "tape"),
        ("my head itches; i would go for the shampoo", "shampoo"),
        ("The remote controller would be great.", "remote controller"),
        ("what I need now is the soap dish", "soap dish"),
        ("I wonder where the black marker is", "black marker"),
        ("the plum is what I want", "plum"),
        ("Point me to the gelatin box, if you don't mind", "gelatin box"),
        ("It would be lovely if you could pass over the pear", "pear"),
        ("Do you think you could retrieve the racquetball from that heap?", "racquetball"),
        ("Good morning robot, be a dear and fetch the orange", "orange"),
        ("would it be possible to get the yellow bowl now?", "yellow bowl"),
        ("your next task is to grip the bleach cleanser", "bleach cleanser"),
        ("Slide me the tomato soup can when you have a minute", "tomato soup can"),
        ("where did you put the apple? hand it over", "apple"),
        ("I lost the strawberry, could you look for it?", "strawberry"),
        ("give me the banana because I like it", "banana"),
        ("take one of those toys in front of you", "toys"),
        ("a piece of fruit, please", "fruit"),
        ("any container will do", "container"),
        ("got any sugar?", "sugar"),
        ("a sponge to clean with would help", "sponge"),
        ("I'd love a mug I can drink from", "mug"),
        # How it looks.
        ("get hold of something red", "red object"),
        ("I'd like anything that looks round", "round object"),
        ("pick whatever is yellow", "yellow object"),
        ("is there anything blue in this pile?", "blue object"),
        ("which of these things is round?", "round"),
        ("point at the green coloured item", "green object"),
        ("hand me a thing with a round shape", "round object"),
        ("catch the yellow one over there", "yellow object"),
        ("show me an object that is red in color", "red object"),
        ("some object of a red colour would be nice", "red object"),
        # Needs.
        ("I'm starving", EAT),
        ("My stomach is empty, help!", EAT),
        ("what can I eat here?", EAT),
        ("Time for a snack.", EAT),
        ("do we have anything edible?", EAT),
        ("could I get some food", EAT),
        ("we are so thirsty", DRINK),
        ("my throat is parched", DRINK),
        ("is there something I could drink out of?", DRINK),
        ("I fancy a beverage", DRINK),
        ("I am bored to death", PLAY),
        ("the toddler wants to be entertained", PLAY),
        ("find us something fun", PLAY),
        ("I'm looking for something my kids can play with", PLAY),
        ("I need something to put my coins in", HOLD),
        ("hand me an object that can hold water", HOLD),
        ("anything that I could keep my keys in?", HOLD),
        ("where could I store these marbles?", HOLD),
        ("my hands are filthy", CLEAN),
        ("Somebody spilled juice, what could we wipe it up with?", CLEAN),
        ("grab a thing for washing dishes", CLEAN),
        ("I want to scrub the floor", CLEAN),
    ],
)
def test_free_picks(text: str, target: str) -> None:
    instruction = parse_instruction(text)
    assert (instruction.target, instruction.relation, instruction.reference) == (target, None, None)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("should the knife go beside the plate?", ("knife", "beside", "plate")),
        ("Could this be placed on top of the box?", (None, "on top of", "box")),
        ("find a free spot for it near the soap", (None, "near", "soap")),
        ("find room for the cup next to the drill", ("cup", "next to", "drill")),
        ("its place is right next to the lemon", (None, "next to", "lemon")),
        ("I'd like it close to the red mug", (None, "close to", "red mug")),
        ("into the bowl with it", (None, "in", "bowl")),
        ("bring it near the tape please", (None, "near", "tape")),
        ("please park that thing beside the can", (None, "beside", "can")),
        ("can you toss it gently into the yellow bowl", (None, "in", "yellow bowl")),
        ("let it rest on the tea box", (None, "on", "tea box")),
        ("lower it so that it sits around the apple", (None, "around", "apple")),
        ("I'm hungry: find me a pear and tuck it in the cup", ("pear", "in", "cup")),
        ("is there a sponge here? keep it not too far from something round",
         ("sponge", "close to", "round object")),
        ("my mouth is dry, get me a drink and then park it by the plate",
         (DRINK, "near", "plate")),
    ],
)  # fmt: skip
def test_free_places(text: str, parts: tuple[str | None, str, str]) -> None:
    instruction = parse_instruction(text)
    assert (instruction.target, instruction.relation, instruction.reference) == parts


@pytest.mark.parametrize(
    ("phrase", "short"),
    [
        ("the red mug on this table", "red mug"),
        ("any food", EAT),
        ("kind of toy", "toy"),
        ("something", "something"),
        ("cup that is red", "red cup"),
        ("salt and pepper shaker", "salt and pepper shaker"),
        ("magic clean", "magic clean"),
        ("head shoulders care", "head shoulders care"),
        ("place mat", "place mat"),
        ("thing", "thing"),
    ],
)
def test_reduced_phrases(phrase: str, short: str) -> None:
    assert reduce_phrase(phrase) == short
    assert reduce_phrase(short) == short


def test_no_need_without_its_words() -> None:
    assert find_need("the weather is nice") is None
    assert parse_instruction("the weather is rather nice today").target is not None
