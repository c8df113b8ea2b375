import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from dm_control import mjcf

from models.camera_mjcf import add_cameras
from models.cameras import CAMERA_PRESETS, L515, CameraPlacement, PinholeSensor
from sr_mj.errors import ConfigError, RenderError, SceneError, UnknownNameError
from sr_mj.sensors.renderer import CameraRig

pytestmark = pytest.mark.render

ROOT = Path(__file__).parents[2]
RADIUS_M = 0.01
CENTERS = np.array(
    [[0.5, 0.0, 0.05], [0.35, 0.15, 0.03], [0.62, -0.13, 0.1], [0.6, 0.1, 0.05], [0.42, -0.1, 0.02]]
)
# A sensor with nothing symmetric about it, near what a real unit calibrates to.
CALIBRATED = PinholeSensor(
    width=960, height=540, fx=680.7, fy=690.2, cx=487.2, cy=282.1, range_m=(0.25, 9.0)
)
CAMERA_SETS = {
    **CAMERA_PRESETS,
    "calibrated": tuple(replace(c, sensor=CALIBRATED) for c in CAMERA_PRESETS["sr"]),
}
CASES = [(name, camera) for name, cameras in CAMERA_SETS.items() for camera in cameras]
CASE_IDS = [f"{name}-{camera.name}" for name, camera in CASES]


def build_root(cameras: tuple[CameraPlacement, ...], *, has_sky: bool = False) -> mjcf.RootElement:
    """A table top (z = 0) of 1.2 m, small red spheres, and a box of collision geometry."""
    root = mjcf.RootElement(model="markers")
    if has_sky:
        root.asset.add(
            "texture",
            name="sky",
            type="skybox",
            builtin="flat",
            rgb1=(0, 0, 1),
            width=8,
            height=8,
        )
    root.worldbody.add("light", pos=(0.5, 0, 2), dir=(0, 0, -1))
    root.worldbody.add(
        "geom",
        name="table",
        type="box",
        size=(0.6, 0.6, 0.02),
        pos=(0.5, 0, -0.02),
        rgba=(0.2, 0.3, 0.2, 1),
        group=1,
    )
    for i, center in enumerate(CENTERS):
        body = root.worldbody.add("body", name=f"sphere{i}", pos=center)
        body.add("geom", type="sphere", size=(RADIUS_M,), rgba=(1, 0, 0, 1))
    root.worldbody.add("geom", type="box", size=(0.2, 0.2, 0.1), pos=(0.5, 0, 0.1), group=3)
    root.worldbody.add("site", type="sphere", size=(0.05,), pos=(0.5, 0, 0.2))
    add_cameras(root, cameras)
    return root


def compiled(root: mjcf.RootElement) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(root.to_xml_string())
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@pytest.fixture(scope="module")
def rigs():
    opened = {}
    for name, cameras in CAMERA_SETS.items():
        model, data = compiled(build_root(cameras))
        opened[name] = (CameraRig(model, cameras), data, model)
    yield opened
    for rig, _, _ in opened.values():
        rig.close()


def rays(sensor: PinholeSensor) -> np.ndarray:
    """Rays (H, W, 3) through the pixels' centres at integer coordinates, z = 1."""
    u, v = np.meshgrid(np.arange(sensor.width), np.arange(sensor.height))
    return np.stack(
        [(u - sensor.cx) / sensor.fx, (v - sensor.cy) / sensor.fy, np.ones(u.shape)], axis=-1
    )


def sphere_centers_in(camera: CameraPlacement) -> np.ndarray:
    return (CENTERS - camera.position) @ camera.R_world_cam_cv()


@pytest.mark.parametrize(("set_name", "camera"), CASES, ids=CASE_IDS)
def test_markers_appear_where_the_pinhole_model_projects_them(rigs, set_name, camera):
    rig, data, model = rigs[set_name]
    body_ids = rig.render_body_ids(data, camera.name)
    rgb, _ = rig.render(data, camera.name)
    sensor, errors = camera.sensor, []
    for i, (x, y, z) in enumerate(sphere_centers_in(camera)):
        shows = body_ids == model.body(f"sphere{i}").id
        assert shows.sum() > 100
        assert (rgb[shows, 0] > 2 * rgb[shows, 1].astype(int)).all()  # the same pixels are red
        v, u = np.argwhere(shows).mean(axis=0)
        projected = (sensor.fx * x / z + sensor.cx, sensor.fy * y / z + sensor.cy)
        errors.append(np.subtract((u, v), projected))
    # Half a pixel would be a wrong convention; single pixels on the rim leave a fifth.
    assert np.abs(errors).max() < 0.25
    assert np.abs(np.mean(errors, axis=0)).max() < 0.1


@pytest.mark.parametrize(("set_name", "camera"), CASES, ids=CASE_IDS)
def test_depth_is_the_analytic_distance_along_the_optical_axis(rigs, set_name, camera):
    rig, data, model = rigs[set_name]
    _, depth_m = rig.render(data, camera.name)
    body_ids = rig.render_body_ids(data, camera.name)
    directions = rays(camera.sensor)
    assert depth_m.dtype == np.float32

    table = body_ids == 0  # the world's only visible geom; its sides face away from the cameras
    expected_m = -camera.position[2] / (directions @ camera.R_world_cam_cv()[2])
    assert table.sum() > 1000
    assert np.abs(depth_m - expected_m)[table].max() < 1e-4

    for i, center in enumerate(sphere_centers_in(camera)):
        v, u = np.argwhere(body_ids == model.body(f"sphere{i}").id).mean(axis=0).round().astype(int)
        ray = directions[v, u]
        # |s ray - center| = radius, nearer solution; ray has z = 1, so s is the depth.
        b, c = ray @ center, center @ center - RADIUS_M**2
        expected = (b - np.sqrt(b * b - ray @ ray * c)) / (ray @ ray)
        assert depth_m[v, u] == pytest.approx(expected, abs=1e-3)


def test_collision_geoms_and_sites_are_invisible(rigs):
    rig, data, model = rigs["sr"]
    _, depth_m = rig.render(data, "top")
    over_box = depth_m[360, 540:600]  # beside the spheres, under the box and the site
    np.testing.assert_allclose(over_box, 0.75, atol=1e-4)
    assert set(np.unique(rig.render_body_ids(data, "top"))) == {
        0,
        *(model.body(f"sphere{i}").id for i in range(len(CENTERS))),
    }


@pytest.mark.parametrize("has_sky", [False, True])
def test_what_no_surface_returns_has_depth_zero_and_no_body(has_sky):
    camera = CameraPlacement(name="out", position=(0.1, 0, 0.4), target=(1.6, 0, 0.2))
    model, data = compiled(build_root((camera,), has_sky=has_sky))
    with CameraRig(model, (camera,)) as rig:
        rgb, depth_m = rig.render(data, "out")
        body_ids = rig.render_body_ids(data, "out")
        again, _ = rig.render(data, "out")
    nothing = depth_m == 0
    assert nothing[0].all()
    assert not nothing[-1, 640]
    np.testing.assert_array_equal(nothing, body_ids == -1)
    assert (rgb[nothing] == ((0, 0, 255) if has_sky else (0, 0, 0))).all()
    np.testing.assert_array_equal(rgb, again)


def test_rendering_twice_gives_the_same_bytes(rigs):
    rig, data, _ = rigs["sr"]
    first, second = rig.render(data, "left"), rig.render(data, "left")
    for a, b in zip(first, second, strict=True):
        assert a.tobytes() == b.tobytes()


def test_pose_comes_from_the_state(rigs):
    rig, data, _ = rigs["sr"]
    for camera in CAMERA_PRESETS["sr"]:
        np.testing.assert_allclose(
            rig.T_world_cam_cv(data, camera.name), camera.T_world_cam_cv(), atol=1e-12
        )


def test_one_rig_outlives_another():
    cameras = CAMERA_PRESETS["sr"]
    model, data = compiled(build_root(cameras))
    with CameraRig(model, cameras) as first:
        expected, _ = first.render(data, "top")
        second = CameraRig(model, cameras)
        second.render(data, "left")
        second.close()
        second.close()
        dropped = CameraRig(model, cameras)
        del dropped
        np.testing.assert_array_equal(first.render(data, "top")[0], expected)
    with pytest.raises(RenderError, match=r"^The renderer is closed\. Make a new one\.$"):
        first.render(data, "top")


def test_images_do_not_depend_on_the_model_s_quality_settings():
    cameras = CAMERA_PRESETS["sr"]
    images = []
    for samples, size in ((0, 1280), (8, 64)):
        root = build_root(cameras)
        root.visual.quality.offsamples = samples
        getattr(root.visual, "global").offwidth = size
        model, data = compiled(root)
        with CameraRig(model, cameras) as rig:
            images.append(rig.render(data, "left"))
    for a, b in zip(*images, strict=True):
        np.testing.assert_array_equal(a, b)


def test_unknown_camera_names_those_that_exist(rigs):
    rig, data, model = rigs["sr"]
    message = "Unknown camera 'lift'. Cameras: top, left, right. Did you mean 'left'?"
    with pytest.raises(UnknownNameError) as of_rig:
        rig.render(data, "lift")
    with pytest.raises(UnknownNameError) as of_model:
        CameraRig(model, (replace(CAMERA_PRESETS["sr"][1], name="lift"),))
    assert str(of_rig.value) == str(of_model.value) == message


def test_no_camera_is_refused(rigs):
    with pytest.raises(ConfigError, match=r"^Got no cameras, expected at least one\.$"):
        CameraRig(rigs["sr"][2], ())


def test_a_camera_with_other_intrinsics_is_refused():
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody><camera name="top" fovy="{L515.fovy_deg}"/></worldbody></mujoco>'
    )
    with pytest.raises(SceneError) as error:
        CameraRig(model, CAMERA_PRESETS["sr"][:1])
    assert str(error.value) == (
        "Camera 'top' of the model has resolution [1, 1] and focal length and principal offset "
        "[0.0, 0.0, 0.0, 0.0] px, expected [1280, 720] and [914.01, 914.01, -0.5, -0.5]. "
        "Write cameras with models.camera_mjcf.add_cameras."
    )


def test_a_near_plane_inside_the_sensor_s_range_is_refused():
    cameras = CAMERA_PRESETS["sr"]
    root = build_root(cameras)
    root.statistic.extent = 40
    model, _ = compiled(root)
    with pytest.raises(SceneError) as error:
        CameraRig(model, cameras)
    assert str(error.value) == (
        "The near plane at 0.400 m cuts off what camera 'top' sees from 0.25 m on. "
        "Lower visual.map.znear or statistic.extent."
    )


def test_a_rig_left_open_is_freed_at_exit_without_noise():
    program = (
        "import mujoco\n"
        "from models.cameras import CAMERA_PRESETS\n"
        "from models.camera_mjcf import add_cameras\n"
        "from models.tabletop import build_tabletop\n"
        "from sr_mj.sensors.renderer import CameraRig\n"
        "root = build_tabletop(); add_cameras(root, CAMERA_PRESETS['sr'])\n"
        "model = mujoco.MjModel.from_xml_string(root.to_xml_string())\n"
        "data = mujoco.MjData(model); mujoco.mj_forward(model, data)\n"
        "rig = CameraRig(model, CAMERA_PRESETS['sr'])\n"
        "print(rig.render(data, 'top')[1][360, 640])\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "ignore"}
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert float(done.stdout) == pytest.approx(0.75, abs=1e-4)
