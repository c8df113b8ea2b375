"""MJCF that cannot be used gets one clear line."""

import os

import pytest

from models.errors import ImportRefusedError
from models.importing.mjcf_folder import is_mjcf, read_mjcf_object


@pytest.mark.parametrize(
    ("file", "text", "expected"),
    [
        ("a.xml", "<mujoco/>", True),
        ("a.XML", "<?xml version='1.0'?><!-- no --><mujoco model='a'><broken", True),
        ("a.xml", "<robot/>", False),
        ("a.txt", "<mujoco/>", False),
        ("a.xml", "", False),
        ("a.xml", "mujoco", False),
    ],
)
def test_mjcf_is_recognised_by_its_root(file, text, expected, tmp_path):
    (tmp_path / file).write_text(text)
    assert is_mjcf(tmp_path / file) is expected
    assert not is_mjcf(tmp_path)
    assert not is_mjcf(tmp_path / "missing.xml")


BALL = '<geom type="sphere" size="0.03"/>'
BOMB = '<!DOCTYPE a [<!ENTITY b "bbbbbbbb"><!ENTITY c "&b;&b;&b;&b;">]>'
REFUSED = {
    "not well-formed": (
        "<mujoco><worldbody></mujoco>",
        "{p} is not well-formed XML: Opening and ending tag mismatch: worldbody line 1 and mujoco, "
        "line 1, column 29; fix it.",
    ),
    "another root": ("<robot/>", "{p} is <robot>, expected an MJCF document, <mujoco>."),
    "entities": (
        f"{BOMB}<mujoco model='&c;'/>",
        "{p} has a DOCTYPE, which MJCF does not need; remove it.",
    ),
    "include": (
        "<mujoco><include file='../secret.xml'/></mujoco>",
        "{p} includes '../secret.xml'; save it as one document without <include>.",
    ),
    "include in a body": (
        f"<mujoco><worldbody><body>{BALL}<include file='a.xml'/></body></worldbody></mujoco>",
        "{p} includes 'a.xml'; save it as one document without <include>.",
    ),
    "replicate": (
        f"<mujoco><worldbody><body><replicate count='999999999'>{BALL}</replicate></body>"
        "</worldbody></mujoco>",
        "{p} has <replicate> in line 1; only rigid objects of meshes and primitives are imported.",
    ),
    "huge texture": (
        "<mujoco><asset><texture name='t' builtin='flat' width='1000000' height='9'/></asset>"
        "</mujoco>",
        "{p} has a texture of width '1000000'; expected at most 8192.",
    ),
    "absolute path": (
        "<mujoco><asset><mesh file='/etc/passwd'/></asset></mujoco>",
        "{p} names '/etc/passwd' by an absolute path; make it relative to the file.",
    ),
    "absolute folder": (
        "<mujoco><compiler meshdir='/etc'/><asset><mesh file='passwd'/></asset></mujoco>",
        "{p} names '/etc/passwd' by an absolute path; make it relative to the file.",
    ),
    "path that leaves": (
        "<mujoco><asset><mesh file='../../a.obj'/></asset></mujoco>",
        "{p} names '../../a.obj', which leaves {r}; copy the file into the folder, or name a "
        "folder that contains both with --root.",
    ),
    "missing mesh": (
        "<mujoco><asset><mesh file='a.obj'/></asset></mujoco>",
        "{p} names 'a.obj', which does not exist; put the mesh there.",
    ),
    "missing texture": (
        "<mujoco><compiler texturedir='t'/><asset><texture name='a' file='a.png'/></asset></mujoco>",
        "{p} names 't/a.png', which does not exist; put the texture there.",
    ),
    "file in a default": (
        f"<mujoco><default><mesh file='a'/></default><worldbody><body>{BALL}</body></worldbody>"
        "</mujoco>",
        "{p} names 'a', which does not exist; put the mesh there.",
    ),
    "no geoms": (
        "<mujoco><worldbody><body/></worldbody></mujoco>",
        "{p} has no geoms; an object needs at least one.",
    ),
    "two bodies": (
        f"<mujoco><worldbody><body><freejoint/>{BALL}</body><body><freejoint/>{BALL}</body>"
        "</worldbody></mujoco>",
        "{p} has 2 bodies in its world, expected one; make a document an object.",
    ),
    "geom in the world": (
        f"<mujoco><worldbody>{BALL}<body>{BALL}</body></worldbody></mujoco>",
        "{p} has geoms outside a body; put the object's into one body and remove others.",
    ),
    "hinge": (
        f"<mujoco><worldbody><body>{BALL}<body><joint type='hinge'/>{BALL}</body></body>"
        "</worldbody></mujoco>",
        "{p} has 1 joints that are not free; only rigid objects are imported.",
    ),
    "only seen": (
        "<mujoco><worldbody><body><geom type='sphere' size='0.03' contype='0' conaffinity='0'/>"
        "</body></worldbody></mujoco>",
        "{p} has no collision geoms, only visual ones; import its mesh instead, which is then "
        "decomposed.",
    ),
    "massless": (
        "<mujoco><worldbody><body><geom type='sphere' size='0.03' mass='0'/></body></worldbody>"
        "</mujoco>",
        "{p} has no mass: neither <inertial> nor collision geoms with a density; give mass_kg in "
        "the words file.",
    ),
    "plane": (
        f"<mujoco><worldbody><body>{BALL.replace('sphere', 'plane').replace('0.03', '1 1 1')}"
        "</body></worldbody></mujoco>",
        "{p} has a geom of type 'plane'; expected solids.",
    ),
    "millimetres": (
        f"<mujoco><worldbody><body>{BALL.replace('0.03', '30')}</body></worldbody></mujoco>",
        "{p} is 60 m large, expected 0.003 to 0.4 m; if its unit is another, correct the attribute "
        'scale="..." of its meshes.',
    ),
    "computed mesh": (
        "<mujoco><asset><mesh name='m' builtin='sphere' params='30'/></asset></mujoco>",
        "{p} computes the mesh 'm' (builtin='sphere'); save it to a file.",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_used_gets_one_clear_line(case, tmp_path, words):
    text, expected = REFUSED[case]
    path = tmp_path / "thing" / "thing.xml"
    path.parent.mkdir()
    path.write_text(text)
    with pytest.raises(ImportRefusedError) as caught:
        read_mjcf_object(path, name="thing", words=words, root=path.parent)
    message = str(caught.value)
    assert message == expected.format(p=path, r=path.parent)
    assert "\n" not in message


def test_a_link_out_of_the_folder_is_refused(libero, tmp_path, words):
    inner = tmp_path / "inner"
    inner.mkdir()
    (inner / "textured.xml").write_text(libero.read_text())
    os.symlink(tmp_path / "map.png", inner / "map.png")
    os.symlink(tmp_path / "visual", inner / "visual")
    with pytest.raises(ImportRefusedError, match=r"names 'map\.png', which leaves .*inner;"):
        read_mjcf_object(inner / "textured.xml", name="thing", words=words, root=inner)


def test_a_damaged_texture_is_refused(libero, read):
    file = libero.parent / "map.png"
    file.write_bytes(file.read_bytes()[:200])
    with pytest.raises(
        ImportRefusedError, match=rf"^Texture {file} cannot be read \(.*\); replace"
    ):
        read(libero)


def test_what_mujoco_refuses_is_passed_on_in_one_line(plain, read):
    plain.write_text(plain.read_text().replace('size="0.02 0.05"', 'size="0.02"'))
    with pytest.raises(ImportRefusedError, match=r"^MuJoCo refuses .* \(.*size.*\); fix") as caught:
        read(plain)
    assert "\n" not in str(caught.value)


def test_a_damaged_mesh_is_refused(libero, read):
    (libero.parent / "visual" / "scan.obj").write_text("v 0 0\nf 1 2 3\n")
    with pytest.raises(ImportRefusedError, match=rf"^MuJoCo refuses {libero} \(.*\); fix"):
        read(libero)


def test_too_many_triangles_are_refused_before_they_are_read(libero, read):
    (libero.parent / "visual" / "scan.obj").write_text("f 1 2 3\n" * 2_000_001)
    with pytest.raises(
        ImportRefusedError, match=r"has 2000001 triangles, at most 2000000 are read"
    ):
        read(libero)
