"""What `python -m perception.lift` leaves behind: clouds, heat maps and a summary."""

import json
import platform
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from perception.heatmap import is_seen, paint_heatmap
from perception.lifter import LifterConfig
from perception.scene import Answer, LiftedScene
from perception.views import CameraView

_PACKAGES = ("sr-mj", "numpy", "open3d", "torch", "open-clip-torch", "timm", "transformers")
_MAX_STEM = 60
_REACH_VOXELS = 1.5  # from a pixel's point to the feature point whose colour it takes


def write_results(
    folder: Path,
    views: Sequence[CameraView],
    scene: LiftedScene,
    texts: Sequence[str],
    config: LifterConfig,
    seconds: float,
) -> Iterator[str]:
    """Answer the texts and write everything, `summary.json` last.

    Args:
        folder: Where to write; made where it does not exist.
        views: The views that the scene was lifted from.
        scene: The scene.
        texts: Phrases or instructions.
        config: The settings that the scene was lifted with.
        seconds: How long the lifting took.

    Yields:
        Lines of the summary, as they are known.
    """
    folder.mkdir(parents=True, exist_ok=True)
    scene.save(folder / "cloud.npz")
    cloud = scene.cloud
    num_fine = len(scene.geometry) if scene.geometry is not None else 0
    yield (
        f"Cloud   {num_fine} points at {config.fusion.voxel_size_m * 1e3:.1f} mm, {len(cloud)} "
        f"with features at {config.feature_voxel_size_m * 1e3:.1f} mm ({cloud.encoder}, "
        f"{cloud.features.shape[1]} channels) [{seconds:.1f} s]"
    )
    reach_m = _REACH_VOXELS * config.feature_voxel_size_m
    records: list[dict[str, Any]] = []
    files: dict[str, list[str]] = {}  # by phrase: the same one may be asked for twice
    for text in texts:
        answer = scene.query(text)
        for role, part in _parts(answer):
            if part.phrase not in files:
                stem = _unused_stem(part.phrase, {names[0] for names in files.values()})
                files[part.phrase] = _write_answer(folder, stem, part, views, reach_m)
            records.append(
                _record(text, role, part, views, reach_m) | {"files": files[part.phrase]}
            )
            yield _describe(text, role, part)
    summary = {
        "views": [view.name for view in views],
        "num_points": num_fine,
        "num_feature_points": len(cloud),
        "encoder": cloud.encoder,
        "lift_seconds": round(seconds, 3),
        "answers": records,
        "config": asdict(config),
        "versions": _versions(),
    }
    (folder / "summary.json").write_text(json.dumps(summary, indent=1) + "\n")
    yield f"Written {folder}"


def _parts(answer: Answer) -> Iterator[tuple[str, Answer]]:
    yield ("target" if answer.instruction.target is not None else "reference"), answer
    if answer.reference is not None:
        yield "reference", answer.reference


def _write_answer(
    folder: Path, stem: str, answer: Answer, views: Sequence[CameraView], reach_m: float
) -> list[str]:
    names = [f"{stem}.ply"]
    answer.cloud.save(folder / names[0], ply_colors="similarity")
    for view in views:
        picture = paint_heatmap(
            view,
            answer.cloud,
            reach_m=reach_m,
            marked_point=answer.point,
        )
        names.append(f"{stem}_{_stem(view.name)}.png")
        Image.fromarray(picture).save(folder / names[-1])
    return names


def _record(
    text: str, role: str, answer: Answer, views: Sequence[CameraView], reach_m: float
) -> dict[str, Any]:
    instruction = answer.instruction
    return {
        "text": text,
        "role": role,
        "phrase": answer.phrase,
        "relation": instruction.relation,
        "score": round(answer.score, 4),
        "point_m": _rounded(answer.point),
        "region_center_m": _rounded(answer.center),
        "region_size_m": _rounded(answer.size_m),
        "region_points": len(answer.region),
        "pixels": {view.name: _pixel(view, answer.point, reach_m) for view in views},
    }


def _describe(text: str, role: str, answer: Answer) -> str:
    center = ", ".join(f"{value:.3f}" for value in answer.center)
    size = " x ".join(f"{value * 100:.0f}" for value in answer.size_m)
    if role == "reference":
        of = f"{answer.instruction.relation} {answer.phrase!r}"
    else:
        of = repr(answer.phrase)
    return f"{text!r}: {role} {of}, score {answer.score:.2f} at ({center}) m, {size} cm"


def _pixel(view: CameraView, point: np.ndarray, reach_m: float) -> list[float] | None:
    """Return where the view sees the point, or None if it does not."""
    (pixel,), _ = view.project(np.asarray(point, np.float64)[None])
    return [round(float(c), 1) for c in pixel] if is_seen(view, point, reach_m) else None


def _rounded(values: np.ndarray) -> list[float]:
    return [round(float(value), 4) for value in values]


def _stem(text: str) -> str:
    return re.sub(r"[^\w.-]+", "_", text.lower()).strip("_.")[:_MAX_STEM] or "text"


def _unused_stem(text: str, files: set[str]) -> str:
    base = _stem(text)
    stem, number = base, 2
    while f"{stem}.ply" in files:
        stem, number = f"{base}_{number}", number + 1
    return stem


def _versions() -> dict[str, str]:
    versions = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = "not installed"
    return versions
