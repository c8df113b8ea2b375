"""The examples of docs/perception.md run as they stand there, and its tables tell the truth."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import perception
from perception.language import parse_instruction
from perception.readers import LAYOUTS, read_views
from perception.readers.folder import save_views
from perception.views import CameraView, Intrinsics

PAGE = Path(__file__).parents[2] / "docs" / "perception.md"


def _blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE.read_text(), re.DOTALL)


def _halved(view: CameraView) -> CameraView:
    """Take every second pixel, and nothing beyond 0.8 m: half of the table is enough."""
    K = view.intrinsics
    depth_m = view.depth_m[::2, ::2]
    half = Intrinsics(
        fx=K.fx / 2, fy=K.fy / 2, cx=K.cx / 2, cy=K.cy / 2, width=K.width // 2, height=K.height // 2
    )
    return CameraView(
        name=view.name,
        rgb=view.rgb[::2, ::2],
        depth_m=np.where(depth_m < 0.8, depth_m, np.float32(0)),
        intrinsics=half,
        T_world_cam_cv=view.T_world_cam_cv,
    )


def test_python_examples_run(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    table_views: tuple[CameraView, ...],
) -> None:
    save_views([_halved(view) for view in table_views[1:]], tmp_path / "my_views")
    monkeypatch.chdir(tmp_path)
    blocks = _blocks("python")
    assert len(blocks) == 3
    for block in blocks:
        exec(compile(block, str(PAGE), "exec"), {})
    printed = capsys.readouterr().out.splitlines()
    assert printed[2] == "green box -> next to red ball"
    assert printed[-1] == printed[0].rpartition(" ")[0]  # the saved scene answers as before
    assert {path.name for path in tmp_path.iterdir()} == {"my_views", "red_ball.ply", "scene.npz"}


def test_cameras_example_can_be_read(tmp_path: Path, make_view) -> None:
    (block,) = _blocks("json")
    data = json.loads(block)
    data["cameras"]["front"]["intrinsics"].update(cx=3.5, cy=2.5)  # of an 8x6 image
    save_views([make_view()], tmp_path)
    (tmp_path / "cameras.json").write_text(json.dumps(data))
    (view,) = read_views(tmp_path)
    np.testing.assert_allclose(view.position, [0.5, 0.0, 0.7])
    np.testing.assert_allclose(view.T_world_cam_cv[:3, 2], [0.0, 0.0, -1.0])


def test_instruction_table_is_true() -> None:
    section = PAGE.read_text().split("## What instructions are understood")[1].split("## ")[0]
    rows = re.findall(r"^\| (.*?) \|(.*?)\|(.*?)\|(.*?)\|$", section, re.MULTILINE)
    assert len(rows) == 14  # head and rule included
    for text, *parts in rows[2:]:
        instruction = parse_instruction(text)
        found = (instruction.target, instruction.relation, instruction.reference)
        assert [part or "" for part in found] == [part.strip() for part in parts], text


def test_every_layout_and_public_name_exists() -> None:
    page = PAGE.read_text()
    section = page.split("## Layouts of folders")[1].split("## ")[0]
    assert re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE) == list(LAYOUTS)
    for block in _blocks("python"):
        for line in re.findall(r"from perception import (.*)", block):
            assert set(line.split(", ")) <= set(perception.__all__)


def test_public_names_can_be_imported() -> None:
    assert sorted(perception.__all__) == perception.__all__
    for name in perception.__all__:
        assert getattr(perception, name).__doc__
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = perception.nothing
