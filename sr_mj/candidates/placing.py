"""The default place generator: on and in things, beside them, and on the free table.

Segments of the cloud -> places over their middle and on a grid of the table -> the held object let
down there at several headings -> what carries it, what is in the way -> a spread-out choice.
"""

from dataclasses import dataclass

import numpy as np

from perception.cloud import GeometryCloud
from policy.actions import ActionCandidates
from sr_mj.candidates.held import HeldObject
from sr_mj.candidates.place_columns import columns_of, gripper_columns
from sr_mj.candidates.place_config import PlaceConfig
from sr_mj.candidates.place_fit import Fits, Load, fit_on_table, fit_on_things
from sr_mj.candidates.place_heights import HeightMap, height_map
from sr_mj.candidates.place_ranking import beside_prior, choose_spread, inside_prior
from sr_mj.candidates.place_references import (
    Reference,
    core_places,
    edge_distances,
    find_references,
)
from sr_mj.candidates.surface import extract_surface

# On the free table nothing says where; such places rank behind those that something does.
_TABLE_PRIOR = 0.5
# Headings at one place in a core count as one if they are closer than this.
_CORE_SPREAD = 0.5


@dataclass(frozen=True, kw_only=True, eq=False)
class _View:
    """What all relations share."""

    references: tuple[Reference, ...]
    heights: HeightMap
    bounds: np.ndarray
    load: Load


class SurfacePlacer:
    """Proposes places for what the gripper holds; a `PlaceGenerator`.

    The object keeps the tilt at which it was grasped and is turned about the vertical. It comes
    straight down and is let go a little above what carries it, higher where the gripper would
    touch something.

    Attributes:
        config: The settings.
    """

    def __init__(self, config: PlaceConfig | None = None) -> None:
        """Keep the settings.

        Args:
            config: Settings; the defaults if None.
        """
        self.config = PlaceConfig() if config is None else config

    def place(
        self, cloud: GeometryCloud, held: HeldObject, rng: np.random.Generator
    ) -> ActionCandidates:
        """Propose places.

        `width_m` is the opening around the held object. The poses are free of collision for the
        object and for a gripper that opens to `release_opening`, on a straight vertical descent.

        Args:
            cloud: Fused cloud in world coordinates without the held object, the table at z = 0.
                Its bounds bound the workspace, so that points of the table should be present,
                unless the settings bound it.
            held: What the gripper holds.
            rng: Shifts the grid of places; the same state gives the same bytes.

        Returns:
            At most `max_candidates` places, best prior first; none is a normal result.
        """
        shift = rng.uniform(0, self.config.grid_m, 2)
        if not len(cloud):
            return _candidates(np.zeros((0, 4, 4)), np.zeros(0), held)
        view = self._view(cloud, held)
        poses, prior = self._inside(view, held)
        more_poses, more_prior = self._on_table(view, held, shift)
        poses, prior = np.concatenate([poses, more_poses]), np.concatenate([prior, more_prior])
        order = np.argsort(-prior, kind="stable")[: self.config.max_candidates]
        return _candidates(poses[order], prior[order], held)

    def release_opening(self, width_m: float) -> float:
        """Say how wide the gripper opens at the release, metres.

        Args:
            width_m: Opening around the held object, metres.
        """
        grasping = self.config.grasping
        return min(width_m + grasping.extra_opening_m, grasping.gripper.max_width_m)

    def _view(self, cloud: GeometryCloud, held: HeldObject) -> _View:
        config = self.config
        surface = extract_surface(cloud.points, cloud.normals, config.grasping)
        rotation = held.T_world_tool[:3, :3]
        opening_m = self.release_opening(held.width_m)
        points = held.points_tool @ rotation.T.astype(np.float32)
        load = Load(
            held=columns_of(points, config.column_m),
            gripper=gripper_columns(rotation, opening_m, config.grasping, config.column_m),
            low_m=-held.drop_m,
        )
        low = config.workspace_min or cloud.points[:, :2].min(axis=0)
        high = config.workspace_max or cloud.points[:, :2].max(axis=0)
        bounds = np.array([low, high], float)
        return _View(
            references=find_references(surface, config),
            heights=height_map(surface.points, bounds, config.cell_m),
            bounds=bounds,
            load=load,
        )

    def _inside(self, view: _View, held: HeldObject) -> tuple[np.ndarray, np.ndarray]:
        """Poses and priors on and in every reference that is large enough."""
        config = self.config
        hosts = [r for r in view.references if r.side_m >= config.min_side_m]
        cores = [core_places(host, config.num_core) for host in hosts]
        places = np.concatenate([np.zeros((0, 2)), *cores])
        owner = np.repeat(np.arange(len(hosts)), [len(core) for core in cores])
        centers = np.array([host.center for host in hosts]).reshape(-1, 2)
        half_core_m = np.array([host.side_m for host in hosts]) / 6

        fits = fit_on_things(places, view.load, view.heights, config)
        mine = owner[fits.place]
        off_center = np.linalg.norm(places[fits.place] - centers[mine], axis=1)
        prior = inside_prior(fits, off_center / half_core_m[mine])
        of_host = prior * (mine == np.arange(len(hosts))[:, None])
        spread_m = np.minimum(half_core_m * _CORE_SPREAD, config.spread_m)
        rows = self._choose(fits, places, of_host, spread_m, config.num_inside)
        return self._poses(fits.take(rows), held), prior[rows]

    def _on_table(
        self, view: _View, held: HeldObject, shift: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Poses and priors beside every reference, and wherever the table is free."""
        config = self.config
        axes = [
            np.arange(low + offset, high, config.grid_m)
            for low, high, offset in zip(*view.bounds, shift, strict=True)
        ]
        places = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
        fits = fit_on_table(places, view.load, view.heights, view.bounds, config)
        distance = edge_distances(view.references, places)[:, fits.place]
        prior = beside_prior(fits, distance, config)
        prior *= (distance >= config.ring_m[0]) & (distance <= config.ring_m[1])
        middle = np.full((1, len(fits)), np.mean(config.ring_m))
        anywhere = _TABLE_PRIOR * beside_prior(fits, middle, config)
        spread_m = np.full(len(prior), config.spread_m)
        rows = np.union1d(
            self._choose(fits, places, prior, spread_m, config.num_beside),
            self._choose(fits, places, anywhere, np.array([config.spread_m]), config.num_table),
        )
        best = np.concatenate([prior, anywhere]).max(axis=0)
        return self._poses(fits.take(rows), held), best[rows]

    def _choose(
        self, fits: Fits, places: np.ndarray, prior: np.ndarray, spread_m: np.ndarray, limit: int
    ) -> np.ndarray:
        """Rows of the fits that are chosen under any of several ratings (R, H)."""
        xy, yaw = places[fits.place], self.config.yaws[fits.yaw]
        chosen = [
            choose_spread(xy, yaw, row, distance_m, limit)
            for row, distance_m in zip(prior, spread_m, strict=True)
        ]
        return np.unique(np.concatenate([np.zeros(0, np.int64), *chosen]))

    def _poses(self, fits: Fits, held: HeldObject) -> np.ndarray:
        """Poses (H, 4, 4) of the tool at the release."""
        yaw = self.config.yaws[fits.yaw]
        poses = np.zeros((len(fits), 4, 4))
        turn = np.zeros((len(fits), 3, 3))
        turn[:, 0, 0] = turn[:, 1, 1] = np.cos(yaw)
        turn[:, 1, 0], turn[:, 0, 1] = np.sin(yaw), -np.sin(yaw)
        turn[:, 2, 2] = 1
        poses[:, :3, :3] = turn @ held.T_world_tool[:3, :3]
        poses[:, :3, 3] = fits.tool
        poses[:, 3, 3] = 1
        return poses


def _candidates(poses: np.ndarray, prior: np.ndarray, held: HeldObject) -> ActionCandidates:
    return ActionCandidates(
        kind="place",
        Ts_world_tool=poses,
        width_m=np.full(len(poses), held.width_m),
        prior=prior,
    )
