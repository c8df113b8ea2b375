import json
import shutil
import subprocess
import sys

import mujoco
import numpy as np
import pytest

from sr_mj.errors import ConfigError
from sr_mj.export import KEYFRAME, export_scene
from sr_mj.scene import SceneConfig, make_scene

LOAD = """
import sys, mujoco
m = mujoco.MjModel.from_xml_path(sys.argv[1])
d = mujoco.MjData(m)
mujoco.mj_resetDataKeyframe(m, d, m.key(sys.argv[2]).id)
mujoco.mj_step(m, d, 1000)
assert "dm_control" not in sys.modules and "sr_mj" not in sys.modules
print(d.qpos.tobytes().hex() + " " + d.qvel.tobytes().hex())
"""


@pytest.fixture(scope="module")
def scene():
    return make_scene(SceneConfig(scene="cluttered15", seed=2))


@pytest.fixture(scope="module")
def folder(scene, tmp_path_factory):
    out = tmp_path_factory.mktemp("export") / "first" / "scene"
    out.parent.mkdir()
    export_scene(scene, out)
    # Self-contained: it still loads after it was moved.
    return shutil.move(out, out.parent.parent / "moved")


def test_same_model(scene, folder):
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    assert (model.nq, model.nu, model.ngeom) == (scene.model.nq, scene.model.nu, scene.model.ngeom)
    np.testing.assert_array_equal(model.body_mass, scene.model.body_mass)
    np.testing.assert_array_equal(model.geom_size, scene.model.geom_size)
    key = model.key(KEYFRAME)
    np.testing.assert_array_equal(key.qpos, scene.settled_qpos)


def test_a_thousand_steps_stay_bit_equal_in_plain_mujoco(scene, folder):
    plain = subprocess.run(
        [sys.executable, "-c", LOAD, str(folder / "scene.xml"), KEYFRAME],
        capture_output=True, text=True, check=True, cwd=folder,
    )  # fmt: skip
    mujoco.mj_step(scene.model, scene.data, 1000)
    ours = scene.data.qpos.tobytes().hex() + " " + scene.data.qvel.tobytes().hex()
    assert plain.stdout.strip() == ours


def test_description(scene, folder):
    about = json.loads((folder / "scene.json").read_text())
    assert about["goal"] == scene.goal.text
    assert about["targets"] == list(scene.goal.targets)
    assert [entry["name"] for entry in about["objects"]] == [o.name for o in scene.objects]
    assert about["versions"]["mujoco"] == mujoco.__version__
    np.testing.assert_array_equal(
        about["objects"][0]["position_m"], scene.settled_qpos[scene.objects[0].body.qpos][:3]
    )
    assert "BSD-3-Clause" in (folder / "README.md").read_text()


def test_refuses_a_folder_that_is_not_empty_and_leaves_nothing_behind(scene, tmp_path):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "keep.txt").write_text("mine")
    with pytest.raises(ConfigError) as error:
        export_scene(scene, tmp_path / "full")
    assert (
        str(error.value) == f"Cannot export to '{tmp_path / 'full'}': it exists and is not empty."
    )
    with pytest.raises(ConfigError) as error:
        export_scene(scene, tmp_path / "a" / "b")
    expected = f"Cannot export to '{tmp_path / 'a' / 'b'}': create its parent folder first."
    assert str(error.value) == expected
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["full", "keep.txt"]
