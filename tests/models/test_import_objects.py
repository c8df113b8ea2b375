import json
import subprocess
import sys

import numpy as np
import pytest
import trimesh
from PIL import Image

from models.errors import ImportRefusedError, MissingPackageError, WordsFileError
from models.import_objects import ImportConfig, run
from models.importing import decompose
from models.importing.importer import match_labels
from models.importing.labels import label_from_stem, read_labels
from models.importing.sources import find_sources
from models.objects.folder_catalogue import FolderCatalogue
from models.objects.mjcf_builder import build_object

XML = """
<mujoco model="block">
  <asset><mesh name="block" file="block.stl"/></asset>
  <worldbody><body name="object">
    <geom type="mesh" mesh="block" contype="0" conaffinity="0" group="1" mass="0"/>
    <geom type="box" size="0.02 0.02 0.02" group="0" mass="0.05"/>
  </body></worldbody>
</mujoco>
"""


@pytest.fixture(autouse=True)
def _own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SR_MJ_CACHE", str(tmp_path / "cache"))


def textured(path, extents=(0.05, 0.04, 0.03)):
    """Write a textured box at the place where a collection keeps it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    mesh = trimesh.creation.box(extents)
    uv = mesh.vertices[:, :2] / mesh.extents[:2] + 0.5
    lines = ["mtllib m.mtl", "usemtl m"]
    lines += ["v {} {} {}".format(*v) for v in mesh.vertices] + ["vt {} {}".format(*v) for v in uv]
    lines += ["f " + " ".join(f"{i + 1}/{i + 1}" for i in face) for face in mesh.faces]
    path.write_text("\n".join(lines) + "\n")
    (path.parent / "m.mtl").write_text("newmtl m\nmap_Kd texture.png\n")
    pictures = path.parent.parent / "materials" / "textures"
    home = pictures if path.parent.name == "meshes" else path.parent
    home.mkdir(parents=True, exist_ok=True)
    Image.new("RGB", (16, 16), (200, 30, 30)).save(home / "texture.png")


@pytest.fixture
def collection(tmp_path):
    """One object in each of the layouts that are out there."""
    src = tmp_path / "src"
    textured(src / "011_banana" / "google_16k" / "textured.obj")
    textured(src / "005" / "textured.obj")
    (src / "005" / "nontextured.ply").write_bytes(b"not read")
    textured(src / "Toy_Train" / "meshes" / "model.obj")
    (src / "block").mkdir()
    trimesh.creation.box((0.04, 0.04, 0.04)).export(src / "block" / "block.stl")
    (src / "block" / "block.xml").write_text(XML)
    return src


WORDS = """
011_banana: {name: banana, label: banana, category: fruit, colors: [yellow], mass_kg: 0.066}
"005": {label: red mug, synonyms: [mug], category: cup, functions: [drink]}
Toy_Train: {label: toy train, category: toy, density_kg_m3: 700}
block: {label: block, shapes: []}
"""


def take_in(src, dest, words=WORDS, **options):
    labels = src.parent / "words.yaml"
    labels.write_text(words)
    return run(ImportConfig(src=src, dest=dest, labels=labels, **options))


def snapshot(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_collections_become_a_catalogue(collection, tmp_path, capsys):
    dest = tmp_path / "dest"
    assert take_in(collection, dest) == 0
    assert capsys.readouterr().out == f"{dest}: 4 imported, 0 already there, 0 refused\n"
    catalogue = FolderCatalogue(dest)
    assert catalogue.names() == ("banana", "block", "graspnet_005", "toy_train")
    assert catalogue.by_graspnet_id("005") == "graspnet_005"
    assert catalogue.words("graspnet_005").synonyms == ("mug",)
    assert catalogue.load("banana").mass_kg == 0.066
    assert catalogue.load("toy_train").mass_kg == pytest.approx(700 * 0.05 * 0.04 * 0.03)
    for name in catalogue.names():
        root = build_object(catalogue.load(name))
        assert root.worldbody.body["object"] is not None
        np.testing.assert_allclose(catalogue.load(name).vertices[:, 2].min(), 0, atol=1e-6)


def test_importing_again_costs_nothing_and_takes_new_words(collection, tmp_path, capsys):
    dest = tmp_path / "dest"
    take_in(collection, dest)
    before = snapshot(dest)
    assert take_in(collection, dest) == 0
    assert "0 imported, 4 already there" in capsys.readouterr().out
    assert snapshot(dest) == before
    take_in(collection, dest, WORDS.replace("toy train,", "wooden train,"))
    assert "0 imported, 4 already there" in capsys.readouterr().out
    assert FolderCatalogue(dest).load("toy_train").words.label == "wooden train"


def test_what_changed_is_replaced_and_damage_repaired(collection, tmp_path, capsys):
    dest = tmp_path / "dest"
    take_in(collection, dest)
    textured(collection / "005" / "textured.obj", (0.05, 0.05, 0.05))
    (damaged,) = (dest / "objects").glob("banana-*/object.npz")
    whole = damaged.read_bytes()
    damaged.write_bytes(whole[:100])
    capsys.readouterr()
    assert take_in(collection, dest) == 0
    assert "2 imported, 2 already there" in capsys.readouterr().out
    assert damaged.read_bytes() == whole
    assert len(list((dest / "objects").iterdir())) == 4
    np.testing.assert_allclose(FolderCatalogue(dest).load("graspnet_005").size_m, 0.05, atol=1e-9)


def test_a_bad_object_is_told_and_the_others_come_in(collection, tmp_path, capsys):
    dest = tmp_path / "dest"
    (collection / "005" / "texture.png").unlink()
    assert take_in(collection, dest) == 2
    captured = capsys.readouterr()
    assert captured.err.splitlines()[-1] == (
        f"error: {collection}/005/m.mtl names 'texture.png', which does not exist; "
        "put the texture there."
    )
    assert "3 imported, 0 already there, 1 refused" in captured.out
    assert "graspnet_005" not in FolderCatalogue(dest).names()
    assert not list(dest.rglob("*005*")) and not list(dest.rglob(".*"))


def test_an_object_does_not_take_the_place_of_another(collection, tmp_path, capsys):
    dest = tmp_path / "dest"
    take_in(collection, dest)
    other = tmp_path / "more" / "banana"
    textured(other / "textured.obj", (0.1, 0.02, 0.02))
    capsys.readouterr()
    assert take_in(other, dest, "banana: {label: banana}") == 2
    assert capsys.readouterr().err.splitlines()[-1] == (
        f"error: {other}/textured.obj would replace 'banana', imported from {collection}/"
        "011_banana/google_16k/textured.obj; give it another name in the words file."
    )


def test_objects_without_words(collection, tmp_path):
    sources = find_sources(collection)
    with pytest.raises(
        WordsFileError, match=r"No words for: 005, 011_banana, Toy_Train, block; add"
    ):
        match_labels(sources, {}, "refuse")
    assert match_labels(sources, {}, "skip") == ()
    labels = [label for _, label in match_labels(sources, {}, "stem")]
    assert [label.words.label for label in labels] == [
        "graspnet 005",
        "banana",
        "toy train",
        "block",
    ]
    textured(collection / "toy-train" / "textured.obj")
    with pytest.raises(WordsFileError, match="would both be 'toy_train'"):
        match_labels(find_sources(collection), {}, "stem")


@pytest.mark.parametrize(
    ("stem", "name", "noun"),
    [
        ("011_banana", "011_banana", "banana"),
        ("065-a_cups", "065_a_cups", "cups"),
        ("Toy Train (red)", "toy_train_red", "toy train red"),
    ],
)
def test_words_from_a_name(stem, name, noun):
    label = label_from_stem(stem)
    assert (label.name, label.words.label) == (name, noun)


def test_numbers_in_keys_stay_as_they_are_written(tmp_path):
    path = tmp_path / "w.yaml"
    path.write_text("010: {label: can}\n008: {label: drill}\n")
    assert list(read_labels(path)) == ["010", "008"]


BAD_WORDS = [
    ("a: [b", "{at} is not YAML (while parsing a flow sequence"),
    ("- a", "{at} has no objects; expected a name with fields a line."),
    ("a: x", "{at}: 'a' has no fields; give at least a label."),
    ("a: {colors: [red]}", "{at}: 'a' has no label; give one, or a category and synonyms."),
    ("a: {lable: x}", "{at}: 'a' has an unknown field 'lable'; there are: name, label, category, synonyms, colors, shapes, functions, mass_kg, density_kg_m3. Did you mean 'label'?"),
    ("a: {label: x, colors: [redd]}", "{at}: 'a' has an unknown entry of colors 'redd'; there are: red, yellow, orange, green, blue, purple, pink, brown, black, white, gray. Did you mean 'red'?"),
    ("a: {label: x, category: fruits}", "{at}: 'a' has an unknown category 'fruits'; there are: fruit, container, toy, cup, sugar. Did you mean 'fruit'?"),
    ("a: {label: x, mass_kg: 10 g}", "{at}: 'a' has mass_kg '10 g'; expected a positive number."),
    ("a: {label: x, mass_kg: 1, density_kg_m3: 2}", "{at}: 'a' has mass_kg and density_kg_m3; give one of them."),
    ("a: {label: x, name: A/B}", "{at}: 'a' has the name 'A/B'; expected lower-case letters, digits and _, such as 'a_b'."),
    ("a: {label: x}\na: {label: y}", "{at} has the object 'a' twice; keep one of them."),
    ("a: {label: x}\nb: {label: y, name: a}", "{at} has the name 'a' twice; keep one of them."),
]  # fmt: skip


@pytest.mark.parametrize(("text", "message"), BAD_WORDS, ids=range(len(BAD_WORDS)))
def test_bad_words_files(tmp_path, text, message):
    path = tmp_path / "words.yaml"
    path.write_text(text)
    with pytest.raises(WordsFileError) as caught:
        read_labels(path)
    assert str(caught.value).startswith(message.format(at=path))
    assert "\n" not in str(caught.value)


def test_folders_that_hold_no_object(tmp_path):
    with pytest.raises(ImportRefusedError, match="does not exist; name a mesh"):
        find_sources(tmp_path / "none")
    with pytest.raises(ImportRefusedError, match="has no objects; expected"):
        find_sources(tmp_path)
    (tmp_path / "a").mkdir()
    for name in ("one.stl", "two.stl", "one_collision.stl"):
        (tmp_path / "a" / name).write_bytes(b"")
    with pytest.raises(ImportRefusedError, match=r"several meshes \(one\.stl, two\.stl\)"):
        find_sources(tmp_path)
    assert [s.keys[0] for s in find_sources(tmp_path / "a")] == ["one", "two"]


def test_without_coacd_one_line_says_what_to_install(monkeypatch):
    # A name that is not installed stands for coacd where it is missing.
    monkeypatch.setattr(decompose, "PACKAGE", "coacd_is_not_here")
    with pytest.raises(MissingPackageError, match=r"pip install '\.\[import\]'"):
        decompose.require_coacd()


def command(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "models.import_objects", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
    )


def test_the_command_ends_mistakes_in_one_line(collection, tmp_path):
    done = command(collection, tmp_path / "dest")
    assert (done.returncode, done.stdout) == (2, "")
    (line,) = done.stderr.splitlines()
    assert line.startswith("error: No words for: 005, 011_banana, Toy_Train, block;")
    assert not (tmp_path / "dest").exists()
    (line,) = command(collection, collection, "--unlabelled", "stem").stderr.splitlines()
    assert line.startswith(f"error: {collection} is not a catalogue: it has no catalogue.json.")
    (line,) = command(collection, tmp_path / "dest", "--scale", "0").stderr.splitlines()
    assert line == "error: --scale is 0.0; expected a positive number."


def test_help_loads_nothing_heavy():
    code = (
        "import sys; sys.argv = ['x', '--help']\n"
        "from models.import_objects import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print(sorted({'mujoco', 'trimesh', 'numpy', 'dm_control', 'coacd'} & set(sys.modules)))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.splitlines()[-1] == "[]"
    assert "SRC DEST" in out.stdout


def test_the_index_is_json_with_a_format(collection, tmp_path):
    dest = tmp_path / "dest"
    take_in(collection, dest)
    index = json.loads((dest / "catalogue.json").read_text())
    assert index["format"] == 1
    entry = index["objects"]["graspnet_005"]
    assert entry["graspnet_id"] == "005" and entry["kind"] == "mesh"
    assert index["objects"]["block"]["kind"] == "mjcf"
