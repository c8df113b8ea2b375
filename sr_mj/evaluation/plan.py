"""Which episodes a suite consists of, and which policies run them."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from models.arrangements.library import arrangement_names
from sr_mj.errors import ConfigError, UnknownNameError, unknown_name_message
from sr_mj.evaluation.conditions import read_condition

TASKS = ("grasp", "place", "pick-place", "heavy30")
"""Kinds of fixed arrangements."""

NOISE_LEVELS = ("points-0.1", "points-0.2", "points-0.3", "l515-0x", "l515-2x", "l515-4x")
POSE_LEVELS = ("pose-0.5cm-2deg", "pose-1cm-5deg", "pose-2cm-10deg")

SUITES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "grasp": (("grasp",), ("clean",)),
    "place": (("place",), ("clean",)),
    "pick-place": (("pick-place",), ("clean",)),
    "heavy30": (("heavy30",), ("clean",)),
    "paraphrase": (("grasp", "place", "pick-place"), ("reworded",)),
    # With the plain condition, so that every level has something to be compared with.
    "noise": (("grasp",), ("clean", *NOISE_LEVELS)),
    "perturbation": (("place",), ("clean", *POSE_LEVELS)),
}
"""Tasks and conditions of every suite."""

REFERENCES = ("oracle", "random")
"""Policies that always run: ceiling and floor of every comparison."""


@dataclass(frozen=True, kw_only=True, order=True)
class Episode:
    """One episode: the unit of work. Its seed draws whatever its scene leaves open.

    Attributes:
        task: One of `TASKS`, or "random-" and the kind of a random scene.
        split: Objects: seen or unseen.
        scene: Name of an arrangement, or the kind of a random scene.
        condition: Name of a condition.
        seed: Draws sensor noise, candidates and errors; a random scene's objects and goal too.
        policy: Label of a policy.
    """

    task: str
    split: str
    scene: str
    condition: str
    seed: int
    policy: str

    @property
    def key(self) -> str:
        """A text that no other episode has, fit for the name of a file."""
        return f"{self.scene}_{self.split}_{self.condition}_{self.seed:04d}_{self.policy}"

    @property
    def is_arranged(self) -> bool:
        """Whether the scene is a fixed arrangement."""
        return self.task in TASKS

    @property
    def beginning(self) -> "Episode":
        """What stands for all episodes with the same scene, hand-over and first look."""
        return replace(self, policy="", condition=read_condition(self.condition).beginning)

    @classmethod
    def of_record(cls, record: dict[str, Any]) -> "Episode":
        """Read an episode back from its line of results."""
        return cls(**{name: record[name] for name in cls.__dataclass_fields__})

    def record(self) -> dict[str, Any]:
        """Return the fields as plain JSON values."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True)
class PolicyChoice:
    """A policy to run.

    Attributes:
        label: What results call it.
        name: Its name in the registry.
        checkpoint: Its weights; those shipped when None.
    """

    label: str
    name: str
    checkpoint: Path | None = None


def read_policies(texts: Iterable[str]) -> tuple[PolicyChoice, ...]:
    """Read policies as they are given on a command line, and add the references.

    Args:
        texts: `NAME` or `NAME@CHECKPOINT`; the second is called `NAME@` and the file's stem.

    Returns:
        The references first, then what was asked for, each once.

    Raises:
        UnknownNameError: If there is no such policy.
        ConfigError: If a file is missing or given to a reference, or two policies would be called
            the same.
    """
    choices: dict[str, PolicyChoice] = {}
    for text in (*REFERENCES, *texts):
        choice = _read_policy(text)
        if choices.setdefault(choice.label, choice) != choice:
            raise ConfigError(
                f"Two policies would both be called {choice.label!r}; give their checkpoints "
                "different file names."
            )
    return tuple(choices.values())


def _read_policy(text: str) -> PolicyChoice:
    from sr_mj.assemble import check_policy_name

    name, _, checkpoint = text.partition("@")
    check_policy_name(name)
    if not checkpoint:
        return PolicyChoice(label=name, name=name)
    if name in REFERENCES:
        raise ConfigError(
            f"Policy {name!r} is given the checkpoint {checkpoint!r}, but has no weights; leave "
            "the checkpoint out, or name the policy that it belongs to."
        )
    path = Path(checkpoint)
    if not path.is_file():
        raise ConfigError(f"Checkpoint {checkpoint!r} of policy {name!r} is no file; check it.")
    # Workers on other machines have another working directory.
    return PolicyChoice(label=f"{name}@{path.stem}", name=name, checkpoint=path.resolve())


def plan_suites(
    suites: Sequence[str],
    splits: Sequence[str],
    seeds: Iterable[int],
    policies: Sequence[PolicyChoice],
    *,
    conditions: Sequence[str] | None = None,
    only: Sequence[str] = (),
) -> tuple[Episode, ...]:
    """List the episodes of suites.

    Args:
        suites: Keys of `SUITES`, or "all".
        splits: Of the objects.
        seeds: One run each.
        policies: Every one of them runs every scene with every seed.
        conditions: Instead of the suites' own.
        only: Names of arrangements to restrict the suites to; each must be in one of them.

    Returns:
        The episodes in canonical order, each once, though suites share some.

    Raises:
        UnknownNameError: If a suite or an arrangement does not exist.
        ConfigError: If a condition does not exist, an arrangement is not in these suites, or
            nothing is left to run.
    """
    tasks_and_conditions, runs = _tasks_and_conditions(suites, conditions), tuple(seeds)
    _check_arrangements(only, suites, splits, {task for task, _ in tasks_and_conditions})
    planned = {
        Episode(task=t, split=p, scene=name, condition=c, seed=seed, policy=policy.label)
        for t, c in tasks_and_conditions
        for p in splits
        for name in arrangement_names(t, p)
        if not only or name in only
        for seed in runs
        for policy in policies
    }
    if not planned:
        raise ConfigError(
            f"Nothing to run in the suites {', '.join(suites)}: got {len(runs)} seeds and "
            f"{len(policies)} policies, expected at least one of each."
        )
    return tuple(sorted(planned))


def _check_arrangements(
    only: Sequence[str], suites: Sequence[str], splits: Sequence[str], tasks: Iterable[str]
) -> None:
    """Refuse names that do not exist, or that would be left out without a word."""
    known = arrangement_names()
    there = {name for task in tasks for split in splits for name in arrangement_names(task, split)}
    for name in only:
        if name not in known:
            raise UnknownNameError(unknown_name_message("arrangement", name, known))
        if name not in there:
            raise ConfigError(
                f"Arrangement {name!r} is in none of the suites {', '.join(suites)} with split "
                f"{' and '.join(splits)}; add its suite and split, or leave it out."
            )


def _tasks_and_conditions(
    suites: Sequence[str], conditions: Sequence[str] | None
) -> list[tuple[str, str]]:
    names = tuple(SUITES) if "all" in suites else suites
    for name in names:
        if name not in SUITES:
            raise UnknownNameError(unknown_name_message("suite", name, (*SUITES, "all")))
    pairs = [
        (task, read_condition(condition).name)
        for name in names
        for task in SUITES[name][0]
        for condition in (conditions or SUITES[name][1])
    ]
    return list(dict.fromkeys(pairs))


def plan_random(
    scene: str,
    split: str,
    seeds: Iterable[int],
    policies: Sequence[PolicyChoice],
    *,
    conditions: Sequence[str] | None = None,
) -> tuple[Episode, ...]:
    """List episodes in random scenes, for development: every seed is a scene of its own.

    Args:
        scene: Kind of scene.
        split: Of the objects.
        seeds: Of the scenes.
        policies: Every one of them runs every scene.
        conditions: The plain one when None.

    Returns:
        The episodes in canonical order.

    Raises:
        ConfigError: If a condition does not exist or does not apply, or there is no seed.
        UnknownNameError: If there is no such kind of scene.
    """
    from sr_mj.scene import SCENE_KINDS

    if scene not in SCENE_KINDS:
        raise UnknownNameError(unknown_name_message("scene", scene, SCENE_KINDS))
    names = tuple(read_condition(name).name for name in conditions or ("clean",))
    if "reworded" in names:
        raise ConfigError("Only the goals of arrangements have other wordings; use a suite.")
    planned = {
        Episode(
            task=f"random-{scene}", split=split, scene=scene, condition=c, seed=seed, policy=p.label
        )
        for c in names
        for seed in seeds
        for p in policies
    }
    if not planned:
        raise ConfigError("There is no seed to run; give the first seed and one past the last.")
    return tuple(sorted(planned))
