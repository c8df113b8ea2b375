"""Where the weights of CLIP models are: a file, a cache on this machine, or the hub."""

import os
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from huggingface_hub import try_to_load_from_cache
from huggingface_hub.constants import HF_HUB_CACHE
from open_clip.constants import (
    HF_SAFE_WEIGHTS_NAME,
    HF_WEIGHTS_NAME,
    OPENAI_DATASET_MEAN,
    OPENAI_DATASET_STD,
)
from open_clip.pretrained import (
    download_pretrained,
    get_pretrained_cfg,
    list_pretrained_tags_by_model,
)

from perception.errors import MissingWeightsError, UnknownEncoderError, did_you_mean

# Where open_clip and OpenAI's own package keep files that come from a plain address.
CLIP_CACHE = Path("~/.cache/clip").expanduser()

RGB = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class ClipWeights:
    """A weight file and how its model was trained.

    Attributes:
        architecture: Name of the model configuration in open_clip.
        source: Tag of the weights, or name of the file.
        path: The file.
        is_quick_gelu: Whether the model computes x * sigmoid(1.702 x) in place of GELU. OpenAI's
            do; with the wrong one of the two the features are silently worse.
        mean: RGB mean for normalisation, of 0..1 values.
        std: RGB deviation for normalisation.
    """

    architecture: str
    source: str
    path: Path
    is_quick_gelu: bool
    mean: RGB = OPENAI_DATASET_MEAN
    std: RGB = OPENAI_DATASET_STD


def resolve_weights(architecture: str, source: str, *, allow_download: bool) -> ClipWeights:
    """Find the weights of a CLIP model.

    Args:
        architecture: Name of the model configuration in open_clip.
        source: A tag that open_clip knows, or the path of a file.
        allow_download: Whether to fetch weights that are not on this machine.

    Returns:
        The weights.

    Raises:
        UnknownEncoderError: If `source` is neither a file's path nor a tag of the architecture.
        MissingWeightsError: If the weights are not on this machine, or could not be fetched.
    """
    if _is_path(source):
        return _local_weights(architecture, Path(source).expanduser())
    cfg = _tag_config(architecture, source)
    path = find_weights(architecture, source)
    if path is None and allow_download:
        path = _download(architecture, source, cfg)
    if path is None:
        raise MissingWeightsError(
            f"The weights of {architecture}:{source} are not on this machine: no "
            f"{_missing_file(cfg)}. Fetch them with `{fetch_command(architecture, source)}`, or "
            f"name a file as {architecture}:/path/to/file."
        )
    return ClipWeights(
        architecture=architecture,
        source=source,
        path=path,
        is_quick_gelu=cfg.get("quick_gelu", False),
        mean=cfg["mean"],
        std=cfg["std"],
    )


def find_weights(architecture: str, tag: str) -> Path | None:
    """Look for weights in the caches of this machine, without any network.

    Args:
        architecture: Name of the model configuration in open_clip.
        tag: Tag of the weights.

    Returns:
        The file, or None.
    """
    cfg = _tag_config(architecture, tag)
    repository, file = os.path.split(cfg.get("hf_hub", ""))
    if repository:
        names = (file,) if file else (HF_SAFE_WEIGHTS_NAME, HF_WEIGHTS_NAME)
        for name in names:
            cached = try_to_load_from_cache(repository, name)
            if isinstance(cached, str):
                return Path(cached)
    url = cfg.get("url", "")
    plain = CLIP_CACHE / os.path.basename(url)
    return plain if url and plain.is_file() else None


def fetch_command(architecture: str, tag: str) -> str:
    """Return the shell command that fetches weights into a cache.

    Args:
        architecture: Name of the model configuration in open_clip.
        tag: Tag of the weights.

    Returns:
        The command.
    """
    cfg = _tag_config(architecture, tag)
    repository, file = os.path.split(cfg.get("hf_hub", ""))
    if repository:
        return f"hf download {repository} {file or HF_SAFE_WEIGHTS_NAME}"
    url = cfg["url"]
    return f"curl -L --create-dirs -o {CLIP_CACHE / os.path.basename(url)} {url}"


def is_torchscript(path: Path) -> bool:
    """Tell OpenAI's own archives, which hold code, from plain state dictionaries.

    Args:
        path: A weight file.

    Returns:
        Whether it is a TorchScript archive.
    """
    if not zipfile.is_zipfile(path):
        return False
    with zipfile.ZipFile(path) as archive:
        return any("/code/" in name for name in archive.namelist())


def _missing_file(cfg: dict[str, Any]) -> str:
    repository, file = os.path.split(cfg.get("hf_hub", ""))
    url_file = os.path.basename(cfg.get("url", ""))
    places = []
    if repository:
        places.append(f"{file or HF_SAFE_WEIGHTS_NAME} of {repository} in {HF_HUB_CACHE}")
    if url_file:
        places.append(f"{url_file} in {CLIP_CACHE}")
    return " and no ".join(places)


def _is_path(source: str) -> bool:
    return os.sep in source or Path(source).suffix in (".pt", ".pth", ".bin", ".safetensors")


def _local_weights(architecture: str, path: Path) -> ClipWeights:
    if not path.is_file():
        raise MissingWeightsError(
            f"No weight file {path} for {architecture}; expected a .pt, .bin or .safetensors file."
        )
    return ClipWeights(
        architecture=architecture,
        source=path.name,
        path=path,
        # A file carries no such note; its form or its name tells OpenAI's weights from others.
        is_quick_gelu=is_torchscript(path) or "openai" in str(path).lower(),
    )


def _tag_config(architecture: str, tag: str) -> dict[str, Any]:
    tags = list_pretrained_tags_by_model(architecture)
    if tag not in tags:
        raise UnknownEncoderError(
            f"Unknown weights {tag!r} of {architecture}. Tags: {', '.join(tags)}."
            f"{did_you_mean(tag, tags)}"
        )
    return get_pretrained_cfg(architecture, tag)


def _download(architecture: str, tag: str, cfg: dict[str, Any]) -> Path:
    try:
        return Path(download_pretrained(cfg))
    except OSError as error:
        raise MissingWeightsError(
            f"The weights of {architecture}:{tag} could not be fetched "
            f"({type(error).__name__}: {str(error).splitlines()[0]}). Check the network, or fetch "
            f"them elsewhere with `{fetch_command(architecture, tag)}`."
        ) from error
