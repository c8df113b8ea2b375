import numpy as np
import pytest

from models.cameras import CAMERA_PRESETS, L515, camera_preset
from models.errors import UnknownNameError
from models.workspace import GRASP_WORKSPACE

PLACEMENTS = [(p, c) for p, cameras in CAMERA_PRESETS.items() for c in cameras]


@pytest.mark.parametrize(("preset", "camera"), PLACEMENTS)
def test_pose_is_a_rotation_that_looks_at_the_target(preset, camera):
    pose = camera.T_world_cam_cv()
    np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1)
    target = pose[:3, :3].T @ (np.array(camera.target) - pose[:3, 3])
    np.testing.assert_allclose(target[:2], 0, atol=1e-12)
    assert target[2] > 0


@pytest.mark.parametrize(("preset", "camera"), PLACEMENTS)
def test_protocol_angles(preset, camera):
    down = np.degrees(np.arcsin(-camera.R_world_cam_cv()[2, 2]))
    assert down == pytest.approx(90 if camera.name == "top" else 45, abs=0.3)


def test_presets_have_the_three_views_of_the_protocol():
    for cameras in CAMERA_PRESETS.values():
        assert [camera.name for camera in cameras] == ["top", "left", "right"]
    assert (L515.width, L515.height, L515.fx, L515.cx, L515.cy) == (1280, 720, 914.01, 640, 360)


@pytest.mark.parametrize("camera", CAMERA_PRESETS["sr"])
def test_every_camera_sees_the_centre_of_the_table(camera):
    point = np.r_[GRASP_WORKSPACE.center[:2], 0.0]
    x, y, z = camera.R_world_cam_cv().T @ (point - camera.position)
    u, v = camera.sensor.fx * x / z + camera.sensor.cx, camera.sensor.fy * y / z + camera.sensor.cy
    assert 0 < u < camera.sensor.width and 0 < v < camera.sensor.height


def test_unknown_preset_names_those_that_exist():
    message = "Unknown camera preset 'srr'. Presets: sr, a2. Did you mean 'sr'?"
    with pytest.raises(UnknownNameError) as error:
        camera_preset("srr")
    assert str(error.value) == message
