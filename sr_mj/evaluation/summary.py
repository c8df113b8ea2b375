"""From lines of results to counts: success, steps, causes of failure, paired differences."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from statistics import fmean
from typing import Any, TypeVar

import numpy as np

from sr_mj.evaluation.plan import REFERENCES
from sr_mj.evaluation.results import Lines
from sr_mj.evaluation.statistics import Interval, paired_bootstrap, wilson

Key = TypeVar("Key")

PREFERRED = ("sr", "grounding")
"""The policy that others are compared with, if it is there."""

_BOOTSTRAP_SEED = 0


@dataclass(frozen=True, kw_only=True, order=True)
class Group:
    """Episodes that are counted together: the same task under the same circumstances.

    Attributes:
        task: Task.
        split: Objects.
        condition: Condition.
    """

    task: str
    split: str
    condition: str


@dataclass(frozen=True, kw_only=True)
class Score:
    """How a policy did on some episodes.

    Attributes:
        policy: Label.
        is_privileged: It reads ground truth.
        runs: Episodes, all of which count.
        num_scenes: Different scenes among them.
        success: Share of successes, with its Wilson interval.
        steps: Mean number of executed actions over all episodes.
        success_steps: The same over successes; None if there are none.
        reward: Mean reward of an attempt of the policy's, averaged over episodes with any.
        errors: Episodes that ended in an exception.
    """

    policy: str
    is_privileged: bool
    runs: int
    num_scenes: int
    success: Interval
    steps: float
    success_steps: float | None
    reward: float | None
    errors: int

    @property
    def title(self) -> str:
        """The label; marked if it reads ground truth."""
        return f"{self.policy} (reads ground truth)" if self.is_privileged else self.policy


def grouped(
    records: Iterable[dict[str, Any]], key: Callable[[dict[str, Any]], Key]
) -> dict[Key, list[dict[str, Any]]]:
    """Sort records into lists by a key, in the order in which keys first occur."""
    found: dict[Key, list[dict[str, Any]]] = defaultdict(list)
    for record in records:
        found[key(record)].append(record)
    return dict(found)


def by_group(lines: Lines) -> dict[Group, list[dict[str, Any]]]:
    """Sort lines of results into groups, which come in order."""
    groups = grouped(
        lines.values(),
        lambda r: Group(task=r["task"], split=r["split"], condition=r["condition"]),
    )
    return {group: groups[group] for group in sorted(groups)}


def by_policy(records: Iterable[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """Sort records by policy: those that were asked for by name, then the references."""
    policies = grouped(records, lambda r: str(r["policy"]))
    order = sorted(policies, key=lambda label: (label in REFERENCES, label))
    return {label: policies[label] for label in order}


def score(policy: str, records: list[dict[str, Any]]) -> Score:
    """Count what a policy did.

    Args:
        policy: Label.
        records: At least one of its lines.

    Returns:
        The score; every line is in the denominator.
    """
    successes = [record for record in records if record["success"]]
    rewards = [fmean(own) for record in records if (own := _own_rewards(record))]
    return Score(
        policy=policy,
        is_privileged=any(record["privileged"] for record in records),
        runs=len(records),
        num_scenes=len({_scene_key(record) for record in records}),
        success=wilson(len(successes), len(records)),
        steps=fmean(record["num_actions"] for record in records),
        success_steps=fmean(r["num_actions"] for r in successes) if successes else None,
        reward=fmean(rewards) if rewards else None,
        errors=sum(record["error"] is not None for record in records),
    )


def _own_rewards(record: dict[str, Any]) -> list[float]:
    return [a["reward"] for a in record["attempts"] if not a["is_hand_over"]]


def _scene_key(record: dict[str, Any]) -> tuple[str, int]:
    """Tell scenes apart; every seed of a random one is another."""
    return record["scene"], record["seed"] if record["arrangement_sha256"] is None else 0


def causes(records: list[dict[str, Any]]) -> list[tuple[str, int]]:
    """Count the causes of failure, the most frequent first."""
    counts = Counter(r["cause"] for r in records if not r["success"])
    return sorted(counts.items(), key=lambda item: (-item[1], item[0]))


def attempt_outcomes(records: list[dict[str, Any]]) -> list[tuple[str, int]]:
    """Count how attempts ended, hand-overs apart, the most frequent first."""
    counts = Counter(
        f"{'hand-over' if a['is_hand_over'] else a['kind']}: {a['reason']}"
        for record in records
        for a in record["attempts"]
    )
    return sorted(counts.items(), key=lambda item: (-item[1], item[0]))


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """How much better a policy did than another on the same scenes with the same seeds.

    Attributes:
        policy: Label.
        against: Label of the other.
        pairs: Episodes that both ran.
        success: Difference of the success rates; interval for other seeds on these scenes, its ends
            nan if every scene was run once, which tells nothing of other seeds, or if no pair
            differs from another, which does not tell how much they may.
        success_elsewhere: The same, with an interval for other scenes too; None if there is only
            one, which tells nothing of others.
        steps: Difference of the steps; interval for other seeds on these scenes, as `success`.
        wins: Pairs in which only `policy` succeeded.
        losses: Pairs in which only `against` did.
    """

    policy: str
    against: str
    pairs: int
    success: Interval
    success_elsewhere: Interval | None
    steps: Interval
    wins: int
    losses: int


def main_policy(labels: Iterable[str]) -> str:
    """Choose the policy that the others are compared with, by name and never by its results."""
    known = list(labels)
    others = [label for label in known if label not in REFERENCES]
    for label in (*PREFERRED, *others, *known):
        if label in known:
            return label
    raise ValueError("Got no policy to choose from; expected at least one.")


def compare(policies: dict[str, list[dict[str, Any]]]) -> list[Comparison]:
    """Compare the main policy with every other one that ran on the same episodes.

    Args:
        policies: Lines of one group by policy.

    Returns:
        One comparison for each other policy, positive where the main one is better at succeeding.
    """
    ours = main_policy(policies)
    found = []
    for other in policies:
        pairs = _pairs(policies[ours], policies[other]) if other != ours else {}
        if pairs:
            found.append(_compare_pairs(ours, other, pairs))
    return found


Pairs = dict[tuple[str, int], list[tuple[dict[str, Any], dict[str, Any]]]]


def _pairs(ours: list[dict[str, Any]], theirs: list[dict[str, Any]]) -> Pairs:
    """Pair what has the same scene and seed, sorted by scene."""
    known = {(r["scene"], r["seed"]): r for r in theirs}
    pairs: Pairs = defaultdict(list)
    for record in ours:
        if (other := known.get((record["scene"], record["seed"]))) is not None:
            pairs[_scene_key(record)].append((record, other))
    return pairs


def _compare_pairs(ours: str, other: str, pairs: Pairs) -> Comparison:
    rng = np.random.default_rng(_BOOTSTRAP_SEED)
    success = [[float(a["success"]) - b["success"] for a, b in g] for g in pairs.values()]
    steps = [[float(a["num_actions"]) - b["num_actions"] for a, b in g] for g in pairs.values()]
    # Where every seed is a scene of its own, other seeds are other scenes.
    is_random = all(a["arrangement_sha256"] is None for group in pairs.values() for a, _ in group)
    if is_random:
        success, steps = [[d for g in success for d in g]], [[d for g in steps for d in g]]
    within, elsewhere = _on_other_seeds(success, rng), None
    if is_random and len(pairs) > 1:
        elsewhere = within
    elif len(pairs) > 1:
        elsewhere = _if_varying(success, paired_bootstrap(success, rng, are_groups_drawn=True))
    differences = [d for group in success for d in group]
    return Comparison(
        policy=ours,
        against=other,
        pairs=len(differences),
        success=within,
        success_elsewhere=elsewhere,
        steps=_on_other_seeds(steps, rng),
        wins=sum(d > 0 for d in differences),
        losses=sum(d < 0 for d in differences),
    )


def _on_other_seeds(groups: list[list[float]], rng: np.random.Generator) -> Interval:
    """Estimate a mean; without ends if no scene was run twice, as if none could vary."""
    found = paired_bootstrap(groups, rng)
    if any(len(group) > 1 for group in groups):
        return _if_varying(groups, found)
    return _without_ends(found)


def _if_varying(groups: list[list[float]], found: Interval) -> Interval:
    """Take the ends of an interval away if all differences are equal: it would be a point."""
    return found if len({d for group in groups for d in group}) > 1 else _without_ends(found)


def _without_ends(found: Interval) -> Interval:
    return Interval(value=found.value, low=float("nan"), high=float("nan"))
