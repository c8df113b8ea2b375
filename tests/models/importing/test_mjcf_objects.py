"""Objects described in MJCF: our conventions, their geometry and contact settings."""

import dataclasses

import mujoco
import numpy as np
import pytest
import trimesh
from dm_control import mjcf

from models.drop_test import drop_object, find_faults
from models.objects.mjcf_builder import COLLISION_GROUP, VISUAL_GROUP, build_object
from models.objects.mjcf_object import decode_mjcf, encode_mjcf


@pytest.mark.parametrize("kind", ["robosuite", "libero", "obj2mjcf", "plain"])
def test_every_layout_follows_our_conventions(kind, request, read, compiled):
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
def test_every_layout_comes_to_rest_on_the_table(kind, request, read):
    assert find_faults(drop_object(read(request.getfixturevalue(kind)))) == []


def test_robosuite_object_weighs_what_is_felt_and_keeps_its_contact_settings(
    robosuite, read, compiled
):
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


def test_robosuite_s_angles_are_radians(libero, robosuite, read, compiled):
    turned = '<geom type="box" size="0.1 0.01 0.01" euler="0 0 {}"/>'
    quarter = (np.sqrt(0.5), 0, 0, np.sqrt(0.5))
    robosuite.write_text(
        robosuite.read_text().replace("<site", turned.format(1.5707963) + "<site", 1)
    )
    felt = compiled(read(robosuite)).geom("collision_0")
    np.testing.assert_allclose(np.abs(felt.quat), quarter, atol=1e-6)
    libero.write_text(libero.read_text().replace("</body>", turned.format(90) + "</body>", 1))
    felt = compiled(read(libero)).geom("collision_2")
    np.testing.assert_allclose(np.abs(felt.quat), quarter, atol=1e-6)


def test_settings_that_nobody_chose_are_ours(obj2mjcf, read, compiled):
    geom = compiled(read(obj2mjcf)).geom("collision_0")
    np.testing.assert_allclose(geom.friction, (0.7, 0.005, 0.001))
    np.testing.assert_allclose(geom.solref, (0.008, 1))


@pytest.mark.parametrize(
    ("condim", "expected"), [(1, (1, 0.9, 0.8, 0.7)), (3, (6, 0.9, 0.005, 0.001)),
                             (4, (6, 0.9, 0.8, 0.001)), (6, (6, 0.9, 0.8, 0.7))],
)  # fmt: skip
def test_what_the_author_left_without_effect_is_ours(condim, expected, plain, read, compiled):
    chosen = f'<geom condim="{condim}" friction="0.9 0.8 0.7" '
    plain.write_text(plain.read_text().replace("<geom ", chosen))
    geom = compiled(read(plain)).geom("collision_0")
    np.testing.assert_allclose((*geom.condim, *geom.friction), expected)


def test_a_ball_comes_to_rest(plain, read):
    ball = '<geom type="sphere" size="0.03" condim="4" friction="0.95 0.3 0.1" solref="0.001 1"/>'
    plain.write_text(f"<mujoco><worldbody><body>{ball}</body></worldbody></mujoco>")
    assert find_faults(drop_object(read(plain))) == []


def test_scale_moves_into_the_mesh(libero, read, compiled):
    item = read(libero)
    np.testing.assert_allclose(item.size_m, (0.08, 0.06, 0.07), atol=1e-6)
    model = compiled(item)
    # The body stood at (0.3, 0.1, 0.7), the scan's bottom 35 mm below its centre.
    np.testing.assert_allclose(model.geom("collision_1").pos, (0, 0, 0.06), atol=1e-6)
    np.testing.assert_allclose(model.geom("collision_1").size, (0.04, 0.02, 0.01))


def test_collision_geoms_are_seen_where_nothing_else_is(plain, read, compiled):
    model = compiled(read(plain))
    assert (model.geom_group == VISUAL_GROUP).sum() == (model.geom_group == COLLISION_GROUP).sum()


def test_primitives_stay_where_they_were(plain, read, compiled):
    original = mujoco.MjModel.from_xml_path(str(plain))
    data = mujoco.MjData(original)
    mujoco.mj_kinematics(original, data)
    model = compiled(read(plain))
    felt = model.geom_group == COLLISION_GROUP
    np.testing.assert_array_equal(model.geom_type[felt], original.geom_type)
    offsets = data.geom_xpos - model.geom_pos[felt]
    np.testing.assert_allclose(offsets, np.broadcast_to(offsets[0], offsets.shape), atol=1e-7)
    np.testing.assert_allclose(model.geom_size[felt], original.geom_size, atol=1e-8)


@pytest.mark.parametrize("kind", ["robosuite", "libero", "plain"])
def test_an_object_survives_its_file_and_the_same_files_give_the_same_bytes(
    kind, request, read, compiled, words
):
    path = request.getfixturevalue(kind)
    data = encode_mjcf(read(path))
    assert encode_mjcf(read(path)) == data
    item = decode_mjcf(data)
    assert encode_mjcf(item) == data
    assert item.words == words
    model, again = compiled(read(path)), compiled(item)
    np.testing.assert_array_equal(model.geom_pos, again.geom_pos)


def test_an_object_is_attached_twice_under_two_names(libero, read):
    item = read(libero)
    root = mjcf.RootElement()
    for name in ("thing", "thing_2"):
        root.attach(build_object(item, name=name)).add("freejoint")
    model = mjcf.Physics.from_mjcf_model(root).model.ptr
    assert model.nq == 14
    assert model.geom("thing/collision_0").id != model.geom("thing_2/collision_0").id


def test_a_document_exported_with_its_files_is_the_same_model(libero, tmp_path, read, compiled):
    root = build_object(read(libero))
    mjcf.export_with_assets(root, str(tmp_path / "out"), "thing.xml")
    exported = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "thing.xml"))
    np.testing.assert_allclose(exported.geom_pos, compiled(read(libero)).geom_pos, atol=1e-6)


def test_arrays_are_read_only(libero, read):
    item = read(libero)
    for field in ("vertices", "faces", "center_of_mass", "inertia"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(item, field)[0] = 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        item.name = "other"  # pyright: ignore[reportAttributeAccessIssue]
