import dataclasses
import functools

import numpy as np
import pytest

from models.errors import AssetError, UnknownNameError
from models.objects.asset import Matter, ObjectAsset, closed_mesh
from models.objects.catalogue import build_asset, load_object, object_names, object_words
from models.objects.entries import SEEN, UNSEEN
from models.objects.words import CATEGORIES, COLORS, FUNCTIONS, PROTOCOL_GENERAL_WORDS, SHAPES

LABELS = {
    "seen": (
        "tomato soup can, banana, red bowl, red mug, power drill, scissors, strawberry, apple, "
        "lemon, peach, pear, orange, plum, knife, flat screwdriver, racquetball, cup, "
        "toy airplane, dabao sod, box, toothpaste, white mouse, darlie box, soap, "
        "dabao facewash, pantene, thera med, dove, head shoulders care, lion, tape"
    ),
    "unseen": (
        "black marker, bleach cleanser, blue moon, gelatin box, magic clean, pink tea box, "
        "red marker, remote controller, repellent, shampoo, small clamp, soap dish, sugar, "
        "two color hammer, yellow bowl, yellow cup"
    ),
}
# Narrowest way across that the gripper, which opens 85 mm, closes on with room to spare.
GRASPABLE_M = 0.075

build = functools.cache(build_asset)
every_object = pytest.mark.parametrize("name", object_names())


@pytest.mark.parametrize(("split", "least"), [("seen", 66), ("unseen", 30)])
def test_split_has_enough_distinct_names(split, least):
    names = object_names(split)
    assert len(names) == len(set(names)) >= least


def test_splits_partition_the_catalogue():
    assert object_names() == object_names("seen") + object_names("unseen")
    assert not set(object_names("seen")) & set(object_names("unseen"))


@pytest.mark.parametrize("split", ["seen", "unseen"])
def test_labels_are_those_of_the_protocol(split):
    labels = {object_words(name).label for name in object_names(split)} - {None}
    assert labels == set(LABELS[split].split(", "))


@pytest.mark.parametrize(
    ("split", "word"),
    [(split, word) for split, words in PROTOCOL_GENERAL_WORDS.items() for word in words],
)
def test_every_general_word_of_the_protocol_fits_an_object(split, word):
    assert any(object_words(name).fits(word) for name in object_names(split))


@every_object
def test_words_stay_in_the_vocabulary(name):
    words = object_words(name)
    assert words.title
    assert words.category is None or words.category in CATEGORIES
    assert set(words.colors) <= set(COLORS)
    assert set(words.shapes) <= set(SHAPES)
    assert set(words.functions) <= set(FUNCTIONS)


@every_object
def test_mesh_is_closed_mapped_and_of_reasonable_size(name):
    asset = build(name)
    mesh = closed_mesh(asset.vertices, asset.faces)
    assert mesh.is_winding_consistent
    assert mesh.is_watertight
    assert 1000 <= len(asset.faces) <= 8000
    assert asset.uv.min() >= 0 and asset.uv.max() <= 1
    assert max(asset.texture.shape[:2]) <= 512


@every_object
def test_frame_is_centred_on_the_base(name):
    vertices = build(name).vertices
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    np.testing.assert_allclose([*middle[:2], vertices[:, 2].min()], 0, atol=1.01e-5)


@every_object
def test_mass_and_inertia_are_physical(name):
    asset = build(name)
    assert 0.005 < asset.mass_kg < 1.2
    assert 100 < asset.density_kg_m3 < 3000
    assert asset.matter_source
    # Principal moments of a rigid body obey the triangle inequality, and its radii of gyration
    # are smaller than the body.
    moments = np.linalg.eigvalsh(asset.inertia)
    assert moments[0] > 0
    assert moments[2] <= moments[0] + moments[1]
    assert moments[2] / asset.mass_kg < np.sum(asset.size_m**2) / 4
    low, high = asset.vertices.min(axis=0), asset.vertices.max(axis=0)
    assert np.all((low < asset.center_of_mass) & (asset.center_of_mass < high))


@every_object
def test_build_is_deterministic(name):
    first, second = build(name), build_asset(name)
    for field in ("vertices", "faces", "uv", "texture", "center_of_mass", "inertia"):
        assert getattr(first, field).tobytes() == getattr(second, field).tobytes(), field
    assert first.mass_kg == second.mass_kg
    assert [p.vertices.tobytes() for p in first.collision] == [
        p.vertices.tobytes() for p in second.collision
    ]


def _width_as_it_lies(asset: ObjectAsset) -> float:
    angles = np.radians(np.arange(0, 180, 5))
    along = asset.vertices[:, :2] @ np.stack([np.cos(angles), np.sin(angles)])
    return float(np.ptp(along, axis=0).min())


@pytest.mark.parametrize("split", ["seen", "unseen"])
def test_most_objects_fit_the_gripper_as_they_stand(split):
    names = object_names(split)
    open_rim = [n for n in names if object_words(n).category in ("container", "cup")]
    narrow = [n for n in names if _width_as_it_lies(build(n)) < GRASPABLE_M]
    assert len(set(narrow) | set(open_rim)) >= 0.9 * len(names)


def test_no_two_objects_look_the_same():
    prints = {(build(n).vertices.tobytes(), build(n).texture.tobytes()) for n in object_names()}
    assert len(prints) == len(object_names())


def _parameters(value: object, path: str = "") -> dict[str, object]:
    """Flatten the parameters bound to a family, looking into its descriptions."""
    if dataclasses.is_dataclass(value):
        value = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
    if not isinstance(value, dict):
        return {path: value}
    return {
        k: v for key, item in value.items() for k, v in _parameters(item, f"{path}.{key}").items()
    }


def _sizes(split: str) -> list[tuple[str, dict[str, object]]]:
    """List family and lengths of every object of a split."""
    found = []
    for entry in {"seen": SEEN, "unseen": UNSEEN}[split]:
        bound = _parameters(entry.shape.keywords)
        lengths = {k: v for k, v in bound.items() if k.endswith("_m") or ".animal." in k}
        found.append((entry.family, lengths))
    return found


def _paints(split: str) -> list[tuple[str, dict[str, object]]]:
    """List family, seed, colours and printed words of every object of a split."""
    found = []
    for entry in {"seen": SEEN, "unseen": UNSEEN}[split]:
        bound = _parameters(entry.shape.keywords)
        found.append((entry.family, {k: v for k, v in bound.items() if not k.endswith("_m")}))
    return found


@pytest.mark.parametrize("parameters", [_sizes, _paints])
def test_unseen_objects_share_no_parameter_set_with_seen_ones(parameters):
    seen = parameters("seen")
    assert [thing for thing in parameters("unseen") if thing in seen] == []


def test_no_seed_is_used_twice():
    seeds = [e.shape.keywords["seed"] for e in (*SEEN, *UNSEEN) if "seed" in e.shape.keywords]
    assert len(seeds) == len(set(seeds))


@pytest.mark.parametrize("split", ["seen", "unseen"])
def test_unlabelled_objects_can_be_asked_for(split):
    labels = {object_words(name).label for name in object_names(split)} - {None}
    for name in object_names(split):
        words = object_words(name)
        # A synonym that is another object's label would make that label ambiguous.
        assert words.synonyms
        assert not set(words.synonyms) & (labels - {words.label}) or name == "darlie_box"


def test_words_hold_for_everything_that_a_person_would_call_so():
    words = {name: object_words(name) for name in object_names("seen")}
    drinking = [n for n in words if n.endswith(("mug", "cup"))]
    assert len(drinking) >= 4
    assert all(words[n].category == "cup" for n in drinking)
    assert all("round" in words[n].shapes for n in words if n.endswith("ball"))
    cartons = [n for n in words if n.endswith("box")]
    assert all("box" in (words[n].label, *words[n].synonyms) for n in cartons)
    assert all(words[n].category == "toy" for n in words if n.startswith(("toy_", "block_")))


def test_assets_are_read_only():
    asset = build("apple")
    with pytest.raises(ValueError, match="read-only"):
        asset.vertices[0] = 0
    with pytest.raises(ValueError, match="read-only"):
        build("red_bowl").collision[0].vertices[0] = 0


@pytest.mark.parametrize("call", [object_words, load_object, build_asset])
def test_unknown_object_says_what_was_meant(call):
    with pytest.raises(UnknownNameError) as caught:
        call("aple")
    known = ", ".join(object_names())
    assert str(caught.value) == f"Unknown object 'aple'. Objects: {known}. Did you mean 'apple'?"


def test_unknown_split_lists_the_splits():
    with pytest.raises(UnknownNameError) as caught:
        object_names("sen")
    assert str(caught.value) == "Unknown split 'sen'. Splits: seen, unseen. Did you mean 'seen'?"


@pytest.mark.parametrize("figures", [{}, {"mass_kg": 1.0, "density_kg_m3": 1.0}])
def test_matter_wants_exactly_one_figure(figures):
    with pytest.raises(AssetError) as caught:
        Matter(source="test", **figures)
    assert str(caught.value) == ("Matter needs a mass or a density, got both or neither; give one.")
