"""Tables of what is made harder than in the plain suites: noise, errors of the pose, wording."""

from collections.abc import Iterable

from sr_mj.evaluation.plan import NOISE_LEVELS, POSE_LEVELS
from sr_mj.evaluation.published import TABLE_4, TABLE_4_LEVELS
from sr_mj.evaluation.results import Lines
from sr_mj.evaluation.summary import Group, Score, by_group, by_policy, score
from tools.table_text import COLUMNS, ORDER, SPLITS, markdown, percent, title

Scores = dict[Group, dict[str, Score]]


def noise(lines: Lines) -> str:
    """Return unseen grasping under noise, with mean steps: the paper's table 4 and the sensor."""
    conditions = ("clean", *NOISE_LEVELS)
    scores = _scores(lines)
    groups = [Group(task="grasp", split="unseen", condition=c) for c in conditions]
    rows = []
    for name, (_, values) in TABLE_4.items():
        printed = dict(zip(TABLE_4_LEVELS.values(), map(str, values), strict=True))
        rows.append([f"*paper: {name}*", *(printed.get(c, "") for c in conditions)])
    rows += [
        [title(label), *(_with_steps(scores, group, label) for group in groups)]
        for label in _labels(scores, groups[1:])
    ]
    return markdown(["", *conditions], rows)


def perturbation(lines: Lines) -> str:
    """Return placing with an error added to the executed pose."""
    scores = _scores(lines)
    groups = [
        Group(task="place", split=split, condition=c)
        for split in SPLITS
        for c in ("clean", *POSE_LEVELS)
    ]
    harder = [group for group in groups if group.condition != "clean"]
    heading = [f"{g.split}, {g.condition.removeprefix('pose-')}" for g in groups]
    rows = [
        [title(label), *(_success(scores, group, label) for group in groups)]
        for label in _labels(scores, harder)
    ]
    return markdown(["policy", *heading], rows)


def heavy30(lines: Lines) -> str:
    """Return grasping among 30 objects, with the steps over all episodes."""
    scores = _scores(lines)
    groups = [Group(task="heavy30", split=split, condition="clean") for split in SPLITS]
    rows = []
    for label in _labels(scores, groups):
        row = [title(label)]
        for group in groups:
            found = scores.get(group, {}).get(label)
            row += [percent(found.success), f"{found.steps:.2f}"] if found else ["", ""]
        rows.append(row)
    return markdown(["policy", "seen", "steps", "unseen", "steps"], rows)


def paraphrase(lines: Lines) -> str:
    """Return all tasks with the goal in other words; in brackets what the plain words give."""
    scores = _scores(lines)
    groups = [Group(task=task, split=split, condition="reworded") for task, split in COLUMNS]
    rows = []
    for label in _labels(scores, groups):
        row = [title(label)]
        for group in groups:
            text = _success(scores, group, label)
            plain = scores.get(Group(task=group.task, split=group.split, condition="clean"), {})
            if text and (before := plain.get(label)):
                text += f" ({before.success.value * 100:.1f})"
            row.append(text)
        rows.append(row)
    return markdown(["policy", *(f"{task}, {split}" for task, split in COLUMNS)], rows)


def _scores(lines: Lines) -> Scores:
    return {
        group: {label: score(label, own) for label, own in by_policy(records).items()}
        for group, records in by_group(lines).items()
    }


def _labels(scores: Scores, groups: Iterable[Group]) -> list[str]:
    """List who ran any of these, from top to bottom."""
    found = {label for group in groups for label in scores.get(group, {})}
    # A checkpoint's policy stands behind that of the shipped weights.
    places = {label: place for place, label in enumerate(ORDER)}
    return sorted(found, key=lambda label: (places[label.partition("@")[0]], label))


def _success(scores: Scores, group: Group, label: str) -> str:
    found = scores.get(group, {}).get(label)
    return percent(found.success) if found else ""


def _with_steps(scores: Scores, group: Group, label: str) -> str:
    found = scores.get(group, {}).get(label)
    return f"{percent(found.success)}, {found.steps:.1f}" if found else ""
