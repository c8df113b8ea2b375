"""Every layout, written from the same synthetic views, gives those views back."""

import json
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from perception.errors import InvalidFileError, InvalidOptionError, PerceptionError
from perception.readers import LAYOUTS, detect_layout, list_views, read_pair, read_views
from perception.readers.folder import save_views
from perception.readers.frames import ReadOptions
from perception.views import CameraView

GL_CV = np.diag([1.0, -1.0, -1.0, 1.0])


def _image(path: Path, array: np.ndarray) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(array).save(path)
    return path


def _depth_png(path: Path, view: CameraView, units_per_m: float) -> Path:
    return _image(path, np.rint(view.depth_m * units_per_m).astype(np.uint16))


def _write_bop(views: tuple[CameraView, ...], folder: Path) -> None:
    cameras = {}
    for number, view in enumerate(views):
        _image(folder / "rgb" / f"{number:06d}.png", view.rgb)
        _depth_png(folder / "depth" / f"{number:06d}.png", view, 10000)
        T = view.T_cam_cv_world
        cameras[str(number)] = {
            "cam_K": view.intrinsics.matrix().ravel().tolist(),
            "cam_R_w2c": T[:3, :3].ravel().tolist(),
            "cam_t_w2c": (T[:3, 3] * 1000).tolist(),
            "depth_scale": 0.1,
        }
    (folder / "scene_camera.json").write_text(json.dumps(cameras))


def _write_graspnet(views: tuple[CameraView, ...], folder: Path) -> None:
    folder.mkdir()
    for number, view in enumerate(views):
        _image(folder / "rgb" / f"{number:04d}.png", view.rgb)
        _depth_png(folder / "depth" / f"{number:04d}.png", view, 1000)
    first = views[0].T_world_cam_cv
    np.save(folder / "camK.npy", views[0].intrinsics.matrix())
    np.save(folder / "cam0_wrt_table.npy", first)
    poses = [np.linalg.inv(first) @ view.T_world_cam_cv for view in views]
    np.save(folder / "camera_poses.npy", np.stack(poses))


def _write_tum(views: tuple[CameraView, ...], folder: Path) -> None:
    rgb, depth, truth = (["# timestamp ..."] for _ in range(3))
    for number, view in enumerate(views):
        stamp = 1305031102.0 + number / 30
        _image(folder / "rgb" / f"{stamp:.6f}.png", view.rgb)
        _depth_png(folder / "depth" / f"{stamp + 0.01:.6f}.png", view, 5000)
        rgb.append(f"{stamp:.6f} rgb/{stamp:.6f}.png")
        depth.append(f"{stamp + 0.01:.6f} depth/{stamp + 0.01:.6f}.png")
        numbers = (*view.position, *Rotation.from_matrix(view.T_world_cam_cv[:3, :3]).as_quat())
        truth.append(f"{stamp - 0.004:.6f} " + " ".join(f"{n:.9f}" for n in numbers))
    for name, lines in (("rgb", rgb), ("depth", depth), ("groundtruth", truth)):
        (folder / f"{name}.txt").write_text("\n".join(lines) + "\n")


def _write_open3d(views: tuple[CameraView, ...], folder: Path) -> None:
    trajectory = o3d.camera.PinholeCameraTrajectory()
    parameters = []
    for number, view in enumerate(views):
        _image(folder / "color" / f"{number:05d}.jpg", view.rgb)
        _depth_png(folder / "depth" / f"{number:05d}.png", view, 1000)
        K = view.intrinsics
        camera = o3d.camera.PinholeCameraParameters()
        camera.intrinsic = o3d.camera.PinholeCameraIntrinsic(
            K.width, K.height, K.fx, K.fy, K.cx, K.cy
        )
        camera.extrinsic = np.array(view.T_cam_cv_world)
        parameters.append(camera)
    trajectory.parameters = parameters
    o3d.io.write_pinhole_camera_trajectory(str(folder / "trajectory.json"), trajectory)


WRITERS = {
    "folder": save_views,
    "bop": _write_bop,
    "graspnet": _write_graspnet,
    "tum": _write_tum,
    "open3d": _write_open3d,
}


@pytest.fixture(scope="module")
def folders(
    tmp_path_factory: pytest.TempPathFactory, table_views: tuple[CameraView, ...]
) -> dict[str, Path]:
    made = {name: tmp_path_factory.mktemp("layouts") / name for name in WRITERS}
    for name, writer in WRITERS.items():
        writer(table_views, made[name])
    return made


@pytest.mark.parametrize("layout", WRITERS)
def test_layouts_give_the_views_back(
    folders: dict[str, Path], table_views: tuple[CameraView, ...], layout: str
) -> None:
    assert detect_layout(folders[layout]) == layout
    # A TUM sequence does not say its intrinsics.
    K = table_views[0].intrinsics
    options = ReadOptions(intrinsics=(K.fx, K.fy, K.cx, K.cy) if layout == "tum" else None)
    views = read_views(folders[layout], options=options)
    assert len(views) == len(table_views)
    assert [v.name for v in views] == [f.name for f in list_views(folders[layout])]
    for view, wanted in zip(views, table_views, strict=True):
        assert view.intrinsics == wanted.intrinsics
        np.testing.assert_allclose(view.T_world_cam_cv, wanted.T_world_cam_cv, atol=1e-7)
        np.testing.assert_allclose(view.depth_m, wanted.depth_m, atol=0.5001e-3)
        if layout == "open3d":  # JPEG
            assert np.abs(view.rgb.astype(int) - wanted.rgb).mean() < 3
        else:
            np.testing.assert_array_equal(view.rgb, wanted.rgb)


def test_names_of_our_own_folder_are_kept(folders: dict[str, Path]) -> None:
    assert [view.name for view in read_views(folders["folder"])] == ["top", "left", "right"]


def test_saving_twice_gives_the_same_bytes(
    tmp_path: Path, folders: dict[str, Path], table_views: tuple[CameraView, ...]
) -> None:
    save_views(table_views, tmp_path)
    for file in ("cameras.json", "rgb/top.png", "depth/left.png"):
        assert (tmp_path / file).read_bytes() == (folders["folder"] / file).read_bytes()


def test_far_depth_does_not_fit_into_16_bits(tmp_path: Path, make_view) -> None:
    with pytest.raises(InvalidFileError) as caught:
        save_views([make_view(depth_m=np.full((6, 8), 70.0, np.float32))], tmp_path)
    assert str(caught.value) == (
        "View 'front': depth reaches 70.0 m; a 16-bit PNG in millimetres holds up to 65.5 m. Set "
        "what lies beyond to 0."
    )


@pytest.mark.parametrize("convention", ["cv", "gl"])
@pytest.mark.parametrize("direction", ["T_world_cam", "T_cam_world"])
def test_conventions_and_directions_mean_the_same_camera(
    tmp_path: Path, make_view, convention: str, direction: str, table_views
) -> None:
    pose = table_views[1].T_world_cam_cv
    view = make_view(T_world_cam_cv=pose)
    save_views([view], tmp_path)
    T = pose @ GL_CV if convention == "gl" else pose
    data = json.loads((tmp_path / "cameras.json").read_text())
    del data["cameras"]["front"]["T_world_cam"]
    data["cameras"]["front"][direction] = (
        np.linalg.inv(T) if direction == "T_cam_world" else T
    ).tolist()
    data["cameras"]["front"]["convention"] = convention
    (tmp_path / "cameras.json").write_text(json.dumps(data))
    np.testing.assert_allclose(read_views(tmp_path)[0].T_world_cam_cv, pose, atol=1e-12)


def test_shared_intrinsics_and_metres_in_npy(tmp_path: Path, make_view) -> None:
    views = [make_view(name="a"), make_view(name="b")]
    save_views(views, tmp_path)
    data = json.loads((tmp_path / "cameras.json").read_text())
    data["intrinsics"] = data["cameras"]["a"]["intrinsics"]
    del data["depth_scale"]
    for name, camera in data["cameras"].items():
        del camera["intrinsics"]
        (tmp_path / "depth" / f"{name}.png").unlink()
        np.save(tmp_path / "depth" / f"{name}.npy", views[0].depth_m[..., None])
    (tmp_path / "cameras.json").write_text(json.dumps(data))
    for view, wanted in zip(read_views(tmp_path), views, strict=True):
        assert view.intrinsics == wanted.intrinsics
        np.testing.assert_array_equal(view.depth_m, wanted.depth_m)


def test_graspnet_scene_with_one_camera(tmp_path: Path, table_views) -> None:
    _write_graspnet(table_views, tmp_path / "kinect")
    assert detect_layout(tmp_path) == "graspnet"
    assert [view.name for view in read_views(tmp_path)] == ["0000", "0001", "0002"]


def test_graspnet_scene_with_two_cameras_is_ambiguous(tmp_path: Path) -> None:
    for name in ("kinect", "realsense"):
        (tmp_path / name).mkdir()
        np.save(tmp_path / name / "camK.npy", np.eye(3))
    with pytest.raises(PerceptionError) as caught:
        read_views(tmp_path)
    assert str(caught.value) == (
        f"{tmp_path}: expected the folder of one GraspNet camera; cameras here: realsense and "
        f"kinect. Name one, such as {tmp_path / 'realsense'}."
    )


def test_bop_without_world_poses_reads_one_view_only(
    tmp_path: Path, table_views: tuple[CameraView, ...]
) -> None:
    _write_bop(table_views, tmp_path)
    data = json.loads((tmp_path / "scene_camera.json").read_text())
    for camera in data.values():
        del camera["cam_R_w2c"], camera["cam_t_w2c"]
    (tmp_path / "scene_camera.json").write_text(json.dumps(data))
    with pytest.raises(InvalidFileError) as caught:
        read_views(tmp_path)
    assert str(caught.value) == (
        f"{tmp_path / 'scene_camera.json'}: 0: has no pose of the camera in the world, so 3 views "
        "cannot be fused; choose one view, such as '000000'."
    )
    (view,) = read_views(tmp_path, options=ReadOptions(names=("000001",)))
    np.testing.assert_array_equal(view.T_world_cam_cv, np.eye(4))


def test_tum_drops_frames_without_depth_or_pose_in_time(
    tmp_path: Path, table_views: tuple[CameraView, ...]
) -> None:
    _write_tum(table_views, tmp_path)
    lines = (tmp_path / "depth.txt").read_text().splitlines()
    (tmp_path / "depth.txt").write_text("\n".join(lines[:1] + lines[2:]) + "\n")
    assert [frame.name for frame in list_views(tmp_path)] == [
        f"{1305031102.0 + n / 30:.6f}" for n in (1, 2)
    ]


@pytest.mark.parametrize(
    ("name", "fx"),
    [
        ("rgbd_dataset_freiburg1_desk", 517.3),
        ("rgbd_dataset_freiburg2_xyz", 520.9),
        ("rgbd_dataset_freiburg3_long", 535.4),
        ("mine", 525.0),
    ],
)
def test_tum_intrinsics_by_sequence(
    tmp_path: Path, table_views: tuple[CameraView, ...], name: str, fx: float
) -> None:
    _write_tum(table_views[:1], tmp_path / name)
    assert list_views(tmp_path / name)[0].intrinsics[0] == fx


def test_pair_from_options_and_from_a_folder(tmp_path: Path, table_views) -> None:
    view, K = table_views[0], table_views[0].intrinsics
    rgb = _image(tmp_path / "color.png", view.rgb)
    depth = _depth_png(tmp_path / "depth.png", view, 1000)
    numbers = (K.fx, K.fy, K.cx, K.cy)
    pair = read_pair(rgb, depth, ReadOptions(intrinsics=numbers, depth_scale=1000))
    names = dict(zip(("fx", "fy", "cx", "cy"), numbers, strict=True))
    (tmp_path / "camera.json").write_text(json.dumps({"intrinsics": names, "depth_scale": 1000}))
    (from_folder,) = read_views(tmp_path)
    assert (pair.name, from_folder.name) == ("color", tmp_path.name)
    for read in (pair, from_folder):
        assert read.intrinsics == K
        np.testing.assert_array_equal(read.rgb, view.rgb)
        np.testing.assert_array_equal(read.T_world_cam_cv, np.eye(4))


@pytest.mark.parametrize(
    ("most", "wanted"), [(1, [0]), (2, [0, 2]), (3, [0, 1, 2]), (9, [0, 1, 2])]
)
def test_frames_are_spread_evenly(folders: dict[str, Path], most: int, wanted: list[int]) -> None:
    views = read_views(folders["bop"], options=ReadOptions(max_views=most))
    assert [int(view.name) for view in views] == wanted


def test_options_replace_what_the_folder_says(folders: dict[str, Path], table_views) -> None:
    options = ReadOptions(
        names=("left",), depth_scale=2000, intrinsics=(400.0, 410.0, 300.0, 200.0)
    )
    (view,) = read_views(folders["folder"], options=options)
    np.testing.assert_allclose(view.depth_m, table_views[1].depth_m / 2, atol=0.5e-3)
    assert (view.intrinsics.fx, view.intrinsics.cy) == (400.0, 200.0)


def test_far_depth_can_be_cut(folders: dict[str, Path], table_views) -> None:
    (view,) = read_views(folders["folder"], options=ReadOptions(names=("left",), max_depth_m=0.6))
    wanted = np.rint(table_views[1].depth_m * 1000) / 1000
    np.testing.assert_array_equal(view.depth_m > 0, (wanted > 0) & (wanted <= 0.6))


def test_grey_and_transparent_images_become_rgb(tmp_path: Path, make_view) -> None:
    view = make_view(rgb=np.full((6, 8, 3), 77, np.uint8))
    save_views([view], tmp_path)
    for mode in ("L", "RGBA"):
        Image.fromarray(view.rgb).convert(mode).save(tmp_path / "rgb" / "front.png")
        np.testing.assert_array_equal(read_views(tmp_path)[0].rgb, view.rgb)


def test_layouts_are_detected_in_the_order_of_the_list() -> None:
    assert LAYOUTS == ("folder", "bop", "graspnet", "tum", "open3d", "pair")


def test_unknown_names_suggest_one(folders: dict[str, Path]) -> None:
    with pytest.raises(InvalidOptionError) as caught:
        read_views(folders["folder"], options=ReadOptions(names=("lefft",)))
    assert str(caught.value) == (
        f"{folders['folder']}: no view 'lefft'. Views: top, left, right. Did you mean 'left'?"
    )


def test_views_are_chosen_by_name(folders: dict[str, Path]) -> None:
    views = read_views(folders["folder"], options=ReadOptions(names=("right", "top", "right")))
    assert [view.name for view in views] == ["right", "top"]
