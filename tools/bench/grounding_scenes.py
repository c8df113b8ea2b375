"""Scenes to ask questions about: views as an episode takes them, the truth, and every question."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from models.cameras import camera_preset
from models.objects.words import (
    CATEGORIES,
    COLORS,
    FUNCTIONS,
    PROTOCOL_GENERAL_WORDS,
    SHAPES,
    ObjectWords,
)
from perception.views import CameraView
from sr_mj.scene import Scene, SceneConfig, make_scene
from sr_mj.scene.goals import find_targets
from sr_mj.sensors.capture import capture_views
from sr_mj.sensors.l515 import L515NoiseConfig
from sr_mj.sensors.renderer import CameraRig
from tools.arrangements.wording import other_wordings

GENERAL_KINDS = ("category", "colour", "shape", "function")
KINDS = ("label", *GENERAL_KINDS)
# The first template of each kind in the evaluation protocol.
_TEMPLATES = {
    "label": "give me the {}",
    "category": "I need a {}",
    "colour": "grasp a {} object",
    "shape": "grasp a {} object",
    "function": "get something to {}",
}
_VOCABULARY = {"category": CATEGORIES, "colour": COLORS, "shape": SHAPES, "function": FUNCTIONS}
# A feature point is a mean over its voxel, and depth is noisy: a view that measures this much
# nearer or farther does not see the point.
_DEPTH_TOLERANCE_M = 0.012


@dataclass(frozen=True, kw_only=True)
class Question:
    """An instruction that at least one object in sight satisfies.

    Attributes:
        kind: One of `KINDS`.
        text: The instruction.
        is_paraphrase: It is another wording, not the protocol's template.
        targets: Indices, among the scene's objects, of those that satisfy it.
    """

    kind: str
    text: str
    is_paraphrase: bool
    targets: tuple[int, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class BenchScene:
    """A scene as the cameras see it, and what they look at. Ground truth.

    Attributes:
        split: Part of the catalogue.
        seed: Seed of the scene and of the sensor's noise.
        scene: The scene.
        views: What the cameras measured.
        body_ids: For each view, (H, W) int32: the body that each pixel shows.
    """

    split: str
    seed: int
    scene: Scene
    views: tuple[CameraView, ...]
    body_ids: tuple[np.ndarray, ...]

    @property
    def words(self) -> dict[str, ObjectWords]:
        """Words of every object by name, in the scene's order."""
        return {item.name: item.words for item in self.scene.objects}

    def owners(self, points: np.ndarray) -> np.ndarray:
        """Tell which object every point lies on.

        Args:
            points: (N, 3) world, metres.

        Returns:
            (N,) indices among the scene's objects; -1 where no view that agrees in depth with the
            point sees an object there.
        """
        errors, bodies = zip(
            *(_seen_bodies(view, ids, points) for view, ids in self._looks()), strict=True
        )
        best = np.argmin(errors, axis=0)
        columns = np.arange(len(points))
        body = np.where(
            np.array(errors)[best, columns] < _DEPTH_TOLERANCE_M,
            np.array(bodies)[best, columns],
            -1,
        )
        owners = np.full(len(points), -1)
        for index, item in enumerate(self.scene.objects):
            owners[body == item.body.body_id] = index
        return owners

    def _looks(self) -> Iterator[tuple[CameraView, np.ndarray]]:
        return zip(self.views, self.body_ids, strict=True)


def _seen_bodies(
    view: CameraView, body_ids: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return how far each point is off the measured depth, and the body shown at its pixel."""
    pixels, depth_m = view.project(points.astype(np.float64))
    height, width = view.depth_m.shape
    u, v = np.rint(pixels).astype(int).T
    is_inside = (depth_m > 0) & (u >= 0) & (v >= 0) & (u < width) & (v < height)
    u, v = np.clip(u, 0, width - 1), np.clip(v, 0, height - 1)
    measured = view.depth_m[v, u]
    error = np.where(is_inside & (measured > 0), np.abs(measured - depth_m), np.inf)
    return error, body_ids[v, u]


def photograph(kind: str, split: str, seed: int) -> BenchScene:
    """Make a scene and take its views, with sensor noise.

    Args:
        kind: Kind of scene, one of `sr_mj.scene.SCENE_KINDS`.
        split: Part of the catalogue.
        seed: Draws the scene and the noise.

    Returns:
        The scene.
    """
    scene = make_scene(SceneConfig(scene=kind, split=split, seed=seed))  # pyright: ignore[reportArgumentType]
    noise_rng = np.random.default_rng(seed).spawn(3)[0]
    cameras = camera_preset(scene.config.cameras)
    with CameraRig(scene.model, cameras) as rig:
        views = capture_views(rig, scene.data, L515NoiseConfig(), noise_rng)
        body_ids = tuple(rig.render_body_ids(scene.data, camera.name) for camera in cameras)
    return BenchScene(split=split, seed=seed, scene=scene, views=views, body_ids=body_ids)


def list_questions(bench: BenchScene, visible: np.ndarray) -> list[Question]:
    """List all that a scene can be asked for in the protocol's words, and other wordings of each.

    Args:
        bench: The scene.
        visible: Indices of the objects that are in sight.

    Returns:
        Questions of which at least one target is in sight; the other wordings after each template.
    """
    questions = []
    names = list(bench.words)
    for kind, word in _askable(bench.split, bench.words):
        goal = _TEMPLATES[kind].format(word)
        targets = tuple(names.index(name) for name in find_targets(goal, bench.words))
        if not set(targets) & set(visible.tolist()):
            continue
        for text in (goal, *other_wordings(goal)):
            question = Question(kind=kind, text=text, is_paraphrase=text != goal, targets=targets)
            questions.append(question)
    return questions


def _askable(split: str, objects: dict[str, ObjectWords]) -> list[tuple[str, str]]:
    """List the kinds and words of questions, each once, whatever is in sight."""
    labels = sorted({words.label for words in objects.values() if words.label})
    general = [
        (kind, word)
        for kind, vocabulary in _VOCABULARY.items()
        for word in PROTOCOL_GENERAL_WORDS[split]
        if word in vocabulary
    ]
    return [*(("label", label) for label in labels), *general]
