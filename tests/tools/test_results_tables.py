import json
from pathlib import Path

import pytest

from sr_mj.evaluation.plan import Episode
from sr_mj.evaluation.results import read_lines
from tools.results_tables import (
    BLOCKS,
    TablesConfig,
    fill_in,
    main,
    read_all,
)

ROOT = Path(__file__).parents[2]
CONFIG = TablesConfig(
    results=tuple(ROOT / folder for folder in TablesConfig().results),
    documents=tuple(ROOT / name for name in TablesConfig().documents),
    check=True,
)


@pytest.fixture(scope="module")
def lines():
    return read_all(CONFIG.results)


def test_the_documents_say_what_the_lines_say(lines):
    assert main(CONFIG) == 0
    asked = {
        name for name in BLOCKS if any(f": {name} -->" in d.read_text() for d in CONFIG.documents)
    }
    # Every table is there in which some policy has a row.
    assert asked == {name for name, table in BLOCKS.items() if "| `" in table(lines)}


def test_a_figure_that_drifted_is_told_and_mended(tmp_path, lines, capsys):
    document = tmp_path / "a.md"
    text = "before\n\n<!-- results: place -->\n\n| 1 |\n\n<!-- end -->\nafter\n"
    document.write_text(text)
    config = TablesConfig(results=CONFIG.results, documents=(document,), check=True)
    assert main(config) == 1
    assert capsys.readouterr().err == (
        f"error: Tables in {document} are not those of the lines; run "
        "`python -m tools.results_tables`.\n"
    )
    assert document.read_text() == text
    assert main(TablesConfig(results=CONFIG.results, documents=(document,))) == 0
    filled = document.read_text()
    assert f"| `sr` | {rate(chosen(lines, 'sr', 'place', 'seen'))} [" in filled
    assert filled.startswith("before\n\n<!--") and filled.endswith("\n\n<!-- end -->\nafter\n")
    assert fill_in(filled, lines) == filled


def test_what_was_not_run_is_left_empty(lines):
    some = {e: r for e, r in lines.items() if (r["policy"], r["split"]) == ("vlg", "seen")}
    _, _, row = BLOCKS["grasp"](some).splitlines()
    assert row.startswith("| `vlg` | ") and row.endswith(" | 74.3 / 4.11 | | | 78.7 / 3.98 |")


def test_an_unknown_table_is_an_error(lines):
    with pytest.raises(KeyError, match="gras"):
        fill_in("<!-- results: gras -->\n\n<!-- end -->", lines)


def test_a_later_folder_replaces_an_earlier_one(tmp_path):
    first, second = tmp_path / "a.jsonl", tmp_path / "b.jsonl"
    known = sorted(read_lines(CONFIG.results[0])[0].items())[0][1]
    for path, is_won in ((first, True), (second, False)):
        path.write_text(json.dumps({**known, "success": is_won}) + "\n")
    (found,) = read_all((first, second)).values()
    assert not found["success"]


def under(lines, condition, **changes):
    """Say of lines that they were run under another condition."""
    records = [{**r, "condition": condition, **changes} for r in lines]
    return {Episode.of_record(record): record for record in records}


def cells(table):
    """Read a table: the columns of every row by its first cell."""
    heading, _, *rows = (
        [cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines()
    )
    return {name: dict(zip(heading[1:], values, strict=True)) for name, *values in rows}


def chosen(lines, policy, task, split):
    """Return the clean lines of one policy."""
    keys = ("policy", "task", "split", "condition")
    return [
        r for r in lines.values() if tuple(r[k] for k in keys) == (policy, task, split, "clean")
    ]


def rate(records):
    """Write a share of successes as the tables do."""
    share = sum(record["success"] for record in records) / len(records)
    return "100" if share == 1 else f"{share * 100:.1f}"


def test_noise_stands_beside_the_plain_condition_and_the_paper(lines):
    plain = chosen(lines, "sr", "grasp", "unseen")
    some = under(plain, "clean") | under(plain, "points-0.2", success=False, num_actions=8)
    some |= under(chosen(lines, "sr", "grasp", "seen"), "points-0.1")
    some |= under(plain, "l515-4x", policy="sr@softmax")
    table = cells(BLOCKS["noise"](some))
    assert list(table) == [
        "*paper: ReLU*",
        "*paper: Softmax*",
        "*paper: ReLU²*",
        "`sr`",
        "`sr@softmax`",
    ]
    assert table["*paper: ReLU²*"]["points-0.2"] == "78.1"
    assert table["`sr`"]["clean"].startswith(f"{rate(plain)} [")
    assert table["`sr`"]["points-0.2"] == "0.0 [0, 5], 8.0"
    assert table["`sr`"]["points-0.1"] == ""
    assert table["`sr@softmax`"]["l515-4x"] == table["`sr`"]["clean"]
    assert table["`sr@softmax`"]["clean"] == ""


def test_every_instruction_has_a_row(lines):
    plain = chosen(lines, "sr", "grasp", "seen")
    (scene,) = {r["scene"] for r in plain if r["goal"] == "give me the thera med"}
    mine = [r for r in plain if r["scene"] == scene]
    some = under(plain, "clean", success=True, num_actions=1)
    some |= under(mine, "clean", success=False, num_actions=8)
    some |= under(mine, "clean", policy="a2", num_actions=3)
    some |= under(mine, "points-0.1", policy="grounding")
    unseen = chosen(lines, "oracle", "grasp", "unseen")
    some |= under(unseen, "clean", num_actions=2)
    # An episode whose process died has no goal.
    died = {k: v for k, v in unseen[0].items() if k != "goal"}
    some |= under([died], "clean", policy="vlg", success=False)
    rows = BLOCKS["grasp-goals"](some).splitlines()[2:]
    assert len(rows) == 15
    assert "| seen | give me the thera med | 0.0 [0, 20] | 8.0 | 100 / 5.3 | 3.0 | | |" in rows
    assert "| seen | I need a fruit | 100 [80, 100] | 1.0 | 90 / 3.3 | | | |" in rows
    assert "| unseen | give me the shampoo | | | | | | 2.0 |" in rows


def test_an_error_of_the_pose_is_told_by_split(lines):
    plain = chosen(lines, "a2", "place", "unseen")
    some = under(plain, "clean") | under(plain, "pose-1cm-5deg", success=True)
    some |= under(chosen(lines, "grounding", "place", "seen"), "clean")
    table = cells(BLOCKS["perturbation"](some))
    # Who ran only plain conditions has no row.
    assert list(table) == ["`a2`"]
    assert table["`a2`"]["unseen, 1cm-5deg"] == "100 [98, 100]"
    assert {name for name, text in table["`a2`"].items() if not text} == {
        "unseen, 0.5cm-2deg",
        "unseen, 2cm-10deg",
        *(f"seen, {level}" for level in ("clean", "0.5cm-2deg", "1cm-5deg", "2cm-10deg")),
    }


def test_other_words_stand_before_the_plain_ones(lines):
    plain = chosen(lines, "sr", "place", "seen")
    before = f"({sum(r['success'] for r in plain) / len(plain) * 100:.1f})"
    some = under(plain, "clean") | under(plain, "reworded", success=True)
    some |= under(chosen(lines, "sr", "grasp", "seen"), "reworded", success=False)
    table = cells(BLOCKS["paraphrase"](some))
    assert table["`sr`"]["place, seen"] == f"100 [99, 100] {before}"
    assert table["`sr`"]["grasp, seen"] == "0.0 [0, 2]"


def test_thirty_objects_have_a_table_of_their_own(lines):
    seen = chosen(lines, "oracle", "grasp", "seen")
    some = under(seen, "clean", task="heavy30", num_actions=2, success=True) | under(seen, "clean")
    rows = BLOCKS["heavy30"](some).splitlines()[2:]
    assert rows == ["| `oracle` (reads ground truth) | 100 [98, 100] | 2.00 | | |"]


def test_scenes_that_were_run_once_are_compared_as_scenes(lines):
    scenes = range(200, 220)
    known = chosen(lines, "oracle", "random-cluttered15", "seen")
    plain = [r for r in known if r["seed"] in scenes]
    won = {"success": True, "num_actions": 2, "privileged": False}
    some = under(plain, "clean", policy="sr", **won)
    some |= under(plain, "clean", policy="base", **won | {"success": False, "num_actions": 8})
    # Who left scenes out has no row.
    some |= under(plain[1:], "clean", policy="vlg", **won)
    assert BLOCKS["random-cluttered15"](some).splitlines() == [
        "| policy | 20 scenes | steps | SR minus this: success | steps |",
        "| --- | --- | --- | --- | --- |",
        "| `sr` | 100 [84, 100] | 2.00 | | |",
        "| `base` (stage 2 only) | 0.0 [0, 16] | 8.00 | 100.0 [-, -] | -6.00 [-, -] |",
    ]
    assert len(BLOCKS["random-place8"](some).splitlines()) == 2
    # Without SR in all scenes, nothing is said of what it does better.
    first = next(e for e, r in some.items() if r["policy"] == "sr")
    some.pop(first)
    assert BLOCKS["random-cluttered15"](some).splitlines()[2:] == [
        "| `base` (stage 2 only) | 0.0 [0, 16] | 8.00 | | |"
    ]


def test_differences_are_those_of_sr(lines):
    plain = chosen(lines, "oracle", "grasp", "seen")
    known = {"privileged": False, "num_actions": 1}
    some = under(plain, "clean", policy="grounding", success=True, **known)
    some |= under(plain, "clean", policy="a2", success=False, **known)
    assert cells(BLOCKS["differences"](some)) == {}
    some |= under(plain, "clean", policy="sr", success=True, **known)
    table = cells(BLOCKS["differences"](some))
    # Nothing varies, and nothing tells how much it might.
    assert table["`a2`"]["grasp, seen"] == "100.0 [-, -], [-, -]"
    assert table["`grounding`"]["grasp, seen"] == "0.0 [-, -], [-, -]"


def test_one_attempt_needs_no_count_of_steps(lines):
    heading, *_ = BLOCKS["random-place8"](lines).splitlines()
    assert heading == "| policy | 100 scenes | SR minus this: success |"


def test_who_left_out_an_episode_has_no_row(lines):
    plain = chosen(lines, "oracle", "grasp", "seen")
    some = under(plain, "clean", policy="sr", privileged=False, success=True, num_actions=1)
    some |= under(plain[1:], "clean", policy="a2", success=True, num_actions=1)
    assert list(cells(BLOCKS["grasp"](some))) == ["`sr`"]
