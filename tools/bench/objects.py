"""Drop every object of the catalogue: does it come to rest, does a vessel keep a ball?

    python -m tools.bench.objects

Prints a markdown table, which docs/objects.md carries, the objects that fail, and a line of JSON.
"""

import dataclasses
import json
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import tyro
from tqdm import tqdm

if TYPE_CHECKING:
    from models.objects.words import ObjectWords


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """What to drop.

    Attributes:
        splits: Parts of the catalogue.
        objects: Names of objects to drop instead.
    """

    splits: tuple[str, ...] = ("seen", "unseen")
    objects: tuple[str, ...] = ()


def measure(name: str) -> dict:
    """Drop one object in every orientation, and a ball into it if it is a vessel."""
    from models.drop_test import drop_ball, drop_object, find_faults, is_vessel
    from models.objects.catalogue import load_object

    item = load_object(name)
    start = time.process_time()
    rests = drop_object(item)
    ball = drop_ball(item) if is_vessel(item) else None
    return {
        "name": name,
        "split": item.split,
        "asked_for": list_words(item.words),
        "size_mm": [round(1e3 * extent) for extent in item.size_m.tolist()],
        "mass_kg": item.mass_kg,
        "triangles": len(item.faces),
        "parts": len(item.collision),
        "rests": {turn: dataclasses.asdict(rest) for turn, rest in rests.items()},
        "ball": None if ball is None else dataclasses.asdict(ball),
        "faults": find_faults(rests, ball),
        "cpu_s": round(time.process_time() - start, 2),
    }


def list_words(words: "ObjectWords") -> str:
    """List the protocol's words for an object: what it is called first, then the general ones."""
    general = (words.category, *words.colors, *words.shapes, *words.functions)
    return "; ".join([words.title, *(word for word in general if word)])


def row(record: dict) -> str:
    """Format one line of the table: the worst of the four orientations."""
    worst = {
        key: max(rest[key] for rest in record["rests"].values())
        for key in ("settle_s", "speed_m_s", "spin_rad_s", "sink_m")
    }
    ball = record["ball"]
    kept = "" if ball is None else ("stays" if ball["is_inside"] else "lost")
    cells = (
        record["name"],
        record["split"],
        record["asked_for"],
        " x ".join(map(str, record["size_mm"])),
        f"{1e3 * record['mass_kg']:.0f}",
        record["triangles"],
        record["parts"],
        f"{worst['settle_s']:.2f}",
        f"{1e3 * worst['speed_m_s']:.2f}",
        f"{worst['spin_rad_s']:.4f}",
        f"{1e3 * worst['sink_m']:.2f}",
        kept,
    )
    return "| " + " | ".join(map(str, cells)) + " |"


def main(config: BenchConfig) -> None:
    """Drop what was asked for, print."""
    from models.objects.catalogue import object_names

    names = config.objects or [name for split in config.splits for name in object_names(split)]
    records = [measure(name) for name in tqdm(names, desc="objects")]
    print(
        "| object | split | asked for as | size mm | mass g | triangles | parts | settles s | "
        "jitter mm/s | spin rad/s | sinks mm | ball |"
    )
    print("|" + " --- |" * 12)
    for record in records:
        print(row(record))
    failed = [record for record in records if record["faults"]]
    seconds = sum(record["cpu_s"] for record in records)
    print(f"\n{len(records)} objects, {len(failed)} fail; {seconds:.0f} s of processor time.")
    for record in failed:
        print(f"- {record['name']}: {'; '.join(record['faults'])}")
    print(json.dumps(records))


if __name__ == "__main__":
    main(tyro.cli(BenchConfig, description=__doc__))
