"""The folder that demonstrations are collected in: what it is for, what it has, what it will take.

- `collection.json`: what all scenes have in common
- `pick-0010000000.h5`: one shard a scene
- `pick-0010000001.none.json`: a scene that gave no decision, which is not tried again
"""

import json
import os
import shutil
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from policy.demonstrations import SCHEMA_VERSION, read_shard
from policy.demonstrations.shard import SUFFIX
from sr_mj.collecting.crowds import SPLIT
from sr_mj.collecting.tasks import SceneTask
from sr_mj.collecting.work import SceneResult
from sr_mj.errors import ConfigError
from sr_mj.provenance import git_revision, package_versions, to_json
from sr_mj.scene import Scene

# Changes whenever the same seed gives another scene, other goals, or other labels.
RECIPE = 3

_COMMON = "collection.json"
_MARKER = ".none.json"
# Measured: points of a look, decisions that share one, wordings of a decision, tokens of a
# wording, and bytes of candidates and labels.
_POINTS, _PER_LOOK, _WORDINGS, _TOKENS, _OTHER_BYTES = 2600, 4, 4, 9, 30_000
_HALF_BYTES = 2


@dataclass(frozen=True, kw_only=True)
class Stock:
    """What a folder has.

    Attributes:
        stored: Decisions by phase.
        done: Names of the scenes that need not be done again.
    """

    stored: Counter[str]
    done: frozenset[str]


def open_folder(out: Path, encoder: str, feature_dim: int) -> Stock:
    """Make the folder, or continue it.

    Args:
        out: The folder.
        encoder: Fingerprint of the encoder.
        feature_dim: Channels of its features.

    Returns:
        What is there already.

    Raises:
        ConfigError: If it belongs to another encoder, schema or recipe, or is something else.
    """
    common = {
        "schema_version": SCHEMA_VERSION,
        "recipe": RECIPE,
        "encoder": encoder,
        "feature_dim": feature_dim,
        "split": SPLIT,
    }
    path = out / _COMMON
    if path.is_file():
        _check_common(path, common)
        return read_stock(out)
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise ConfigError(
            f"Output {str(out)!r} exists and is no folder of demonstrations; choose a new one."
        )
    out.mkdir(parents=True, exist_ok=True)
    _write_whole(path, (json.dumps(common, indent=1, sort_keys=True) + "\n").encode())
    return read_stock(out)


def read_stock(out: Path) -> Stock:
    """Count what a folder has.

    Args:
        out: The folder.

    Returns:
        Its decisions and scenes.

    Raises:
        PolicyError: If a shard can't be read.
    """
    stored: Counter[str] = Counter()
    done = {path.name.removesuffix(_MARKER) for path in out.glob(f"[!.]*{_MARKER}")}
    for path in out.glob(f"[!.]*{SUFFIX}"):
        shard = read_shard(path)
        stored.update(entry["phase"] for entry in shard.index)
        done.add(shard.scene)
    return Stock(stored=stored, done=frozenset(done))


def shard_name(task: SceneTask) -> str:
    """Return the name of a scene's shard."""
    return f"{task.name}{SUFFIX}"


def marker(task: SceneTask, reasons: Mapping[str, int]) -> tuple[str, bytes]:
    """Return name and content of the file that tells that a scene gave no decision, and why."""
    return f"{task.name}{_MARKER}", (json.dumps({"reasons": dict(reasons)}) + "\n").encode()


def save(out: Path, result: SceneResult) -> None:
    """Write the file of a scene; it appears complete or not at all.

    Args:
        out: The folder.
        result: What came of the scene.
    """
    if result.file_name is not None:
        _write_whole(out / result.file_name, result.content)


def write_run(
    out: Path, config: Any, stored: Mapping[str, int], reasons: Mapping[str, int], seconds: float
) -> None:
    """Write down what the last run was asked for, with what, and what it did.

    Args:
        out: The folder.
        config: Its options, a dataclass.
        stored: Decisions that the folder has after it, by phase.
        reasons: How often what was tried ended how, successes aside.
        seconds: How long it took.
    """
    account = {
        "config": config,
        "stored": dict(stored),
        "not_stored": dict(reasons),
        "seconds": round(seconds, 1),
        "versions": package_versions(),
        "revision": git_revision(),
    }
    _write_whole(out / "run.json", to_json(account).encode())


def estimate_bytes(num_decisions: int, feature_dim: int) -> int:
    """Estimate the disk space that decisions take.

    Args:
        num_decisions: How many.
        feature_dim: Channels of the features.

    Returns:
        Bytes.
    """
    look = _POINTS * (feature_dim * _HALF_BYTES + 16)
    wording = (_TOKENS + 2) * feature_dim * _HALF_BYTES + _POINTS * _HALF_BYTES
    return round(num_decisions * (look / _PER_LOOK + _WORDINGS * wording + _OTHER_BYTES))


def check_disk(out: Path, wanted: int) -> None:
    """Refuse to begin what the disk has no room for.

    Args:
        out: The folder; it exists.
        wanted: Bytes.

    Raises:
        ConfigError: If there is less space.
    """
    free = shutil.disk_usage(out).free
    if free < wanted:
        raise ConfigError(
            f"About {wanted / 1e9:.1f} GB are needed in {str(out)!r}, {free / 1e9:.1f} GB are "
            "free; make room, choose another folder, or ask for fewer."
        )


def _check_common(path: Path, common: dict[str, Any]) -> None:
    try:
        found = json.loads(path.read_text())
    except ValueError:
        found = {}
    for name, wanted in common.items():
        if found.get(name) != wanted:
            raise ConfigError(
                f"{path}: {name} is {found.get(name)!r}, this run has {wanted!r}; choose a new "
                "folder, or go on with what the folder was begun with."
            )


def describe_scene(task: SceneTask, scene: Scene) -> dict[str, Any]:
    """Describe a scene by what it was made from and how it came to lie.

    Args:
        task: Its task.
        scene: The scene.

    Returns:
        JSON values.
    """
    config = scene.config
    return {
        "task": {"phase": task.phase, "number": task.number, "run": task.run},
        "seed": task.seed,
        "scene": config.scene,
        "split": config.split,
        "cameras": config.cameras,
        "recipe": RECIPE,
        "num_heaped": config.kind.num_heaped,
        "num_spread": config.kind.num_spread,
        "objects": [
            {
                "name": item.name,
                "object": item.asset.name,
                "pose": [round(float(x), 6) for x in scene.settled_qpos[item.body.qpos]],
            }
            for item in scene.objects
        ],
        "versions": package_versions(),
        "revision": git_revision(),
    }


def _write_whole(path: Path, content: bytes) -> None:
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with temporary.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
