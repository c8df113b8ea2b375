"""Other wordings of the expert's instructions."""

import json
from importlib import resources

import numpy as np
import pytest

from models.objects.catalogue import object_names, object_words
from models.objects.words import CATEGORIES, COLORS, FUNCTIONS, SHAPES
from perception.language import parse_instruction
from perception.relations import RELATIONS
from sr_mj.collecting.wordings import reword_pick, reword_place
from sr_mj.instruction import place_text
from sr_mj.scene import find_goal, find_targets

WORDS = {name: object_words(name) for name in object_names("seen")}


def pick_goals():
    goals = [f"give me the {w.label}" for w in WORDS.values() if w.label]
    goals += [f"give me the {s}" for w in WORDS.values() for s in w.synonyms]
    goals += [f"I need a {word}" for word in CATEGORIES]
    goals += [f"{verb} a {w} object" for verb in ("grasp", "I want") for w in (*COLORS, *SHAPES)]
    goals += [f"get something to {word}" for word in FUNCTIONS]
    return {g: find_targets(g, WORDS) for g in goals if find_targets(g, WORDS)}


def place_wordings(relation, name, rng):
    goal = find_goal(f"put it {relation} the {WORDS[name].title}", WORDS)
    return reword_place(goal.text, goal.place.references, WORDS, rng, 99)


def test_every_instruction_has_three_other_wordings_that_mean_the_same():
    rng = np.random.default_rng(1)
    for goal, targets in pick_goals().items():
        wordings = reword_pick(goal, targets, WORDS, rng, 3)
        assert len(wordings) == len({w.text for w in wordings} - {goal}) == 3, goal
        for wording in wordings:
            assert find_targets(wording.text, WORDS) == targets
            assert parse_instruction(wording.text).relation is None
            assert (wording.phase, wording.relation, wording.side) == ("pick", None, None)


@pytest.mark.parametrize("relation", RELATIONS)
def test_every_place_has_three_other_wordings_that_mean_the_same(relation):
    rng = np.random.default_rng(2)
    for words in list(WORDS.values())[::6]:
        text = f"put it {relation} the {words.title}"
        goal = find_goal(text, WORDS)
        wordings = reword_place(text, goal.place.references, WORDS, rng, 3)
        assert len(wordings) == len({w.text for w in wordings} - {text}) == 3, text
        for wording in wordings:
            place = find_goal(wording.text, WORDS).place
            assert place == goal.place
            said = place_text(text)
            assert (wording.relation, wording.side) == (said.relation, said.side)


def test_no_wording_is_kept_for_the_evaluation():
    table = json.loads(
        resources.files("models.arrangements").joinpath("paraphrases.json").read_text()
    )
    held_out = {text for others in table.values() for text in others}
    # Their place parts alone, too.
    held_out |= {text.rpartition(", and ")[2] for text in held_out}
    rng = np.random.default_rng(0)
    # Verbs and nouns are put together anyhow; all of either are enough.
    goals = list(pick_goals().items())
    picks = [w for g, t in goals[::3] for w in reword_pick(g, t, WORDS, rng, 99)]
    places = [w for r in RELATIONS for w in place_wordings(r, "soap", rng)]
    assert len(picks) > 300 and len(places) > 50
    assert not held_out & {wording.text for wording in picks + places}


def test_the_same_draws_give_the_same_wordings():
    first, again, other = (
        [place_wordings(r, "soap", np.random.default_rng(seed)) for r in RELATIONS[:3]]
        for seed in (3, 3, 4)
    )
    assert first == again != other
