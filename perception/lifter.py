"""From views and an instruction to a percept: the one entry point of the package."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from torch import Tensor

from perception.cache import LruCache, hash_image, hash_view
from perception.cloud import FeatureCloud, GeometryCloud
from perception.encoders.base import CellEncoder, Encoder, TextFeatures
from perception.errors import EmptyCloudError, InvalidConfigError
from perception.fusion import FusionConfig, fuse, ordered_views
from perception.language import parse_instruction
from perception.lifting import LiftingConfig, lift_features
from perception.scene import LiftedScene
from perception.text_scores import (
    DEFAULT_NEGATIVE_PROMPTS,
    DEFAULT_SHARPNESS,
    PLAIN_PROMPT,
    TextScorer,
)
from perception.views import CameraView
from perception.voxels import voxel_means


@dataclass(frozen=True, kw_only=True)
class LifterConfig:
    """Settings of perception as a whole.

    Attributes:
        fusion: Workspace, voxels, outliers and normals of the geometry cloud.
        lifting: Weights of the views.
        feature_voxel_size_m: Edge of the voxels that give one feature point each.
        table_height_m: Height of the table's surface in the world.
        table_margin_m: Points up to this far above the table belong to it.
        is_table_lifted: Whether feature points on the table are kept. The geometry cloud always
            keeps them.
        negative_prompts: Texts that fit anything; see `perception.similarity.relevancy`. Empty
            makes the similarity a plain cosine.
        sharpness: Steepness of the relevancy.
        prompts: Wordings that each phrase is put into; see `perception.text_scores.TextScorer`.
        num_cached_images: Images whose feature maps are remembered.
    """

    fusion: FusionConfig = field(default_factory=FusionConfig)
    lifting: LiftingConfig = field(default_factory=LiftingConfig)
    feature_voxel_size_m: float = 0.008
    table_height_m: float = 0.0
    table_margin_m: float = 0.003
    is_table_lifted: bool = False
    negative_prompts: tuple[str, ...] = DEFAULT_NEGATIVE_PROMPTS
    sharpness: float = DEFAULT_SHARPNESS
    prompts: tuple[str, ...] = PLAIN_PROMPT
    num_cached_images: int = 12

    def __post_init__(self) -> None:
        """Check the ranges."""
        if self.feature_voxel_size_m < self.fusion.voxel_size_m:
            raise InvalidConfigError(
                f"feature_voxel_size_m is {self.feature_voxel_size_m}, expected at least the "
                f"voxel_size_m of the geometry, {self.fusion.voxel_size_m}."
            )
        if self.num_cached_images < 0 or self.sharpness <= 0:
            raise InvalidConfigError(
                f"num_cached_images is {self.num_cached_images} and sharpness {self.sharpness}, "
                "expected 0 or more and more than 0."
            )


@dataclass(frozen=True, kw_only=True, eq=False)
class Percept:
    """What is known of a scene with respect to one instruction.

    Attributes:
        geometry: Fine cloud for candidates and collision checks, table included.
        features: Coarser points with features, confidence and similarity to the target phrase.
        text: Features of the whole instruction, relation included.
        target_text: Features of the target phrase alone; what `features.similarity` looks for.
        target_phrase: What the instruction asks for, as `perception.language` reads it.
    """

    geometry: GeometryCloud
    features: FeatureCloud
    text: TextFeatures
    target_text: TextFeatures
    target_phrase: str


class MultiViewLifter:
    """Turns RGB-D views into a `LiftedScene`, or views and an instruction into a `Percept`.

    The clouds of the last scene, the feature maps of the last images and the last texts are
    remembered: another question about the same views costs little more than encoding its text.
    """

    def __init__(self, encoder: Encoder, config: LifterConfig | None = None) -> None:
        """Prepare a lifter.

        Args:
            encoder: Image and text towers; see `perception.encoders.load_encoder`.
            config: Settings; the defaults if None.
        """
        self.encoder = encoder
        self.config = config or LifterConfig()
        self._maps: LruCache[Tensor] = LruCache(self.config.num_cached_images)
        self._scorer = TextScorer(
            encoder,
            negative_prompts=self.config.negative_prompts,
            sharpness=self.config.sharpness,
            prompts=self.config.prompts,
        )
        self._scenes: LruCache[tuple[GeometryCloud, FeatureCloud]] = LruCache(1)

    def lift(self, views: Sequence[CameraView]) -> LiftedScene:
        """Lift features onto the fused cloud of the views.

        Args:
            views: At least one view, under different names; their order does not matter.

        Returns:
            A scene that answers questions; another one costs only the text tower.

        Raises:
            InvalidViewError: If there is no view, or two share a name.
            EmptyCloudError: If no point is left inside the workspace.
        """
        geometry, cloud = self._scene_clouds(ordered_views(views))
        return LiftedScene(cloud=cloud, scorer=self._scorer, geometry=geometry)

    def perceive(
        self, views: Sequence[CameraView], instruction: str, *, unwanted: Sequence[str] = ()
    ) -> Percept:
        """Perceive a scene with respect to one instruction.

        Args:
            views: At least one view, under different names; their order does not matter.
            instruction: What the robot is asked to do.
            unwanted: What is not looked for, besides what the instruction itself tells by naming
                both a target and a reference; see `TextScorer.score`.

        Returns:
            The clouds and the text features.

        Raises:
            InvalidViewError: If there is no view, or two share a name.
            InvalidTextError: If the instruction holds no words, or too many.
            EmptyCloudError: If no point is left inside the workspace.
        """
        parsed = parse_instruction(instruction)
        target_phrase = parsed.target_phrase
        # Texts before images: what is wrong with them shows at once.
        target_text = self._scorer.encode(target_phrase)
        text = self._scorer.encode(instruction)
        geometry, cloud = self._scene_clouds(ordered_views(views))
        similarity = self._scorer.score(
            cloud.features, target_phrase, (*parsed.unwanted, *unwanted)
        )
        return Percept(
            geometry=geometry,
            features=replace(cloud, similarity=similarity),
            text=text,
            target_text=target_text,
            target_phrase=target_phrase,
        )

    def _scene_clouds(self, views: Sequence[CameraView]) -> tuple[GeometryCloud, FeatureCloud]:
        key = "|".join([self.encoder.fingerprint, *map(hash_view, views)])
        clouds = self._scenes.get(key)
        if clouds is None:
            clouds = self._lift_scene(views)
            self._scenes.put(key, clouds)
        return clouds

    def _lift_scene(self, views: Sequence[CameraView]) -> tuple[GeometryCloud, FeatureCloud]:
        """Return the geometry cloud, and the feature cloud with a similarity of zero."""
        geometry = fuse(views, self.config.fusion)
        points, colors, normals = self._feature_points(geometry)
        encoder = self.encoder
        lifted = lift_features(
            points,
            views,
            self._feature_maps(views),
            self.config.lifting,
            encoder.describe_cells if isinstance(encoder, CellEncoder) else None,
        )
        is_seen = lifted.confidence > 0
        if not is_seen.any():
            raise EmptyCloudError(
                f"No view agrees in depth with any of {len(points)} feature points; raise mu_m or "
                "check T_world_cam_cv."
            )
        cloud = FeatureCloud(
            points=points[is_seen],
            colors=colors[is_seen],
            normals=normals[is_seen],
            features=lifted.features[is_seen],
            confidence=lifted.confidence[is_seen],
            similarity=np.zeros(int(is_seen.sum()), np.float32),
            encoder=self.encoder.name,
        )
        return geometry, cloud

    def _feature_points(self, geometry: GeometryCloud) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Thin the geometry cloud out; return points, colours and unit normals, (N, 3) each."""
        config = self.config
        is_kept = np.ones(len(geometry), bool)
        if not config.is_table_lifted:
            is_kept = geometry.points[:, 2] > config.table_height_m + config.table_margin_m
        if not is_kept.any():
            raise EmptyCloudError(
                f"All {len(geometry)} points lie within {config.table_margin_m} m of the table; "
                "there is no object in the workspace. Set is_table_lifted to keep table points."
            )
        points, attributes, _ = voxel_means(
            geometry.points[is_kept],
            np.concatenate([geometry.colors, geometry.normals], axis=1)[is_kept],
            config.feature_voxel_size_m,
        )
        colors, normals = attributes[:, :3], attributes[:, 3:]
        norms = np.linalg.norm(normals, axis=1, keepdims=True)
        # The normals of a thin rim may cancel out; it is seen from above if from anywhere.
        normals = np.where(norms > 0.1, normals / np.maximum(norms, 0.1), [0.0, 0.0, 1.0])
        return points, colors, normals.astype(np.float32)

    def _feature_maps(self, views: Sequence[CameraView]) -> Sequence[Tensor] | Tensor:
        """Return one map a view, encoding only the images that are not remembered.

        Maps are (C, h, w) of features, or (M, h, w) of cells if the encoder is a `CellEncoder`.
        """
        keys = [f"{self.encoder.fingerprint}|{hash_image(view.rgb)}" for view in views]
        maps = {key: m for key in keys if (m := self._maps.get(key)) is not None}
        missing = {k: v.rgb for k, v in zip(keys, views, strict=True) if k not in maps}
        for shape in sorted({rgb.shape for rgb in missing.values()}):
            group = {key: rgb for key, rgb in missing.items() if rgb.shape == shape}
            encoded = self._encode(list(group.values()))
            maps.update(zip(group, encoded, strict=True))
            if list(group) == keys:
                self._remember(maps)
                return encoded  # in one piece: lifting then copies nothing
        self._remember(maps)
        return [maps[key] for key in keys]

    def _encode(self, images: Sequence[np.ndarray]) -> Tensor:
        if isinstance(self.encoder, CellEncoder):
            return self.encoder.encode_cells(images).permute(0, 3, 1, 2)
        return self.encoder.encode_dense(images).to(self.config.lifting.dtype)

    def _remember(self, maps: dict[str, Tensor]) -> None:
        for key, feature_map in maps.items():
            self._maps.put(key, feature_map)
