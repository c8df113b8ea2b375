"""Encoders by name: the embedded default, and models of open_clip."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from perception.errors import UnknownEncoderError, did_you_mean

if TYPE_CHECKING:
    from perception.encoders.base import Encoder

# open_clip architecture -> the weights that are meant where no tag is given.
DEFAULT_TAGS = {
    "ViT-L-14": "openai",
    "ViT-L-14-336": "openai",
    "ViT-B-16": "openai",
    "ViT-B-32": "openai",
    "ViT-H-14": "laion2b_s32b_b79k",
    "ViT-B-16-SigLIP": "webli",
}


@dataclass(frozen=True, kw_only=True)
class WeightsStatus:
    """Whether the weights of an encoder are on this machine.

    Attributes:
        name: Name of the encoder.
        path: Where the weights are (a file, or the folder of the embedded encoder); None if absent.
        fetch_command: A shell command that fetches them, or makes them, if they are absent.
    """

    name: str
    path: Path | None
    fetch_command: str


def available_encoders() -> tuple[str, ...]:
    """Return the names that `load_encoder` knows, the default first."""
    return ("embedded", *DEFAULT_TAGS)


def load_encoder(name: str = "embedded", *, allow_download: bool = False) -> "Encoder":
    """Load an encoder by name.

    Args:
        name: One of `available_encoders()`, or any other model of open_clip with a tag of its
            weights or a file that holds them: "ViT-B-16:laion2b_s34b_b88k",
            "convnext_base:/data/convnext.safetensors".
        allow_download: Whether weights that are not on this machine may be fetched. Off by default:
            nothing reaches a network unless it is asked to.

    Returns:
        The encoder, ready for use on the CPU.

    Raises:
        UnknownEncoderError: If there is no encoder, or no tag, of that name.
        UnsupportedEncoderError: If the model of open_clip cannot be read patch by patch.
        MissingWeightsError: If the weights are not on this machine.
        InvalidWeightsError: If a weight file does not fit the architecture.
    """
    architecture, _, source = name.partition(":")
    _check_name(name, architecture, source)
    if architecture == "embedded":
        from perception.encoders.embedded import EmbeddedEncoder

        return EmbeddedEncoder()
    from perception.encoders.clip_weights import resolve_weights
    from perception.encoders.open_clip_vit import OpenClipVitEncoder

    weights = resolve_weights(
        architecture, source or DEFAULT_TAGS[architecture], allow_download=allow_download
    )
    return OpenClipVitEncoder.from_weights(weights)


def encoder_weights_status() -> tuple[WeightsStatus, ...]:
    """Look up, without loading anything, which encoders could be loaded on this machine.

    Returns:
        One entry for each of `available_encoders()`.
    """
    from perception.encoders.clip_weights import fetch_command, find_weights
    from perception.encoders.embedded import WEIGHT_FILES, WEIGHTS_DIR

    is_complete = all((WEIGHTS_DIR / file).is_file() for file in WEIGHT_FILES)
    embedded = WeightsStatus(
        name="embedded",
        path=WEIGHTS_DIR if is_complete else None,
        fetch_command="python tools/convert_embedded_weights.py",
    )
    clip = (
        WeightsStatus(
            name=name, path=find_weights(name, tag), fetch_command=fetch_command(name, tag)
        )
        for name, tag in DEFAULT_TAGS.items()
    )
    return (embedded, *clip)


def _check_name(name: str, architecture: str, source: str) -> None:
    known = available_encoders()
    if architecture not in known:
        from open_clip import list_models

        if source and architecture in list_models():
            return
        raise UnknownEncoderError(
            f"Unknown encoder {name!r}. Encoders: {', '.join(known)}, and any model of open_clip "
            f"followed by :TAG or :/path/to/file.{did_you_mean(architecture, known)}"
        )
    if architecture == "embedded" and source:
        raise UnknownEncoderError(
            f"Encoder {name!r}: the embedded encoder has one set of weights; use 'embedded'."
        )
