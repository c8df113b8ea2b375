"""Reads the public test cases of Vision-Language-Grasping and A2, for whoever has them.

Both projects keep one text file a case: the goal in line 1, the indices of the targets in line 2,
then one object a line: the path of a URDF file whose stem is the object's number in
GraspNet-1Billion, x y z in metres, roll pitch yaw in radians; objects drop in that order. A JSON
list of cases with the same content is read as well. Nothing of these files is part of this project.
"""

import json
import re
from collections.abc import Sequence
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from models.arrangements.arrangement import (
    ArrangedGoal,
    ArrangedObject,
    Arrangement,
    Pose,
    instance_names,
)
from models.errors import ArrangementError
from models.objects.catalogue import Catalogue

_FIELDS = ("goal", "target_indices", "objects")
_OBJECT_FIELDS = ("graspnet_id", "drop_xyz_m", "euler_xyz_rad")


def read_cases(
    path: Path, catalogue: Catalogue, *, scene: str = "cluttered15", split: str = "seen"
) -> tuple[Arrangement, ...]:
    """Read test cases.

    Args:
        path: A text file, a folder of text files, or a JSON file.
        catalogue: Where objects are looked up by their number in GraspNet-1Billion.
        scene: Kind of scene that names the workspace.
        split: Split that the cases count for.

    Returns:
        One arrangement a case, not settled, sorted by file name or in the order of the list.

    Raises:
        ArrangementError: If a file cannot be read as a case, or the catalogue lacks an object.
    """
    if path.is_dir():
        files = sorted(path.glob("*.txt"))
        if not files:
            raise ArrangementError(f"Folder {str(path)!r} has no case files (*.txt).")
        cases = [(file.stem, str(file), _read_text(file)) for file in files]
    elif path.suffix == ".json":
        cases = _read_json(path)
    else:
        cases = [(path.stem, str(path), _read_text(path))]
    return tuple(
        _arrange(name, source, case, catalogue, scene=scene, split=split)
        for name, source, case in cases
    )


def _load(path: Path) -> str:
    try:
        return path.read_text()
    except (OSError, UnicodeDecodeError) as error:
        raise ArrangementError(f"Cannot read case file {str(path)!r}: {error}.") from None


def _read_text(path: Path) -> dict[str, Any]:
    """Turn a text file into the content of one entry of a JSON list."""
    lines = [line.strip() for line in _load(path).splitlines() if line.strip()]
    if len(lines) < 3:
        raise ArrangementError(
            f"{path}: {len(lines)} lines; expected the goal, the targets' indices, and one line "
            "an object."
        )
    return {
        "goal": lines[0],
        "target_indices": [_number(word, int, f"{path}: line 2") for word in _words(lines[1])],
        "objects": [
            _object_line(line, f"{path}: object {index}") for index, line in enumerate(lines[2:])
        ],
    }


def _words(line: str) -> list[str]:
    return line.replace(",", " ").split()


def _number(word: str, kind: type, where: str) -> Any:
    try:
        return kind(word)
    except ValueError:
        raise ArrangementError(f"{where}: {word!r} is not a number.") from None


def _object_line(line: str, where: str) -> dict[str, Any]:
    words = _words(line)
    if len(words) != 7:
        raise ArrangementError(
            f"{where}: {len(words)} fields; expected 7: URDF path, x, y, z, roll, pitch, yaw."
        )
    numbers = [_number(word, float, where) for word in words[1:]]
    return {
        "graspnet_id": PurePosixPath(words[0].replace("\\", "/")).stem,
        "drop_xyz_m": numbers[:3],
        "euler_xyz_rad": numbers[3:],
    }


def _read_json(path: Path) -> list[tuple[str, str, dict[str, Any]]]:
    try:
        content = json.loads(_load(path))
    except ValueError as error:
        raise ArrangementError(f"{path}: not JSON: {error}.") from None
    cases = content.get("cases") if isinstance(content, dict) else content
    if not isinstance(cases, list) or not cases:
        raise ArrangementError(
            f"{path}: expected a list of cases, or an object with one as 'cases'."
        )
    found = []
    for index, case in enumerate(cases):
        name = case.get("case", f"case{index:02d}") if isinstance(case, dict) else str(index)
        source = f"{path}: case {name}"
        _require(case, _FIELDS, source)
        for number, item in enumerate(case["objects"]):
            _require(item, _OBJECT_FIELDS, f"{source}: object {number}")
        found.append((str(name), source, case))
    return found


def _require(record: Any, fields: Sequence[str], where: str) -> None:
    missing = [f for f in fields if not isinstance(record, dict) or f not in record]
    if missing:
        raise ArrangementError(f"{where}: {missing[0]!r} is missing; expected {', '.join(fields)}.")


def _arrange(
    name: str,
    source: str,
    case: dict[str, Any],
    catalogue: Catalogue,
    *,
    scene: str,
    split: str,
) -> Arrangement:
    drops = [_pose(item, f"{source}: object {index}") for index, item in enumerate(case["objects"])]
    objects = [_look_up(str(item["graspnet_id"]), catalogue, source) for item in case["objects"]]
    names = instance_names(objects)
    targets = [_target(index, names, source) for index in case["target_indices"]]
    return Arrangement(
        # It also names folders of results.
        name=re.sub(r"[^\w.-]+", "-", name),
        suite="case",
        split=split,
        scene=scene,
        goal=ArrangedGoal(
            # The public files write some labels as identifiers.
            text=str(case["goal"]).replace("_", " "),
            targets=tuple(dict.fromkeys(targets)),
        ),
        objects=tuple(
            ArrangedObject(name=name, object=obj, drop=drop)
            for name, obj, drop in zip(names, objects, drops, strict=True)
        ),
    )


def _look_up(graspnet_id: str, catalogue: Catalogue, source: str) -> str:
    name = catalogue.by_graspnet_id(graspnet_id)
    if name is None:
        raise ArrangementError(
            f"{source}: {catalogue.source} has nothing for GraspNet-1Billion object "
            f"{graspnet_id!r}; import it, or correct the number."
        )
    return name


def _target(index: Any, names: tuple[str, ...], source: str) -> str:
    if not isinstance(index, int) or not 0 <= index < len(names):
        raise ArrangementError(
            f"{source}: target index {index!r}; expected integers from 0 to {len(names) - 1}."
        )
    return names[index]


def _pose(item: dict[str, Any], where: str) -> Pose:
    vectors = []
    for field in ("drop_xyz_m", "euler_xyz_rad"):
        try:
            vector = np.asarray(item[field], float)
        except (TypeError, ValueError):
            vector = np.zeros(0)
        if vector.shape != (3,) or not np.all(np.isfinite(vector)):
            raise ArrangementError(
                f"{where}: {field} is {item[field]!r}; expected 3 finite numbers."
            )
        vectors.append(vector)
    # Roll, pitch and yaw about fixed axes, as URDF and PyBullet have them.
    quat = Rotation.from_euler("xyz", vectors[1]).as_quat(scalar_first=True)
    return Pose(position_m=tuple(vectors[0].tolist()), quat_wxyz=tuple(quat.tolist()))
