"""The command lines as a user meets them: from the built wheel, in another folder."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from models.arrangements.library import summary
from policy.registry import POLICY_NAMES

REPOSITORY = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The wheel, installed without dependencies into a folder of its own."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "-o", str(folder)]
    subprocess.run([*build, str(REPOSITORY)], check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    site = folder / "site"
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", str(site)]
    subprocess.run([*pip, str(wheel)], check=True, capture_output=True)
    return site


@pytest.fixture
def command(installed, tmp_path):
    def call(module, *arguments):
        return subprocess.run(
            [sys.executable, "-m", module, *map(str, arguments)],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(installed)},
            capture_output=True,
            text=True,
        )

    return call


def without_times(text):
    return re.sub(r"\[[\d.]+ s\]", "[time]", text)


def test_the_wheel_is_what_runs(installed, command, tmp_path):
    code = "import sr_mj, models, perception, policy; print(sr_mj.__file__)"
    (tmp_path / "where.py").write_text(code)
    shown = command("where").stdout
    assert shown.startswith(str(installed))
    assert not (installed / "tools").exists() and not (installed / "tests").exists()


def test_the_main_job_end_to_end(command, tmp_path):
    done = command(
        "sr_mj.run", "--scene", "cluttered15", "--seed", 4, "--attempts", 2, "--out", "o"
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    lines = done.stdout.splitlines()
    assert lines[0] == "Scene  cluttered15 (seen, seed 4), 15 objects"
    assert re.fullmatch(r"Goal   '.+'", lines[1])
    assert re.fullmatch(r"Read   pick '.+'", lines[2])
    assert lines[3] == "Policy sr, encoder embedded"
    assert re.match(r"Result (success|failure): .+ \[[\d.]+ s\]$", lines[-1])

    out = tmp_path / "o"
    about = json.loads((out / "run.json").read_text())
    assert about["config"]["seed"] == 4 and about["versions"]["mujoco"].startswith("3.")
    result = json.loads((out / "result.json").read_text())
    attempts = [json.loads(line) for line in (out / "attempts.jsonl").read_text().splitlines()]
    assert attempts == result["attempts"] and len(attempts) == len(lines) - 5
    assert attempts[0]["num_candidates"] > 20
    assert result["success"] == ("success" in lines[-1])
    for picture, size in {
        "views": (1920, 360),
        "similarity": (1920, 360),
        "grasp": (1280, 720),
    }.items():
        image = Image.open(out / f"attempt_01_{picture}.png")
        assert image.size == size
        assert np.asarray(image).std() > 5


def test_same_seed_same_account(command):
    arguments = ("sr_mj.run", "--scene", "single", "--seed", 2, "--attempts", 2)
    first, second = command(*arguments), command(*arguments)
    assert first.returncode == 0, first.stderr
    assert without_times(first.stdout) == without_times(second.stdout)
    assert "[time]" in without_times(first.stdout)


def test_json_is_one_object(command):
    done = command(
        "sr_mj.run", "--scene", "single", "--policy", "oracle", "--json",
        "--goal", "give me the violin", "--attempts", 1,
    )  # fmt: skip
    record = json.loads(done.stdout)
    assert record["goal"] == "give me the violin"
    assert record["targets"] == [] and record["success"] is False


def test_an_empty_table_is_reported_not_raised(command):
    done = command("sr_mj.run", "--scene", "empty", "--goal", "give me the apple")
    assert done.returncode == 0, done.stderr
    assert "no object in sight" in done.stdout
    assert done.stdout.splitlines()[-1].startswith(
        "Result failure: no object of this scene satisfies the goal after 1 of 8 attempts"
    )


def test_records_a_video(command, tmp_path):
    import imageio.v3 as imageio

    done = command(
        "sr_mj.run", "--scene", "single", "--attempts", 1, "--policy", "oracle", "--record", "v.mp4"
    )
    assert done.returncode == 0, done.stderr
    frames = imageio.imread(tmp_path / "v.mp4")
    assert frames.shape[0] > 20 and frames.shape[1:] == (720, 960, 3)
    # The arm moves: frames differ.
    assert np.abs(frames[0].astype(int) - frames[len(frames) // 2]).mean() > 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["v.mp4"]


def test_runs_test_cases_in_turn(command, tmp_path):
    (tmp_path / "cases").mkdir()
    (tmp_path / "cases" / "a.txt").write_text(CASE)
    (tmp_path / "cases" / "b.txt").write_text(
        CASE.replace("pear", "violin").replace("\n0\n", "\n\n0\n")
    )
    done = command(
        "sr_mj.run", "--cases", "cases", "--policy", "oracle", "--attempts", 1, "--out", "result"
    )
    assert done.returncode == 0, done.stderr
    assert [line for line in done.stdout.splitlines() if line.startswith("Scene")] == [
        "Scene  a, 1 object",
        "Scene  b, 1 object",
    ]
    assert re.fullmatch(r"Cases  2 of 2 succeeded \[.* s\]", done.stdout.splitlines()[-1])
    for name in ("a", "b"):
        record = json.loads((tmp_path / "result" / name / "result.json").read_text())
        assert record["arrangement"] == name
        assert record["objects"] == record["targets"] == ["pear"]


def test_runs_an_arrangement(command):
    done = command("sr_mj.run", "--scene", "grasp-seen-02", "--policy", "oracle", "--json")
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert (record["arrangement"], record["goal"]) == ("grasp-seen-02", "give me the pear")
    assert record["success"] and record["attempts"][-1]["grasped"] in record["targets"]


def test_runs_a_place_arrangement(command, tmp_path):
    done = command("sr_mj.run", "--scene", "place-seen-01", "--policy", "oracle", "--out", "o")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[2] == "Read   place it near 'darlie box'"
    assert re.match(r"ho +\d+ grasps .*handed over: grasped toy_nut", lines[4])
    assert re.match(r"pl +\d+ places .*placed toy_nut", lines[-2])
    assert lines[-1].startswith("Result success: toy_nut placed near darlie_box")
    record = json.loads((tmp_path / "o" / "result.json").read_text())
    assert record["success"] and (record["num_attempts"], record["num_actions"]) == (0, 1)
    assert (record["relation"], record["references"]) == ("near", ["darlie_box"])
    place = record["attempts"][-1]
    assert (place["kind"], place["reason"], place["reward"]) == ("place", "placed", 1.0)
    for name in ("hand_over_01_grasp", "place_01_views", "place_01_similarity", "place_01_place"):
        assert np.asarray(Image.open(tmp_path / "o" / f"{name}.png")).std() > 5


def test_exports_a_scene(command, tmp_path):
    done = command("sr_mj.export", "--scene", "single", "--seed", 1, "--out", "scene")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "scene" / "scene.xml").exists()


POLICIES = ", ".join((*POLICY_NAMES, "oracle"))
SCENES = f"cluttered15, place8, pickplace8, heavy30, single, empty, {summary()}"
CASE = "give me the pear\n0\nassets/015.urdf 0.5 0 0.2 0 0 0\n"


@pytest.mark.parametrize(
    ("module", "arguments", "message"),
    [
        ("run", ["--scene", "cluttered51"], f"Unknown scene 'cluttered51'. Scenes: {SCENES}. Did you mean 'cluttered15'?"),
        ("run", ["--split", "unsen"], "Unknown split 'unsen'. Splits: seen, unseen. Did you mean 'unseen'?"),
        ("run", ["--policy", "grunding", "--scene", "single"], f"Unknown policy 'grunding'. Policies: {POLICIES}. Did you mean 'grounding'?"),
        ("run", ["--cameras", "srr", "--scene", "single"], "Unknown camera preset 'srr'. Presets: sr, a2. Did you mean 'sr'?"),
        ("run", ["--seed", "-3"], "Seed is -3; expected an integer of 0 or more."),
        ("run", ["--attempts", "0"], "Attempts is 0; expected 1 to 100."),
        ("run", ["--goal", ""], "The goal is blank; say what to grasp, or leave the goal out."),
        ("run", ["--scene", "empty"], "The scene 'empty' has no objects from which to draw a goal; state one with --goal, or choose another scene, such as 'single'."),
        ("run", ["--record", "film.avi"], "Cannot record to 'film.avi': the name ends in '.avi', expected one of .mp4, .gif."),
        ("run", ["--record", "no/film.mp4"], "Cannot record to 'no/film.mp4': create its folder first."),
        ("run", ["--scene", "place8", "--goal", "put it near the bowl"], "The goal 'put it near the bowl' does not say what to pick; say it first, as in 'give me the apple, put it near the bowl', or choose a place arrangement."),
        ("run", ["--generator", "antipodl"], "Unknown generator 'antipodl'. Generators: antipodal, file:PATH or http://HOST:PORT/PATH."),
        ("run", ["--perturb-cm", "-1"], "Perturbation of positions is -1 cm; expected 0 to 10."),
        ("run", ["--perturb-deg", "100"], "Perturbation of orientations is 100 degrees; expected 0 to 90."),
        ("run", ["--cases", "mine.txt", "--goal", "give me the pear"], "Test cases bring their own goals; leave --goal or --cases out."),
        ("run", ["--cases", "mine.txt"], "mine.txt: 0 lines; expected the goal, the targets' indices, and one line an object."),
        ("run", ["--out", "."], "Output folder '.' exists and is not empty; choose a new one."),
        ("export", ["--scene", "plce8", "--out", "x"], f"Unknown scene 'plce8'. Scenes: {SCENES}. Did you mean 'place8'?"),
    ],
)  # fmt: skip
def test_mistakes_get_one_line_and_status_2(command, tmp_path, module, arguments, message):
    (tmp_path / "mine.txt").touch()
    done = command(f"sr_mj.{module}", *arguments)
    assert done.stderr == f"error: {message}\n"
    assert done.stdout == ""
    assert done.returncode == 2
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_an_unknown_encoder_names_those_that_exist(command):
    done = command("sr_mj.run", "--scene", "single", "--encoder", "embeded")
    assert done.returncode == 2 and done.stdout == ""
    assert re.fullmatch(
        r"error: Unknown encoder 'embeded'\..*embedded.*Did you mean 'embedded'\?\n", done.stderr
    )


def test_absent_weights_are_one_line_and_nothing_is_downloaded(command, tmp_path, monkeypatch):
    monkeypatch.setenv("HF_HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    done = command("sr_mj.run", "--scene", "single", "--encoder", "ViT-B-16")
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.startswith("error: ") and done.stderr.count("\n") == 1
    assert "ViT-B-16" in done.stderr


def test_missing_weights_of_a_policy_are_one_line(command):
    done = command("sr_mj.run", "--scene", "single", "--checkpoint", "nowhere.safetensors")
    assert done.returncode == 2 and done.stdout == ""
    assert "nowhere.safetensors" in done.stderr and done.stderr.count("\n") == 1
    assert done.stderr.startswith("error: ") and "grounding" in done.stderr
