import gzip
import json
import re
import subprocess
import sys

import pytest

from sr_mj.errors import ConfigError
from sr_mj.evaluation.identity import NOT_KNOWN_BEFORE
from sr_mj.evaluation.results import LINES, SECONDS, ResultFolder, read_lines


@pytest.fixture
def dones(make_done):
    return [make_done(policy, seed) for policy in ("random", "oracle") for seed in (3, 0, 11)]


def write(path, dones, *, resume=False, finish=True):
    with ResultFolder(path, resume=resume) as folder:
        for done in dones:
            folder.add(done)
        if finish:
            folder.finish()


def test_bytes_do_not_depend_on_the_order(tmp_path, dones):
    write(tmp_path / "a", dones)
    write(tmp_path / "b", dones[::-1])
    for name in (LINES, SECONDS):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    assert sorted(path.name for path in (tmp_path / "a").iterdir()) == [LINES, SECONDS]


def test_bytes_do_not_depend_on_interruptions(tmp_path, dones):
    write(tmp_path / "a", dones)
    write(tmp_path / "b", dones[:2], finish=False)
    write(tmp_path / "b", dones[2:3], resume=True)
    write(tmp_path / "b", dones[3:], resume=True)
    assert (tmp_path / "a" / LINES).read_bytes() == (tmp_path / "b" / LINES).read_bytes()


def test_lines_are_sorted_json_without_times(tmp_path, dones):
    write(tmp_path, dones, resume=True)
    lines = [json.loads(x) for x in gzip.decompress((tmp_path / LINES).read_bytes()).splitlines()]
    assert [(line["seed"], line["policy"]) for line in lines] == [
        (seed, policy) for seed in (0, 3, 11) for policy in ("oracle", "random")
    ]
    assert "seconds" not in json.dumps(lines)
    assert (
        lines[0]["versions"] == {"mujoco": "3.17.0"} and len(lines[0]["arrangement_sha256"]) == 64
    )


def test_what_is_written_is_read_back(tmp_path, dones):
    write(tmp_path / "a", dones[:4])
    write(tmp_path / "a", dones[4:], resume=True, finish=False)
    lines, seconds = read_lines(tmp_path / "a")
    assert lines == {done.episode: done.record for done in dones}
    assert seconds == {done.episode: done.seconds for done in dones}
    assert list(read_lines(tmp_path / "a" / LINES)[0]) == [
        d.episode for d in sorted(dones[:4], key=lambda d: d.episode)
    ]


@pytest.mark.parametrize("cut", [1, 7, 200])
def test_a_torn_last_line_costs_one_episode(tmp_path, dones, cut):
    write(tmp_path, dones, resume=True, finish=False)
    journal = tmp_path / "journal.jsonl"
    journal.write_bytes(journal.read_bytes()[:-cut])
    assert len(read_lines(tmp_path)[0]) == len(dones) - 1
    write(tmp_path, dones[-1:], resume=True)
    write(tmp_path / "whole", dones)
    assert (tmp_path / LINES).read_bytes() == (tmp_path / "whole" / LINES).read_bytes()


def test_a_line_torn_inside_a_letter_costs_one_episode(tmp_path, make_done):
    done = make_done(goal="Gib mir das Stück Käse")
    write(tmp_path, [make_done(seed=1), done], resume=True, finish=False)
    journal = tmp_path / "journal.jsonl"
    journal.write_bytes(journal.read_bytes().rpartition("ä".encode())[0] + b"\xc3")
    assert [episode.seed for episode in read_lines(tmp_path)[0]] == [1]


def test_a_file_without_a_last_line_break_loses_nothing(tmp_path, dones):
    path = tmp_path / "lines.jsonl"
    text = "\n".join(json.dumps(done.record) for done in dones)
    path.write_text(text)
    assert read_lines(path)[0] == {done.episode: done.record for done in dones}
    # What was cut in a file of its own is told: nobody knows what else is missing.
    path.write_text(text[:-7])
    with pytest.raises(ConfigError, match=r"^Results '.*' cannot be read \(line 6: Expecting"):
        read_lines(path)


def test_other_files_get_one_line(tmp_path, dones):
    write(tmp_path, dones[:1], resume=True)
    write(tmp_path, dones[1:2], resume=True, finish=False)
    record = dones[0].record
    (tmp_path / "list.jsonl").write_text("[1]\n")
    (tmp_path / "text.jsonl").write_text("hello\n")
    damaged = bytearray((tmp_path / LINES).read_bytes())
    damaged[12] ^= 0xFF
    (tmp_path / "damaged.jsonl.gz").write_bytes(damaged)
    (tmp_path / "cut.jsonl.gz").write_bytes((tmp_path / LINES).read_bytes()[:-9])
    (tmp_path / "kind.jsonl").write_text(json.dumps({**record, "seed": "0"}))
    (tmp_path / "attempt.jsonl").write_text(json.dumps({**record, "attempts": [{"kind": "pick"}]}))
    for name, problem in (
        ("journal.jsonl", "line 1: there is no 'task'"),
        ("seconds.jsonl.gz", "line 1: there is no 'success'"),
        ("damaged.jsonl.gz", "Error -3 ..."),
        ("cut.jsonl.gz", "Compressed file ended before the end-of-stream marker was reached"),
        ("list.jsonl", "line 1: expected an object with names and values"),
        ("text.jsonl", "line 1: Expecting value: line 1 column 1 (char 0)"),
        ("kind.jsonl", "line 1: 'seed' is '0'"),
        ("attempt.jsonl", "line 1: there is no 'is_hand_over'"),
    ):
        with pytest.raises(ConfigError) as error:
            read_lines(tmp_path / name)
        told = re.fullmatch(
            rf"Results '{tmp_path}/{name}' cannot be read \((.*)\); give a folder that "
            r"python -m sr_mj\.eval wrote, or its episodes\.jsonl\.gz\.",
            str(error.value),
        )
        # What zlib says depends on which bits are damaged.
        assert told and (
            told[1] == problem or (name == "damaged.jsonl.gz" and "Error -3" in told[1])
        )


def test_lines_of_earlier_versions_are_read(tmp_path, dones):
    lines = [{k: v for k, v in d.record.items() if k not in NOT_KNOWN_BEFORE} for d in dones]
    path = tmp_path / "old.jsonl"
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    assert list(read_lines(path)[0].values()) == lines


def test_nothing_is_lost_when_the_process_is_killed(tmp_path, make_done):
    done = make_done()
    code = (
        "import os, pickle, sys, signal\n"
        "from pathlib import Path\n"
        "from sr_mj.evaluation.results import ResultFolder\n"
        "done = pickle.load(sys.stdin.buffer)\n"
        f"ResultFolder(Path({str(tmp_path)!r}), resume=True).add(done)\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    import pickle

    killed = subprocess.run([sys.executable, "-c", code], input=pickle.dumps(done))
    assert killed.returncode == -9
    assert read_lines(tmp_path)[0] == {done.episode: done.record}


def test_exceptions_are_kept_with_their_tracebacks(tmp_path, make_done):
    done = make_done(error="ValueError: no")
    write(tmp_path, [done], resume=True)
    assert (tmp_path / "errors.txt").read_text() == f"{done.episode.key}\nTraceback ...\n\n"
    line = read_lines(tmp_path)[0][done.episode]
    assert (line["success"], line["cause"], line["error"]) == (False, "error", "ValueError: no")


def test_only_one_writes_at_a_time(tmp_path):
    with ResultFolder(tmp_path / "out") as folder:
        with pytest.raises(ConfigError, match=r"^Another evaluation is writing to '.*out'; wait"):
            ResultFolder(tmp_path / "out", resume=True)
        folder.finish()
    ResultFolder(tmp_path / "out", resume=True)


def test_bad_folders_get_one_line(tmp_path, dones):
    write(tmp_path / "out", dones)
    with pytest.raises(ConfigError) as error:
        ResultFolder(tmp_path / "out")
    assert str(error.value) == (
        f"Output folder '{tmp_path}/out' is not empty; add --resume to go on with what is in it, "
        "or choose a new one."
    )
    with pytest.raises(ConfigError, match=r"is a file; give a folder\.$"):
        ResultFolder(tmp_path / "out" / LINES)
    (tmp_path / "out" / LINES).write_bytes(b"no gzip")
    with pytest.raises(ConfigError, match=r"cannot be read \(Not a gzipped file"):
        read_lines(tmp_path / "out")
    with pytest.raises(ConfigError, match=r"^Results '.*nowhere' cannot be read"):
        read_lines(tmp_path / "nowhere")
