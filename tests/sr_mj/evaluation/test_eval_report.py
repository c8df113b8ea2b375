import csv
import io
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

from models.arrangements.library import arrangement_names, load_arrangement
from policy.registry import POLICY_NAMES
from sr_mj.errors import ConfigError
from sr_mj.evaluation.published import (
    TABLE_1,
    TABLE_2,
    TABLE_3,
    kind_of_policy,
    plain_goal,
)
from sr_mj.evaluation.report import TABLES, merge_results, warnings_about, write_report
from sr_mj.evaluation.results import ResultFolder, snapshot_path
from sr_mj.evaluation.statistics import Interval, paired_bootstrap, wilson
from sr_mj.evaluation.summary import (
    by_group,
    by_policy,
    causes,
    compare,
    main_policy,
    score,
)
from sr_mj.evaluation.table import Column, Table
from sr_mj.evaluation.tables import comparison_table, overview_table

GOOD, BAD = ("grasped_target",), ("wrong_object", "slip_lift")


@pytest.fixture
def dones(make_done):
    """Four seeds: sr succeeds in three, random in one, which sr loses; the oracle always."""
    results = {"sr": "1101", "random": "0010", "oracle": "1111"}
    return [
        make_done(policy, seed, reasons=GOOD if digit == "1" else BAD)
        for policy, digits in results.items()
        for seed, digit in enumerate(digits)
    ]


def group_of(lines):
    (records,) = by_group(lines).values()
    return by_policy(records)


def test_scores_count_every_episode(dones, as_lines, make_done):
    broken = make_done("sr", 4, reasons=(), error="ValueError: no")
    policies = group_of(as_lines([*dones, broken]))
    assert list(policies) == ["sr", "oracle", "random"]
    s = score("sr", policies["sr"])
    assert (s.runs, s.errors, s.num_scenes, s.is_privileged) == (5, 1, 1, False)
    assert s.success == wilson(3, 5)
    assert s.steps == (3 * 1 + 2 + 0) / 5 and s.success_steps == 1
    assert s.reward == (3 * 1.0 + -0.25) / 4
    assert causes(policies["sr"]) == [("error", 1), ("pick: slip_lift", 1)]
    assert score("oracle", policies["oracle"]).title == "oracle (reads ground truth)"


def test_overview_has_a_column_for_each_task_and_plain_episodes_only(dones, as_lines, make_done):
    other = [make_done("grounding", 0, split="unseen", scene="grasp-unseen-00")]
    noisy = [make_done("sr", 0, condition="points-0.1", reasons=BAD)]
    table = overview_table(as_lines([*dones, *other, *noisy]))
    assert [column.name for column in table.columns] == ["policy", "grasp, seen", "grasp, unseen"]
    assert table.rows == (
        ("grounding", None, wilson(1, 1)),
        ("sr", wilson(3, 4), None),
        ("oracle", wilson(4, 4), None),
        ("random", wilson(1, 4), None),
    )


def test_differences_are_paired(dones, as_lines):
    of_random, of_oracle = sorted(
        compare(group_of(as_lines(dones))), key=lambda c: c.against, reverse=True
    )
    assert (of_random.policy, of_random.against, of_random.pairs) == ("sr", "random", 4)
    assert (of_random.wins, of_random.losses) == (3, 1)
    assert of_random.success.value == 0.5
    assert (of_oracle.wins, of_oracle.losses, of_oracle.success.value) == (0, 1, -0.25)
    assert of_oracle.success.low <= -0.25 <= of_oracle.success.high <= 0
    # One scene tells nothing of others.
    assert of_oracle.success_elsewhere is None


def near(found, groups, **how):
    """Whether an interval is that of the bootstrap, by other draws than those that it is from."""
    expected = paired_bootstrap(groups, np.random.default_rng(99), num_draws=40_000, **how)
    return np.allclose(*([i.value, i.low, i.high] for i in (found, expected)), rtol=0, atol=0.05)


def test_every_difference_has_an_interval_of_its_own(make_done, as_lines):
    """Scenes of different size, whose pairs differ within; steps are another story than success."""
    ours = {"grasp-seen-00": "11010111", "grasp-seen-01": "011", "grasp-seen-02": "00101"}
    reasons = {"0": ("slip_lift",) * 4, "1": GOOD}
    dones = [
        make_done(policy, seed, scene=scene, reasons=reasons[digit])
        for scene, digits in ours.items()
        for seed, digit in enumerate(digits)
        for policy, digit in (("sr", digit), ("random", "0"))
    ]
    (found,) = compare(group_of(as_lines(dones)))
    success = [[float(digit) for digit in digits] for digits in ours.values()]
    steps = [[-3 * d for d in group] for group in success]
    assert near(found.success, success)
    assert near(found.success_elsewhere, success, are_groups_drawn=True)
    assert near(found.steps, steps)
    assert not near(found.success_elsewhere, success) and not near(found.steps, success)
    cells = comparison_table(as_lines(dones)).rows[0][5:]
    assert cells == (found.success, found.success_elsewhere, 10, 0, found.steps)


def test_where_every_seed_is_a_scene_other_seeds_are_other_scenes(make_done, as_lines):
    random_scene = {"scene": "cluttered15", "task": "random-cluttered15"}
    dones = [
        make_done(
            policy, seed, reasons=GOOD if policy == "sr" and seed % 3 else BAD, **random_scene
        )
        for policy in ("sr", "random")
        for seed in range(30)
    ]
    (found,) = compare(group_of(as_lines(dones)))
    assert found.success_elsewhere == found.success
    assert near(found.success, [[float(seed % 3 > 0) for seed in range(30)]])
    (alone,) = compare(group_of(as_lines(d for d in dones if d.episode.seed == 0)))
    assert alone.success_elsewhere is None and np.isnan(alone.success.low)


def test_one_run_of_each_arrangement_tells_nothing_of_other_seeds(make_done, as_lines):
    dones = [
        make_done(policy, scene=scene, reasons=GOOD if policy == "sr" and number % 2 else BAD)
        for policy in ("sr", "random")
        for number, scene in enumerate(arrangement_names("grasp", "seen"))
    ]
    lines = as_lines(dones)
    (found,) = compare(group_of(lines))
    assert found.success.value == 0.5 and np.isnan([found.success.low, found.steps.high]).all()
    groups = [[float(number % 2)] for number in range(10)]
    assert near(found.success_elsewhere, groups, are_groups_drawn=True)
    table = comparison_table(lines)
    assert table.shown()[0][5:7] == (
        "+50.0", f"+50.0 [{found.success_elsewhere.low * 100:+.1f}, +80.0]"
    )  # fmt: skip
    only_one = as_lines(d for d in dones if d.episode.scene == "grasp-seen-01")
    assert comparison_table(only_one).shown()[0][5:7] == ("+100.0", "")


def test_where_nothing_varies_there_is_no_interval(make_done, as_lines):
    """Of two policies that win every time, nobody knows how often one of them would not."""
    dones = [
        make_done(policy, seed, scene=scene, reasons=GOOD if seed or policy == "sr" else BAD + GOOD)
        for policy in ("sr", "random")
        for scene in ("grasp-seen-00", "grasp-seen-01")
        for seed in range(5)
    ]
    lines = as_lines(dones)
    (found,) = compare(group_of(lines))
    for interval in (found.success, found.success_elsewhere):
        assert interval.value == 0 and np.isnan([interval.low, interval.high]).all()
    # The number of steps does vary.
    assert found.steps.low < found.steps.value < 0
    assert comparison_table(lines).shown()[0][5:7] == ("+0.0", "+0.0")


def test_a_report_leaves_nothing_of_an_earlier_one(make_done, as_lines, tmp_path):
    write_report(tmp_path, as_lines([make_done("sr"), make_done("random")]), {})
    before = {path.stem for path in (tmp_path / "tables").iterdir()}
    assert before <= set(TABLES) and {"paper-1", "paper-4", "goals"} <= before
    random_scene = {"scene": "cluttered15", "task": "random-cluttered15"}
    write_report(tmp_path, as_lines([make_done("sr", **random_scene)]), {})
    after = {path.stem for path in (tmp_path / "tables").iterdir()}
    assert "success" in after and not {"paper-1", "paper-4", "goals"} & after
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["report.html", "report.md", "tables"]


def test_only_common_episodes_are_compared(dones, as_lines):
    lines = as_lines(d for d in dones if d.episode.policy != "random" or d.episode.seed == 2)
    (of_random,) = (c for c in compare(group_of(lines)) if c.against == "random")
    assert (of_random.pairs, of_random.success.value) == (1, -1)
    assert any("did not run the same episodes" in note for note in warnings_about(lines))
    assert "same episodes" not in "".join(warnings_about(as_lines(dones)))


def test_the_main_policy_is_chosen_by_name_alone():
    assert main_policy(["a2", "grounding", "oracle", "sr"]) == "sr"
    assert main_policy(["a2", "grounding", "oracle"]) == "grounding"
    assert main_policy(["oracle", "random", "a2"]) == "a2"
    assert main_policy(["oracle", "random"]) == "oracle"


def test_warnings_tell_what_is_mixed(dones, as_lines):
    lines = as_lines(dones)
    assert warnings_about(lines) == ["oracle: reads ground truth, which no robot has."]
    episode = next(iter(lines))
    lines[episode] = {**lines[episode], "revision": "other", "error": "ValueError: no"}
    assert warnings_about(lines)[1:] == [
        "1 episodes ended in an exception; they count as failures.",
        "The episodes were run with 2 revisions of the code.",
    ]


def test_a_report_is_complete_and_stands_alone(tmp_path, dones, as_lines):
    lines = as_lines(dones)
    key = dones[0].episode.key
    for name, grey in (("view", 10), ("choice", 90), ("outcome", 200)):
        (tmp_path / "pictures").mkdir(exist_ok=True)
        path = snapshot_path(tmp_path / "pictures" / key, name)
        Image.fromarray(np.full((9, 16, 3), grey, np.uint8)).save(path)
    shown = write_report(
        tmp_path, lines, {d.episode: d.seconds for d in dones}, [tmp_path / "pictures"]
    )
    assert "| grasp | seen | clean | sr | 4 | 1 | 75.0 [30.1, 95.4] | 1.25 | 1.00 |" in shown

    page = (tmp_path / "report.html").read_text()
    links = re.findall(r'(?:src|href)=["\']([^"\']+)', page)
    assert all(link.startswith(("#", "data:image/jpeg;base64,")) for link in links)
    assert sum(link.startswith("data:") for link in links) == 3
    assert page.count("<svg") == 2 and "http" not in page
    assert "sr: first choice" in page and "grasp-seen-02: give me the pear" in page
    assert_balanced(page)

    text = (tmp_path / "report.md").read_text()
    for title in ("Success and steps", "Paired differences", "Causes of failure", "table 4"):
        assert title in text
    rows = list(csv.DictReader((tmp_path / "tables" / "success.csv").open()))
    assert float(rows[0]["success_low"]) == wilson(3, 4).low
    assert {row["policy"] for row in rows} == {"sr", "random", "oracle (reads ground truth)"}


def assert_balanced(page):
    opened = []
    void = ("meta", "img", "br")

    class Checker(HTMLParser):
        def handle_starttag(self, tag, attrs):
            if tag not in void:
                opened.append(tag)

        def handle_endtag(self, tag):
            assert opened.pop() == tag

    Checker().feed(page)
    assert opened == []


def test_the_same_lines_give_the_same_report(tmp_path, dones, as_lines):
    for name, order in (("a", dones), ("b", dones[::-1])):
        (tmp_path / name).mkdir()
        lines = as_lines(order)
        write_report(tmp_path / name, lines, {d.episode: d.seconds for d in dones})
    for path in (tmp_path / "a").rglob("*.*"):
        other = tmp_path / "b" / path.relative_to(tmp_path / "a")
        assert path.read_bytes() == other.read_bytes()


def test_results_of_several_folders_make_one_report(tmp_path, dones, make_done):
    for name, part in (("a", dones[:5]), ("b", dones[4:])):
        with ResultFolder(tmp_path / name) as folder:
            for done in part:
                folder.add(done)
            folder.finish()
    lines, seconds, pictures = merge_results([tmp_path / "a", tmp_path / "b"])
    assert set(lines) == set(seconds) == {done.episode for done in dones}
    assert pictures == (tmp_path / "a" / "pictures", tmp_path / "b" / "pictures")

    with ResultFolder(tmp_path / "c") as folder:
        folder.add(make_done("sr", 0, reasons=BAD))
    with pytest.raises(
        ConfigError, match=r"has another result of grasp-seen-02_seen_clean_0000_sr"
    ):
        merge_results([tmp_path / "a", tmp_path / "c"])
    with ResultFolder(tmp_path / "d") as folder:
        folder.add(replace(dones[0], record={**dones[0].record, "revision": "x", "versions": None}))
    assert merge_results([tmp_path / "a", tmp_path / "d"])[0][dones[0].episode] == dones[0].record
    (tmp_path / "empty").mkdir()
    with pytest.raises(ConfigError, match=r"^There are no results in '.*empty'; give a folder"):
        merge_results([tmp_path / "empty"])


def test_ours_stand_beside_what_was_published(tmp_path, dones, as_lines, make_done):
    noisy = [
        make_done("sr", seed, scene="grasp-unseen-00", split="unseen", condition="points-0.1")
        for seed in range(4)
    ]
    others = {
        replace(done.episode, policy=label): done.record | {"policy": label}
        for done in noisy
        for label in ("sr@relu", "sr@relu2")
    }
    write_report(tmp_path, as_lines([*dones, *noisy]) | others, {})
    tables = tmp_path / "tables"
    rows = list(csv.DictReader((tables / "paper-1.csv").open()))
    assert len(rows) == len(TABLE_1) + 2
    (row,) = (r for r in rows if r["our_policy"] == "sr" and r["task"] == "grasp")
    assert (row["published_method"], row["published_seen"], row["our_seen"]) == ("SR", "92", "0.75")
    assert row["our_unseen"] == ""
    rows = list(csv.DictReader((tables / "paper-2.csv").open()))
    (row,) = (r for r in rows if r["our_runs"])
    assert row["goal"] == "Give me the pear" and row["our_success"] == "0.75"
    # In per cent, as the column says, though the paper prints shares.
    shown = (tmp_path / "report.md").read_text()
    assert "| Give me the pear | 100 | 3.1 | 3.1 | 0.369404 | 4 | 75.0 [30.1, 95.4] |" in shown
    assert "| I need a fruit | 90 | 3.3 |" in shown
    rows = {r["sparsifier"]: r for r in csv.DictReader((tables / "paper-4.csv").open())}
    assert rows["published: ReLU²"]["points-0.1"] == "86.7"
    for name in ("sr (ReLU²)", "sr@relu2 (ReLU²)", "sr@relu (ReLU)"):
        assert rows[f"ours: {name}"]["points-0.1"] == "1.0"
        assert rows[f"ours: {name}"]["clean"] == ""


def test_random_scenes_are_not_set_beside_what_was_published(tmp_path, make_done, as_lines):
    lines = as_lines(
        [make_done("sr", seed, scene="place8", task="random-place8") for seed in (0, 1)]
    )
    write_report(tmp_path, lines, {})
    page = (tmp_path / "report.html").read_text()
    assert "random-place8, seen objects, clean: success in per cent<" in page
    assert "published" not in page and "#arrangements" not in page
    assert_balanced(page)
    links = set(re.findall(r"href=[\"']#([^\"']+)", page))
    assert links == set(re.findall(r"id=[\"']([^\"']+)", page))
    assert not list((tmp_path / "tables").glob("paper-*.csv"))


def test_published_figures_agree_with_each_other():
    both = {(e.task, e.policy): e for e in TABLE_1 if e.policy == "sr"}
    assert both == {(e.task, e.policy): e for e in TABLE_3 if e.policy == "sr"}
    goals = {
        plain_goal(load_arrangement(name).goal.text) for name in arrangement_names("grasp", "seen")
    }
    assert goals == {plain_goal(goal) for goal in TABLE_2}


@pytest.mark.parametrize(
    ("label", "kind"),
    [("sr", "sr"), ("sr@sr_a", "sr-a"), ("sr_a", "sr-a"), ("a2", "a2"), ("vlg@mine", "vlg")],
)
def test_labels_say_which_method_they_stand_for(label, kind):
    assert kind_of_policy(label) == kind
    assert "sr" in POLICY_NAMES


def test_a_table_writes_numbers_for_people_and_for_programs():
    table = Table(
        name="t",
        title="Title",
        note="Note <1>.",
        columns=(Column(name="who"), Column(name="rate", style="percent"), Column(name="n")),
        rows=(("a|b", Interval(value=0.5, low=0.25, high=0.75), 3), ("c", 0.125, None)),
    )
    assert table.markdown().splitlines()[4:] == [
        "| who | rate | n |",
        "| --- | --: | --- |",
        r"| a\|b | 50.0 [25.0, 75.0] | 3 |",
        "| c | 12.5 |  |",
    ]
    assert list(csv.reader(io.StringIO(table.csv()))) == [
        ["who", "rate", "rate_low", "rate_high", "n"],
        ["a|b", "0.5", "0.25", "0.75", "3"],
        ["c", "0.125", "", "", ""],
    ]
    assert "Note &lt;1&gt;." in table.html() and '<td class="percent">12.5</td>' in table.html()
