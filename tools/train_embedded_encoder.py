"""Render pictures, train the embedded encoder, evaluate it, and write the shipped weights.

    python -m tools.train_embedded_encoder render --split train --num-shards 450
    python -m tools.train_embedded_encoder maps --num-shards 450
    python -m tools.train_embedded_encoder train --run RUN --num-shards 450
    python -m tools.train_embedded_encoder evaluate --split val --runs RUN
    python -m tools.train_embedded_encoder forgetting --photos DIR --runs RUN
    python -m tools.train_embedded_encoder export --run RUN

Every step goes on where it was stopped: shards that are there are not made again, and training
resumes from its last checkpoint. `MODEL_CARD.md` beside the weights has the commands that made the
shipped ones. Several `render` commands may run at once with different `--first-shard`.
"""

import argparse
from pathlib import Path

from models.objects.cache import cache_dir

SPLITS = ("train", "val", "seen", "unseen")


def main() -> None:
    """Run one step."""
    arguments = _parser().parse_args()
    # Heavy imports come after parsing, so that --help answers at once.
    arguments.step(arguments)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    steps = parser.add_subparsers(required=True, metavar="STEP")
    step = _add_step(steps, "render", _render, "render shards of pictures")
    step.add_argument("--split", choices=SPLITS, default="train")
    step.add_argument("--first-shard", type=int, default=0)
    step.add_argument("--num-shards", type=int, default=8, help="18 pictures each")
    step = _add_step(steps, "maps", _extract, "compute what the frozen stages make of them")
    step.add_argument("--num-shards", type=int, default=450)
    step = _add_step(steps, "train", _train, "train; log.csv and trained.pt go to --run")
    step.add_argument("--run", type=Path, required=True, help="folder of the run")
    step.add_argument("--num-shards", type=int, default=450)
    step.add_argument("--steps", type=int, default=1200)
    step.add_argument("--learning-rate", type=float, default=1e-3, help="of the head")
    step.add_argument("--stage-learning-rate", type=float, default=2e-4, help="0 freezes the tower")
    step.add_argument("--distillation", type=float, default=0.5)
    step.add_argument("--mixture-share", type=float, default=0.25)
    step.add_argument("--seed", type=int, default=0)
    step = _add_step(steps, "evaluate", _evaluate, "compare runs with the untrained mixture")
    step.add_argument("--split", choices=SPLITS[1:], default="val")
    step.add_argument("--runs", type=Path, nargs="*", default=[], help="folders of runs")
    step = _add_step(steps, "forgetting", _forget, "how far ImageNet's classes have moved")
    step.add_argument("--photos", type=Path, required=True, help="folder of photographs")
    step.add_argument("--runs", type=Path, nargs="*", default=[], help="folders of runs")
    step = _add_step(steps, "export", _export, "write the weights that the package ships")
    step.add_argument("--run", type=Path, required=True, help="folder of a run")
    step.add_argument("--output", type=Path, help="folder; by default that of the package")
    return parser


def _add_step(
    steps: "argparse._SubParsersAction[argparse.ArgumentParser]", name: str, run: object, text: str
) -> argparse.ArgumentParser:
    step = steps.add_parser(name, help=text, description=text)
    step.set_defaults(step=run)
    step.add_argument(
        "--data", type=Path, default=cache_dir() / "encoder_data", help="folder of the pictures"
    )
    return step


def _render(arguments: argparse.Namespace) -> None:
    from tqdm import trange

    from tools.encoder.shards import render_shard

    first = arguments.first_shard
    for index in trange(first, first + arguments.num_shards, desc=f"{arguments.split} shards"):
        render_shard(arguments.data, arguments.split, index)


def _extract(arguments: argparse.Namespace) -> None:
    from tqdm import trange

    from perception.encoders.embedded import EmbeddedEncoder
    from tools.encoder.maps import extract_maps, maps_path
    from tools.encoder.shards import shard_path

    encoder = EmbeddedEncoder()
    for index in trange(arguments.num_shards, desc="shards"):
        source = shard_path(arguments.data, "train", index)
        extract_maps(encoder, source, maps_path(arguments.data, index))


def _train(arguments: argparse.Namespace) -> None:
    from tools.encoder.maps import maps_path
    from tools.encoder.training import TrainingConfig, train, untrained_encoder
    from tools.encoder.training_set import gather

    encoder = untrained_encoder()
    paths = [maps_path(arguments.data, index) for index in range(arguments.num_shards)]
    config = TrainingConfig(
        steps=arguments.steps,
        learning_rate=arguments.learning_rate,
        stage_learning_rate=arguments.stage_learning_rate,
        distillation=arguments.distillation,
        mixture_share=arguments.mixture_share,
        seed=arguments.seed,
    )
    print(train(gather(paths, encoder), encoder, config, arguments.run))


def _evaluate(arguments: argparse.Namespace) -> None:
    from tools.encoder.evaluation import format_table, grounding, load_pictures, questions_about
    from tools.encoder.export import opened_runs

    pictures = load_pictures(arguments.data, arguments.split)
    questions = questions_about(pictures)
    with opened_runs(arguments.runs) as encoders:
        results = {
            name: grounding(encoder, pictures, questions) for name, encoder in encoders.items()
        }
    print(format_table(results))


def _forget(arguments: argparse.Namespace) -> None:
    from tools.encoder.export import opened_runs
    from tools.encoder.forgetting import compare_classes, format_comparison, load_photos

    photos = load_photos(arguments.photos)
    with opened_runs(arguments.runs) as encoders:
        print(format_comparison(compare_classes(encoders, photos)))


def _export(arguments: argparse.Namespace) -> None:
    import torch

    from perception.encoders.embedded import WEIGHTS_DIR
    from tools.encoder.export import export_trained

    state = torch.load(arguments.run / "trained.pt", weights_only=True)
    print(export_trained(state, arguments.output or WEIGHTS_DIR))


if __name__ == "__main__":
    main()
