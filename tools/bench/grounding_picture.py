"""Heat maps of scenes of the bench, one encoder under the other."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from perception.cloud import FeatureCloud
from perception.heatmap import paint_heatmap
from perception.language import parse_instruction
from perception.lifter import MultiViewLifter
from perception.views import CameraView
from tools.bench.grounding_answers import Examiner
from tools.bench.grounding_scenes import BenchScene, Question

_SHOWN_KINDS = ("label", "category", "colour", "function")
_CELL_PX = (330, 270)
_CAPTION_PX = 20
_COLORS = 192


def draw_heatmaps(
    scenes: Sequence[BenchScene], lifters: Mapping[str, MultiViewLifter], path: Path
) -> None:
    """Draw each scene as the first camera sees it, and what each encoder makes of four questions.

    Args:
        scenes: The scenes.
        lifters: Lifters by the names of their encoders.
        path: PNG to write.
    """
    rows = [row for bench in scenes for row in _rows(bench, lifters)]
    width, height = _CELL_PX[0], _CELL_PX[1] + _CAPTION_PX
    columns = max(len(row) for row in rows)
    sheet = Image.new("RGB", (columns * width, len(rows) * height), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(12)
    for i, row in enumerate(rows):
        for j, (caption, picture) in enumerate(row):
            sheet.paste(picture, (j * width, i * height))
            draw.text((j * width + 3, i * height + _CELL_PX[1] + 3), caption, "black", font)
    path.parent.mkdir(parents=True, exist_ok=True)
    # A palette is a third of the bytes, and colours of a heat map are few.
    sheet.quantize(_COLORS, dither=Image.Dither.NONE).save(path, optimize=True)


def _rows(
    bench: BenchScene, lifters: Mapping[str, MultiViewLifter]
) -> list[list[tuple[str, Image.Image]]]:
    """Make a row of captioned pictures for each encoder."""
    view, rows = bench.views[0], []
    for name, lifter in lifters.items():
        lifted = lifter.lift(bench.views)
        examiner = Examiner(bench, lifted.cloud, lifted.scorer)
        row = [(f"{bench.split}, seed {bench.seed}: {name}", _cropped(view.rgb))]
        for question in _chosen(examiner.questions()):
            phrase = parse_instruction(question.text).target_phrase
            cloud = replace(lifted.cloud, similarity=lifted.similarity(phrase))
            is_right = examiner.ask(question.text)[0] in question.targets
            caption = f"{question.text}: {'right' if is_right else 'WRONG'}"
            row.append((caption, _heatmap(view, cloud, lifter.config.feature_voxel_size_m)))
        rows.append(row)
    return rows


def _chosen(questions: Sequence[Question]) -> list[Question]:
    """Choose the first template of each kind, in the order of the kinds."""
    templates = [q for q in questions if not q.is_paraphrase]
    firsts = (next((q for q in templates if q.kind == kind), None) for kind in _SHOWN_KINDS)
    return [question for question in firsts if question is not None]


def _heatmap(view: CameraView, cloud: FeatureCloud, voxel_m: float) -> Image.Image:
    best = cloud.points[np.argmax(cloud.similarity)]
    return _cropped(paint_heatmap(view, cloud, reach_m=1.5 * voxel_m, marked_point=best))


def _cropped(picture: np.ndarray) -> Image.Image:
    """Cut the workspace out of the middle of a view, and shrink it."""
    height, width = picture.shape[:2]
    cut = round(height * _CELL_PX[0] / _CELL_PX[1])
    left = (width - cut) // 2
    image = Image.fromarray(np.ascontiguousarray(picture[:, left : left + cut]))
    return image.resize(_CELL_PX, Image.Resampling.LANCZOS)
