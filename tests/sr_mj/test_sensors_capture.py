import mujoco
import numpy as np
import pytest
from dm_control import mjcf

from models.camera_mjcf import add_cameras
from models.cameras import CAMERA_PRESETS
from sr_mj.sensors.capture import capture_views
from sr_mj.sensors.l515 import L515NoiseConfig
from sr_mj.sensors.renderer import CameraRig

pytestmark = pytest.mark.render

CAMERAS = CAMERA_PRESETS["sr"]
CENTER = np.array([0.55, 0.05, 0.04])
OFF = L515NoiseConfig.off()


@pytest.fixture(scope="module")
def rig_and_data():
    root = mjcf.RootElement(model="capture")
    root.worldbody.add("light", pos=(0.5, 0, 2), dir=(0, 0, -1))
    root.worldbody.add("geom", type="plane", size=(1, 1, 0.1), rgba=(0.5, 0.5, 0.5, 1))
    root.worldbody.add("geom", type="sphere", size=(0.01,), pos=CENTER, rgba=(1, 0, 0, 1))
    add_cameras(root, CAMERAS)
    model = mujoco.MjModel.from_xml_string(root.to_xml_string())
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with CameraRig(model, CAMERAS) as rig:
        yield rig, data


def test_noise_free_views_are_the_rendered_images(rig_and_data):
    rig, data = rig_and_data
    views = capture_views(rig, data, OFF, np.random.default_rng(0))
    assert [view.name for view in views] == ["top", "left", "right"]
    for view, camera in zip(views, CAMERAS, strict=True):
        rgb, depth_m = rig.render(data, camera.name)
        np.testing.assert_array_equal(view.rgb, rgb)
        np.testing.assert_array_equal(view.depth_m, depth_m)
        np.testing.assert_allclose(view.T_world_cam_cv, camera.T_world_cam_cv(), atol=1e-12)
        for name in ("fx", "fy", "cx", "cy", "width", "height"):
            assert getattr(view.intrinsics, name) == getattr(camera.sensor, name)


def test_views_project_and_unproject_what_the_scene_holds(rig_and_data):
    rig, data = rig_and_data
    for view in capture_views(rig, data, OFF, np.random.default_rng(0)):
        is_red = view.rgb[..., 0].astype(int) > 2 * view.rgb[..., 1].astype(int)
        v, u = np.nonzero(is_red)
        projected, depth_m = view.project(CENTER[None])
        assert np.abs(projected[0] - (u.mean(), v.mean())).max() < 0.25
        assert depth_m[0] == pytest.approx(view.depth_m[is_red].min() + 0.01, abs=2e-3)

        v, u = np.nonzero(~is_red & (view.depth_m > 0))
        pixels = np.stack([u, v], axis=1).astype(float)
        points = view.unproject(pixels, view.depth_m[v, u].astype(float))
        assert np.abs(points[:, 2]).max() < 1e-4  # the ground plane
        v, u = np.nonzero(is_red)
        points = view.unproject(np.stack([u, v], axis=1).astype(float), view.depth_m[v, u])
        radii_m = np.linalg.norm(points - CENTER, axis=1)
        assert np.abs(radii_m - 0.01).max() < 3e-4  # the sphere is drawn with flat facets


def test_same_seed_same_bytes_and_every_view_has_its_own_noise(rig_and_data):
    rig, data = rig_and_data
    runs = [
        capture_views(rig, data, L515NoiseConfig(), np.random.default_rng(seed))
        for seed in (1, 1, 2)
    ]
    clean = capture_views(rig, data, OFF, np.random.default_rng(0))
    errors = []
    for first, second, other, perfect in zip(*runs, clean, strict=True):
        assert first.depth_m.tobytes() == second.depth_m.tobytes()
        assert first.rgb.tobytes() == second.rgb.tobytes()
        assert (first.depth_m != other.depth_m).mean() > 0.5
        errors.append((first.depth_m - perfect.depth_m)[300:400, 500:600].ravel())
    assert np.abs(np.corrcoef(errors) - np.eye(3)).max() < 0.05
