"""Tells which lines of results belong together, and what differs among those that were put so."""

from collections.abc import Iterable
from typing import Any

from sr_mj.evaluation.results import Lines
from sr_mj.evaluation.setting import BLIND_POLICIES
from sr_mj.evaluation.summary import grouped

_MADE_WITH = ("versions", "revision")
# What has to be the same in all lines; the encoder only in those of policies that look.
_SHARED = (
    ("generator", "generators of grasps"),
    ("cameras", "camera presets"),
    ("max_attempts", "numbers of attempts"),
    ("keep_unreachable", "settings of keep_unreachable"),
)

Record = dict[str, Any]


def is_same_result(a: Record, b: Record) -> bool:
    """Tell whether two lines of an episode say the same.

    Code and packages with which it was run may differ. What one of them lacks, as lines of earlier
    versions do, is not known, and holds nothing against it.

    Args:
        a: A line.
        b: Another of the same episode.

    Returns:
        Whether they agree in all that both tell.
    """
    return _agree(*({k: v for k, v in line.items() if k not in _MADE_WITH} for line in (a, b)))


def _agree(a: Any, b: Any) -> bool:
    if isinstance(a, dict) and isinstance(b, dict):
        return all(_agree(a[name], b[name]) for name in a.keys() & b.keys())
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(_agree, a, b))
    return a == b


def mixtures(lines: Lines) -> list[str]:
    """Say what was not the same in all results that are counted together.

    Args:
        lines: All results.

    Returns:
        Sentences; none if nothing differs.
    """
    records = list(lines.values())
    looking = [r for r in records if r["policy"].partition("@")[0] not in BLIND_POLICIES]
    notes = [*_of_policies(records), *_of_scenes(records)]
    encoders = _known(looking, "encoder_fingerprint")
    if len(encoders) > 1:
        notes.append(f"The policies looked through {len(encoders)} encoders ({_listed(encoders)}).")
    for name, what in _SHARED:
        found = _known(records, name)
        if len(found) > 1:
            notes.append(f"The episodes were run with {len(found)} {what} ({_listed(found)}).")
    for name, what in (("revision", "revisions of the code"), ("versions", "sets of packages")):
        if (number := len(_known(records, name))) > 1:
            notes.append(f"The episodes were run with {number} {what}.")
    return notes


def _of_policies(records: list[Record]) -> list[str]:
    notes = []
    for label, own in sorted(grouped(records, lambda r: str(r["policy"])).items()):
        for name, what in (("weights_sha256", "weights"), ("card_sha256", "cards of weights")):
            if (number := len(_known(own, name))) > 1:
                notes.append(
                    f"{label}: {number} different {what} under this name, counted together."
                )
    return notes


def _of_scenes(records: list[Record]) -> list[str]:
    notes = []
    fixed = [r for r in records if r["arrangement_sha256"] is not None]
    for scene, own in sorted(grouped(fixed, lambda r: str(r["scene"])).items()):
        if (number := len(_known(own, "arrangement_sha256"))) > 1:
            notes.append(f"{scene}: {number} different arrangements under this name.")
    for task, own in sorted(grouped(records, lambda r: str(r["task"])).items()):
        makers = _known(own, "scene_maker")
        if len(makers) > 1:
            notes.append(f"{task}: scenes of {len(makers)} makers ({_listed(makers)}).")
        if number := _num_unlike(own):
            notes.append(
                f"{task}: {number} scenes had other objects or another goal with one policy than "
                "with another, under the same seed; paired differences do not hold there."
            )
    return notes


def _num_unlike(records: list[Record]) -> int:
    """Count what should have been the same scene, and was not."""
    begun = [r for r in records if "goal" in r and "objects" in r]
    scenes = grouped(begun, lambda r: (r["split"], r["scene"], r["condition"], r["seed"]))
    return sum(
        len(_distinct((r["goal"], r["objects"]) for r in own)) > 1 for own in scenes.values()
    )


def _known(records: Iterable[Record], name: str) -> list[Any]:
    """List the different values of an entry; lines without it do not know theirs."""
    return _distinct(record[name] for record in records if name in record)


def _distinct(values: Iterable[Any]) -> list[Any]:
    found: list[Any] = []
    for value in values:
        if value not in found:
            found.append(value)
    return found


def _listed(values: Iterable[Any]) -> str:
    return ", ".join(map(str, values))
