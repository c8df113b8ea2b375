import mujoco
import numpy as np
import pytest
from dm_control import mjcf

from models.camera_mjcf import add_cameras, principal_offset_px
from models.cameras import CAMERA_PRESETS, L515, CameraPlacement, PinholeSensor

CALIBRATED = PinholeSensor(
    width=640, height=480, fx=907.6, fy=907.7, cx=649.6, cy=376.1, range_m=(0.25, 9.0)
)


def compiled(cameras: tuple[CameraPlacement, ...]) -> tuple[mujoco.MjModel, mujoco.MjData]:
    root = mjcf.RootElement(model="cameras")
    add_cameras(root, cameras)
    model = mujoco.MjModel.from_xml_string(root.to_xml_string())
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@pytest.mark.parametrize("preset", CAMERA_PRESETS)
def test_compiled_cameras_stand_where_the_preset_puts_them(preset):
    cameras = CAMERA_PRESETS[preset]
    model, data = compiled(cameras)
    assert [model.camera(i).name for i in range(model.ncam)] == [c.name for c in cameras]
    for i, camera in enumerate(cameras):
        R_world_cam_cv = data.cam_xmat[i].reshape(3, 3) @ np.diag([1.0, -1.0, -1.0])
        np.testing.assert_allclose(R_world_cam_cv, camera.R_world_cam_cv(), atol=1e-12)
        np.testing.assert_allclose(data.cam_xpos[i], camera.position, atol=1e-12)


@pytest.mark.parametrize("sensor", [L515, CALIBRATED])
def test_compiled_intrinsics_are_those_of_the_sensor(sensor):
    camera = CameraPlacement(
        name="c", position=(0, 0, 1), target=(0, 0, 0), up=(1, 0, 0), sensor=sensor
    )
    model, _ = compiled((camera,))
    pixels_per_m = model.cam_resolution[0] / model.cam_sensorsize[0]
    in_pixels = model.cam_intrinsic[0].reshape(2, 2) * pixels_per_m
    np.testing.assert_allclose(in_pixels[0], (sensor.fx, sensor.fy), rtol=1e-6)
    np.testing.assert_allclose(in_pixels[1], principal_offset_px(sensor), rtol=1e-6)
    assert tuple(model.cam_resolution[0]) == (sensor.width, sensor.height)
    assert model.cam_fovy[0] == pytest.approx(sensor.fovy_deg, rel=1e-6)


def test_principal_point_in_the_middle_of_the_pixel_area_is_half_a_pixel_off():
    assert principal_offset_px(L515) == (-0.5, -0.5)


def test_offscreen_buffer_holds_the_largest_image_and_is_never_made_smaller():
    root = mjcf.RootElement()
    buffer = getattr(root.visual, "global")
    buffer.offwidth, buffer.offheight = 2000, 100
    add_cameras(root, CAMERA_PRESETS["sr"])
    assert (buffer.offwidth, buffer.offheight) == (2000, 720)
