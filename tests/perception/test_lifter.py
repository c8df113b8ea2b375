from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import torch

from perception.encoders.base import TextFeatures
from perception.encoders.embedded import EmbeddedEncoder, EmbeddedEncoderConfig
from perception.errors import EmptyCloudError, InvalidConfigError, InvalidTextError
from perception.fusion import FusionConfig
from perception.lifter import LifterConfig, MultiViewLifter
from perception.lifting import LiftingConfig, lift_features
from perception.similarity import relevancy
from perception.text_scores import TextScorer
from perception.views import CameraView


@pytest.fixture
def lifter(make_color_encoder) -> MultiViewLifter:
    return MultiViewLifter(make_color_encoder())


def test_the_named_object_is_found(
    lifter: MultiViewLifter, table_views: tuple[CameraView, ...]
) -> None:
    centers = {"red": (0.5, 0.08), "green": (0.44, -0.09), "blue": (0.6, -0.05)}
    for word, center in centers.items():
        percept = lifter.perceive(table_views, f"give me the {word} object")
        assert percept.target_phrase == f"{word} object"
        cloud = percept.features
        best = cloud.points[np.argsort(cloud.similarity)[-50:]]
        assert np.linalg.norm(best[:, :2] - center, axis=1).max() < 0.06
        assert cloud.similarity.min() >= 0 and cloud.similarity.max() <= 1


def test_clouds_fit_together(lifter: MultiViewLifter, table_views: tuple[CameraView, ...]) -> None:
    percept = lifter.perceive(table_views, "give me the red object")
    assert len(percept.geometry) > 10 * len(percept.features) > 1000
    assert (percept.features.confidence > 0).all() and (percept.features.confidence <= 1).all()
    assert percept.features.points[:, 2].min() > 0.003  # the table is not lifted by default
    assert percept.geometry.points[:, 2].min() < 0.001  # but it is in the geometry


def test_table_is_lifted_on_demand(table_views: tuple[CameraView, ...], make_color_encoder) -> None:
    lifter = MultiViewLifter(make_color_encoder(), LifterConfig(is_table_lifted=True))
    points = lifter.perceive(table_views, "give me the red object").features.points
    assert (np.abs(points[:, 2]) < 0.001).sum() > 1000


def test_second_question_costs_only_its_text(
    lifter: MultiViewLifter, table_views: tuple[CameraView, ...]
) -> None:
    encoder = lifter.encoder
    first = lifter.perceive(table_views, "give me the red object")
    assert encoder.num_images == 3
    encoder.texts.clear()
    second = lifter.perceive(table_views, "give me the blue object")
    assert encoder.num_images == 3
    assert encoder.texts == ["blue object", "give me the blue object"]
    assert second.geometry is first.geometry
    assert np.shares_memory(second.features.features, first.features.features)


class CountingEncoder(EmbeddedEncoder):
    """The embedded encoder at a small size, with every call of a tower counted."""

    def __init__(self) -> None:
        super().__init__(EmbeddedEncoderConfig(long_side=160))
        self.num_images = self.num_described = 0
        self.texts: list[str] = []

    def encode_cells(self, images: Sequence[np.ndarray]) -> torch.Tensor:
        self.num_images += len(images)
        return super().encode_cells(images)

    def describe_cells(self, cells: torch.Tensor) -> torch.Tensor:
        self.num_described += 1
        return super().describe_cells(cells)

    def encode_text(self, text: str) -> TextFeatures:
        self.texts.append(text)
        return super().encode_text(text)


def test_second_question_runs_the_text_tower_alone(table_views: tuple[CameraView, ...]) -> None:
    encoder = CountingEncoder()
    lifter = MultiViewLifter(encoder)
    first = lifter.perceive(table_views, "give me the red ball")
    assert (encoder.num_images, encoder.num_described) == (3, 1)
    encoder.texts.clear()
    # Other objects with the same contents: what counts is what they hold.
    again = [
        replace(view, rgb=view.rgb.copy(), depth_m=view.depth_m.copy()) for view in table_views
    ]
    second = lifter.perceive(again, "give me the blue cylinder")
    assert (encoder.num_images, encoder.num_described) == (3, 1)
    assert encoder.texts == ["blue cylinder", "give me the blue cylinder"]
    assert np.shares_memory(second.features.features, first.features.features)
    # Depth alone changed: the cloud is made anew, from the images encoded before.
    moved = replace(again[0], depth_m=again[0].depth_m + np.float32(0.001))
    lifter.perceive([moved, *again[1:]], "give me the blue cylinder")
    assert (encoder.num_images, encoder.num_described) == (3, 2)


def test_lifting_of_cells_equals_lifting_of_maps(table_views: tuple[CameraView, ...]) -> None:
    encoder = EmbeddedEncoder(EmbeddedEncoderConfig(long_side=160, precision="float32"))
    cloud = MultiViewLifter(encoder).lift(table_views).cloud
    views = sorted(table_views, key=lambda view: view.name)
    maps = encoder.encode_dense([view.rgb for view in views])
    lifted = lift_features(cloud.points, views, maps, LiftingConfig())
    np.testing.assert_allclose(cloud.features, lifted.features, atol=1e-5)
    np.testing.assert_array_equal(cloud.confidence, lifted.confidence)


def test_only_new_images_are_encoded(
    lifter: MultiViewLifter, table_views: tuple[CameraView, ...]
) -> None:
    encoder = lifter.encoder
    lifter.perceive(table_views, "red")
    changed = replace(table_views[0], rgb=255 - table_views[0].rgb)
    lifter.perceive((changed, *table_views[1:]), "red")
    assert encoder.num_images == 4


@pytest.mark.parametrize("capacity", [0, 1, 2])
def test_small_caches_change_nothing(
    table_views: tuple[CameraView, ...], capacity: int, make_color_encoder
) -> None:
    lifter = MultiViewLifter(make_color_encoder(), LifterConfig(num_cached_images=capacity))
    lifter.perceive(table_views[:2], "red")
    again = lifter.perceive(table_views, "red").features
    fresh = MultiViewLifter(make_color_encoder()).perceive(table_views, "red").features
    np.testing.assert_array_equal(again.features, fresh.features)


def test_same_bytes_whatever_the_order_of_views(
    table_views: tuple[CameraView, ...], make_color_encoder
) -> None:
    first = MultiViewLifter(make_color_encoder()).perceive(table_views, "red").features
    second = MultiViewLifter(make_color_encoder()).perceive(table_views[::-1], "red").features
    for name in ("points", "colors", "normals", "features", "confidence", "similarity"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()


def test_place_instructions_look_for_the_reference(
    lifter: MultiViewLifter, table_views: tuple[CameraView, ...]
) -> None:
    percept = lifter.perceive(table_views, "put it near the blue object")
    assert percept.target_phrase == "blue object"
    assert len(percept.text.tokens) == 6  # the whole instruction, relation included
    assert len(percept.target_text.tokens) == 2


def test_no_object_on_the_table(table_views: tuple[CameraView, ...], make_color_encoder) -> None:
    fusion = FusionConfig(workspace_min=(0.6, 0.1, -0.01), workspace_max=(0.7, 0.2, 0.4))
    with pytest.raises(EmptyCloudError, match="there is no object in the workspace"):
        MultiViewLifter(make_color_encoder(), LifterConfig(fusion=fusion)).perceive(
            table_views, "red"
        )


def test_empty_instruction(lifter: MultiViewLifter, table_views: tuple[CameraView, ...]) -> None:
    with pytest.raises(InvalidTextError, match="Empty instruction '': expected at least one word"):
        lifter.perceive(table_views, "")


def test_wordings_are_averaged(table_views: tuple[CameraView, ...], make_color_encoder) -> None:
    encoder = make_color_encoder()
    scorer = TextScorer(encoder, prompts=("{}", "a photo of {} blue"), negative_prompts=())
    found = scorer.encode_ensemble("red")
    wanted = encoder.encode_text("red").pooled + encoder.encode_text("a photo of red blue").pooled
    np.testing.assert_allclose(found.pooled, wanted / np.linalg.norm(wanted), atol=1e-6)
    assert len(found.tokens) == 1
    config = LifterConfig(prompts=("{} blue",), negative_prompts=())
    percept = MultiViewLifter(encoder, config).perceive(table_views, "thing")
    best = percept.features.points[percept.features.similarity.argmax()]
    assert np.linalg.norm(best[:2] - (0.6, -0.05)) < 0.06


@pytest.mark.parametrize("prompts", [(), ("a photo",), ("{} or {}",)])
def test_wordings_without_a_place_for_the_text(
    prompts: tuple[str, ...], make_color_encoder
) -> None:
    with pytest.raises(InvalidTextError, match=r"expected one or more texts, each with one '\{\}'"):
        TextScorer(make_color_encoder(), prompts=prompts)


def test_a_wording_does_not_hide_an_empty_text(make_color_encoder) -> None:
    with pytest.raises(InvalidTextError, match="Empty text"):
        TextScorer(make_color_encoder(), prompts=("a photo of {}",)).encode_ensemble(" ")


def test_maps_in_half_precision(table_views: tuple[CameraView, ...], make_color_encoder) -> None:
    config = LifterConfig(lifting=LiftingConfig(precision="bfloat16"))
    half = MultiViewLifter(make_color_encoder(), config).perceive(table_views, "red").features
    full = MultiViewLifter(make_color_encoder()).perceive(table_views, "red").features
    np.testing.assert_allclose(half.features, full.features, atol=0.01)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        (
            {"feature_voxel_size_m": 0.001},
            "feature_voxel_size_m is 0.001, expected at least the voxel_size_m of the geometry, "
            "0.002.",
        ),
        (
            {"num_cached_images": -1},
            "num_cached_images is -1 and sharpness 10.0, expected 0 or more and more than 0.",
        ),
    ],
)
def test_bad_config(fields: dict[str, float], message: str) -> None:
    with pytest.raises(InvalidConfigError) as caught:
        LifterConfig(**fields)  # pyright: ignore[reportArgumentType]
    assert str(caught.value) == message


def _text(*values: float) -> TextFeatures:
    pooled = np.asarray(values, np.float32)
    pooled /= np.linalg.norm(pooled)
    return TextFeatures(pooled=pooled, tokens=pooled[None])


def test_relevancy_values() -> None:
    features = np.eye(3, dtype=np.float32)
    text, negatives = _text(1, 0, 0), [_text(0, 1, 0), _text(1, 1, 0)]
    best_negative = np.array([np.sqrt(0.5), 1.0, 0.0])
    wanted = 1 / (1 + np.exp(-10 * (np.array([1.0, 0.0, 0.0]) - best_negative)))
    np.testing.assert_allclose(relevancy(features, text, negatives, sharpness=10.0), wanted, 1e-5)
    np.testing.assert_array_equal(relevancy(features, text, [], sharpness=10.0), [1, 0, 0])
    unwanted = _text(1, 0, 1)  # as near to the text as to the third feature
    factor = 1 / (1 + np.exp(-10 * (np.array([1.0, 0.0, 0.0]) - np.sqrt([0.5, 0.0, 0.5]))))
    found = relevancy(features, text, negatives, [unwanted], sharpness=10.0)
    np.testing.assert_allclose(found, wanted * factor, 1e-5)
    np.testing.assert_array_equal(
        relevancy(features, text, [], [unwanted], sharpness=10.0), [1, 0, 0]
    )


def test_what_is_named_but_not_asked_for_is_not_found(
    lifter: MultiViewLifter, table_views: tuple[CameraView, ...]
) -> None:
    # Half red and half blue: the ball and the cylinder are as near.
    for other, center in (("red", (0.6, -0.05)), ("blue", (0.5, 0.08))):
        sentence = f"give me the red blue object, put it near the {other} object"
        by_sentence = lifter.perceive(table_views, sentence).features
        by_part = lifter.perceive(
            table_views, "give me the red blue object", unwanted=(f"{other} object",)
        ).features
        assert by_sentence.similarity.tobytes() == by_part.similarity.tobytes()
        answer = lifter.lift(table_views).query(sentence)
        assert answer.cloud.similarity.tobytes() == by_part.similarity.tobytes()
        best = by_part.points[np.argsort(by_part.similarity)[-50:]]
        assert np.linalg.norm(best[:, :2] - center, axis=1).max() < 0.06
