"""What people get wrong, and the one line that they read."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import open3d as o3d
import pytest
from PIL import Image

from perception.errors import InvalidOptionError, PerceptionError
from perception.readers import read_pair, read_views
from perception.readers.folder import save_views
from perception.readers.frames import ReadOptions


@pytest.fixture
def folder(tmp_path: Path, make_view) -> Path:
    """Two good views, 8x6 pixels, 1 m away."""
    folder = tmp_path / "views"
    save_views([make_view(name="front"), make_view(name="side")], folder)
    return folder


def _edit(
    folder: Path, change: Callable[[dict[str, Any]], Any], name: str = "cameras.json"
) -> None:
    data = json.loads((folder / name).read_text())
    change(data)
    (folder / name).write_text(json.dumps(data))


def _front(**fields: Any) -> Callable[[Path], None]:
    return lambda folder: _edit(folder, lambda data: data["cameras"]["front"].update(fields))


def _intrinsics(**fields: Any) -> Callable[[Path], None]:
    return lambda folder: _edit(
        folder, lambda data: data["cameras"]["front"]["intrinsics"].update(fields)
    )


def _without(*path: str) -> Callable[[Path], None]:
    def change(data: dict[str, Any]) -> None:
        for key in path[:-1]:
            data = data[key]
        del data[path[-1]]

    return lambda folder: _edit(folder, change)


def _depth(array: np.ndarray) -> Callable[[Path], None]:
    return lambda folder: Image.fromarray(array).save(folder / "depth" / "front.png")


def _npy(array: np.ndarray) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        (folder / "depth" / "front.png").unlink()
        np.save(folder / "depth" / "front.npy", array)

    return write


def _cut(name: str) -> Callable[[Path], None]:
    def cut(folder: Path) -> None:
        data = (folder / name).read_bytes()
        (folder / name).write_bytes(data[: len(data) - 40])

    return cut


def _text(name: str, text: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).write_text(text) and None


def _add_image(folder: Path) -> None:
    (folder / "rgb" / "back.png").write_bytes((folder / "rgb" / "front.png").read_bytes())


METRES = np.full((6, 8), 0.75, np.float32)
HOLES = np.array(METRES)
HOLES[1, 2:5] = np.nan
SCALED = np.diag([2.0, 2.0, 2.0, 1.0]).tolist()
MIRRORED = np.diag([1.0, 1.0, -1.0, 1.0]).tolist()
SHIFTED = [*np.eye(4).tolist()[:3], [0.5, 0.0, 0.0, 1.0]]
FRONT = "{f}/cameras.json: cameras.front"


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        # Images.
        (_depth(np.full((5, 8), 900, np.uint16)),
         "{f}/depth/front.png: depth is 8x5, but front.png is 8x6; expected depth registered to the "
         "colour image, pixel by pixel."),
        (_depth(np.zeros((6, 8), np.uint16)),
         "{f}/depth/front.png: all 48 depths are 0 (no return); check the sensor, or leave the view "
         "out."),
        (_depth(np.full((6, 8), 90, np.uint8)),
         "{f}/depth/front.png: the depth image has mode L; expected a 16-bit PNG with one channel, "
         "or a .npy file."),
        (_npy(HOLES),
         "{f}/depth/front.npy: 3 of 48 depths are NaN or infinite; write 0 where the sensor saw "
         "nothing."),
        (_npy(METRES),
         "{f}/depth/front.npy: at a depth scale of 1000 units a metre the median depth is 0.00075 m; "
         "the file seems to be in metres (scale 1)."),
        (lambda f: (_npy(METRES * 1000)(f), _edit(f, lambda d: d.update(depth_scale=1))),
         "{f}/depth/front.npy: at a depth scale of 1 units a metre the median depth is 750 m; the "
         "file seems to be in millimetres (scale 1000)."),
        (_npy(-METRES * 1000),
         "{f}/depth/front.npy: depth goes down to -750; expected 0 (no return) or more."),
        (_npy(np.zeros((6, 8, 3))),
         "{f}/depth/front.npy: the array is float64 (6, 8, 3); expected numbers (H, W)."),
        (_npy(np.array([["a"]])),
         "{f}/depth/front.npy: the array is <U1 (1, 1); expected numbers (H, W)."),
        (lambda f: Image.fromarray(np.full((6, 8), 900, np.uint16)).save(f / "rgb" / "front.png"),
         "{f}/rgb/front.png: the colour image has mode I;16 (more than 8 bits a channel); expected "
         "8-bit RGB or grey. Is it a depth image?"),
        # cameras.json as a whole.
        (_text("cameras.json", '{"convention": '),
         "{f}/cameras.json: not valid JSON (Expecting value: line 1 column 16 (char 15))."),
        (_text("cameras.json", "[]"),
         "{f}/cameras.json: holds a list; expected an object {{}}."),
        (_without("cameras"),
         "{f}/cameras.json: field 'cameras' is missing. Fields: convention, depth_scale."),
        (lambda f: _edit(f, lambda d: d.update(cameras={})),
         "{f}/cameras.json: cameras is {{}}; expected an object with one entry for each view."),
        (lambda f: _edit(f, lambda d: d["cameras"].update(front=3)),
         "{f}/cameras.json: cameras.front is 3; expected an object with intrinsics and "
         "T_world_cam."),
        # Missing and extra views.
        (_without("cameras", "side"),
         "{f}/cameras.json: rgb/ holds side, but cameras has no such entry; entries: front."),
        (_add_image,
         "{f}/cameras.json: rgb/ holds back, but cameras has no such entry; entries: front, side."),
        (lambda f: (f / "depth" / "side.png").unlink(),
         "{f}/cameras.json: cameras lists side, but depth/ has no such image; images: front."),
        (lambda f: _edit(f, lambda d: d["cameras"].update(top=d["cameras"]["front"])),
         "{f}/cameras.json: cameras lists top, but rgb/ has no such image; images: front, side."),
        # Depth scale, convention.
        (_without("depth_scale"),
         FRONT + ": field 'depth_scale' is missing. Fields: convention, cameras, intrinsics, "
         "T_world_cam."),
        (_front(depth_scale=0), FRONT + ": depth_scale is 0; expected a number above 0."),
        (_front(depth_scale="mm"), FRONT + ": depth_scale is 'mm'; expected a number above 0."),
        (_without("convention"),
         FRONT + ": field 'convention' is missing. Fields: depth_scale, cameras, intrinsics, "
         "T_world_cam."),
        (_front(convention="ros"),
         FRONT + ": convention is 'ros'; expected 'cv' (x right, y down, z forward) or 'gl' (x "
         "right, y up, z backward)."),
        # Intrinsics.
        (_without("cameras", "front", "intrinsics"),
         FRONT + ": field 'intrinsics' is missing. Fields: convention, depth_scale, cameras, "
         "T_world_cam."),
        (_intrinsics(fx=-10.0),
         FRONT + ".intrinsics: fx is -10.0; expected a number above 0."),
        (_intrinsics(distortion=[0.1, -0.2, 0, 0, 0]),
         FRONT + ".intrinsics: distortion is [0.1, -0.2, 0, 0, 0]; lens distortion is not undone "
         "here. Undistort colour and depth first, give the new intrinsics, and leave the "
         "coefficients out."),
        (lambda f: _edit(f, lambda d: d["cameras"]["front"].update(k1="big")),
         FRONT + ": k1 is 'big'; lens distortion is not undone here. Undistort colour and depth "
         "first, give the new intrinsics, and leave the coefficients out."),
        (_intrinsics(fy=0), FRONT + ".intrinsics: fy is 0; expected a number above 0."),
        (_intrinsics(cx=float("nan")),
         FRONT + ".intrinsics: cx is nan; expected a number above 0."),
        (_intrinsics(cx=640.0),
         FRONT + ": the principal point (640, 2.5) lies outside the image, 8x6; the intrinsics "
         "belong to another resolution."),
        (_without("cameras", "front", "intrinsics", "fy"),
         FRONT + ".intrinsics: field 'fy' is missing. Fields: fx, cx, cy."),
        # Extrinsics.
        (_without("cameras", "front", "T_world_cam"),
         FRONT + ": neither of T_world_cam and T_cam_world given; expected one: T_world_cam maps "
         "camera coordinates into the world, T_cam_world is its inverse."),
        (_front(T_cam_world=SCALED),
         FRONT + ": both of T_world_cam and T_cam_world given; expected one: T_world_cam maps "
         "camera coordinates into the world, T_cam_world is its inverse."),
        (_front(T_world_cam=SCALED),
         FRONT + ": T_world_cam is not rigid (|R R^T - I| = 3, det R = 8, last row [0.0, 0.0, 0.0, "
         "1.0]); expected a rotation, a translation and the last row [0, 0, 0, 1]."),
        (_front(T_world_cam=MIRRORED),
         FRONT + ": T_world_cam is not rigid (|R R^T - I| = 0, det R = -1, last row [0.0, 0.0, 0.0, "
         "1.0]); expected a rotation, a translation and the last row [0, 0, 0, 1]."),
        (_front(T_world_cam=SHIFTED),
         FRONT + ": T_world_cam is not rigid (|R R^T - I| = 0, det R = 1, last row [0.5, 0.0, 0.0, "
         "1.0]); expected a rotation, a translation and the last row [0, 0, 0, 1]."),
        (_front(T_world_cam=[[1, 0, 0], [0, 1, 0], [0, 0, 1]]),
         FRONT + ": T_world_cam is [[1, 0, 0], [0, 1, 0], [0, 0, 1]]; expected 16 finite numbers."),
        (_front(T_world_cam="identity"),
         FRONT + ": T_world_cam is 'identity'; expected 16 finite numbers."),
    ],
)  # fmt: skip
def test_bad_folders(folder: Path, spoil: Callable[[Path], Any], message: str) -> None:
    spoil(folder)
    with pytest.raises(PerceptionError) as caught:
        read_views(folder)
    assert str(caught.value) == message.format(f=folder)


@pytest.mark.parametrize("name", ["rgb/front.png", "depth/front.png"])
def test_truncated_png(folder: Path, name: str) -> None:
    _cut(name)(folder)
    with pytest.raises(PerceptionError) as caught:
        read_views(folder)
    text = str(caught.value)
    assert text.startswith(f"{folder / name}: the image cannot be decoded (")
    assert text.endswith("); it is cut off or no image. Write it again.")
    assert "\n" not in text


@pytest.mark.parametrize("content", [b"", b"\x93NUMPY", b"PK\x03\x04 not an archive"])
def test_spoilt_npy(folder: Path, content: bytes) -> None:
    _npy(METRES)(folder)
    path = folder / "depth" / "front.npy"
    path.write_bytes(content)
    with pytest.raises(PerceptionError) as caught:
        read_views(folder)
    assert str(caught.value).startswith(f"{path}: no NumPy array can be read (")
    assert "\n" not in str(caught.value)


def test_pickles_are_not_opened(folder: Path) -> None:
    _npy(np.array([{"code": "may run"}], dtype=object))(folder)
    with pytest.raises(PerceptionError, match="no NumPy array can be read"):
        read_views(folder)


def test_no_folder_and_no_layout(tmp_path: Path) -> None:
    with pytest.raises(PerceptionError) as caught:
        read_views(tmp_path / "nothing")
    assert str(caught.value) == (
        f"{tmp_path / 'nothing'}: no such folder; expected a folder of views."
    )
    with pytest.raises(PerceptionError) as caught:
        read_views(tmp_path)
    assert str(caught.value) == (
        f"{tmp_path}: no known layout of views. Layouts: folder: cameras.json with rgb/ and depth/; "
        "bop: scene_camera.json with rgb/ and depth/; graspnet: camK.npy, camera_poses.npy, rgb/ "
        "and depth/; tum: rgb.txt, depth.txt and groundtruth.txt; open3d: a "
        "PinholeCameraTrajectory .json with color/ and depth/; pair: color.png, depth.png and "
        "camera.json."
    )


@pytest.mark.parametrize(
    ("layout", "message"),
    [
        ("bob", "Unknown layout 'bob'. Layouts: auto, folder, bop, graspnet, tum, open3d, pair. "
                "Did you mean 'bop'?"),
        ("tum", "{f}: is not of layout 'tum'; expected rgb.txt, depth.txt and groundtruth.txt."),
    ],
)  # fmt: skip
def test_wrong_layout(folder: Path, layout: str, message: str) -> None:
    with pytest.raises(PerceptionError) as caught:
        read_views(folder, layout)
    assert str(caught.value) == message.format(f=folder)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"max_views": 0}, "max_views is 0; expected 1 or more."),
        ({"depth_scale": -1.0}, "depth_scale is -1.0; expected a number above 0."),
        ({"max_depth_m": float("nan")}, "max_depth_m is nan; expected a number above 0."),
        (
            {"intrinsics": (0.0, 1.0, 1.0, 1.0)},
            "intrinsics: fx is 0.0; expected more than 0 pixels.",
        ),
    ],
)
def test_bad_options(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidOptionError) as caught:
        ReadOptions(**fields)
    assert str(caught.value) == message


def test_a_pair_needs_intrinsics_and_scale(tmp_path: Path) -> None:
    with pytest.raises(InvalidOptionError) as caught:
        read_pair(tmp_path / "c.png", tmp_path / "d.png", ReadOptions(depth_scale=1000))
    assert str(caught.value) == (
        f"{tmp_path / 'c.png'}: a single pair needs the camera's intrinsics: --intrinsics FX FY CX "
        "CY."
    )
    options = ReadOptions(intrinsics=(10.0, 10.0, 3.5, 2.5))
    with pytest.raises(InvalidOptionError) as caught:
        read_pair(tmp_path / "c.png", tmp_path / "d.png", options)
    assert str(caught.value) == (
        f"{tmp_path / 'd.png'}: PNG depth needs its scale, the stored units in a metre: "
        "--depth-scale 1000 for millimetres."
    )
    with pytest.raises(PerceptionError) as caught:
        read_pair(tmp_path / "c.png", tmp_path / "d.npy", options)
    assert str(caught.value) == f"{tmp_path / 'c.png'}: no such file; expected an image."


@pytest.mark.parametrize(
    ("table", "line", "message"),
    [
        ("rgb.txt", "1.0", "line 2 is '1.0'; expected a time stamp and 1 column."),
        ("depth.txt", "now depth/1.png",
         "line 2 is 'now depth/1.png'; expected a time stamp and 1 column."),
        ("groundtruth.txt", "1.0 0 0 0",
         "line 2 is '1.0 0 0 0'; expected a time stamp and 7 columns."),
        ("groundtruth.txt", "", "has no line with a time stamp."),
    ],
)  # fmt: skip
def test_bad_tum_tables(tmp_path: Path, table: str, line: str, message: str) -> None:
    good = {
        "rgb.txt": "1.0 rgb/1.png",
        "depth.txt": "1.0 depth/1.png",
        "groundtruth.txt": "1.0 0 0 0 0 0 0 1",
    }
    for name, row in {**good, table: line}.items():
        (tmp_path / name).write_text(f"# comment\n{row}\n")
    with pytest.raises(PerceptionError) as caught:
        read_views(tmp_path)
    assert str(caught.value) == f"{tmp_path / table}: {message}"


def test_tum_paths_stay_within_the_sequence(tmp_path: Path) -> None:
    (tmp_path / "rgb.txt").write_text("1.0 ../../secret.png\n")
    (tmp_path / "depth.txt").write_text("1.0 depth/1.png\n")
    (tmp_path / "groundtruth.txt").write_text("1.0 0 0 0 0 0 0 1\n")
    with pytest.raises(PerceptionError) as caught:
        read_views(tmp_path)
    assert str(caught.value) == (
        f"{tmp_path / 'rgb.txt'}: '../../secret.png' lies outside the sequence; expected a relative "
        "path within it."
    )


def test_tum_times_that_never_meet(tmp_path: Path) -> None:
    (tmp_path / "rgb.txt").write_text("1.0 rgb/1.png\n")
    (tmp_path / "depth.txt").write_text("2.0 depth/1.png\n")
    (tmp_path / "groundtruth.txt").write_text("1.0 0 0 0 0 0 0 1\n")
    with pytest.raises(PerceptionError) as caught:
        read_views(tmp_path)
    assert str(caught.value) == (
        f"{tmp_path}: no colour image has depth and pose within 0.02 s; check the time stamps of "
        "rgb.txt, depth.txt and groundtruth.txt."
    )


def test_bop_image_without_camera(tmp_path: Path) -> None:
    for part in ("rgb", "depth"):
        (tmp_path / part).mkdir()
        Image.fromarray(np.zeros((6, 8), np.uint8)).save(tmp_path / part / "000004.png")
    path = tmp_path / "scene_camera.json"
    path.write_text('{"3": {}}')
    with pytest.raises(PerceptionError) as caught:
        read_views(tmp_path)
    assert str(caught.value) == f"{path}: has no entry '4' for an image of that number."
    path.write_text('{"4": {"cam_K": [1, 2], "depth_scale": 1.0}}')
    with pytest.raises(PerceptionError) as caught:
        read_views(tmp_path)
    assert str(caught.value) == f"{path}: 4: cam_K is [1, 2]; expected 9 finite numbers."


def test_graspnet_poses_of_another_shape(tmp_path: Path) -> None:
    for part in ("rgb", "depth"):
        (tmp_path / part).mkdir()
        Image.fromarray(np.zeros((6, 8), np.uint8)).save(tmp_path / part / "0004.png")
    np.save(tmp_path / "camK.npy", np.eye(3))
    np.save(tmp_path / "camera_poses.npy", np.tile(np.eye(4), (4, 1, 1)))
    with pytest.raises(PerceptionError) as caught:
        read_views(tmp_path)
    assert str(caught.value) == (
        f"{tmp_path / 'camera_poses.npy'}: the array is (4, 4, 4); expected (F, 4, 4) with F above "
        "4, the number of the last image."
    )


def test_open3d_trajectory_of_another_length(tmp_path: Path) -> None:
    trajectory = o3d.camera.PinholeCameraTrajectory()
    trajectory.parameters = [o3d.camera.PinholeCameraParameters()]
    path = tmp_path / "poses.json"
    o3d.io.write_pinhole_camera_trajectory(str(path), trajectory)
    with pytest.raises(PerceptionError) as caught:
        read_views(tmp_path)
    assert str(caught.value) == (
        f"{path}: parameters has 1 cameras, but there are 0 colour (color/ or rgb/ or image/ or "
        "images/) and 0 depth images (depth/); expected one of each for every camera."
    )
