from dataclasses import replace

import numpy as np
import pytest
import torch

from models.cameras import CAMERA_PRESETS
from perception.encoders.embedded import EmbeddedEncoder, EmbeddedEncoderConfig
from perception.lifter import MultiViewLifter
from perception.views import CameraView, Intrinsics
from policy.actions import ActionCandidates
from policy.images import ImageSource
from policy.observation import Observation
from policy.registry import load_policy
from sr_mj.assemble import assembled, lifter_config
from sr_mj.episode import run_episode
from sr_mj.evaluation.noisy import NoisyPoints
from sr_mj.outcome import Reason
from sr_mj.view_images import ViewImages


class ColorEncoder:
    """Every pixel is a cell, its feature the colour."""

    name = fingerprint = "color"
    fingerprints = ("color",)
    feature_dim = 3

    def encode_dense(self, images):
        return torch.from_numpy(np.stack(images)).permute(0, 3, 1, 2).float()

    def encode_text(self, text):
        raise NotImplementedError


@pytest.fixture(scope="module")
def views():
    """Black pictures of the protocol's cameras."""
    made = []
    for camera in CAMERA_PRESETS["sr"]:
        sensor = camera.sensor
        intrinsics = Intrinsics(
            fx=sensor.fx,
            fy=sensor.fy,
            cx=sensor.cx,
            cy=sensor.cy,
            width=sensor.width,
            height=sensor.height,
        )
        size = (sensor.height, sensor.width)
        made.append(
            CameraView(
                name=camera.name,
                rgb=np.zeros((*size, 3), np.uint8),
                depth_m=np.zeros(size, np.float32),
                intrinsics=intrinsics,
                T_world_cam_cv=camera.T_world_cam_cv(),
            )
        )
    return tuple(made)


def test_positions_are_projected_as_perception_does(views):
    images = ViewImages(views=views, encoder=ColorEncoder())
    assert isinstance(images, ImageSource)
    positions = np.random.default_rng(0).uniform((-0.5, -1, -0.5), (1.5, 1, 1.5), (2000, 3))
    for view, frame in zip(views, images.frames, strict=True):
        pixels, depth = view.project(positions)
        u, v = (pixels.T + 0.5) * 8
        width, height = view.intrinsics.width, view.intrinsics.height
        is_inside = (depth > 0) & (u >= 0) & (u < 8 * width) & (v >= 0) & (v < 8 * height)
        expected = np.where(is_inside, v // height * 8 + u // width, -1)
        np.testing.assert_array_equal(frame.parts_of(positions, 8), expected)
        assert 100 < is_inside.sum() < 1900


@pytest.mark.parametrize("num_parts", [1, 7, 8])
def test_the_part_in_which_a_point_appears_is_the_one_that_shows_it(views, num_parts):
    points = np.random.default_rng(1).uniform((0.3, -0.2, 0.0), (0.7, 0.2, 0.1), (5, 3))
    for index, view in enumerate(views):
        for point in points:
            (pixel,) = np.rint(view.project(point[None])[0]).astype(int)
            if not (0 <= pixel[1] < 720 and 0 <= pixel[0] < 1280):
                continue
            rgb = np.array(view.rgb)
            rgb[pixel[1], pixel[0]] = (0, 255, 0)
            images = ViewImages(
                views=(*views[:index], replace(view, rgb=rgb), *views[index + 1 :]),
                encoder=ColorEncoder(),
            )
            (part,) = images.frames[index].parts_of(point[None], num_parts)
            shown = images.describe(index, num_parts, np.arange(num_parts**2))
            assert np.flatnonzero(shown.any(axis=1)).tolist() == [part]
            np.testing.assert_allclose(shown[part], [0, 1, 0])


class CountingEncoder(EmbeddedEncoder):
    """The embedded encoder; counts how often cells are described."""

    num_described = 0

    def describe_cells(self, cells):
        self.num_described += 1
        return super().describe_cells(cells)


class BelowTheTable:
    """Generates grasps that are in sight and cannot be carried out."""

    positions = np.array([[0.45, 0.0, -0.3], [0.47, 0.02, -0.3], [0.6, -0.1, -0.3]])

    def pick(self, cloud, rng):
        poses = np.tile(np.diag([1.0, -1.0, -1.0, 1.0]), (3, 1, 1))
        poses[:, :3, 3] = self.positions
        return ActionCandidates(
            kind="pick", Ts_world_tool=poses, width_m=np.full(3, 0.04), prior=np.ones(3)
        )


def test_only_who_asks_for_pictures_has_them_described(cluttered_scene):
    scene = cluttered_scene
    encoder, generator = CountingEncoder(EmbeddedEncoderConfig(long_side=256)), BelowTheTable()
    lifter = MultiViewLifter(encoder, lifter_config(scene.workspace))
    described = []
    policies = [load_policy(name) for name in ("grounding", "vlp", "raw-image", "raw-image-grid")]
    with assembled(
        scene, lifter=lifter, policy=policies[0], generator=generator, keep_unreachable=True
    ) as pipeline:
        for policy in policies:
            before = encoder.num_described
            # The same views each time: their cloud is made once.
            (attempt,) = run_episode(
                scene, replace(pipeline, policy=policy), seed=0, max_attempts=1
            )
            assert attempt.outcome.reason is Reason.UNREACHABLE
            assert attempt.scores is not None and len(attempt.scores) == 3
            described.append(encoder.num_described - before)
    frames = ViewImages(views=attempt.views, encoder=encoder).frames
    num_parts = [len(set(f.parts_of(generator.positions, 8)) - {-1}) for f in frames]
    assert sum(num_parts) >= 3
    # Once for the points of the cloud; once for each picture; once for each crop with a grasp in.
    assert described == [1, 0, 3, sum(num_parts)]


def test_noise_of_the_points_does_not_reach_the_pictures(views):
    rng = np.random.default_rng(0)
    lit = tuple(replace(v, rgb=rng.integers(0, 256, v.rgb.shape, dtype=np.uint8)) for v in views)
    features = np.eye(3, dtype=np.float32)
    observation = Observation(
        points=rng.uniform((0.3, -0.2, 0), (0.7, 0.2, 0.1), (3, 3)),
        features=features,
        similarity=np.ones(3),
        confidence=np.ones(3),
        text_tokens=features,
        text_pooled=features[0],
        workspace_min=np.array([0.276, -0.224, 0.0]),
        workspace_max=np.array([0.724, 0.224, 0.4]),
        images=ViewImages(views=lit, encoder=ColorEncoder()),
    )
    grasps = BelowTheTable().pick(None, None)
    policy = load_policy("raw-image-grid")
    expected, found = (
        p.score(observation, grasps, rng).logits for p in (policy, NoisyPoints(policy, 0.3))
    )
    np.testing.assert_array_equal(found, expected)
    assert np.ptp(expected) > 0
