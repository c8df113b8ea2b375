import io
import json
import threading
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from perception.cloud import GeometryCloud
from sr_mj.candidates import AntipodalConfig, AntipodalSampler, CandidateGenerator
from sr_mj.candidates.external import (
    ExternalConfig,
    GraspServiceError,
    file_generator,
    http_generator,
    load_generator,
    parse_grasps,
    tool_poses,
)
from sr_mj.errors import ConfigError

GRIPPER = AntipodalConfig().gripper
# Straight down, closing along the world's x: columns are approach, closing, side.
DOWN = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])


def _grasp(*, score=0.8, width=0.05, depth=0.02, rotation=DOWN, at=(0.5, 0.0, 0.05)):
    return np.array([score, width, 0.02, depth, *np.ravel(rotation), *at, -1.0])


def _box_cloud(half_x=0.02, half_y=0.02, height=0.05):
    """Observed top and sides of a box that stands at (0.5, 0)."""
    x = np.arange(-half_x, half_x + 1e-9, 0.002)
    y = np.arange(-half_y, half_y + 1e-9, 0.002)
    z = np.arange(0.006, height + 1e-9, 0.002)
    faces = [
        np.stack(np.meshgrid(x, y, [height], indexing="ij"), axis=-1),
        np.stack(np.meshgrid([-half_x, half_x], y, z, indexing="ij"), axis=-1),
        np.stack(np.meshgrid(x, [-half_y, half_y], z, indexing="ij"), axis=-1),
    ]
    points = np.concatenate([face.reshape(-1, 3) for face in faces]) + np.array([0.5, 0, 0])
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    arrays = (points, np.zeros_like(points), normals)
    points, colors, normals = (array.astype(np.float32) for array in arrays)
    return GeometryCloud(points=points, colors=colors, normals=normals)


CLOUD = _box_cloud()


def _save(path, *rows):
    np.save(path, np.array(rows).reshape(-1, 17))
    return path


@contextmanager
def _service(answer, status=200):
    """Serve one answer; yields the address and the bodies that were received."""
    received = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            received.append(self.rfile.read(int(self.headers["Content-Length"])))
            self.send_response(status)
            self.end_headers()
            self.wfile.write(answer)

        def log_message(self, *_):
            pass

    server = HTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/grasps", received
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def _npy(rows):
    body = io.BytesIO()
    np.save(body, rows)
    return body.getvalue()


def test_frame_is_converted_to_the_tools():
    pose = tool_poses(_grasp(depth=0.02)[None], GRIPPER)[0]
    np.testing.assert_allclose(pose[:3, 0], [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(pose[:3, 2], [0, 0, -1], atol=1e-12)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1)
    # The fingertips are 20 mm below the translation, the tool's origin above them.
    assert pose[2, 3] == pytest.approx(0.05 - 0.02 + GRIPPER.tip_below_tool_m)


def test_frame_conversion_turns_with_the_grasp():
    rng = np.random.default_rng(0)
    turns = Rotation.random(20, rng=rng).as_matrix()
    shift = rng.normal(size=(20, 3))
    base = tool_poses(_grasp(at=(0, 0, 0))[None], GRIPPER)[0]
    rows = np.array(
        [_grasp(rotation=turn @ DOWN, at=at) for turn, at in zip(turns, shift, strict=True)]
    )
    for pose, turn, at in zip(tool_poses(rows, GRIPPER), turns, shift, strict=True):
        np.testing.assert_allclose(pose[:3, :3], turn @ base[:3, :3], atol=1e-12)
        np.testing.assert_allclose(pose[:3, 3], turn @ base[:3, 3] + at, atol=1e-12)


def test_file_of_grasps_is_checked_and_ranked(tmp_path):
    wide = _grasp(width=0.09)
    into_the_table = _grasp(depth=0.05)
    into_the_box = _grasp(rotation=Rotation.from_euler("z", 45, degrees=True).as_matrix() @ DOWN)
    into_the_box[1] = 0.02
    beside = _grasp(score=0.4, at=(0.5, 0.012, 0.05))
    path = _save(tmp_path / "grasps.npy", beside, wide, into_the_table, into_the_box, _grasp())
    picks = file_generator(path).pick(CLOUD, np.random.default_rng())
    assert picks.kind == "pick"
    np.testing.assert_allclose(picks.prior, [0.8, 0.4], rtol=1e-6)
    np.testing.assert_allclose(picks.width_m, 0.05, rtol=1e-6)
    np.testing.assert_allclose(picks.positions[:, 1], [0, 0.012], atol=1e-12)


def test_grasps_in_a_cameras_frame_are_brought_into_the_world(tmp_path):
    T_world_cam = np.eye(4)
    T_world_cam[:3, :3] = Rotation.from_euler("xyz", [170, 20, 35], degrees=True).as_matrix()
    T_world_cam[:3, 3] = [0.3, -0.2, 0.8]
    inverse = np.linalg.inv(T_world_cam)
    row = _grasp(
        rotation=inverse[:3, :3] @ DOWN, at=inverse[:3, :3] @ [0.5, 0, 0.05] + inverse[:3, 3]
    )
    np.savez(tmp_path / "camera.npz", grasps=row[None], T_world_frame=T_world_cam)
    in_camera = file_generator(tmp_path / "camera.npz").pick(CLOUD, np.random.default_rng())
    in_world = file_generator(_save(tmp_path / "world.npy", _grasp())).pick(
        CLOUD, np.random.default_rng()
    )
    assert len(in_camera) == 1
    np.testing.assert_allclose(in_camera.Ts_world_tool, in_world.Ts_world_tool, atol=1e-9)


def test_scores_over_one_are_scaled_and_keep_their_order(tmp_path):
    rows = [
        _grasp(score=score, at=(0.5, y, 0.05))
        for score, y in ((2.0, 0.01), (-0.1, 0.0), (0.5, -0.01))
    ]
    picks = file_generator(_save(tmp_path / "grasps.npy", *rows)).pick(
        CLOUD, np.random.default_rng()
    )
    np.testing.assert_allclose(picks.prior, [1, 0.25, 0], rtol=1e-6)


def test_no_grasps_are_a_normal_result(tmp_path):
    for path in (_save(tmp_path / "none.npy"), tmp_path / "none.json"):
        if path.suffix == ".json":
            path.write_text("[]")
        assert len(file_generator(path).pick(CLOUD, np.random.default_rng())) == 0


@pytest.mark.parametrize(
    "answer",
    [
        _npy(_grasp()[None]),
        json.dumps([_grasp().tolist()]).encode(),
        json.dumps({"grasps": [_grasp().tolist()], "T_world_frame": np.eye(4).tolist()}).encode(),
    ],
    ids=["npy", "json list", "json names"],
)
def test_service_gets_the_cloud_and_its_grasps_are_used(answer):
    with _service(answer) as (url, received):
        picks = http_generator(url).pick(CLOUD, np.random.default_rng())
    assert len(picks) == 1
    sent = np.load(io.BytesIO(received[0]))
    for name in ("points", "colors", "normals"):
        assert sent[name].dtype == np.float32
        np.testing.assert_array_equal(sent[name], getattr(CLOUD, name))


def test_service_that_fails_is_reported_in_one_line():
    with _service(b"", status=500) as (url, _), pytest.raises(GraspServiceError) as caught:
        http_generator(url).pick(CLOUD, np.random.default_rng())
    assert str(caught.value) == (
        f"Grasp service {url} answered with status 500, expected 200; see its log."
    )
    with _service(b"hello") as (url, _), pytest.raises(GraspServiceError) as caught:
        http_generator(url).pick(CLOUD, np.random.default_rng())
    assert str(caught.value) == (
        f"Grasp service {url}: got 5 bytes that are no .npy, .npz or JSON."
    )
    # Nobody listens there any more.
    with pytest.raises(
        GraspServiceError, match=r"does not answer within 2 s .*; start it"
    ) as caught:
        http_generator(url, ExternalConfig(timeout_s=2)).pick(CLOUD, np.random.default_rng())
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "got 0 bytes that are no .npy, .npz or JSON."),
        (b"{}", "got the names none, expected 'grasps'."),
        (b'{"grasp": []}', "got the names grasp, expected 'grasps'."),
        (b'[["a"]]', "got something else than numbers, expected K rows of 17."),
        (b"[[1, 2, 3]]", "got grasps of shape (1, 3), expected (K, 17)."),
        (
            _npy(np.full((1, 17), np.nan)),
            "got grasps with NaN or infinity, expected finite numbers.",
        ),
        (
            _npy(np.stack([_grasp(), _grasp(rotation=np.diag([1, 1, -1]))])),
            "grasps: the rotation of row 1 is none, expected an orthonormal matrix with "
            "determinant 1, row by row.",
        ),
        (
            json.dumps({"grasps": [], "T_world_frame": [1, 2]}).encode(),
            "got T_world_frame of shape (2,), expected a pose (4, 4).",
        ),
    ],
)
def test_bad_documents_are_refused_in_one_line(content, message, tmp_path):
    with pytest.raises(ValueError) as caught:
        parse_grasps(content)
    assert str(caught.value) == message
    path = tmp_path / "grasps"
    path.write_bytes(content)
    with pytest.raises(ConfigError) as caught:
        file_generator(path).pick(CLOUD, np.random.default_rng())
    assert str(caught.value) == f"Grasp file {str(path)!r}: {message}"


def test_missing_file_is_refused_in_one_line(tmp_path):
    with pytest.raises(ConfigError) as caught:
        file_generator(tmp_path / "no.npy").pick(CLOUD, np.random.default_rng())
    assert str(caught.value) == (
        f"Grasp file {str(tmp_path / 'no.npy')!r} cannot be read: No such file or directory; give "
        "an .npy, .npz or .json file."
    )


def test_generators_are_loaded_by_name(tmp_path):
    path = _save(tmp_path / "grasps.npy", _grasp())
    generator = load_generator(f"file:{path}")
    assert isinstance(generator, CandidateGenerator)
    assert len(generator.pick(CLOUD, np.random.default_rng())) == 1
    assert isinstance(load_generator("antipodal"), AntipodalSampler)
    assert isinstance(load_generator("http://127.0.0.1:9/x"), CandidateGenerator)


@pytest.mark.parametrize("name", ["graspnet", "file:", ""])
def test_unknown_generator_is_refused_in_one_line(name):
    with pytest.raises(ConfigError) as caught:
        load_generator(name)
    assert str(caught.value) == (
        f"Unknown generator {name!r}. Generators: antipodal, file:PATH or http://HOST:PORT/PATH."
    )


def test_bad_time_limit_is_refused_in_one_line():
    with pytest.raises(ConfigError) as caught:
        ExternalConfig(timeout_s=0)
    assert str(caught.value) == "ExternalConfig: timeout_s is 0, expected more than 0."
