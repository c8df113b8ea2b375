"""Make random scenes: how long each takes, how often an object is dropped again, how they stack.

    python -m tools.bench.scenes --scene cluttered15 --seeds 0 100 --splits seen unseen

Prints a line of JSON a scene as it is made, failures too, then a markdown table; docs/physics.md
carries one.
"""

import json
import logging
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np
import tyro
from tqdm import tqdm

if TYPE_CHECKING:
    from sr_mj.scene import Scene


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """What to make.

    Attributes:
        scene: Kind of scene.
        seeds: First seed and one past the last.
        splits: Parts of the catalogue.
        drift_s: Simulated seconds after which to look who moved.
        moved_m: An object counts as moved beyond this distance.
    """

    scene: str = "cluttered15"
    seeds: tuple[int, int] = (0, 100)
    splits: tuple[str, ...] = ("seen", "unseen")
    drift_s: float = 1.0
    moved_m: float = 0.002


def supported_by_others(scene: "Scene") -> set[int]:
    """Return the bodies of the objects that rest on another object.

    Args:
        scene: A settled scene.

    Returns:
        Ids of the bodies that an object presses upwards on.
    """
    contact = scene.data.contact
    bodies = scene.model.geom_bodyid[contact.geom[: scene.data.ncon]]
    # The normal points from the first geom to the second.
    up = contact.frame[: scene.data.ncon, 2]
    objects = {item.body.body_id for item in scene.objects}
    return {
        int(pair[1] if rise > 0 else pair[0])
        for pair, rise in zip(bodies, up, strict=True)
        if abs(rise) > 0.3 and objects.issuperset(pair.tolist())
    }


def count_moved(scene: "Scene", config: BenchConfig) -> int:
    """Simulate the settled scene further; count the objects that wander off."""
    mujoco.mj_step(scene.model, scene.data, round(config.drift_s / scene.model.opt.timestep))
    moved = [
        np.linalg.norm((scene.data.qpos - scene.settled_qpos)[item.body.qpos][:3])
        for item in scene.objects
    ]
    return int(np.sum(np.array(moved) > config.moved_m))


class RedropCounter(logging.Handler):
    """Counts the objects that the settler says it drops again."""

    def __init__(self) -> None:
        """Listen to the settler."""
        super().__init__(logging.DEBUG)
        self.count = 0
        logger = logging.getLogger("sr_mj.scene.settle")
        logger.addHandler(self)
        logger.setLevel(logging.DEBUG)
        logger.propagate = False

    def emit(self, record: logging.LogRecord) -> None:
        """Count one message."""
        self.count += 1


def measure(config: BenchConfig, split: str, seed: int, redrops: RedropCounter) -> dict:
    """Make one scene and return its record."""
    from sr_mj.errors import SceneError
    from sr_mj.scene import SceneConfig, make_scene

    wanted = SceneConfig(scene=config.scene, split=split, seed=seed)  # pyright: ignore[reportArgumentType]
    before = redrops.count
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        scene = make_scene(wanted)
    except SceneError as error:
        return {"split": split, "seed": seed, "error": str(error)}
    return {
        "split": split,
        "seed": seed,
        "wall_s": round(time.perf_counter() - wall, 3),
        "cpu_s": round(time.process_time() - cpu, 3),
        "redrops": redrops.count - before,
        "stacked": len(supported_by_others(scene)),
        "moved": count_moved(scene, config),
    }


def summarise(records: list[dict], split: str) -> dict:
    """Condense the records of one split into a row of the table."""
    made = [r for r in records if r["split"] == split and "error" not in r]
    row: dict = {"split": split, "made": len(made)}
    row["failed"] = sum(r["split"] == split and "error" in r for r in records)
    for key in ("wall_s", "cpu_s"):
        values = [r[key] for r in made]
        row |= {f"mean {key}": np.mean(values), f"median {key}": np.median(values)}
        row[f"max {key}"] = np.max(values)
    row["redrops"] = sum(r["redrops"] for r in made)
    row["mean stacked"] = np.mean([r["stacked"] for r in made])
    row["moved"] = sum(r["moved"] for r in made)
    return {key: round(v, 2) if isinstance(v, float) else v for key, v in row.items()}


def main(config: BenchConfig) -> None:
    """Warm the cache, make every scene, print as it goes."""
    from models.objects.catalogue import load_object, object_names

    for split in tqdm(config.splits, desc="warming the object cache"):
        for name in object_names(split):
            load_object(name)
    jobs = [(split, seed) for split in config.splits for seed in range(*config.seeds)]
    records, redrops = [], RedropCounter()
    for split, seed in tqdm(jobs, desc="scenes"):
        records.append(measure(config, split, seed, redrops))
        tqdm.write(json.dumps(records[-1]))
    rows = [summarise(records, split) for split in config.splits]
    print("| " + " | ".join(rows[0]) + " |\n|" + " --- |" * len(rows[0]))
    for row in rows:
        print("| " + " | ".join(map(str, row.values())) + " |")


if __name__ == "__main__":
    main(tyro.cli(BenchConfig, description=__doc__))
