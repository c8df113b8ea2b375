"""Ask encoders for every object of held-out random scenes: do they find what is asked for?

    python -m tools.bench.grounding --seeds 1000 1040 --splits seen unseen \
        --encoder embedded:untrained embedded --json outputs/grounding.json

Nothing may be trained or tuned on these scenes: seeds from 1000 on are for this bench, 900 to 919
for choosing settings. Prints a markdown table a split, which docs/grounding.md carries; `--picture`
draws the heat maps that it shows. `embedded:untrained` is the mixture of class names without
training.
"""

import json
import sys
import time
from collections import defaultdict
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro
from tqdm import tqdm

from sr_mj.cli import run_command

if TYPE_CHECKING:
    from perception.lifter import MultiViewLifter
    from tools.bench.grounding_scenes import BenchScene


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """Options of `python -m tools.bench.grounding`."""

    seeds: tuple[int, int] = (1000, 1040)
    """First seed and one past the last."""
    splits: tuple[str, ...] = ("seen", "unseen")
    """Parts of the catalogue."""
    scene: str = "cluttered15"
    """Kind of scene."""
    encoder: tuple[str, ...] = ("embedded",)
    """Encoders to compare on the same views."""
    negatives: tuple[str, ...] | None = None
    """Negative prompts instead of the lifter's; give none for the plain cosine."""
    sharpness: float | None = None
    """Steepness of the relevancy instead of the lifter's."""
    beside: Path | None = None
    """JSON of an earlier run on the same scenes, to be shown beside this one's encoders."""
    json: Annotated[Path | None, tyro.conf.arg(name="json")] = None
    """File for every answer and the counts."""
    picture: Path | None = None
    """PNG for heat maps of the first scene of each split."""


class _Watch:
    """Adds up the processor seconds of named stages: other programs share the machine."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = defaultdict(float)
        self._last = time.process_time()

    def start(self) -> None:
        self._last = time.process_time()

    def stop(self, stage: str) -> None:
        now = time.process_time()
        self.seconds[stage] += now - self._last
        self._last = now


def make_lifters(config: BenchConfig) -> "dict[str, MultiViewLifter]":
    """Load the encoders, and put each into a lifter as an episode would use it."""
    from models.objects.words import PROTOCOL_GENERAL_WORDS
    from perception.lifter import MultiViewLifter
    from sr_mj.assemble import lifter_for
    from sr_mj.errors import ConfigError, UnknownNameError, unknown_name_message
    from sr_mj.scene import SCENE_KINDS
    from tools.bench.grounding_answers import open_encoder

    for split in config.splits:
        if split not in PROTOCOL_GENERAL_WORDS:
            raise UnknownNameError(unknown_name_message("split", split, PROTOCOL_GENERAL_WORDS))
    if config.scene not in SCENE_KINDS:
        raise UnknownNameError(unknown_name_message("scene", config.scene, SCENE_KINDS))
    if not config.encoder or not config.splits:
        raise ConfigError("No encoder or no split is given; name at least one of each.")
    if not 0 <= config.seeds[0] < config.seeds[1]:
        raise ConfigError(f"Seeds are {config.seeds}; expected the first and one past the last.")
    settings = lifter_for(SCENE_KINDS[config.scene].workspace, "embedded").config
    if config.negatives is not None:
        settings = replace(settings, negative_prompts=config.negatives)
    if config.sharpness is not None:
        settings = replace(settings, sharpness=config.sharpness)
    return {name: MultiViewLifter(open_encoder(name), settings) for name in config.encoder}


def ask_everything(bench: "BenchScene", name: str, lifter: "MultiViewLifter") -> list[dict]:
    """Lift one scene with one encoder and ask all that the scene allows; return the records."""
    from tools.bench.grounding_answers import Examiner, examine

    lifted = lifter.lift(bench.views)
    names = list(bench.words)
    return [
        {
            "split": bench.split,
            "seed": bench.seed,
            "encoder": name,
            "kind": question.kind,
            "wording": "paraphrase" if question.is_paraphrase else "template",
            "text": question.text,
            "targets": [names[index] for index in question.targets],
            "answers": [names[index] if index >= 0 else None for index in answers],
            **asdict(mark),
            "chance_point": chance_point,
            "chance_object": chance_object,
        }
        for question, answers, mark, (chance_point, chance_object) in examine(
            Examiner(bench, lifted.cloud, lifted.scorer)
        )
    ]


def read_records(path: Path, config: BenchConfig) -> list[dict]:
    """Read an earlier run's answers, but not those of encoders that are asked again."""
    from sr_mj.errors import ConfigError

    try:
        records = json.loads(path.read_text())["records"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ConfigError(
            f"--beside {path}: cannot be read as a file that --json wrote ({error!r}); give one."
        ) from error
    return [record for record in records if record["encoder"] not in config.encoder]


def check_comparable(records: list[dict]) -> None:
    """Refuse to compare encoders that were asked different questions."""
    from sr_mj.errors import ConfigError

    asked = defaultdict(set)
    for r in records:
        asked[r["encoder"]].add((r["split"], r["seed"], r["text"], *r["targets"]))
    (first, questions), *others = asked.items()
    for name, theirs in others:
        if theirs != questions:
            raise ConfigError(
                f"{name} and {first} were asked {len(theirs ^ questions)} different questions; "
                "expected the same seeds, splits and catalogue: run both again."
            )


def run(config: BenchConfig) -> int:
    """Ask, print the tables, write what was asked for; returns exit status 0."""
    from sr_mj.gl import select_backend

    select_backend()
    from tools.bench.grounding_report import format_tables, summarise
    from tools.bench.grounding_scenes import photograph

    earlier = [] if config.beside is None else read_records(config.beside, config)
    lifters = make_lifters(config)
    jobs = [(split, seed) for split in config.splits for seed in range(*config.seeds)]
    records, watch, shown = [], _Watch(), {}
    for split, seed in tqdm(jobs, desc="scenes"):
        watch.start()
        bench = photograph(config.scene, split, seed)
        shown.setdefault(split, bench)
        watch.stop("scene and views")
        for name, lifter in lifters.items():
            records += ask_everything(bench, name, lifter)
            watch.stop(name)
    records = [*earlier, *records]
    rows = summarise(records)
    seconds = {stage: round(total / len(jobs), 2) for stage, total in watch.seconds.items()}
    if config.json is not None:
        config.json.parent.mkdir(parents=True, exist_ok=True)
        report = {"rows": rows, "seconds_per_scene": seconds, "records": records}
        config.json.write_text(json.dumps(report, indent=1) + "\n")
    check_comparable(records)  # when nothing can be lost any more
    print(format_tables(rows))
    print(f"\nProcessor seconds a scene: {json.dumps(seconds)}")
    if config.picture is not None:
        from tools.bench.grounding_picture import draw_heatmaps

        draw_heatmaps(list(shown.values()), lifters, config.picture)
    return 0


if __name__ == "__main__":
    sys.exit(run_command(BenchConfig, run, description=__doc__ or ""))
