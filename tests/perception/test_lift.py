"""The command line `python -m perception.lift`."""

import contextlib
import io
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from perception.cloud import FeatureCloud
from perception.lift import main
from perception.readers.folder import save_views
from perception.views import CameraView


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, table_views: tuple[CameraView, ...]) -> Path:
    folder = tmp_path_factory.mktemp("lift") / "views"
    save_views(table_views, folder)
    return folder


def _run(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> int:
    monkeypatch.setattr(sys, "argv", ["lift", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert isinstance(ended.value.code, int)
    return ended.value.code


@pytest.fixture(scope="module")
def result(folder: Path) -> tuple[str, Path]:
    """One real run; its output and its folder."""
    out = folder.parent / "out"
    texts = ["a red ball", "put the green box next to the red ball"]
    box = [0.3, -0.2, -0.01, 0.7, 0.2, 0.3]
    printed = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(printed):
        status = _run(patch, folder, "--out", out, "--text", *texts, "--workspace", *box)
    assert status == 0
    return printed.getvalue(), out


def test_account(result: tuple[str, Path], folder: Path) -> None:
    lines = result[0].splitlines()
    assert lines[0] == f"Views   3 of 3 in {folder} (layout folder): top, left, right"
    assert lines[1].startswith("Cloud   ") and "(embedded, 384 channels)" in lines[1]
    assert lines[2].startswith("'a red ball': target 'red ball', score ")
    assert lines[3].startswith("'put the green box next to the red ball': target 'green box', ")
    assert lines[4].startswith(
        "'put the green box next to the red ball': reference next to 'red ball', score "
    )
    assert lines[5] == f"Written {result[1]}"
    assert len(lines) == 6


def test_files(result: tuple[str, Path]) -> None:
    _, out = result
    names = {path.name for path in out.iterdir()}
    stems = ("red_ball", "green_box")
    pictures = {f"{stem}_{view}.png" for stem in stems for view in ("top", "left", "right")}
    assert names == {"cloud.npz", "summary.json", *(f"{s}.ply" for s in stems), *pictures}
    for picture in pictures:
        assert Image.open(out / picture).size == (640, 360)


def test_summary(result: tuple[str, Path], table_views: tuple[CameraView, ...]) -> None:
    _, out = result
    summary = json.loads((out / "summary.json").read_text())
    cloud = FeatureCloud.load(out / "cloud.npz")
    assert summary["num_feature_points"] == len(cloud) > 500
    assert summary["num_points"] > 5 * len(cloud)
    assert cloud.encoder == summary["encoder"] == "embedded"
    assert [(a["role"], a["phrase"], a["relation"]) for a in summary["answers"]] == [
        ("target", "red ball", None),
        ("target", "green box", "next to"),
        ("reference", "red ball", "next to"),
    ]
    first, _, last = summary["answers"]
    assert first["point_m"] == last["point_m"] and first["files"] == last["files"]
    for answer in summary["answers"]:
        seen = {name: pixel for name, pixel in answer["pixels"].items() if pixel is not None}
        assert seen  # the point hides in some views, not in all
        for view in table_views:
            (pixel,), _ = view.project(np.array([answer["point_m"]]))
            np.testing.assert_allclose(seen.get(view.name, pixel), pixel, atol=0.2)
    assert summary["config"]["fusion"]["workspace_max"] == [0.7, 0.2, 0.3]
    assert summary["versions"]["torch"] != "not installed"


def test_help_is_quick_and_complete() -> None:
    code = (
        "import sys, runpy; sys.argv = ['x', '--help']\n"
        "try: runpy.run_module('perception.lift', run_name='__main__')\n"
        "except SystemExit as e: assert e.code == 0\n"
        "heavy = {'torch', 'open3d', 'open_clip', 'scipy', 'PIL'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    for option in ("--text", "--out", "--rgb", "--intrinsics", "--layout", "--workspace"):
        assert option in done.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--out {t}/o",
         "Expected either a folder of views, or both --rgb and --depth of a single pair."),
        ("{f} --rgb a.png --depth b.png --out {t}/o",
         "Expected either a folder of views, or both --rgb and --depth of a single pair."),
        ("--rgb a.png --out {t}/o",
         "Expected either a folder of views, or both --rgb and --depth of a single pair."),
        ("{f} --out {f}", "--out {f}: exists and is not an empty folder; choose a new one."),
        ("{f} --out {f}/cameras.json/o",
         "--out {f}/cameras.json/o: cannot be made, since {f}/cameras.json is no folder that can be "
         "written to."),
        ("{f} --out {t}/o --text ?!", "Empty instruction '?!': expected at least one word."),
        ("{f}/nothing --out {t}/o",
         "{f}/nothing: no such folder; expected a folder of views."),
        ("{f} --layout bob --out {t}/o",
         "Unknown layout 'bob'. Layouts: auto, folder, bop, graspnet, tum, open3d, pair. Did you "
         "mean 'bop'?"),
        ("{f} --frames topp --out {t}/o",
         "{f}: no view 'topp'. Views: top, left, right. Did you mean 'top'?"),
        ("{f} --max-views 0 --out {t}/o", "max_views is 0; expected 1 or more."),
        ("--rgb {f}/rgb/top.png --depth {f}/depth/top.png --depth-scale 1000 --out {t}/o",
         "{f}/rgb/top.png: a single pair needs the camera's intrinsics: --intrinsics FX FY CX CY."),
        ("--rgb {f}/rgb/top.png --depth {f}/depth/top.png --depth-scale 1000 "
         "--intrinsics 457 -457 320 180 --out {t}/o",
         "intrinsics: fy is -457.0; expected more than 0 pixels."),
        ("{f} --depth-scale 1e6 --out {t}/o",
         "{f}/depth/top.png: at a depth scale of 1e+06 units a metre the median depth is 0.00075 m; "
         "check the scale."),
        ("{f} --encoder embeded --out {t}/o",
         "Unknown encoder 'embeded'. Encoders: embedded, ViT-L-14, ViT-L-14-336, ViT-B-16, "
         "ViT-B-32, ViT-H-14, ViT-B-16-SigLIP, and any model of open_clip followed by :TAG or "
         ":/path/to/file. Did you mean 'embedded'?"),
        ("{f} --voxel-size 0 --out {t}/o", "voxel_size_m is 0.0, expected more than 0 m."),
        ("{f} --workspace 0 0 0 1 -1 1 --out {t}/o",
         "workspace_min (0.0, 0.0, 0.0) is not below workspace_max (1.0, -1.0, 1.0) on every axis; "
         "swap them or widen the box."),
        ("{f} --max-depth 0.1 --out {t}/o",
         "No depth at all in 3 views; check the sensor and the unit (metres)."),
    ],
)  # fmt: skip
def test_mistakes_end_in_one_line(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: str,
    message: str,
) -> None:
    places = {"f": folder, "t": tmp_path}
    assert _run(monkeypatch, *arguments.format(**places).split()) == 2
    assert capsys.readouterr().err == f"error: {message.format(**places)}\n"
    assert not (tmp_path / "o").exists()


def test_long_text(folder: Path, tmp_path: Path, monkeypatch, capsys) -> None:
    assert _run(monkeypatch, folder, "--text", "red ball " * 50, "--out", tmp_path / "o") == 2
    assert capsys.readouterr().err == (
        "error: Text 'red ball red ball red ball red...' has 102 tokens; expected at most 77. Say "
        "it in fewer words.\n"
    )


def test_workspace_that_no_view_sees(folder: Path, tmp_path: Path, monkeypatch, capsys) -> None:
    arguments = (folder, "--workspace", 5, 5, 5, 6, 6, 6, "--out", tmp_path / "o")
    assert _run(monkeypatch, *arguments) == 2
    message = capsys.readouterr().err
    assert message.startswith("error: None of ") and message.count("\n") == 1
    assert "lies in the workspace (5.0, 5.0, 5.0) to (6.0, 6.0, 6.0)." in message
    assert not (tmp_path / "o").exists()


def test_single_pair_without_text(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    files = ("--rgb", folder / "rgb" / "top.png", "--depth", folder / "depth" / "top.png")
    camera = ("--intrinsics", 457, 457, 320, 180, "--depth-scale", 1000)
    assert _run(monkeypatch, *files, *camera, "--out", tmp_path / "o") == 0
    assert {path.name for path in (tmp_path / "o").iterdir()} == {"cloud.npz", "summary.json"}
    cloud = FeatureCloud.load(tmp_path / "o" / "cloud.npz")
    # The world is the camera's own frame: the table lies 0.75 m in front of it.
    assert np.abs(cloud.points[:, 2] - 0.75).min() < 0.002 and cloud.points[:, 2].max() < 0.76
