import json
from pathlib import Path

import pytest

from sr_mj.evaluation.results import read_lines
from tools.results_tables import BLOCKS, TablesConfig, fill_in, main, read_all

ROOT = Path(__file__).parents[2]
CONFIG = TablesConfig(
    results=tuple(ROOT / folder for folder in TablesConfig().results),
    documents=tuple(ROOT / name for name in TablesConfig().documents),
    check=True,
)


@pytest.fixture(scope="module")
def lines():
    return read_all(CONFIG.results)


def test_the_documents_say_what_the_lines_say():
    assert main(CONFIG) == 0
    asked = {
        name for name in BLOCKS if any(f": {name} -->" in d.read_text() for d in CONFIG.documents)
    }
    assert asked == set(BLOCKS)


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
    wins = [
        record["success"]
        for record in lines.values()
        if (record["task"], record["split"], record["policy"]) == ("place", "seen", "sr")
        and record["condition"] == "clean"
    ]
    filled = document.read_text()
    assert f"| `sr` | {sum(wins) / len(wins) * 100:.1f} [" in filled
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
