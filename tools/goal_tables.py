"""The table of grasping by instruction: the paper's table 2, and the same for unseen objects."""

from sr_mj.evaluation.published import TABLE_2, plain_goal
from sr_mj.evaluation.results import Lines
from sr_mj.evaluation.summary import Group, by_group, by_policy, score
from tools.table_text import SPLITS, markdown, percent

BESIDE = ("a2", "grounding", "oracle")
"""Policies whose steps stand beside those of SR."""
_PAPER = {plain_goal(goal): values for goal, values in TABLE_2.items()}


def grasp_goals(lines: Lines) -> str:
    """Return success and steps of SR, the paper's, and steps of others, for every instruction.

    Args:
        lines: Results.

    Returns:
        The table: seen objects first, in the order of the arrangements. What was not run is empty.
    """
    groups = by_group(lines)
    rows = []
    for split in SPLITS:
        records = groups.get(Group(task="grasp", split=split, condition="clean"), [])
        # An episode whose process died does not tell its goal, but others of its scene may.
        goals = dict.fromkeys((record["scene"] for record in records), "")
        goals |= {record["scene"]: record["goal"] for record in records if "goal" in record}
        for scene in sorted(goals):
            own = by_policy([record for record in records if record["scene"] == scene])
            found = {label: score(label, runs) for label, runs in own.items()}
            rows.append(
                [
                    split,
                    goals[scene],
                    percent(found["sr"].success) if "sr" in found else "",
                    f"{found['sr'].steps:.1f}" if "sr" in found else "",
                    _published(goals[scene]) if split == "seen" else "",
                    *(f"{found[label].steps:.1f}" if label in found else "" for label in BESIDE),
                ]
            )
    beside = [f"`{label}`, steps" for label in BESIDE]
    return markdown(["objects", "goal", "`sr`", "steps", "paper", *beside], rows)


def _published(goal: str) -> str:
    """Return success in per cent and steps as the paper prints them."""
    if (values := _PAPER.get(plain_goal(goal))) is None:
        return ""
    success, steps, *_ = values
    return f"{success * 100:g} / {steps:g}"
