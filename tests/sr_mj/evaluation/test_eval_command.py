"""The command line: mistakes, and a real run that is killed and resumed."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import pytest
import torch

from perception.encoders import load_encoder
from sr_mj.errors import ConfigError
from sr_mj.eval import EvalConfig, run
from sr_mj.evaluation.identity import Identity
from sr_mj.evaluation.plan import plan_random, read_policies
from sr_mj.evaluation.results import LINES, ResultFolder, read_lines
from sr_mj.evaluation.setting import Setting
from sr_mj.evaluation.worker import Worker

SEEDS = (103, 104)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"suite": ("grasp",)}, "No --out is given; name a folder for the results."),
        ({"out": "x"}, "Give one of --suite, --scene and --report."),
        (
            {"out": "x", "suite": ("grasp",), "scene": "single"},
            "Give one of --suite, --scene and --report.",
        ),
        (
            {"out": "x", "scene": "single"},
            "Random scenes need --seeds: the first seed and one past the last, for example "
            "--seeds 100 120.",
        ),
        (
            {"out": "x", "scene": "single", "seeds": (0, 1), "arrangements": ("grasp-seen-00",)},
            "--arrangements restricts suites; leave it or --scene out.",
        ),
        (
            {"out": "x", "suite": ("grasp",), "retry_errors": True},
            "--retry-errors goes with --resume.",
        ),
        ({"out": "x", "suite": ("grasp",), "runs": 0}, "Runs is 0; expected 1 to 10000."),
        ({"out": "x", "suite": ("grasp",), "workers": 999}, "Workers is 999; expected 1 to 256."),
        (
            {"out": "x", "suite": ("grasp",), "seeds": (5, 5)},
            "Seeds are 5 5; expected the first one, 0 or more, and one past the last.",
        ),
    ],
)
def test_bad_options_get_one_line(options, message, tmp_path):
    if "out" in options:
        options = {**options, "out": tmp_path / options["out"]}
    with pytest.raises(ConfigError) as error:
        run(EvalConfig(**options))
    assert str(error.value) == message
    assert not (tmp_path / "x").exists()


def about_to_run(line):
    """What the run said of itself, for running the same here."""
    return Setting(
        policies=read_policies([]),
        encoder_fingerprint="not used by these policies",
        attempts=1,
        versions=line["versions"],
        revision=line["revision"],
    )


@pytest.fixture
def one_thread():
    """Compute as workers do."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.mark.slow
@pytest.mark.distributed
def test_a_killed_run_ends_with_the_same_bytes_as_an_unbroken_one(tmp_path, capsys, one_thread):
    out, journal = tmp_path / "out", tmp_path / "out" / "journal.jsonl"
    killed = subprocess.Popen(
        [
            *(sys.executable, "-m", "sr_mj.eval", "--scene", "single", "--attempts", "1"),
            *("--policy", "random", "--seeds", *map(str, SEEDS), "--out", str(out)),
        ],
        stderr=subprocess.PIPE,
    )
    while not journal.exists() or not journal.read_bytes().count(b"\n"):
        assert killed.poll() is None, killed.stderr.read().decode()
        time.sleep(0.02)
    killed.send_signal(signal.SIGKILL)
    killed.communicate()
    num_done = journal.read_bytes().count(b"\n")
    assert num_done == 1 and not (out / LINES).exists()

    config = EvalConfig(
        scene="single", attempts=1, seeds=SEEDS, policy=("random",), out=out,
        resume=True, pictures=True,
    )  # fmt: skip
    assert run(config) == 0
    shown = capsys.readouterr().out
    assert "1 episodes in" in shown and "1 were there already" in shown
    assert "| random-single | seen | clean | random | 1 | 1 |" in shown
    assert len(list((out / "pictures").iterdir())) == 3

    # Here, in one process, backwards, and without a break.
    lines, seconds = read_lines(out)
    setting = about_to_run(next(iter(lines.values())))
    episodes = plan_random("single", "seen", range(*SEEDS), setting.policies)
    worker = Worker(setting)
    with ResultFolder(tmp_path / "unbroken") as folder:
        for episode in reversed(episodes):
            folder.add(worker.run(episode))
        folder.finish()
    assert (tmp_path / "unbroken" / LINES).read_bytes() == (out / LINES).read_bytes()

    assert all(line["error"] is None and line["attempts"] for line in lines.values())
    assert all(times["look"] > 0 and times["total"] > 1e-3 for times in seconds.values())
    assert json.loads((out / "run.json").read_text())["config"]["attempts"] == 1
    assert sorted(p.name for p in out.iterdir() if p.name != "pictures") == [
        *("episodes.jsonl.gz", "report.html", "report.md", "run.json", "seconds.jsonl.gz", "tables")
    ]


@pytest.mark.slow
def test_what_ran_before_does_not_matter(one_thread):
    encoder = load_encoder("embedded")
    setting = Setting(
        policies=read_policies(["grounding"])[1:],
        encoder_fingerprint=encoder.fingerprint,
        attempts=1,
    )
    conditions = ["clean", "points-0.1", "pose-1cm-5deg"]
    episodes = plan_random("single", "seen", [103, 106], setting.policies, conditions=conditions)
    chosen = [e for e in episodes if e.seed == 103 or e.policy == "grounding"]
    forth, back = Worker(setting), Worker(setting)
    first = {episode: forth.run(episode).record for episode in chosen}
    for episode in reversed(chosen[1::2]):
        assert back.run(episode).record == first[episode]
    plain, noisy = (
        next(r for e, r in first.items() if e.condition == c and e.policy == "grounding")
        for c in ("clean", "points-0.1")
    )
    # The noise moves what the policy sees, not what it chooses among.
    assert plain["attempts"][0]["num_candidates"] == noisy["attempts"][0]["num_candidates"]


def test_results_of_other_options_are_not_resumed(make_done, setting):
    done = make_done("random", 0)
    Identity(setting).check(done.episode, done.record)
    with pytest.raises(ConfigError) as error:
        Identity(setting).check(done.episode, {**done.record, "max_attempts": 3})
    assert str(error.value) == (
        "The results to resume have max_attempts 3 in episode "
        "grasp-seen-02_seen_clean_0000_random, this run has 8; use the same options and files, or "
        "a new --out."
    )


@pytest.fixture
def resumed(tmp_path, setting, make_done, monkeypatch):
    """Return a function that resumes a folder, and returns the episodes that it ran again."""
    monkeypatch.setattr("sr_mj.eval._setting", lambda *_: setting)

    def resume(before, *, interrupted=False, **options):
        ran = []

        def run_episodes(episodes, *_, **__):
            if interrupted:
                raise KeyboardInterrupt
            for episode in episodes:
                ran.append(episode)
                done = make_done(episode.policy, episode.seed)
                yield replace(done, lost_pictures="OSError: full" if episode.seed else None)

        monkeypatch.setattr("sr_mj.evaluation.pool.run_episodes", run_episodes)
        with ResultFolder(tmp_path, resume=True) as folder:
            for done in before:
                folder.add(done)
        config = EvalConfig(
            suite=("grasp",), arrangements=("grasp-seen-02",), split="seen", policy=("random",),
            runs=2, out=tmp_path, resume=True, **options,
        )  # fmt: skip
        assert run(config) == 0
        return [(episode.policy, episode.seed) for episode in ran]

    return resume


def test_what_is_not_planned_again_is_checked_too(resumed, make_done, tmp_path):
    """Its results would stand in the same rows."""
    unplanned = make_done("sr", 77)
    record = {**unplanned.record, "max_attempts": 3}
    with pytest.raises(ConfigError, match=r"have max_attempts 3 in episode .*_0077_sr, this run"):
        resumed([replace(unplanned, record=record)])
    assert not (tmp_path / "run.json").exists()


def test_errors_run_again_if_that_is_asked_for(resumed, make_done, capsys, tmp_path):
    before = [
        make_done("random", 0, error="ValueError: no"),
        make_done("random", 1),
        make_done("oracle", 0),
        make_done("oracle", 7, error="ValueError: not planned now"),
    ]
    assert resumed(before) == [("oracle", 1)]
    told = capsys.readouterr().err
    assert "2 episodes ended in an exception and count as failures; " in told
    assert "Pictures of 1 episodes could not be kept (OSError: full); their results are." in told
    # Killed before anything has run again, the failures are still there.
    with pytest.raises(KeyboardInterrupt):
        resumed([], retry_errors=True, interrupted=True)
    assert sum(line["error"] is not None for line in read_lines(tmp_path)[0].values()) == 2
    assert resumed([], retry_errors=True) == [("random", 0)]
    told = capsys.readouterr().err
    assert "1 episodes ended in an exception" in told and "Pictures" not in told
    lines = read_lines(tmp_path)[0]
    assert [line["seed"] for line in lines.values() if line["error"]] == [7]


def test_the_command_line_answers_mistakes_in_one_line(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "sr_mj.eval", "--suite", "grasp", "--runs", "0", "--out", "x"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "error: Runs is 0; expected 1 to 10000.\n"
