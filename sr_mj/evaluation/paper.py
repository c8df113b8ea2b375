"""The paper's tables with our figures beside them."""

from sr_mj.evaluation.published import (
    TABLE_1,
    TABLE_2,
    TABLE_3,
    TABLE_4,
    TABLE_4_LEVELS,
    Published,
    kind_of_policy,
    plain_goal,
)
from sr_mj.evaluation.results import Lines
from sr_mj.evaluation.statistics import Interval
from sr_mj.evaluation.summary import Group, Score, by_group, by_policy, main_policy, score
from sr_mj.evaluation.table import Cell, Column, Table

Scores = dict[Group, list[Score]]

_AS_PUBLISHED = (
    "Published figures are the paper's, as printed, and were not measured here: other simulator, "
    "objects and arrangements."
)


def paper_tables(lines: Lines) -> tuple[Table, ...]:
    """Return the paper's tables 1 to 4 beside ours; empty cells are what nobody has measured.

    Random scenes have no place in them: without an episode on a fixed arrangement there are none.
    """
    if all(record["arrangement_sha256"] is None for record in lines.values()):
        return ()
    scores = {
        group: [score(label, own) for label, own in by_policy(records).items()]
        for group, records in by_group(lines).items()
    }
    return (
        _methods("paper-1", "The paper's table 1: all methods", TABLE_1, scores, with_others=True),
        _goals(lines),
        _methods("paper-3", "The paper's table 3: ablations", TABLE_3, scores, with_others=False),
        _noise(scores),
    )


def _methods(
    name: str,
    title: str,
    published: tuple[Published, ...],
    scores: Scores,
    *,
    with_others: bool,
) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for task in ("grasp", "place", "pick-place"):
        of_task = [entry for entry in published if entry.task == task]
        for entry in of_task:
            # Two policies may stand for the same method; the first takes its row.
            ours = _labels(scores, task, entry.policy)[:1]
            rows.append(_method_row(entry, scores, task, ours[0] if ours else None))
        if with_others:
            taken = {row[1] for row in rows if row[0] == task}
            others = [x for x in _labels(scores, task, None, is_any=True) if x not in taken]
            rows += [_method_row(None, scores, task, label) for label in others]
    return Table(
        name=name,
        title=title,
        note=f"{_AS_PUBLISHED} Success in per cent, ours with 95 % Wilson intervals; steps over "
        "all episodes.",
        columns=(
            Column(name="task"),
            Column(name="our policy"),
            Column(name="published method"),
            Column(name="published seen", style="percent"),
            Column(name="published seen steps", style="number"),
            Column(name="our seen", style="percent"),
            Column(name="our seen steps", style="number"),
            Column(name="published unseen", style="percent"),
            Column(name="published unseen steps", style="number"),
            Column(name="our unseen", style="percent"),
            Column(name="our unseen steps", style="number"),
        ),
        rows=tuple(rows),
    )


def _printed(value: float | None) -> str | None:
    """Return a published figure with its own digits."""
    return None if value is None else f"{value:g}"


def _labels(scores: Scores, task: str, policy: str | None, *, is_any: bool = False) -> list[str]:
    """List the policies that ran a task plainly: all, or those that stand for a method."""
    found = [
        s.policy
        for group, own in scores.items()
        if group.task == task and group.condition == "clean"
        for s in own
        if is_any or kind_of_policy(s.policy) == policy
    ]
    return list(dict.fromkeys(found))


def _method_row(
    entry: Published | None, scores: Scores, task: str, label: str | None
) -> tuple[Cell, ...]:
    cells: list[Cell] = [task, label, None if entry is None else entry.method]
    for split in ("seen", "unseen"):
        if entry is None:
            cells += [None, None]
        else:
            cells += [
                _printed(getattr(entry, split)),
                _printed(getattr(entry, f"{split}_steps")),
            ]
        found = _find(scores, Group(task=task, split=split, condition="clean"), label)
        cells += [None, None] if found is None else [found.success, found.steps]
    return tuple(cells)


def _find(scores: Scores, group: Group, label: str | None) -> Score | None:
    return next((s for s in scores.get(group, []) if s.policy == label), None)


def _goals(lines: Lines) -> Table:
    group = Group(task="grasp", split="seen", condition="clean")
    policies = by_policy(by_group(lines).get(group, []))
    label = main_policy(policies) if policies else None
    own = policies.get(label or "", [])
    rows: list[tuple[Cell, ...]] = []
    for goal, (success, steps, success_steps, reward) in TABLE_2.items():
        mine = [r for r in own if plain_goal(r.get("goal", "")) == plain_goal(goal)]
        ours: tuple[Cell, ...] = (None,) * 5
        if mine and label:
            s = score(label, mine)
            ours = (s.runs, s.success, s.steps, s.success_steps, s.reward)
        # The paper prints this table's success as a share, the others' in per cent.
        published = map(_printed, (success * 100, steps, success_steps, reward))
        rows.append((goal, *published, *ours))
    return Table(
        name="paper-2",
        title="The paper's table 2: seen grasping by instruction",
        note=f"{_AS_PUBLISHED} Published: SR; ours: {label or 'not run yet'}, in arrangements of "
        "our own with the same instructions.",
        columns=(
            Column(name="goal"),
            Column(name="published success", style="percent"),
            Column(name="published steps", style="number"),
            Column(name="published steps of successes", style="number"),
            Column(name="published reward", style="number"),
            Column(name="our runs", style="number"),
            Column(name="our success", style="percent"),
            Column(name="our steps", style="number"),
            Column(name="our steps of successes", style="number"),
            Column(name="our reward", style="number"),
        ),
        rows=tuple(rows),
    )


def _noise(scores: Scores) -> Table:
    """Return table 4, extended by the plain condition and by noise of the sensor."""
    conditions = ("clean", *TABLE_4_LEVELS.values(), "l515-0x", "l515-2x", "l515-4x")
    rows: list[tuple[Cell, ...]] = []
    for name, (_, values) in TABLE_4.items():
        figures = dict(zip(TABLE_4_LEVELS.values(), values, strict=True))
        printed = (_printed(figures.get(condition)) for condition in conditions)
        rows.append((f"published: {name}", *printed))
    labels = dict.fromkeys(s.policy for g, own in scores.items() if _is_noisy(g) for s in own)
    stands_for = {kind: name for name, (kinds, _) in TABLE_4.items() for kind in kinds}
    for label in labels:
        found = (
            _find(scores, Group(task="grasp", split="unseen", condition=c), label)
            for c in conditions
        )
        successes: tuple[Interval | None, ...] = tuple(s and s.success for s in found)
        kind = stands_for.get(kind_of_policy(label))
        rows.append((f"ours: {label}" + (f" ({kind})" if kind else ""), *successes))
    return Table(
        name="paper-4",
        title="The paper's table 4: unseen grasping under noise",
        note=f"{_AS_PUBLISHED} The paper gives no unit for its noise of 0.1, 0.2 and 0.3 (light, "
        "middle, heavy); ours is in half extents of the workspace along each axis (0.1 is 22 mm "
        "on the table), on the points that the policy sees. l515 is the sensor's noise times a "
        "factor: errors of depth, jitter of edges and noise of colours; of flying and of dark "
        "pixels the share, at most all; not what drops out at grazing angles.",
        columns=(
            Column(name="sparsifier"),
            *(Column(name=condition, style="percent") for condition in conditions),
        ),
        rows=tuple(rows),
    )


def _is_noisy(group: Group) -> bool:
    is_noise = group.condition.startswith(("points-", "l515-"))
    return group.task == "grasp" and group.split == "unseen" and is_noise
