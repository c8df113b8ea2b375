import functools
import io

import mujoco
import numpy as np
import pytest
from dm_control import mjcf
from PIL import Image

from models.objects.catalogue import build_asset, object_names
from models.objects.mjcf_builder import (
    COLLISION_GROUP,
    VISUAL_GROUP,
    build_object,
    obj_bytes,
    texture_bytes,
)

build = functools.cache(build_asset)
every_object = pytest.mark.parametrize("name", object_names())


@every_object
def test_compiled_body_has_the_asset_s_mass_and_inertia(name):
    asset = build(name)
    model = mjcf.Physics.from_mjcf_model(build_object(asset)).model.ptr
    body = model.body("object")
    assert body.mass[0] == pytest.approx(asset.mass_kg)
    np.testing.assert_allclose(body.ipos, asset.center_of_mass, atol=1e-9)
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, body.iquat)
    axes = axes.reshape(3, 3)
    inertia = axes @ np.diag(body.inertia) @ axes.T
    np.testing.assert_allclose(inertia, asset.inertia, atol=1e-6 * asset.inertia.max())


@every_object
def test_one_geom_is_seen_and_the_others_are_felt(name):
    asset = build(name)
    model = mjcf.Physics.from_mjcf_model(build_object(asset)).model.ptr
    seen, felt = model.geom_group == VISUAL_GROUP, model.geom_group == COLLISION_GROUP
    assert seen.sum() == 1
    assert felt.sum() == len(asset.collision) == model.ngeom - 1
    assert not model.geom_contype[seen].any() and not model.geom_conaffinity[seen].any()
    assert model.geom_contype[felt].all() and model.geom_conaffinity[felt].all()
    assert model.njnt == 0
    assert set(model.geom_condim[felt]) == {6 if asset.rolls else 4}
    convex = model.geom_type[felt] == mujoco.mjtGeom.mjGEOM_MESH
    hulls = model.geom_dataid[felt][convex]
    assert all(model.mesh_vertnum[hulls] <= 32)


def test_exported_model_compiles_to_the_same_model(tmp_path):
    root = build_object(build("red_mug"))
    mjcf.export_with_assets(root, str(tmp_path), "mug.xml")
    exported = mujoco.MjModel.from_xml_path(str(tmp_path / "mug.xml"))
    direct = mjcf.Physics.from_mjcf_model(root).model.ptr
    assert exported.ngeom == direct.ngeom
    np.testing.assert_allclose(exported.body_mass, direct.body_mass)
    np.testing.assert_allclose(exported.geom_pos, direct.geom_pos, atol=1e-6)
    np.testing.assert_array_equal(exported.tex_data, direct.tex_data)


def test_the_same_object_can_be_attached_twice_under_two_names():
    asset = build("apple")
    root = mjcf.RootElement()
    for name in ("first", "second"):
        root.attach(build_object(asset, name=name)).add("freejoint")
    model = mjcf.Physics.from_mjcf_model(root).model.ptr
    assert model.nq == 14
    assert model.body("first/object").id != model.body("second/object").id


def test_files_are_deterministic_and_lossless():
    asset = build("tomato_soup_can")
    assert obj_bytes(asset) == obj_bytes(build_asset("tomato_soup_can"))
    assert texture_bytes(asset) == texture_bytes(build_asset("tomato_soup_can"))
    image = np.asarray(Image.open(io.BytesIO(texture_bytes(asset))))
    np.testing.assert_array_equal(image, asset.texture)


@pytest.mark.render
def test_texture_is_upright_and_outside():
    # The can's label is red above and white below.
    root = mjcf.RootElement()
    root.visual.headlight.ambient = (0.8, 0.8, 0.8)
    root.attach(build_object(build("tomato_soup_can")))
    model = mjcf.Physics.from_mjcf_model(root).model.ptr
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat[:] = (0, 0, 0.05)
    camera.distance, camera.azimuth, camera.elevation = 0.4, 90, 0
    with mujoco.Renderer(model, 120, 120) as renderer:
        renderer.update_scene(data, camera)
        image = renderer.render().astype(int)
        renderer.enable_segmentation_rendering()
        renderer.update_scene(data, camera)
        rows, columns = np.nonzero(renderer.render()[..., 0] >= 0)
    middle = (rows.min() + rows.max()) / 2
    third = (rows.max() - rows.min()) / 3
    redness = (image[..., 0] - image[..., 2])[rows, columns]
    top, bottom = redness[rows < middle - third / 2], redness[rows > middle + third / 2]
    assert top.mean() > 60 > bottom.mean()
