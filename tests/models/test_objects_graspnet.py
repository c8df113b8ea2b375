import pytest

from models.errors import UnknownNameError
from models.objects.catalogue import object_names, object_words
from models.objects.graspnet import STAND_INS, stand_in
from sr_mj.scene.goals import find_targets

# Goals as the protocol's templates word them, and objects of the data set that satisfy them.
GOALS = [
    ("grasp a round object", {"017", "021"}),
    ("get something to eat", {"011", "012", "015"}),
    ("get something to hold other things", {"022"}),
    ("I want a round object", {"016", "017", "021"}),
    ("give me the cup", {"022"}),
    ("I need a cup", {"022"}),
    ("I need a fruit", {"005", "012", "013"}),
    ("get something to drink", {"057"}),
    ("give me the thera_med", {"064"}),
    ("give me the pear", {"015"}),
]
BYSTANDERS = ("008", "018", "032", "043", "047", "055", "059", "061", "078", "081", "083", "085")


def test_every_number_has_a_stand_in():
    assert list(STAND_INS) == [f"{number:03d}" for number in range(88)]
    assert {s.graspnet_id for s in STAND_INS.values()} == set(STAND_INS)


@pytest.mark.parametrize("number", STAND_INS)
def test_stand_in_is_in_the_catalogue(number):
    found = stand_in(number)
    assert found.object_name in object_names()
    assert found.graspnet_name
    # What only fills a place must not be asked for by what it happens to be used for.
    if not found.identified:
        assert object_words(found.object_name).category == "toy"


def test_only_one_object_comes_from_the_unseen_split():
    unseen = set(object_names("unseen"))
    assert [n for n, s in STAND_INS.items() if s.object_name in unseen] == ["001"]


def test_names_of_the_same_product_agree():
    same = {s.graspnet_name for s in STAND_INS.values()} & set(object_names())
    assert {"banana", "pear", "thera_med", "dove", "pantene", "lion", "tape", "soap"} <= same
    assert all(
        s.object_name == s.graspnet_name for s in STAND_INS.values() if s.graspnet_name in same
    )


@pytest.mark.parametrize(("goal", "targets"), GOALS)
def test_stand_ins_satisfy_the_goals_that_their_originals_satisfy(goal, targets):
    goal = goal.replace("_", " ")
    numbers = (*sorted(targets), *BYSTANDERS)
    objects = {stand_in(n).object_name: object_words(stand_in(n).object_name) for n in numbers}
    expected = {stand_in(n).object_name for n in targets}
    assert set(find_targets(goal, objects)) == expected


@pytest.mark.parametrize("number", ["088", "7", "", "banana"])
def test_unknown_number_is_refused(number):
    with pytest.raises(UnknownNameError) as caught:
        stand_in(number)
    assert str(caught.value) == (
        f"Unknown GraspNet-1Billion object {number!r}. Objects: three digits, '000' to '087'. "
        "Use the stem of the object's URDF file."
    )
