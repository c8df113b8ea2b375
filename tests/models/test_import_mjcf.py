import dataclasses
import os

import mujoco
import numpy as np
import pytest
import trimesh
from dm_control import mjcf
from PIL import Image

from models.drop_test import drop_object, find_faults
from models.errors import ImportRefusedError
from models.importing.mjcf_folder import is_mjcf, read_mjcf_object
from models.objects.mjcf_builder import COLLISION_GROUP, VISUAL_GROUP, build_object
from models.objects.mjcf_object import decode_mjcf, encode_mjcf
from models.objects.words import ObjectWords

WORDS = ObjectWords(label="thing", synonyms=("object",), colors=("red",))

# As robosuite keeps them: a picture on all sides of a cube, the mesh both seen and felt, twice
# drawn, and sites that tell where the object ends.
ROBOSUITE = """
<mujoco model="tin">
  <asset>
    <mesh file="meshes/tin.stl" name="tin_mesh"/>
    <texture file="../textures/tin.png" name="tex-tin"/>
    <material name="paint" texture="tex-tin" texuniform="true" texrepeat="5 5" reflectance="0.7"/>
  </asset>
  <worldbody>
    <body>
      <body name="collision">
        <geom type="mesh" mesh="tin_mesh" density="100" friction="0.95 0.3 0.1" group="1"
          solref="0.001 1" solimp="0.998 0.998 0.001" condim="4" euler="0 0 0.5"/>
      </body>
      <body name="visual">
        <geom type="mesh" mesh="tin_mesh" material="paint" contype="0" conaffinity="0" group="0"
          mass="0.0001" euler="0 0 0.5"/>
        <geom type="mesh" mesh="tin_mesh" material="paint" contype="0" conaffinity="0" group="1"
          mass="0.0001" euler="0 0 0.5"/>
      </body>
      <site name="bottom_site" pos="0 0 -0.03"/>
      <site name="top_site" pos="0 0 0.03"/>
      <site name="horizontal_radius_site" pos="0.02 0.02 0"/>
    </body>
  </worldbody>
</mujoco>
"""
# As LIBERO keeps them: a scaled scan, and boxes that cover it.
LIBERO = """
<mujoco model="textured">
  <asset>
    <texture file="map.png" name="tex" type="2d"/>
    <material name="textured" texture="tex" texuniform="false"/>
    <mesh file="visual/scan.obj" name="scan" scale="0.01 0.01 0.01"/>
  </asset>
  <worldbody>
    <body>
      <body name="object" pos="0.3 0.1 0.7">
        <geom type="mesh" mesh="scan" material="textured" density="100" contype="0" conaffinity="0"
          group="1"/>
        <geom type="box" size="0.04 0.03 0.025" density="100" group="0" rgba="0.8 0.8 0.8 0.3"/>
        <geom type="box" size="0.04 0.02 0.01" density="100" pos="0 0 0.025" quat="0 1 0 0"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
# As obj2mjcf writes them: classes, names taken from files, one hull a file.
OBJ2MJCF = """
<mujoco model="scan">
  <default>
    <default class="visual"><geom group="2" type="mesh" contype="0" conaffinity="0"/></default>
    <default class="collision"><geom group="3" type="mesh"/></default>
  </default>
  <asset>
    <texture type="2d" name="skin" file="map.png"/>
    <material name="skin" texture="skin" specular="0.4" shininess="0.1"/>
    <mesh file="scan.obj"/>
    <mesh file="scan_collision_0.obj"/>
  </asset>
  <worldbody>
    <body name="scan">
      <freejoint/>
      <geom material="skin" mesh="scan" class="visual"/>
      <geom mesh="scan_collision_0" class="collision"/>
    </body>
  </worldbody>
</mujoco>
"""
PLAIN = """
<mujoco>
  <worldbody>
    <body>
      <inertial pos="0.01 0 0" mass="0.2" diaginertia="1e-4 2e-4 2e-4"/>
      <geom type="cylinder" size="0.02 0.05" pos="0 0 0.05"/>
      <body pos="0 0 0.1" euler="0 90 0">
        <inertial pos="0 0 0" mass="0.1" diaginertia="1e-5 1e-5 2e-5"/>
        <geom type="capsule" size="0.01" fromto="0 0 0 0.05 0 0.02"/>
        <geom type="ellipsoid" size="0.01 0.02 0.03" pos="0 0.02 0"/>
        <geom type="sphere" size="0.015" pos="0 -0.02 0"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def textured_box(extents, path):
    """Save a box with texture coordinates, each side with the whole picture."""
    box = trimesh.creation.box(extents)
    corners = box.vertices[box.faces].reshape(-1, 3)
    along = np.abs(np.repeat(box.face_normals, 3, axis=0)).argmax(axis=1)
    kept = np.array([(1, 2), (0, 2), (0, 1)])[along]
    uv = np.take_along_axis(corners / extents + 0.5, kept, axis=1)
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"vt {u} {v}" for u, v in uv]
    lines += [f"f {i}/{i} {i + 1}/{i + 1} {i + 2}/{i + 2}" for i in range(1, 37, 3)]
    path.write_text("\n".join(lines) + "\n")


def picture(path, mode="RGB"):
    path.parent.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(4)
    channels = len(mode)
    pixels = rng.integers(0, 256, (24, 24, channels), dtype=np.uint8)
    pixels[:12, :, 0] = 250
    Image.fromarray(pixels.squeeze(), mode).resize((96, 96), Image.Resampling.NEAREST).save(path)


@pytest.fixture
def robosuite(tmp_path):
    (tmp_path / "objects" / "meshes").mkdir(parents=True)
    trimesh.creation.cylinder(0.03, 0.07).export(tmp_path / "objects" / "meshes" / "tin.stl")
    picture(tmp_path / "textures" / "tin.png")
    path = tmp_path / "objects" / "tin.xml"
    path.write_text(ROBOSUITE)
    return path


@pytest.fixture
def libero(tmp_path):
    textured_box(np.array([8, 6, 7]), tmp_path / "visual" / "scan.obj")
    picture(tmp_path / "map.png")
    path = tmp_path / "textured.xml"
    path.write_text(LIBERO)
    return path


@pytest.fixture
def obj2mjcf(tmp_path):
    textured_box(np.array([0.08, 0.06, 0.07]), tmp_path / "scan.obj")
    trimesh.creation.box((0.08, 0.06, 0.07)).export(tmp_path / "scan_collision_0.obj")
    picture(tmp_path / "map.png")
    path = tmp_path / "scan.xml"
    path.write_text(OBJ2MJCF)
    return path


@pytest.fixture
def plain(tmp_path):
    path = tmp_path / "plain.xml"
    path.write_text(PLAIN)
    return path


def read(path, **options):
    return read_mjcf_object(path, name="thing", words=WORDS, root=path.parents[1], **options)


def compiled(item):
    return mjcf.Physics.from_mjcf_model(build_object(item)).model.ptr


@pytest.mark.parametrize("kind", ["robosuite", "libero", "obj2mjcf", "plain"])
def test_every_layout_follows_our_conventions(kind, request):
    item = read(request.getfixturevalue(kind))
    model = compiled(item)
    seen, felt = model.geom_group == VISUAL_GROUP, model.geom_group == COLLISION_GROUP
    assert model.njnt == model.nsite == 0 and model.nbody == 2
    assert seen.sum() >= 1 and felt.sum() >= 1 and (seen | felt).all()
    assert not model.geom_contype[seen].any() and not model.geom_conaffinity[seen].any()
    assert (model.geom_contype[felt] == 1).all() and (model.geom_conaffinity[felt] == 1).all()
    names = {model.geom(i).name for i in np.flatnonzero(felt)}
    assert names == {f"collision_{i}" for i in range(felt.sum())}
    assert model.body("object").mass[0] == pytest.approx(item.mass_kg)
    np.testing.assert_allclose(model.body("object").ipos, item.center_of_mass, atol=1e-9)
    low, high = item.vertices.min(axis=0), item.vertices.max(axis=0)
    np.testing.assert_allclose([*(low + high)[:2] / 2, low[2]], 0, atol=2e-7)


@pytest.mark.parametrize("kind", ["robosuite", "libero", "obj2mjcf"])
def test_every_layout_comes_to_rest_on_the_table(kind, request):
    assert find_faults(drop_object(read(request.getfixturevalue(kind)))) == []


def test_robosuite_object_weighs_what_is_felt_and_keeps_its_contact_settings(robosuite):
    item = read(robosuite)
    model = compiled(item)
    volume = trimesh.load_mesh(robosuite.parent / "meshes" / "tin.stl").volume
    assert item.mass_kg == pytest.approx(100 * volume, rel=1e-4)
    assert model.ngeom == 2  # the repeated visual geom is gone
    geom = model.geom("collision_0")
    # Four dimensions have no rolling friction, so the 0.1 has never had an effect; see below.
    np.testing.assert_allclose(geom.friction, (0.95, 0.3, 0.001))
    np.testing.assert_allclose(geom.solref, (0.001, 1))
    np.testing.assert_allclose(geom.solimp[:3], (0.998, 0.998, 0.001))
    assert geom.condim[0] == 6
    assert item.size_m[2] == pytest.approx(0.07, abs=1e-6)


def test_robosuite_s_angles_are_radians(libero, robosuite):
    turned = '<geom type="box" size="0.1 0.01 0.01" euler="0 0 {}"/>'
    quarter = (np.sqrt(0.5), 0, 0, np.sqrt(0.5))
    robosuite.write_text(ROBOSUITE.replace("<site", turned.format(1.5707963) + "<site", 1))
    felt = compiled(read(robosuite)).geom("collision_0")
    np.testing.assert_allclose(np.abs(felt.quat), quarter, atol=1e-6)
    libero.write_text(LIBERO.replace("</body>", turned.format(90) + "</body>", 1))
    felt = compiled(read(libero)).geom("collision_2")
    np.testing.assert_allclose(np.abs(felt.quat), quarter, atol=1e-6)


def test_settings_that_nobody_chose_are_ours(obj2mjcf):
    geom = compiled(read(obj2mjcf)).geom("collision_0")
    np.testing.assert_allclose(geom.friction, (0.7, 0.005, 0.001))
    np.testing.assert_allclose(geom.solref, (0.008, 1))


@pytest.mark.parametrize(
    ("condim", "expected"), [(1, (1, 0.9, 0.8, 0.7)), (3, (6, 0.9, 0.005, 0.001)),
                             (4, (6, 0.9, 0.8, 0.001)), (6, (6, 0.9, 0.8, 0.7))],
)  # fmt: skip
def test_what_the_author_left_without_effect_is_ours(condim, expected, plain):
    chosen = f'<geom condim="{condim}" friction="0.9 0.8 0.7" '
    plain.write_text(PLAIN.replace("<geom ", chosen))
    geom = compiled(read(plain)).geom("collision_0")
    np.testing.assert_allclose((*geom.condim, *geom.friction), expected)


def test_a_ball_comes_to_rest(plain):
    ball = '<geom type="sphere" size="0.03" condim="4" friction="0.95 0.3 0.1" solref="0.001 1"/>'
    plain.write_text(f"<mujoco><worldbody><body>{ball}</body></worldbody></mujoco>")
    assert find_faults(drop_object(read(plain))) == []


def test_scale_moves_into_the_mesh(libero):
    item = read(libero)
    np.testing.assert_allclose(item.size_m, (0.08, 0.06, 0.07), atol=1e-6)
    model = compiled(item)
    # The body stood at (0.3, 0.1, 0.7), the scan's bottom 35 mm below its centre.
    np.testing.assert_allclose(model.geom("collision_1").pos, (0, 0, 0.06), atol=1e-6)
    np.testing.assert_allclose(model.geom("collision_1").size, (0.04, 0.02, 0.01))


def test_picture_and_its_coordinates_are_unchanged(obj2mjcf):
    original = mujoco.MjModel.from_xml_path(str(obj2mjcf))
    model = compiled(read(obj2mjcf))
    np.testing.assert_array_equal(model.tex_data, original.tex_data)
    mesh = original.mesh("scan").id
    assert original.mesh_texcoordnum[mesh] == 36
    end = original.mesh_texcoordadr[mesh] + original.mesh_texcoordnum[mesh]
    np.testing.assert_allclose(
        model.mesh_texcoord, original.mesh_texcoord[original.mesh_texcoordadr[mesh] : end],
        atol=1e-6,
    )  # fmt: skip
    assert model.mat_specular[0] == pytest.approx(0.4)


def test_six_sided_texture_is_unchanged(obj2mjcf):
    directory = obj2mjcf.parent
    sides = ("right", "left", "up", "down", "front", "back")
    for index, side in enumerate(sides):
        Image.new("RGB", (16, 16), (40 * index, 0, 255)).save(directory / f"{side}.png")
    files = " ".join(f'file{side}="{side}.png"' for side in sides)
    text = OBJ2MJCF.replace(
        'type="2d" name="skin" file="map.png"', f'type="cube" name="skin" {files}'
    )
    obj2mjcf.write_text(text)
    original = mujoco.MjModel.from_xml_path(str(obj2mjcf))
    np.testing.assert_array_equal(compiled(read(obj2mjcf)).tex_data, original.tex_data)


def test_large_pictures_are_shrunk_and_jpegs_converted(obj2mjcf):
    Image.new("RGB", (1500, 750), (200, 10, 10)).save(obj2mjcf.parent / "map.jpg")
    obj2mjcf.write_text(OBJ2MJCF.replace("map.png", "map.jpg"))
    model = compiled(read(obj2mjcf))
    assert (model.tex_width[0], model.tex_height[0]) == (512, 256)


@pytest.mark.render
@pytest.mark.parametrize("kind", ["robosuite", "libero", "obj2mjcf"])
def test_it_looks_as_before(kind, request):
    path = request.getfixturevalue(kind)
    item = read(path)
    angle = "radian" if kind == "robosuite" else "degree"
    spec = mujoco.MjSpec.from_file(str(path))
    spec.compiler.degree = angle == "degree"
    original = spec.compile()
    base = {"robosuite": (0, 0, -0.035), "libero": (0.3, 0.1, 0.665), "obj2mjcf": (0, 0, -0.035)}
    # Groups differ: what is seen lies in 0 to 2 here, boxes that are only felt are left out there.
    visible = {"robosuite": [0], "libero": [1], "obj2mjcf": [2]}[kind]
    before = photograph(original, np.array(base[kind]), visible)
    after = photograph(compiled(item), np.zeros(3), [VISUAL_GROUP])
    difference = np.abs(before.astype(int) - after.astype(int)).max(axis=2)
    assert np.mean(difference > 12) < 0.01


def photograph(model, base, groups):
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    option = mujoco.MjvOption()
    option.geomgroup[:] = [group in groups for group in range(6)]
    camera = mujoco.MjvCamera()
    camera.lookat[:] = base + np.array([0, 0, 0.03])
    camera.distance, camera.azimuth, camera.elevation = 0.2, 130, -30
    with mujoco.Renderer(model, 160, 160) as renderer:
        renderer.update_scene(data, camera, option)
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
        return renderer.render()


def test_masses_of_nested_bodies_add_up(plain):
    item = read(plain)
    original = mujoco.MjModel.from_xml_path(str(plain))
    data = mujoco.MjData(original)
    mujoco.mj_forward(original, data)
    assert item.mass_kg == pytest.approx(0.3)
    np.testing.assert_allclose(
        item.center_of_mass - compiled(item).geom("collision_0").pos + (0, 0, 0.05),
        (0.2 * np.array([0.01, 0, 0]) + 0.1 * np.array([0, 0, 0.1])) / 0.3,
        atol=1e-7,
    )
    # Two points of 0.2 and 0.1 kg, 0.01 and 0.1 m apart, besides the bodies' own inertia; the
    # second is turned a quarter about y.
    arm = np.array([0.01, 0, -0.1])
    apart = 0.2 * 0.1 / 0.3 * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    own = np.diag([1e-4, 2e-4, 2e-4]) + np.diag([2e-5, 1e-5, 1e-5])
    np.testing.assert_allclose(item.inertia, apart + own, atol=1e-9)


def test_collision_geoms_are_seen_where_nothing_else_is(plain):
    model = compiled(read(plain))
    assert (model.geom_group == VISUAL_GROUP).sum() == (model.geom_group == COLLISION_GROUP).sum()


def test_primitives_stay_where_they_were(plain):
    original = mujoco.MjModel.from_xml_path(str(plain))
    data = mujoco.MjData(original)
    mujoco.mj_kinematics(original, data)
    model = compiled(read(plain))
    felt = model.geom_group == COLLISION_GROUP
    np.testing.assert_array_equal(model.geom_type[felt], original.geom_type)
    offsets = data.geom_xpos - model.geom_pos[felt]
    np.testing.assert_allclose(offsets, np.broadcast_to(offsets[0], offsets.shape), atol=1e-7)
    np.testing.assert_allclose(model.geom_size[felt], original.geom_size, atol=1e-8)


def test_a_given_mass_scales_the_inertia(libero):
    own, given = read(libero), read(libero, mass_kg=0.3)
    assert given.mass_kg == 0.3
    np.testing.assert_allclose(given.inertia, own.inertia * (0.3 / own.mass_kg), rtol=1e-4)
    np.testing.assert_array_equal(given.center_of_mass, own.center_of_mass)


def test_a_massless_object_takes_the_given_mass_of_its_hull(libero):
    libero.write_text(LIBERO.replace('density="100"', 'mass="0"'))
    item = read(libero, mass_kg=0.12)
    # A box of 80 x 60 x 70 mm.
    expected = 0.01 * np.diag([0.06**2 + 0.07**2, 0.08**2 + 0.07**2, 0.08**2 + 0.06**2])
    np.testing.assert_allclose(item.inertia, expected, atol=1e-9)
    np.testing.assert_allclose(item.center_of_mass, (0, 0, 0.035), atol=1e-6)


def test_an_open_mesh_weighs_as_much_as_its_hull(obj2mjcf):
    box = trimesh.creation.box((0.08, 0.06, 0.07))
    trimesh.Trimesh(box.vertices, box.faces[:-1]).export(obj2mjcf.parent / "scan_collision_0.obj")
    item = read(obj2mjcf)
    assert item.mass_kg == pytest.approx(1000 * 0.08 * 0.06 * 0.07)
    np.testing.assert_allclose(item.center_of_mass, (0, 0, 0.035), atol=1e-6)


@pytest.mark.parametrize("kind", ["robosuite", "libero", "plain"])
def test_an_object_survives_its_file_and_the_same_files_give_the_same_bytes(kind, request):
    path = request.getfixturevalue(kind)
    data = encode_mjcf(read(path))
    assert encode_mjcf(read(path)) == data
    item = decode_mjcf(data)
    assert encode_mjcf(item) == data
    assert item.words == WORDS
    model, again = compiled(read(path)), compiled(item)
    np.testing.assert_array_equal(model.geom_pos, again.geom_pos)


def test_an_object_is_attached_twice_under_two_names(libero):
    item = read(libero)
    root = mjcf.RootElement()
    for name in ("thing", "thing_2"):
        root.attach(build_object(item, name=name)).add("freejoint")
    model = mjcf.Physics.from_mjcf_model(root).model.ptr
    assert model.nq == 14
    assert model.geom("thing/collision_0").id != model.geom("thing_2/collision_0").id


def test_a_document_exported_with_its_files_is_the_same_model(libero, tmp_path):
    root = build_object(read(libero))
    mjcf.export_with_assets(root, str(tmp_path / "out"), "thing.xml")
    exported = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "thing.xml"))
    np.testing.assert_allclose(exported.geom_pos, compiled(read(libero)).geom_pos, atol=1e-6)


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
def test_what_cannot_be_used_gets_one_clear_line(case, tmp_path):
    text, expected = REFUSED[case]
    path = tmp_path / "thing" / "thing.xml"
    path.parent.mkdir()
    path.write_text(text)
    with pytest.raises(ImportRefusedError) as caught:
        read_mjcf_object(path, name="thing", words=WORDS, root=path.parent)
    message = str(caught.value)
    assert message == expected.format(p=path, r=path.parent)
    assert "\n" not in message


def test_a_link_out_of_the_folder_is_refused(libero, tmp_path):
    inner = tmp_path / "inner"
    inner.mkdir()
    (inner / "textured.xml").write_text(LIBERO)
    os.symlink(tmp_path / "map.png", inner / "map.png")
    os.symlink(tmp_path / "visual", inner / "visual")
    with pytest.raises(ImportRefusedError, match=r"names 'map\.png', which leaves .*inner;"):
        read_mjcf_object(inner / "textured.xml", name="thing", words=WORDS, root=inner)


def test_a_damaged_texture_is_refused(libero):
    file = libero.parent / "map.png"
    file.write_bytes(file.read_bytes()[:200])
    with pytest.raises(
        ImportRefusedError, match=rf"^Texture {file} cannot be read \(.*\); replace"
    ):
        read(libero)


def test_what_mujoco_refuses_is_passed_on_in_one_line(plain):
    plain.write_text(PLAIN.replace('size="0.02 0.05"', 'size="0.02"'))
    with pytest.raises(ImportRefusedError, match=r"^MuJoCo refuses .* \(.*size.*\); fix") as caught:
        read(plain)
    assert "\n" not in str(caught.value)


def test_a_damaged_mesh_is_refused(libero):
    (libero.parent / "visual" / "scan.obj").write_text("v 0 0\nf 1 2 3\n")
    with pytest.raises(ImportRefusedError, match=rf"^MuJoCo refuses {libero} \(.*\); fix"):
        read(libero)


def test_too_many_triangles_are_refused_before_they_are_read(libero):
    (libero.parent / "visual" / "scan.obj").write_text("f 1 2 3\n" * 2_000_001)
    with pytest.raises(
        ImportRefusedError, match=r"has 2000001 triangles, at most 2000000 are read"
    ):
        read(libero)


def test_arrays_are_read_only(libero):
    item = read(libero)
    for field in ("vertices", "faces", "center_of_mass", "inertia"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(item, field)[0] = 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        item.name = "other"  # pyright: ignore[reportAttributeAccessIssue]
