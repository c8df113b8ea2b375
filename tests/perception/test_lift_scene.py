"""Scenes that answer questions: `MultiViewLifter.lift`, `LiftedScene`, `fit_config`, heat maps."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from perception.cloud import FeatureCloud
from perception.errors import (
    EmptyCloudError,
    InvalidCloudError,
    InvalidConfigError,
    InvalidTextError,
)
from perception.fitting import fit_config
from perception.heatmap import is_seen, paint_heatmap
from perception.lifter import MultiViewLifter
from perception.scene import LiftedScene, grow_region
from perception.text_scores import TextScorer, check_length
from perception.views import CameraView, Intrinsics

CENTERS = {"red": (0.5, 0.08), "green": (0.44, -0.09), "blue": (0.6, -0.05)}
WORKSPACE = (0.3, -0.2, -0.01, 0.7, 0.2, 0.3)


@pytest.fixture(scope="module")
def scene(table_views: tuple[CameraView, ...], make_color_encoder) -> LiftedScene:
    config = fit_config(table_views, workspace=WORKSPACE)
    return MultiViewLifter(make_color_encoder(), config).lift(table_views)


def test_phrases_find_their_objects(scene: LiftedScene) -> None:
    for word, center in CENTERS.items():
        answer = scene.query(f"{word} thing")
        assert answer.phrase == f"{word} object"
        assert answer.score == answer.cloud.similarity.max()
        np.testing.assert_array_equal(answer.point, answer.cloud.points[answer.best])
        assert np.linalg.norm(answer.point[:2] - center) < 0.07
        assert np.linalg.norm(answer.center[:2] - center) < 0.02
        assert answer.reference is None


def test_the_region_is_the_object(scene: LiftedScene) -> None:
    answer = scene.query("green")
    assert answer.best in answer.region
    low, high = np.array([0.4, -0.12, 0.0]), np.array([0.48, -0.06, 0.1])
    inside = np.all(
        (scene.cloud.points > low - 0.012) & (scene.cloud.points < high + 0.012), axis=1
    )
    assert inside[answer.region].all()
    assert len(answer.region) > 0.6 * inside.sum()
    np.testing.assert_allclose(answer.size_m, high - low, atol=0.02)


def test_composite_instructions_find_both(scene: LiftedScene) -> None:
    answer = scene.query("could you put the red ball next to the blue cylinder")
    assert (answer.phrase, answer.instruction.relation) == ("red ball", "next to")
    assert answer.reference is not None and answer.reference.phrase == "blue cylinder"
    assert np.linalg.norm(answer.point[:2] - CENTERS["red"]) < 0.07
    assert np.linalg.norm(answer.reference.point[:2] - CENTERS["blue"]) < 0.07
    only_place = scene.query("put it next to the blue cylinder")
    assert (only_place.phrase, only_place.reference) == ("blue cylinder", None)


def test_questions_cost_only_their_text(
    table_views: tuple[CameraView, ...], make_color_encoder
) -> None:
    encoder = make_color_encoder()
    lifter = MultiViewLifter(encoder, fit_config(table_views, workspace=WORKSPACE))
    scene = lifter.lift(table_views)
    assert (encoder.num_images, encoder.texts) == (3, [])
    scene.query("red")
    encoder.texts.clear()
    scene.query("blue")
    scene.similarity("blue")
    assert (encoder.num_images, encoder.texts) == (3, ["blue"])
    assert lifter.lift(table_views).cloud is scene.cloud
    assert encoder.num_images == 3


def test_perceive_and_query_agree(table_views: tuple[CameraView, ...], make_color_encoder) -> None:
    lifter = MultiViewLifter(make_color_encoder(), fit_config(table_views, workspace=WORKSPACE))
    percept = lifter.perceive(table_views, "give me the red ball")
    answer = lifter.lift(table_views).query("give me the red ball")
    assert percept.features.similarity.tobytes() == answer.cloud.similarity.tobytes()
    assert percept.target_phrase == answer.phrase


def test_saved_scenes_answer_as_before(
    scene: LiftedScene, tmp_path: Path, make_color_encoder
) -> None:
    scene.save(tmp_path / "scene.npz")
    again = LiftedScene.load(tmp_path / "scene.npz", TextScorer(make_color_encoder()))
    for text in ("red", "put the green box on the blue cylinder"):
        first, second = scene.query(text), again.query(text)
        assert first.cloud.similarity.tobytes() == second.cloud.similarity.tobytes()
        np.testing.assert_array_equal(first.region, second.region)
    assert again.geometry is None and again.cloud.encoder == "color"
    assert FeatureCloud.load(tmp_path / "scene.npz").similarity.max() == 0


def test_clouds_refuse_another_text_tower(scene: LiftedScene, make_color_encoder) -> None:
    other = make_color_encoder()
    other.name = "colour"
    with pytest.raises(InvalidCloudError) as caught:
        LiftedScene(cloud=scene.cloud, scorer=TextScorer(other))
    assert str(caught.value) == (
        "The cloud has 3 channels of encoder 'color', but encoder 'colour' has 3; load the encoder "
        "that made the cloud."
    )


@pytest.mark.parametrize("num_words", [75, 76])
def test_texts_have_at_most_77_tokens(scene: LiftedScene, num_words: int) -> None:
    text = "red " * (num_words - 1) + "red"  # one token a word, and start and end
    if num_words == 75:
        check_length(text)
        assert scene.query(text).score > 0.9
        return
    with pytest.raises(InvalidTextError) as caught:
        scene.query(text)
    assert str(caught.value) == (
        "Text 'red red red red red red red re...' has 78 tokens; expected at most 77. Say it in "
        "fewer words."
    )


@pytest.mark.parametrize("text", ["", "  ", "..."])
def test_empty_texts(scene: LiftedScene, text: str) -> None:
    with pytest.raises(InvalidTextError) as caught:
        scene.query(text)
    assert str(caught.value) == f"Empty instruction {text!r}: expected at least one word."


def test_regions_do_not_jump() -> None:
    x = np.concatenate([np.arange(20), 60 + np.arange(20)]) * 0.01
    points = np.stack([x, 0 * x, 0 * x], axis=1).astype(np.float32)
    similarity = np.zeros(40, np.float32)
    similarity[[3, 4, 5, 30, 31]] = [0.8, 1.0, 0.6, 0.95, 0.95]
    np.testing.assert_array_equal(grow_region(points, similarity, 4), [3, 4, 5])
    np.testing.assert_array_equal(grow_region(points, similarity, 30), [30, 31])
    np.testing.assert_array_equal(grow_region(points[:1], similarity[4:5], 0), [0])
    similarity[[3, 5]] = 0.4
    np.testing.assert_array_equal(grow_region(points, similarity, 4), [4])


def test_fitted_box_holds_all_depth(table_views: tuple[CameraView, ...]) -> None:
    config = fit_config(table_views)
    for view in table_views:
        v, u = np.nonzero(view.depth_m)
        points = view.unproject(np.stack([u, v], axis=1).astype(float), view.depth_m[v, u])
        assert (points > np.array(config.fusion.workspace_min) - 0.02).all()
        assert (points < np.array(config.fusion.workspace_max) + 0.02).all()
    assert config.is_table_lifted


def test_fitted_lengths_grow_with_the_pixels(make_view) -> None:
    def fitted(depth_m: float):
        K = Intrinsics(fx=500.0, fy=500.0, cx=3.5, cy=2.5, width=8, height=6)
        return fit_config([make_view(depth_m=np.full((6, 8), depth_m, np.float32), intrinsics=K)])

    assert fitted(0.4).fusion.voxel_size_m == 0.002
    far = fitted(2.0)
    assert far.fusion.voxel_size_m == 0.008
    assert far.feature_voxel_size_m == 0.032
    near = fitted(0.4)
    for a, b in (
        (far.fusion.normal_radius_m, near.fusion.normal_radius_m),
        (far.fusion.flying_pixel_tolerance_m, near.fusion.flying_pixel_tolerance_m),
        (far.lifting.mu_m, near.lifting.mu_m),
    ):
        assert a == pytest.approx(4 * b)


def test_fitting_needs_depth_and_a_box(make_view) -> None:
    with pytest.raises(EmptyCloudError) as caught:
        fit_config([make_view(depth_m=np.zeros((6, 8), np.float32))])
    assert str(caught.value) == (
        "No depth at all in 1 views; check the sensor and the unit (metres)."
    )
    with pytest.raises(InvalidConfigError, match="is not below workspace_max"):
        fit_config([make_view()], workspace=(0, 0, 0, 1, -1, 1))
    with pytest.raises(InvalidConfigError) as caught:
        fit_config([make_view()], voxel_size_m=-0.1)
    assert str(caught.value) == "voxel_size_m is -0.1, expected more than 0 m."


def test_heat_lies_on_the_object(scene: LiftedScene, table_views: tuple[CameraView, ...]) -> None:
    answer = scene.query("red")
    for view in table_views:
        picture = paint_heatmap(view, answer.cloud, reach_m=0.012).astype(int)
        assert picture.shape == view.rgb.shape
        is_hot = picture[..., 0] - picture[..., 2] > 80
        is_red = (view.rgb == [200, 30, 30]).all(axis=2)
        assert (is_hot & is_red).sum() > 0.65 * is_red.sum()  # its rim takes colours of the table
        assert (is_hot & ~is_red).sum() < 0.3 * is_red.sum()


def test_pixels_without_points_stay_grey(scene: LiftedScene, make_view) -> None:
    rgb = np.random.default_rng(0).integers(0, 255, (6, 8, 3), np.uint8)
    pose = np.eye(4)
    pose[2, 3] = 50.0
    view = make_view(rgb=rgb, T_world_cam_cv=pose)
    picture = paint_heatmap(view, scene.cloud, reach_m=0.01)
    np.testing.assert_array_equal(
        picture, rgb.mean(axis=2).astype(np.uint8)[..., None].repeat(3, axis=2)
    )
    behind = paint_heatmap(view, scene.cloud, reach_m=0.01, marked_point=np.zeros(3))
    np.testing.assert_array_equal(behind, picture)


def test_the_mark_is_where_the_point_projects(
    scene: LiftedScene, table_views: tuple[CameraView, ...]
) -> None:
    view, point = table_views[0], np.array([0.5, 0.08, 0.08])
    plain = paint_heatmap(view, scene.cloud, reach_m=0.012)
    marked = paint_heatmap(view, scene.cloud, reach_m=0.012, marked_point=point)
    rows, columns = np.nonzero((plain != marked).any(axis=2))
    (pixel,), _ = view.project(point[None])
    np.testing.assert_allclose([columns.mean(), rows.mean()], pixel, atol=1.0)


def test_seen_and_hidden_points(table_views: tuple[CameraView, ...]) -> None:
    top, left, _ = table_views
    on_top, beneath, aside = np.array([[0.5, 0.08, 0.08], [0.5, 0.08, 0.0], [5.0, 0.08, 0.0]])
    assert is_seen(top, on_top, 0.01) and is_seen(left, on_top, 0.01)
    assert not is_seen(top, beneath, 0.01)
    assert not is_seen(top, aside, 0.01)
    assert not is_seen(top, np.array([0.5, 0.0, 2.0]), 0.01)  # behind the camera
    blind = replace(top, depth_m=np.zeros_like(top.depth_m))
    assert not is_seen(blind, on_top, 0.01)


def test_order_of_views_does_not_matter(
    scene: LiftedScene, table_views: tuple[CameraView, ...], make_color_encoder
) -> None:
    turned = tuple(replace(view) for view in table_views[::-1])
    config = fit_config(turned, workspace=WORKSPACE)
    again = MultiViewLifter(make_color_encoder(), config).lift(turned)
    assert again.cloud.features.tobytes() == scene.cloud.features.tobytes()
