"""The command line, and the folder that it fills."""

import subprocess
import sys

import numpy as np
import pytest

from policy.actions import ActionCandidates
from policy.demonstrations import Decision, DemonstrationFolder, Look, Wording, write_shard
from sr_mj.collect import CollectConfig, run
from sr_mj.collecting.folder import (
    check_disk,
    estimate_bytes,
    marker,
    open_folder,
    read_stock,
    save,
)
from sr_mj.collecting.tasks import SceneTask
from sr_mj.collecting.work import SceneResult
from sr_mj.errors import ConfigError

PICK = SceneTask(phase="pick", number=0)


def write_demonstrations(folder, name="pick-0010000000", num=3, num_points=2600, channels=384):
    rng = np.random.default_rng(0)
    look = Look(
        points=rng.uniform(size=(num_points, 3)),
        features=rng.normal(size=(num_points, channels)),
        confidence=np.ones(num_points),
        workspace_min=np.zeros(3),
        workspace_max=np.ones(3),
    )
    wording = Wording(
        text="give me the pear",
        tokens=rng.normal(size=(9, channels)),
        pooled=rng.normal(size=channels),
        phrase_pooled=rng.normal(size=channels),
        similarity=rng.uniform(size=num_points),
    )
    candidates = ActionCandidates(
        kind="pick",
        Ts_world_tool=np.tile(np.eye(4), (180, 1, 1)),
        width_m=np.ones(180),
        prior=np.ones(180),
    )
    decision = Decision(
        phase="pick",
        relation=None,
        side=None,
        wordings=(wording,) * 4,
        candidates=candidates,
        executed=0,
        valid=np.ones(180, bool),
        avoid_collision=np.zeros(180),
        expert_logits=np.zeros(180),
        seed=0,
    )
    write_shard(folder / f"{name}.h5", {"encoder": "e-1"}, [look], [(0, decision)] * num)


def test_help_answers_without_anything_heavy():
    code = (
        "import sys; sys.argv = ['collect', '--help']\n"
        "from sr_mj.collect import main\n"
        "try:\n    main()\nexcept SystemExit as end:\n    assert end.code == 0\n"
        "heavy = {'mujoco', 'torch', 'open3d', 'h5py', 'ray', 'scipy'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "--pick" in done.stdout and "--ray" in done.stdout


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"pick": -1}, "Option --pick is -1; expected 0 to 1000000."),
        ({"place": 2_000_000}, "Option --place is 2000000; expected 0 to 1000000."),
        ({"workers": 0}, "Option --workers is 0; expected at least 1."),
        ({"seed": -3}, "Seed is -3; expected 0 to 999."),
    ],
)
def test_bad_options_are_refused_before_anything_is_made(tmp_path, options, message):
    with pytest.raises(ConfigError) as error:
        run(CollectConfig(out=tmp_path / "out", **options))
    assert str(error.value) == message
    assert not (tmp_path / "out").exists()


def test_folders_of_something_else_are_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ConfigError) as error:
        open_folder(tmp_path, "e-1", 16)
    assert str(error.value) == (
        f"Output {str(tmp_path)!r} exists and is no folder of demonstrations; choose a new one."
    )


@pytest.mark.parametrize(
    ("encoder", "width", "found"),
    [
        ("e-2", 16, "encoder is 'e-1', this run has 'e-2'"),
        ("e-1", 32, "feature_dim is 16, this run has 32"),
    ],
)
def test_folders_begun_with_something_else_are_refused(tmp_path, encoder, width, found):
    out = tmp_path / "out"
    open_folder(out, "e-1", 16)
    with pytest.raises(ConfigError) as error:
        open_folder(out, encoder, width)
    assert str(error.value) == (
        f"{out}/collection.json: {found}; choose a new folder, or go on with what the folder was "
        "begun with."
    )
    assert open_folder(out, "e-1", 16).done == frozenset()


def test_scenes_are_known_again(tmp_path):
    out = tmp_path / "out"
    open_folder(out, "e-1", 384)
    write_demonstrations(out, PICK.name)
    empty = SceneTask(phase="place", number=4)
    name, content = marker(empty, {"no_scene": 1})
    save(out, SceneResult(task=empty, file_name=name, content=content))
    save(out, SceneResult(task=SceneTask(phase="pick", number=9), reasons={"worker_died": 1}))
    (out / f".{name}.17.tmp").write_text("half")
    stock = read_stock(out)
    assert stock.done == {PICK.name, empty.name}
    assert stock.stored == {"pick": 3}


def test_the_estimate_of_disk_is_near_what_is_written(tmp_path):
    num = 4  # as many as share a look
    write_demonstrations(tmp_path, num=num)
    (path,) = tmp_path.iterdir()
    assert path.stat().st_size == pytest.approx(estimate_bytes(num, 384), rel=0.15)


def test_a_full_disk_is_one_clear_error(tmp_path):
    check_disk(tmp_path, 0)
    with pytest.raises(
        ConfigError, match=r"^About 1000000000\.0 GB are needed in .* GB are free; "
    ):
        check_disk(tmp_path, 10**18)


def test_verify_tells_whole_from_damaged(tmp_path, capsys):
    write_demonstrations(tmp_path, "a")
    write_demonstrations(tmp_path, "b", num=2)
    assert run(CollectConfig(out=tmp_path, verify=True)) == 0
    assert capsys.readouterr().out == (
        "5 decisions (5 pick, 0 place) in 2 scenes, encoder e-1, all as they were written\n"
    )
    content = bytearray((tmp_path / "b.h5").read_bytes())
    position = content.find(DemonstrationFolder(tmp_path)[4].look.points.tobytes())
    content[position] ^= 1
    (tmp_path / "b.h5").write_bytes(content)
    assert run(CollectConfig(out=tmp_path, verify=True)) == 1
    told = capsys.readouterr()
    assert told.out.endswith("encoder e-1, 1 files damaged\n")
    assert told.err == f"{tmp_path}/b.h5: the content has changed since it was written.\n"


def test_a_folder_that_has_enough_is_left_as_it_is(tmp_path, capsys):
    out = tmp_path / "out"
    assert run(CollectConfig(out=out, pick=0, place=0)) == 0
    assert {path.name for path in out.iterdir()} == {"collection.json", "run.json"}
    told = capsys.readouterr().out
    assert (
        f"{out}: 0 decisions to pick, 0 to place; 0 are missing, which take about 0.00 GB" in told
    )
    assert "Stored 0 decisions in 0 s" in told
