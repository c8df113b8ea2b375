"""Endless variants: named honestly, never an unseen object, as sound as the catalogue's."""

import dataclasses
import functools
import hashlib
import importlib
import inspect
import pkgutil
import subprocess
import sys
from functools import partial

import mujoco
import numpy as np
import pytest
from dm_control import mjcf
from scipy.spatial.transform import Rotation

from models.errors import AssetError, UnknownNameError
from models.objects import families
from models.objects.asset import Shape, closed_mesh
from models.objects.cache import decode, encode
from models.objects.collision import CollisionPart
from models.objects.entries import SEEN, UNSEEN
from models.objects.mjcf_builder import FRICTION, SOLREF, build_object
from models.objects.variants import novelty, sampling, vocabulary
from models.objects.variants.colors import ALL_COLORS, color_name, contrast, draw_color, lab
from models.objects.variants.draft import (
    LEAST_SEED,
    Draft,
    describe,
    is_color,
    leaves,
    parameters,
)
from models.objects.words import CATEGORIES, COLORS, FUNCTIONS, SHAPES

CATALOGUE = (*SEEN, *UNSEEN)
NUM_DRAFTS = 2500
every_unseen = pytest.mark.parametrize("entry", UNSEEN, ids=lambda entry: entry.name)
every_family = pytest.mark.parametrize("family", families.FAMILIES)


@functools.cache
def drafts() -> tuple[Draft, ...]:
    rng = np.random.default_rng(7)
    return tuple(sampling.draw(rng) for _ in range(NUM_DRAFTS))


@functools.cache
def assets(family: str):
    rng = np.random.default_rng(11)
    return tuple(families.sample(rng, family=family) for _ in range(2))


def scaled_geometry(shape: partial[Shape], factor: float) -> partial[Shape]:
    """Scale every length and share among a family's arguments, but nothing that is only painted."""

    def scale(value, key):
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            names = [field.name for field in dataclasses.fields(value)]
            return dataclasses.replace(value, **{n: scale(getattr(value, n), n) for n in names})
        if isinstance(value, float) and key not in novelty.PAINT_KEYS:
            return value * factor
        if isinstance(value, tuple) and not is_color(value) and key not in novelty.PAINT_KEYS:
            return tuple(scale(item, key) for item in value)
        return value

    return partial(shape.func, **{k: scale(v, k) for k, v in parameters(shape).items()})


def words_of(texts: list[str]) -> set[str]:
    return {word for text in texts for word in text.upper().split()}


# --- What is covered


def test_every_family_function_is_sampled():
    found = set()
    for info in pkgutil.iter_modules(families.__path__):
        module = importlib.import_module(f"{families.__name__}.{info.name}")
        for name, function in inspect.getmembers(module, inspect.isfunction):
            is_own = function.__module__ == module.__name__ and not name.startswith("_")
            if is_own and inspect.signature(function).return_annotation is Shape:
                found.add(name)
    assert found == set(families.FAMILIES)


def test_catalogue_families_are_sampled():
    assert {entry.family for entry in CATALOGUE} <= set(families.FAMILIES)


def test_unknown_family_says_what_was_meant():
    with pytest.raises(UnknownNameError) as caught:
        families.sample(np.random.default_rng(0), family="mugg")
    known = ", ".join(families.FAMILIES)
    assert str(caught.value) == f"Unknown family 'mugg'. Families: {known}. Did you mean 'mug'?"


def test_package_of_families_has_nothing_else_to_import():
    with pytest.raises(AttributeError, match="has no attribute 'smaple'"):
        _ = families.smaple


# --- Names of colours


@pytest.mark.parametrize(
    "entry", [e for e in CATALOGUE if e.words.colors], ids=lambda entry: entry.name
)
def test_first_colour_of_an_entry_is_among_the_names_of_its_paints(entry):
    paints = [value for _, value in leaves(parameters(entry.shape)) if is_color(value)]
    if not paints:  # A few families choose their paints themselves, as they do bare steel.
        assert entry.family == "puzzle_cube"
        return
    names = {color_name(paint) for paint in paints}
    assert entry.words.colors[0] in names | ({"gray"} if entry.family == "wrench" else set())


@pytest.mark.parametrize(
    ("rgb", "name"),
    [
        ((255, 0, 0), "red"),
        ((255, 255, 0), "yellow"),
        ((0, 255, 0), "green"),
        ((0, 0, 255), "blue"),
        ((255, 165, 0), "orange"),
        ((128, 0, 128), "purple"),
        ((255, 192, 203), "pink"),
        ((139, 69, 19), "brown"),
        ((0, 0, 0), "black"),
        ((255, 255, 255), "white"),
        ((128, 128, 128), "gray"),
        ((0, 128, 128), "green"),
        ((0, 0, 128), "blue"),
        ((128, 0, 0), "red"),
        ((245, 245, 220), "white"),
    ],
)
def test_css_colours_have_their_names(rgb, name):
    assert color_name(rgb) == name


def test_lightness_and_chroma_of_the_primaries_are_the_published_ones():
    # CIELAB of the sRGB primaries under D65: lightness, chroma, hue.
    assert lab((255, 0, 0)) == pytest.approx((53.24, 104.55, 40.0), abs=0.05)
    assert lab((0, 0, 255)) == pytest.approx((32.30, 133.81, 306.3), abs=0.05)
    assert lab((255, 255, 255)) == pytest.approx((100, 0, lab((255, 255, 255))[2]), abs=0.02)


def test_every_colour_has_a_name_of_the_vocabulary():
    steps = range(0, 256, 17)
    names = {color_name((r, g, b)) for r in steps for g in steps for b in steps}
    assert names == set(COLORS) == set(ALL_COLORS)


@pytest.mark.parametrize("name", ALL_COLORS)
def test_a_colour_drawn_by_name_goes_by_it(name):
    rng = np.random.default_rng(3)
    assert {color_name(draw_color(rng, name)) for _ in range(100)} == {name}


def test_contrast_ends_where_nothing_stands_out_enough():
    rng = np.random.default_rng(4)
    assert color_name(contrast(rng, (120, 120, 120), 80.0)) == "white"
    assert color_name(contrast(rng, (190, 190, 190), 80.0)) == "black"


def test_contrasting_ink_stands_out():
    rng = np.random.default_rng(4)
    for _ in range(100):
        ground = draw_color(rng)
        assert abs(lab(contrast(rng, ground, 38.0))[0] - lab(ground)[0]) >= 38.0


@every_family
def test_first_colour_covers_a_good_part_of_the_surface(family):
    named = functools.cache(color_name)
    for asset in assets(family):
        corners = asset.vertices[asset.faces]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = np.linalg.norm(cross, axis=1)
        rng = np.random.default_rng(0)
        chosen = rng.choice(len(area), 1500, p=area / area.sum())
        share = rng.dirichlet((1, 1, 1), 1500)[:, :, None]
        uv = (asset.uv[asset.faces[chosen]] * share).sum(axis=1)
        height, width = asset.texture.shape[:2]
        column = np.minimum((uv[:, 0] * width).astype(int), width - 1)
        row = np.minimum(((1 - uv[:, 1]) * height).astype(int), height - 1)
        texels = (asset.texture[row, column] // 6 * 6 + 3).tolist()
        hits = [named(tuple(texel)) == asset.words.colors[0] for texel in texels]
        assert np.mean(hits) > 0.12, (asset.words, np.mean(hits))


# --- Words


def test_words_are_rich_and_in_the_vocabulary():
    for draft in drafts():
        words = draft.words
        assert words.label and words.label == words.label.strip().lower()
        assert 3 <= len(words.synonyms) <= 8, words
        assert len({words.label, *words.synonyms}) == 1 + len(words.synonyms)
        assert words.category is None or words.category in CATEGORIES
        assert 1 <= len(words.colors) <= 3 and set(words.colors) <= set(COLORS)
        assert set(words.shapes) <= set(SHAPES)
        assert set(words.functions) <= set(FUNCTIONS)


def test_labels_are_many_and_name_true_colours():
    labels = {draft.words.label for draft in drafts()}
    assert len(labels) > 350
    for draft in drafts():
        named = set((draft.words.label or "").split()) & set(COLORS) - {"orange"}
        assert named <= set(draft.words.colors), draft.words


@pytest.mark.parametrize(
    ("noun", "others", "colors", "colored", "label", "synonyms"),
    [
        (
            "mug",
            ("coffee mug",),
            ("red", "white"),
            True,
            "red mug",
            ("mug", "coffee mug", "red and white mug", "red coffee mug", "red object"),
        ),
        (
            "orange juice carton",
            ("juice",),
            ("orange",),
            True,
            "orange juice carton",
            ("juice", "orange juice", "orange object"),
        ),
    ],
)
def test_describe_puts_colour_before_nouns(noun, others, colors, colored, label, synonyms):
    words = describe(noun, *others, colors=colors, colored=colored)
    assert (words.label, words.synonyms) == (label, synonyms)


def test_vocabulary_has_many_products_each_printed_once():
    products = [p for vessel in vocabulary.VESSELS for p in vocabulary.products(vessel)]
    assert len({product.title for product in products}) >= 60
    assert len({product.noun for product in products}) >= 60
    for vessel in vocabulary.VESSELS:
        titles = [product.title for product in vocabulary.products(vessel)]
        assert len(titles) == len(set(titles)) >= 3, vessel


def test_titles_name_what_the_words_say():
    nouns: dict[str, set[str]] = {}
    for vessel in vocabulary.VESSELS:
        for product in vocabulary.products(vessel):
            nouns.setdefault(product.title.replace("\n", " "), set()).add(product.noun)
    printed = [(d, t) for d in drafts() if (t := _title(d)) is not None]
    assert len({title for _, title in printed}) >= 60
    for draft, title in printed:
        assert any(noun in draft.words.title for noun in nouns[title]), (title, draft.words)


def _title(draft: Draft) -> str | None:
    given = parameters(draft.shape)
    title = given["label"].title if "label" in given else given.get("title")
    return None if title is None else title.replace("\n", " ")


@pytest.mark.parametrize(
    ("family", "least"),
    [
        ("mug", set(COLORS)),
        ("bowl", set(COLORS)),
        ("cup", set(COLORS)),
        ("apple", {"red", "green", "yellow"}),
        ("citrus", {"orange", "yellow", "green"}),
        ("bottle", set(COLORS)),
    ],
)
def test_families_come_in_all_their_colours(family, least):
    rng = np.random.default_rng(5)
    drawn = {sampling.draw(rng, family=family).words.colors[0] for _ in range(300)}
    assert drawn >= least


def test_fruit_has_natural_colours_only():
    for draft in drafts():
        if draft.words.category == "fruit":
            assert not set(draft.words.colors) & {"blue", "pink", "black", "gray", "white"}


# --- Never an unseen object


@every_unseen
def test_unseen_objects_are_refused(entry):
    assert not novelty.is_novel(entry.shape)


@every_unseen
@pytest.mark.parametrize("factor", [0.975, 1.025])
def test_unseen_geometry_is_refused_nearby_whatever_its_paint(entry, factor):
    assert novelty.is_near(scaled_geometry(entry.shape, factor), entry.shape)


@every_unseen
def test_geometry_well_off_an_unseen_object_is_not_near_it(entry):
    assert not novelty.is_near(scaled_geometry(entry.shape, 1.08), entry.shape)


def test_no_draw_is_near_an_unseen_object():
    for draft in drafts():
        own = novelty.geometry(draft.shape)
        for entry in UNSEEN:
            if draft.shape.func is not entry.shape.func:
                continue
            other = novelty.geometry(entry.shape)
            if own.keys() == other.keys():
                differences = [
                    abs(own[k] - v) / max(abs(v), 0.001 if "_m" in k else 0.02)
                    for k, v in other.items()
                ]
                assert max(differences) > novelty.TOLERANCE, (draft.words, entry.name)


def test_no_draw_prints_a_title_of_an_unseen_object():
    barred = {"BLUE", "MOON", "MAGIC", "CLEAN", "REPEL", "LENT", "REPELLENT", "BLEACH"}
    barred |= {"GELATIN", "SUGAR", "SHAMPOO", "PERMANENT", "MARKER", "BLUEMOON", "ROSE"}
    assert barred <= novelty.reserved_words()
    printed = set().union(*(novelty.printed_words(draft.shape) for draft in drafts()))
    assert len(printed) > 200
    assert not printed & novelty.reserved_words()


def test_a_draw_at_an_unseen_object_is_drawn_again():
    (bowl,) = (entry for entry in UNSEEN if entry.name == "yellow_bowl")
    painted = partial(bowl.shape.func, **{**bowl.shape.keywords, "outside": (20, 30, 200)})
    larger = partial(bowl.shape.func, **{**painted.keywords, "diameter_m": 0.16})
    shapes = iter([bowl.shape, painted, larger])

    def recipe(rng: np.random.Generator) -> Draft:
        return Draft(shape=next(shapes), words=bowl.words, matter=bowl.matter)

    assert sampling.draw_novel(np.random.default_rng(0), recipe).shape is larger


def test_a_recipe_without_anything_new_is_an_error():
    (bowl,) = (entry for entry in UNSEEN if entry.name == "yellow_bowl")

    def recipe(rng: np.random.Generator) -> Draft:
        return Draft(shape=bowl.shape, words=bowl.words, matter=bowl.matter)

    with pytest.raises(AssetError) as caught:
        sampling.draw_novel(np.random.default_rng(0), recipe)
    assert str(caught.value) == (
        "None of 200 variants of family 'bowl' differs enough from the unseen objects; "
        "widen the ranges of its recipe."
    )


def test_seeds_of_variants_and_catalogue_never_meet():
    for entry in CATALOGUE:
        assert parameters(entry.shape).get("seed", 0) < LEAST_SEED
    for draft in drafts():
        assert parameters(draft.shape).get("seed", LEAST_SEED) >= LEAST_SEED


# --- Names and bytes


def test_names_follow_from_parameters():
    drawn = drafts()
    assert len({draft.name for draft in drawn}) == NUM_DRAFTS
    again = Draft(shape=partial(drawn[0].shape), words=drawn[1].words, matter=drawn[1].matter)
    assert again.name == drawn[0].name
    assert drawn[0].name.startswith("sample_") and len(drawn[0].name) == 15


def _digest(seed: int, count: int) -> str:
    rng = np.random.default_rng(seed)
    digest = hashlib.sha256()
    for _ in range(count):
        digest.update(encode(families.sample(rng)))
    return digest.hexdigest()


def test_same_seed_gives_the_same_bytes_in_every_process():
    program = (
        "import sys, hashlib, numpy as np\n"
        "from models.objects import families\n"
        "from models.objects.cache import encode\n"
        "rng = np.random.default_rng(21)\n"
        "digest = hashlib.sha256()\n"
        "for _ in range(8): digest.update(encode(families.sample(rng)))\n"
        "print(digest.hexdigest())\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=120
    )
    assert done.stdout.strip() == _digest(21, 8) != _digest(22, 8)


def test_a_variant_survives_the_encoding_of_the_cache():
    asset = assets("mug")[0]
    assert encode(decode(encode(asset))) == encode(asset)
    assert asset.split == "sampled"
    assert asset.family == "mug"


# --- As sound as the catalogue's objects


def _reach(part: CollisionPart, direction: np.ndarray) -> float:
    turn = Rotation.from_quat(part.quat_wxyz, scalar_first=True)
    local, size = turn.inv().apply(direction), part.size
    reach = {
        "box": lambda: float(np.abs(local) @ size),
        "sphere": lambda: size[0],
        "ellipsoid": lambda: float(np.linalg.norm(local * size)),
        "capsule": lambda: size[0] + abs(local[2]) * size[1],
        "cylinder": lambda: size[0] * np.hypot(local[0], local[1]) + abs(local[2]) * size[1],
        "convex": lambda: float((part.vertices @ local).max()),
    }[part.kind]()
    return float(np.dot(part.position, direction)) + reach


@every_family
def test_variants_are_closed_of_true_size_and_felt_where_they_are_seen(family):
    for asset in assets(family):
        mesh = closed_mesh(asset.vertices, asset.faces)
        assert mesh.is_watertight and mesh.is_winding_consistent
        assert 1000 <= len(asset.faces) <= 8000
        assert max(asset.texture.shape[:2]) <= 512
        smallest, middle, largest = np.sort(asset.size_m)
        assert 0.010 <= smallest and 0.015 <= middle and largest <= 0.260
        assert 0.005 < asset.mass_kg < 1.2
        assert 100 < asset.density_kg_m3 < 3000
        for direction in np.concatenate([np.eye(3), -np.eye(3)]):
            seen = float((asset.vertices @ direction).max())
            felt = max(_reach(part, direction) for part in asset.collision)
            assert felt - seen < 0.0025, (asset.words, direction)
            assert seen - felt < 0.030, (asset.words, direction)
        floor = max(_reach(part, np.array([0.0, 0.0, -1.0])) for part in asset.collision)
        assert floor == pytest.approx(0, abs=0.0015)


@every_family
def test_parameters_stay_in_bounds_over_many_draws(family):
    rng = np.random.default_rng(13)
    for _ in range(40):
        shape = sampling.draw(rng, family=family).shape
        lengths = [v for k, v in novelty.geometry(shape).items() if "_m" in k]
        assert all(0 <= length <= 0.260 for length in lengths), shape


@pytest.mark.parametrize(
    "family", ["mug", "bottle", "carton", "quadruped", "citrus", "tape_roll", "scissors", "brick"]
)
def test_variants_settle_on_the_table(family):
    asset = assets(family)[1]
    root = mjcf.RootElement()
    root.option.set_attributes(
        timestep=0.002, cone="elliptic", impratio=10, integrator="implicitfast"
    )
    root.worldbody.add("geom", type="plane", size=(3, 3, 0.1), friction=FRICTION, solref=SOLREF)
    frame = root.attach(build_object(asset))
    frame.pos = (0, 0, 0.005)
    frame.add("freejoint")
    model = mjcf.Physics.from_mjcf_model(root).model.ptr
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=1500)
    fastest = 0.0
    for _ in range(100):
        mujoco.mj_step(model, data)
        fastest = max(fastest, float(np.linalg.norm(data.qvel[:3])))
    assert fastest < 0.005, "metres a second"
    assert np.all(data.contact.dist > -0.001)
    assert np.linalg.norm(data.qpos[:2]) < 0.1
