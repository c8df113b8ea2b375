"""Pictures of objects described in MJCF: as before the import."""

import mujoco
import numpy as np
import pytest
from PIL import Image

from models.objects.mjcf_builder import VISUAL_GROUP


def test_picture_and_its_coordinates_are_unchanged(obj2mjcf, read, compiled):
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


def test_six_sided_texture_is_unchanged(obj2mjcf, read, compiled):
    directory = obj2mjcf.parent
    sides = ("right", "left", "up", "down", "front", "back")
    for index, side in enumerate(sides):
        Image.new("RGB", (16, 16), (40 * index, 0, 255)).save(directory / f"{side}.png")
    files = " ".join(f'file{side}="{side}.png"' for side in sides)
    text = obj2mjcf.read_text().replace(
        'type="2d" name="skin" file="map.png"', f'type="cube" name="skin" {files}'
    )
    obj2mjcf.write_text(text)
    original = mujoco.MjModel.from_xml_path(str(obj2mjcf))
    np.testing.assert_array_equal(compiled(read(obj2mjcf)).tex_data, original.tex_data)


def test_large_pictures_are_shrunk_and_jpegs_converted(obj2mjcf, read, compiled):
    Image.new("RGB", (1500, 750), (200, 10, 10)).save(obj2mjcf.parent / "map.jpg")
    obj2mjcf.write_text(obj2mjcf.read_text().replace("map.png", "map.jpg"))
    model = compiled(read(obj2mjcf))
    assert (model.tex_width[0], model.tex_height[0]) == (512, 256)


@pytest.mark.render
@pytest.mark.parametrize("kind", ["robosuite", "libero", "obj2mjcf"])
def test_it_looks_as_before(kind, request, read, compiled):
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
