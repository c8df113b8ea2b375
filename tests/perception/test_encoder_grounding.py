"""The shipped head against the untrained mixture, on objects that neither has been chosen on."""

from dataclasses import dataclass

import mujoco
import numpy as np
import pytest

from models.camera_mjcf import add_cameras
from models.cameras import camera_preset
from models.objects import families
from models.objects.mjcf_builder import build_object
from models.objects.words import ObjectWords
from models.tabletop import build_tabletop
from perception.encoders.embedded import EmbeddedEncoder, EmbeddedEncoderConfig

pytestmark = pytest.mark.render

# Seeds that training does not use: there, every generator is seeded with a pair of numbers.
SEEDS = (9001, 9002, 9003, 9004)
NUM_OBJECTS = 9
CELL_PX = 16
HEIGHT, WIDTH = 544, 960


@dataclass(frozen=True, kw_only=True)
class Picture:
    rgb: np.ndarray
    words: tuple[ObjectWords, ...]
    object_of_cell: np.ndarray  # (34, 60), -1 where no object fills most of the cell


def _take_picture(seed: int) -> Picture:
    rng = np.random.default_rng(seed)
    assets = [families.sample(rng) for _ in range(NUM_OBJECTS)]
    root = build_tabletop()
    add_cameras(root, camera_preset("sr"))
    for index, asset in enumerate(assets):
        frame = root.attach(build_object(asset, name=f"object_{index}"))
        frame.pos = (0.36 + 0.14 * (index // 3), -0.15 + 0.15 * (index % 3), 0)
        frame.euler = (0, 0, rng.uniform(0, 2 * np.pi))
    model = mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = str(rng.choice(["top", "left", "right"]))
    with mujoco.Renderer(model, HEIGHT, WIDTH) as renderer:
        renderer.update_scene(data, camera)
        rgb = renderer.render()
        renderer.enable_segmentation_rendering()
        renderer.update_scene(data, camera)
        geoms = renderer.render()[..., 0]
    bodies = np.where(geoms >= 0, model.geom_bodyid[geoms], 0)
    object_of_cell = np.full((HEIGHT // CELL_PX, WIDTH // CELL_PX), -1)
    for index in range(NUM_OBJECTS):
        is_it = bodies == model.body(f"object_{index}/object").id
        cells = is_it.reshape(HEIGHT // CELL_PX, CELL_PX, WIDTH // CELL_PX, CELL_PX)
        object_of_cell[cells.mean(axis=(1, 3)) > 0.5] = index
    return Picture(
        rgb=rgb, words=tuple(asset.words for asset in assets), object_of_cell=object_of_cell
    )


@pytest.fixture(scope="module")
def pictures() -> list[Picture]:
    return [_take_picture(seed) for seed in SEEDS]


def _questions(picture: Picture) -> dict[str, set[int]]:
    """Phrases that hold for some of the visible objects, with those for which they hold."""
    visible = set(picture.object_of_cell.ravel().tolist()) - {-1}
    asked: dict[str, set[int]] = {}
    for index in visible:
        words = picture.words[index]
        phrases = [words.title, *(f"{color} object" for color in words.colors[:1])]
        phrases += [words.category] if words.category else []
        phrases += [f"something to {function}" for function in words.functions]
        for phrase in phrases:
            asked.setdefault(phrase, set()).add(index)
    return {phrase: right for phrase, right in asked.items() if right != visible}


def _share_grounded(encoder: EmbeddedEncoder, pictures: list[Picture]) -> float:
    """Share of the questions whose most similar cell, table included, lies on a right object."""
    hits = []
    for picture in pictures:
        dense = encoder.encode_dense([picture.rgb])[0].numpy()
        for phrase, right in _questions(picture).items():
            scores = np.einsum("chw,c->hw", dense, encoder.encode_text(phrase).pooled)
            hits.append(int(picture.object_of_cell.flat[scores.argmax()]) in right)
    assert len(hits) > 50
    return float(np.mean(hits))


def test_training_grounds_more_phrases(pictures: list[Picture]) -> None:
    trained = EmbeddedEncoder(EmbeddedEncoderConfig(precision="float32"))
    untrained = EmbeddedEncoder(EmbeddedEncoderConfig(precision="float32", mixture_share=1.0))
    shares = _share_grounded(trained, pictures), _share_grounded(untrained, pictures)
    assert shares[0] > max(0.5, 3 * shares[1]), shares


def test_table_looks_like_a_table(pictures: list[Picture]) -> None:
    encoder = EmbeddedEncoder(EmbeddedEncoderConfig(precision="float32"))
    table = encoder.encode_text("table").pooled
    for picture in pictures:
        scores = np.einsum("chw,c->hw", encoder.encode_dense([picture.rgb])[0].numpy(), table)
        is_object = picture.object_of_cell >= 0
        assert np.median(scores[~is_object]) > np.quantile(scores[is_object], 0.9)
