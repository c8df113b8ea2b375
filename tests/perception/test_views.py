import numpy as np
import pytest

from perception.errors import InvalidViewError
from perception.views import CameraView, Intrinsics

GOOD = {"fx": 10.0, "fy": 10.0, "cx": 3.5, "cy": 2.5, "width": 8, "height": 6}


def _scaled() -> np.ndarray:
    return np.diag([2.0, 2.0, 2.0, 1.0])


def _mirrored() -> np.ndarray:
    return np.diag([1.0, 1.0, -1.0, 1.0])


def _depth_with(value: float) -> np.ndarray:
    depth = np.ones((6, 8), np.float32)
    depth[2, 3] = value
    return depth


def test_project_inverts_unproject(table_views: tuple[CameraView, ...]) -> None:
    rng = np.random.default_rng(0)
    pixels = rng.uniform((0, 0), (639, 359), (500, 2))
    depth = rng.uniform(0.3, 2.0, 500)
    for view in table_views:
        again, depth_again = view.project(view.unproject(pixels, depth))
        np.testing.assert_allclose(again, pixels, atol=1e-9)
        np.testing.assert_allclose(depth_again, depth, atol=1e-12)


def test_principal_point_looks_along_the_optical_axis(make_view) -> None:
    view = make_view()
    np.testing.assert_allclose(
        view.unproject(np.array([[3.5, 2.5]]), np.array([2.0])), [[0.0, 0.0, 2.0]]
    )


def test_points_behind_the_camera_have_no_pixel(make_view) -> None:
    pixels, depth = make_view().project(np.array([[0.1, 0.2, -1.0]]))
    assert np.isnan(pixels).all()
    assert depth[0] == -1.0


def test_inverse_pose(table_views: tuple[CameraView, ...]) -> None:
    for view in table_views:
        np.testing.assert_allclose(view.T_cam_cv_world @ view.T_world_cam_cv, np.eye(4), atol=1e-12)


def test_arrays_are_read_only(make_view) -> None:
    view = make_view()
    for array in (view.rgb, view.depth_m, view.T_world_cam_cv, view.T_cam_cv_world):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_callers_array_stays_writable(make_view) -> None:
    depth = np.ones((6, 8), np.float32)
    make_view(depth_m=depth)
    assert depth.flags.writeable


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"fx": -1.0}, "Intrinsics: fx is -1.0, expected more than 0."),
        ({"fy": 0.0}, "Intrinsics: fy is 0.0, expected more than 0."),
        ({"width": 0}, "Intrinsics: width is 0, expected more than 0."),
        ({"height": -6}, "Intrinsics: height is -6, expected more than 0."),
        ({"cx": float("nan")}, "Intrinsics: cx is nan, expected a finite number."),
        ({"fx": float("inf")}, "Intrinsics: fx is inf, expected more than 0."),
    ],
)
def test_bad_intrinsics(changes: dict[str, float], message: str) -> None:
    with pytest.raises(InvalidViewError) as caught:
        Intrinsics(**{**GOOD, **changes})
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"rgb": np.zeros((5, 8, 3), np.uint8)},
            "View 'front': rgb is uint8 (5, 8, 3), expected uint8 (6, 8, 3).",
        ),
        (
            {"rgb": np.zeros((6, 8, 3), np.float32)},
            "View 'front': rgb is float32 (6, 8, 3), expected uint8 (6, 8, 3).",
        ),
        (
            {"depth_m": np.ones((8, 6), np.float32)},
            "View 'front': depth_m is float32 (8, 6), expected float32 (6, 8).",
        ),
        (
            {"depth_m": np.ones((6, 8), np.uint16)},
            "View 'front': depth_m is uint16 (6, 8), expected float32 (6, 8).",
        ),
        (
            {"depth_m": _depth_with(float("nan"))},
            "View 'front': depth_m has 1 values that are not finite, expected none.",
        ),
        (
            {"depth_m": _depth_with(-0.25)},
            "View 'front': depth_m goes down to -0.25 m; expected 0 (no return) or more.",
        ),
        (
            {"T_world_cam_cv": np.eye(3)},
            "View 'front': T_world_cam_cv is float64 (3, 3), expected float64 (4, 4).",
        ),
        (
            {"T_world_cam_cv": _scaled()},
            "View 'front': T_world_cam_cv is not rigid (|R R^T - I| = 3, det R = 8, last row "
            "[0.0, 0.0, 0.0, 1.0]); expected a rotation, a translation in metres and the last row "
            "[0, 0, 0, 1].",
        ),
        (
            {"T_world_cam_cv": _mirrored()},
            "View 'front': T_world_cam_cv is not rigid (|R R^T - I| = 0, det R = -1, last row "
            "[0.0, 0.0, 0.0, 1.0]); expected a rotation, a translation in metres and the last row "
            "[0, 0, 0, 1].",
        ),
    ],
)
def test_bad_views(make_view, changes: dict[str, np.ndarray], message: str) -> None:
    with pytest.raises(InvalidViewError) as caught:
        make_view(**changes)
    assert str(caught.value) == message
