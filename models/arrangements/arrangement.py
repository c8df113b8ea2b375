"""`Arrangement`: which objects lie where, what is asked for, and how it is written down."""

import functools
import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from models.errors import ArrangementError

FORMAT = 1
_HASH_KEY = "sha256"


@dataclass(frozen=True, kw_only=True)
class Pose:
    """A pose in the world.

    Attributes:
        position_m: x, y, z.
        quat_wxyz: Unit quaternion.
    """

    position_m: tuple[float, float, float]
    quat_wxyz: tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class ArrangedObject:
    """One object of an arrangement.

    Attributes:
        name: Unique in the arrangement: the catalogue's name, numbered where an object occurs
            more than once.
        object: Name in the catalogue.
        drop: Pose of its frame from which it falls.
        settled: Pose of its frame at rest; None where it was never simulated.
        fingerprint: Hash of the geometry and mass it was settled with, or None.
    """

    name: str
    object: str
    drop: Pose
    settled: Pose | None = None
    fingerprint: str | None = None


@dataclass(frozen=True, kw_only=True)
class ArrangedGoal:
    """What is asked for. All names are those of arranged objects.

    Attributes:
        text: The instruction.
        targets: Objects that may be picked; for an instruction that only places, the one that
            "it" stands for.
        relation: Where to place, in the protocol's words, or None without a place goal.
        references: Objects that the place may be relative to.
    """

    text: str
    targets: tuple[str, ...]
    relation: str | None = None
    references: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Arrangement:
    """A fixed scene.

    Attributes:
        name: Name, unique among arrangements.
        suite: "grasp", "place", "pick-place", "heavy30", or "case" for one that was read from
            somebody else's files.
        split: Part of the catalogue that the objects come from.
        scene: Kind of scene, which names the workspace.
        goal: What is asked for.
        objects: In the order in which they drop.
        seed: Seed of the tool that made it, or None.
        mujoco: Version of MuJoCo that settled it, or None.

    Raises:
        ArrangementError: If names repeat, or the goal speaks of objects that are not there.
    """

    name: str
    suite: str
    split: str
    scene: str
    goal: ArrangedGoal
    objects: tuple[ArrangedObject, ...]
    seed: int | None = None
    mujoco: str | None = None

    def __post_init__(self) -> None:
        """Check that names are unique and known."""
        names = [item.name for item in self.objects]
        if len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise ArrangementError(
                f"Arrangement {self.name!r} has two objects called {twice!r}; number them."
            )
        for name in (*self.goal.targets, *self.goal.references):
            if name not in names:
                raise ArrangementError(
                    f"The goal of arrangement {self.name!r} speaks of {name!r}; its objects are "
                    f"{', '.join(names)}."
                )

    @property
    def is_settled(self) -> bool:
        """Whether the poses at rest are known."""
        return all(item.settled is not None for item in self.objects)


def instance_names(objects: Iterable[str]) -> tuple[str, ...]:
    """Number repeated names: apple, apple, lemon -> apple, apple_2, lemon.

    Args:
        objects: Names in the catalogue.

    Returns:
        Names that differ from each other, in the same order.
    """
    taken: list[str] = []
    listed = list(objects)
    for name in listed:
        number, candidate = 1, name
        while candidate in taken or (number > 1 and candidate in listed):
            number += 1
            candidate = f"{name}_{number}"
        taken.append(candidate)
    return tuple(taken)


def to_record(arrangement: Arrangement) -> dict[str, Any]:
    """Return an arrangement as plain JSON values, with the hash of all of them.

    Args:
        arrangement: A settled one.

    Returns:
        The values; `schema.json` in this package describes them.
    """
    plain = asdict(arrangement)
    record = {
        "format": FORMAT,
        **{key: plain[key] for key in ("name", "suite", "split", "scene", "goal", "objects")},
        "made": {"seed": arrangement.seed, "mujoco": arrangement.mujoco},
    }
    # Tuples become lists here and not first in the file, so that both hash alike.
    record = json.loads(json.dumps(record))
    return {**record, _HASH_KEY: content_hash(record)}


def content_hash(record: dict[str, Any]) -> str:
    """Hash a record, whatever the order of its keys and its white space.

    Args:
        record: Plain JSON values; an entry "sha256" is left out.

    Returns:
        64 hexadecimal digits.
    """
    content = {key: value for key, value in record.items() if key != _HASH_KEY}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


@functools.cache
def _validator() -> Any:
    import jsonschema

    schema = json.loads(resources.files("models.arrangements").joinpath("schema.json").read_text())
    return jsonschema.Draft202012Validator(schema)


def from_record(record: Any, source: str) -> Arrangement:
    """Check plain JSON values and make an arrangement of them.

    Args:
        record: The values.
        source: Where they come from, for messages.

    Returns:
        The arrangement.

    Raises:
        ArrangementError: If they do not follow the schema, or their hash differs.
    """
    error = min(_validator().iter_errors(record), key=lambda e: list(e.path), default=None)
    if error is not None:
        where = ".".join(str(part) for part in error.path) or "the whole document"
        raise ArrangementError(f"{source}: {where}: {error.message}.")
    if (digest := content_hash(record)) != record[_HASH_KEY]:
        raise ArrangementError(
            f"{source}: its content hashes to {digest[:12]}..., the file says "
            f"{record[_HASH_KEY][:12]}...; it was changed by hand. Restore it, or make it anew."
        )
    goal = record["goal"]
    return Arrangement(
        **{key: record[key] for key in ("name", "suite", "split", "scene")},
        goal=ArrangedGoal(
            text=goal["text"],
            targets=tuple(goal["targets"]),
            relation=goal["relation"],
            references=tuple(goal["references"]),
        ),
        objects=tuple(_object(entry) for entry in record["objects"]),
        seed=record["made"]["seed"],
        mujoco=record["made"]["mujoco"],
    )


def _object(entry: dict[str, Any]) -> ArrangedObject:
    poses = {
        key: Pose(
            position_m=tuple(entry[key]["position_m"]), quat_wxyz=tuple(entry[key]["quat_wxyz"])
        )
        for key in ("drop", "settled")
    }
    return ArrangedObject(**{**entry, **poses})


def read_arrangement(path: Path) -> Arrangement:
    """Read the file of one arrangement.

    Args:
        path: JSON file.

    Returns:
        The arrangement.

    Raises:
        ArrangementError: If the file is not readable JSON, breaks the schema, or was changed.
    """
    try:
        record = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise ArrangementError(f"Cannot read arrangement {str(path)!r}: {error}.") from None
    return from_record(record, source=str(path))


def write_arrangement(arrangement: Arrangement, path: Path) -> None:
    """Write the file of one arrangement; it replaces an older one at once and whole.

    Args:
        arrangement: A settled one.
        path: JSON file.
    """
    text = json.dumps(to_record(arrangement), indent=1) + "\n"
    scratch = path.with_name(f".{path.name}.new")
    scratch.write_text(text)
    scratch.replace(path)
