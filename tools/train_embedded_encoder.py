"""Render pictures, train the embedded encoder's head, evaluate it, and write the shipped weights.

    python -m tools.train_embedded_encoder render --split train --num-shards 125
    python -m tools.train_embedded_encoder features --num-shards 125
    python -m tools.train_embedded_encoder train --run RUN --num-shards 125
    python -m tools.train_embedded_encoder evaluate --split val --heads RUN/head.pt
    python -m tools.train_embedded_encoder export --head RUN/head.pt

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
    step = _add_step(steps, "features", _extract, "compute the features of training cells")
    step.add_argument("--num-shards", type=int, default=125)
    step = _add_step(steps, "train", _train, "train the head; log.csv and head.pt go to --run")
    step.add_argument("--run", type=Path, required=True, help="folder of the run")
    step.add_argument("--num-shards", type=int, default=125)
    step.add_argument("--steps", type=int, default=1200)
    step.add_argument("--learning-rate", type=float, default=1e-3)
    step.add_argument("--mixture-share", type=float, default=0.25)
    step.add_argument("--distillation", type=float, default=0.1)
    step.add_argument("--general-weight", type=float, default=1.0)
    step.add_argument("--general-text-weight", type=float, default=1.0)
    step.add_argument("--start-from", type=Path, help="head.pt of an earlier run")
    step.add_argument("--seed", type=int, default=0)
    step = _add_step(steps, "evaluate", _evaluate, "compare heads with the untrained mixture")
    step.add_argument("--split", choices=SPLITS[1:], default="val")
    step.add_argument("--heads", type=Path, nargs="*", default=[], help="files head.pt")
    step.add_argument("--shipped", action="store_true", help="evaluate the shipped head as well")
    step = _add_step(steps, "export", _export, "write the weights that the package ships")
    step.add_argument("--head", type=Path, required=True, help="head.pt of a run")
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
    from tools.encoder.features import cells_path, extract_cells
    from tools.encoder.shards import shard_path

    encoder = EmbeddedEncoder()
    for index in trange(arguments.num_shards, desc="shards"):
        source = shard_path(arguments.data, "train", index)
        extract_cells(encoder, source, cells_path(arguments.data, index))


def _train(arguments: argparse.Namespace) -> None:
    from perception.encoders.embedded import EmbeddedEncoder
    from tools.encoder.features import cells_path
    from tools.encoder.training import TrainingConfig, train
    from tools.encoder.training_set import gather

    encoder = EmbeddedEncoder()
    paths = [cells_path(arguments.data, index) for index in range(arguments.num_shards)]
    config = TrainingConfig(
        steps=arguments.steps,
        learning_rate=arguments.learning_rate,
        mixture_share=arguments.mixture_share,
        distillation=arguments.distillation,
        general_weight=arguments.general_weight,
        general_text_weight=arguments.general_text_weight,
        start_from=arguments.start_from,
        seed=arguments.seed,
    )
    print(train(gather(paths, encoder), encoder, config, arguments.run))


def _evaluate(arguments: argparse.Namespace) -> None:
    from perception.encoders.embedded import EmbeddedEncoder
    from tools.encoder.evaluation import (
        format_table,
        grounding,
        load_head,
        load_pictures,
        questions_about,
    )

    encoder = EmbeddedEncoder()
    temperature = encoder.config.temperature
    heads = {"untrained mixture": load_head(None, encoder)}
    if arguments.shipped:
        heads["shipped"] = lambda cells: encoder.head(cells.bfloat16(), temperature)
    heads |= {str(path): load_head(path, encoder) for path in arguments.heads}
    pictures = load_pictures(encoder, arguments.data, arguments.split)
    questions = questions_about(pictures)
    results = {name: grounding(head, pictures, questions, encoder) for name, head in heads.items()}
    print(format_table(results))


def _export(arguments: argparse.Namespace) -> None:
    import torch

    from perception.encoders.embedded import WEIGHTS_DIR
    from tools.encoder.export import export_head

    state = torch.load(arguments.head, weights_only=True)
    print(export_head(state, arguments.output or WEIGHTS_DIR))


if __name__ == "__main__":
    main()
