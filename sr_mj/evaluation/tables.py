"""The tables of a report, made from lines of results alone."""

from math import isnan
from statistics import fmean
from typing import Any

from sr_mj.evaluation.plan import REFERENCES, Episode
from sr_mj.evaluation.results import Lines
from sr_mj.evaluation.statistics import Interval, wilson
from sr_mj.evaluation.summary import (
    Group,
    attempt_outcomes,
    by_group,
    by_policy,
    causes,
    compare,
    grouped,
    score,
)
from sr_mj.evaluation.table import Cell, Column, Table

_GROUP = (Column(name="task"), Column(name="objects"), Column(name="condition"))
STAGES = ("look", "perceive", "propose", "reach", "decide", "plan", "act", "total")


def _cells(group: Group) -> tuple[str, str, str]:
    return group.task, group.split, group.condition


def success_table(lines: Lines) -> Table:
    """Return success and steps of every policy under all circumstances."""
    rows: list[tuple[Cell, ...]] = []
    for group, records in by_group(lines).items():
        for label, own in by_policy(records).items():
            s = score(label, own)
            steps = (s.steps, s.success_steps, s.reward)
            rows.append(
                (*_cells(group), s.title, s.runs, s.num_scenes, s.success, *steps, s.errors)
            )
    return Table(
        name="success",
        title="Success and steps",
        note=(
            "Success in per cent with its 95 % Wilson interval, over all episodes that were "
            "started: one that ended in an exception is a failure. Steps are executed actions; "
            "the reward is that of an attempt."
        ),
        columns=(
            *_GROUP,
            Column(name="policy"),
            Column(name="runs", style="number"),
            Column(name="scenes", style="number"),
            Column(name="success", style="percent"),
            Column(name="steps", style="number"),
            Column(name="steps of successes", style="number"),
            Column(name="reward", style="number"),
            Column(name="exceptions", style="number"),
        ),
        rows=tuple(rows),
    )


def overview_table(lines: Lines) -> Table:
    """Return the success of every policy, a column for every task and kind of objects."""
    groups = {g: by_policy(own) for g, own in by_group(lines).items() if g.condition == "clean"}
    labels = dict.fromkeys(label for policies in groups.values() for label in policies)
    order = sorted(labels, key=lambda label: (label in REFERENCES, label))
    rows = [
        (label, *(_success_of(label, policies.get(label)) for policies in groups.values()))
        for label in order
    ]
    return Table(
        name="overview",
        title="Overview",
        note=(
            "Success in per cent under plain conditions, with 95 % Wilson intervals over all "
            "episodes that were started."
        ),
        columns=(
            Column(name="policy"),
            *(Column(name=f"{g.task}, {g.split}", style="percent") for g in groups),
        ),
        rows=tuple(rows),
    )


def _success_of(label: str, records: list[dict[str, Any]] | None) -> Cell:
    return score(label, records).success if records else None


def comparison_table(lines: Lines) -> Table:
    """Return paired differences between policies."""
    rows: list[tuple[Cell, ...]] = [
        (
            *_cells(group),
            f"{c.policy} - {c.against}",
            c.pairs,
            _estimate(c.success),
            None if c.success_elsewhere is None else _estimate(c.success_elsewhere),
            c.wins,
            c.losses,
            _estimate(c.steps),
        )
        for group, records in by_group(lines).items()
        for c in compare(by_policy(records))
    ]
    return Table(
        name="differences",
        title="Paired differences",
        note=(
            "The same scenes with the same seeds. Percentage points of success with 95 % intervals "
            "by the paired bootstrap: first for other seeds on these scenes, where they were run "
            "more than once; then for other scenes too, where there are more than one. With two or "
            "three scenes the second is too narrow to be trusted. Where no pair differs from "
            "another, nothing tells how much others might, and there is no interval. Wins are "
            "pairs in which only the first policy succeeded."
        ),
        columns=(
            *_GROUP,
            Column(name="policies"),
            Column(name="pairs", style="number"),
            Column(name="difference", style="points"),
            Column(name="on other scenes", style="points"),
            Column(name="wins", style="number"),
            Column(name="losses", style="number"),
            Column(name="steps", style="number"),
        ),
        rows=tuple(rows),
    )


def _estimate(interval: Interval) -> Cell:
    return interval.value if isnan(interval.low) else interval


def cause_table(lines: Lines) -> Table:
    """Return why episodes failed."""
    rows: list[tuple[Cell, ...]] = [
        (*_cells(group), label, cause, count, wilson(count, len(own)))
        for group, records in by_group(lines).items()
        for label, own in by_policy(records).items()
        for cause, count in causes(own)
    ]
    return Table(
        name="causes",
        title="Causes of failure",
        note="How the last attempt of a failed episode ended, as a share of all episodes.",
        columns=(
            *_GROUP,
            Column(name="policy"),
            Column(name="cause"),
            Column(name="episodes", style="number"),
            Column(name="share", style="percent"),
        ),
        rows=tuple(rows),
    )


def attempt_table(lines: Lines) -> Table:
    """Return how all attempts ended."""
    rows: list[tuple[Cell, ...]] = []
    for group, records in by_group(lines).items():
        for label, own in by_policy(records).items():
            outcomes = attempt_outcomes(own)
            total = sum(count for _, count in outcomes)
            rows += [(*_cells(group), label, what, n, n / total) for what, n in outcomes]
    return Table(
        name="attempts",
        title="How attempts ended",
        note="Every attempt; those of a hand-over are the oracle's, not the policy's.",
        columns=(
            *_GROUP,
            Column(name="policy"),
            Column(name="outcome"),
            Column(name="attempts", style="number"),
            Column(name="share", style="percent"),
        ),
        rows=tuple(rows),
    )


def goal_table(lines: Lines) -> Table:
    """Return success and steps by arrangement."""
    rows: list[tuple[Cell, ...]] = []
    for group, records in by_group(lines).items():
        fixed = [r for r in records if r["arrangement_sha256"] is not None]
        for scene, of_scene in grouped(fixed, lambda r: str(r["scene"])).items():
            for label, own in by_policy(of_scene).items():
                s, goal = score(label, own), _goal(own)
                steps = (s.steps, s.success_steps, s.reward)
                rows.append((scene, group.condition, goal, s.title, s.runs, s.success, *steps))
    return Table(
        name="goals",
        title="By arrangement",
        note="Every arrangement has one goal; said in other words, it is named by the first.",
        columns=(
            Column(name="arrangement"),
            Column(name="condition"),
            Column(name="goal"),
            Column(name="policy"),
            Column(name="runs", style="number"),
            Column(name="success", style="percent"),
            Column(name="steps", style="number"),
            Column(name="steps of successes", style="number"),
            Column(name="reward", style="number"),
        ),
        rows=tuple(rows),
    )


def _goal(records: list[dict[str, Any]]) -> str:
    return next((str(r["goal"]) for r in records if "goal" in r), "")


def second_table(lines: Lines, seconds: dict[Episode, dict[str, float]]) -> Table:
    """Return the mean seconds of an episode by stage."""
    rows: list[tuple[Cell, ...]] = []
    timed = {episode: record for episode, record in lines.items() if seconds.get(episode)}
    for group, records in by_group(timed).items():
        for label, own in by_policy(records).items():
            times = [seconds[Episode.of_record(record)] for record in own]
            means = (round(fmean(t.get(stage, 0.0) for t in times), 3) for stage in STAGES)
            rows.append((*_cells(group), label, *means))
    return Table(
        name="seconds",
        title="Seconds",
        note=(
            "Mean wall time of an episode by stage, one thread each; the total has the making of "
            "the scene too. Scene, hand-over and first look, which policies share, are counted "
            "for each: an episode has the time that it would have taken alone."
        ),
        columns=(
            *_GROUP,
            Column(name="policy"),
            *(Column(name=stage, style="number") for stage in STAGES),
        ),
        rows=tuple(rows),
    )
