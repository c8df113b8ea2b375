import socket
from pathlib import Path

import pytest

from perception.encoders import (
    available_encoders,
    encoder_weights_status,
    load_encoder,
)
from perception.encoders import clip_weights as weights_module
from perception.errors import MissingWeightsError, UnknownEncoderError

NAMES = "embedded, ViT-L-14, ViT-L-14-336, ViT-B-16, ViT-B-32, ViT-H-14, ViT-B-16-SigLIP"
REST = "and any model of open_clip followed by :TAG or :/path/to/file."


@pytest.fixture
def empty_caches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Caches without weights, and no network."""

    def refuse(*args: object, **kwargs: object) -> None:
        raise AssertionError(f"network access: {args}")

    monkeypatch.setattr(weights_module, "HF_HUB_CACHE", str(tmp_path / "hub"))
    monkeypatch.setattr(weights_module, "CLIP_CACHE", tmp_path / "clip")
    monkeypatch.setattr(socket, "getaddrinfo", refuse)
    return tmp_path


def test_names() -> None:
    assert ", ".join(available_encoders()) == NAMES


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "ViT-L-41",
            f"Unknown encoder 'ViT-L-41'. Encoders: {NAMES}, {REST} Did you mean 'ViT-L-14'?",
        ),
        (
            "vit-b-16",
            f"Unknown encoder 'vit-b-16'. Encoders: {NAMES}, {REST} Did you mean 'ViT-B-16'?",
        ),
        (
            "nonsense",
            f"Unknown encoder 'nonsense'. Encoders: {NAMES}, {REST}",
        ),
        ("RN50", f"Unknown encoder 'RN50'. Encoders: {NAMES}, {REST}"),
        (
            "convnext_base:webli",
            "Unknown weights 'webli' of convnext_base. Tags: laion400m_s13b_b51k.",
        ),
        (
            "embedded:large",
            "Encoder 'embedded:large': the embedded encoder has one set of weights; use "
            "'embedded'.",
        ),
        (
            "ViT-L-14-336:opanai",
            "Unknown weights 'opanai' of ViT-L-14-336. Tags: openai. Did you mean 'openai'?",
        ),
    ],
)
def test_unknown_names(name: str, message: str) -> None:
    with pytest.raises(UnknownEncoderError) as caught:
        load_encoder(name)
    assert str(caught.value) == message


def test_missing_weights_name_the_caches_and_the_command(empty_caches: Path) -> None:
    with pytest.raises(MissingWeightsError) as caught:
        load_encoder("ViT-L-14")
    assert str(caught.value) == (
        "The weights of ViT-L-14:openai are not on this machine: no open_clip_model.safetensors of "
        f"timm/vit_large_patch14_clip_224.openai in {empty_caches / 'hub'} and no ViT-L-14.pt in "
        f"{empty_caches / 'clip'}. Fetch them with `hf download "
        "timm/vit_large_patch14_clip_224.openai open_clip_model.safetensors`, or name a file as "
        "ViT-L-14:/path/to/file."
    )


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(MissingWeightsError) as caught:
        load_encoder(f"ViT-B-16:{tmp_path / 'none.pt'}")
    assert str(caught.value) == (
        f"No weight file {tmp_path / 'none.pt'} for ViT-B-16; expected a .pt, .bin or .safetensors "
        "file."
    )


def test_plain_cache_is_found(empty_caches: Path) -> None:
    file = empty_caches / "clip" / "ViT-L-14.pt"
    file.parent.mkdir()
    file.write_bytes(b"")
    status = {entry.name: entry.path for entry in encoder_weights_status()}
    assert status["ViT-L-14"] == file
    assert status["ViT-B-16"] is None


def test_status_lists_every_encoder(empty_caches: Path) -> None:
    status = encoder_weights_status()
    assert tuple(entry.name for entry in status) == available_encoders()
    assert status[0].path is not None and status[0].path.is_dir()
    assert all(entry.fetch_command for entry in status)
