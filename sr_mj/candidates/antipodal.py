"""The default generator: a geometric sampler of antipodal grasps with six degrees of freedom.

Seeds spread over the surface -> orientations from the surface around them -> strips scanned for
gaps beside the object -> contact patches -> swept collision checks -> a spread-out choice.
"""

from dataclasses import dataclass, replace

import numpy as np

from perception.cloud import GeometryCloud
from policy.actions import ActionCandidates
from sr_mj.candidates.collision import hits_points, swept_boxes, table_clearance
from sr_mj.candidates.config import AntipodalConfig, Relaxation
from sr_mj.candidates.contacts import Contacts, find_contacts
from sr_mj.candidates.flat import flat_without_candidate
from sr_mj.candidates.frames import Hypotheses, choose_orientations
from sr_mj.candidates.ranking import (
    best_per_group,
    chance_of_two,
    grasp_prior,
    select_spread,
)
from sr_mj.candidates.strips import FingerPlacements, depth_hypotheses, place_fingers, scan_strips
from sr_mj.candidates.surface import ObjectSurface, choose_seeds, extract_surface, thin
from sr_mj.candidates.threads import single_threaded

_COARSE_M = 0.009
# Rounding of the fingertips' height over the table.
_ROUNDING_M = 1e-4
# Depth of engagement at which a placement is as good as it gets; only orders placements.
_FULL_ENGAGEMENT_M = 0.03
# Approaches within 8 degrees of the vertical.
_DOWN = -0.99


@dataclass(frozen=True, kw_only=True)
class _Search:
    """What all passes over a cloud share."""

    surface: ObjectSurface
    origins: np.ndarray
    pairs: Hypotheses
    profiles: np.ndarray
    shift_m: np.ndarray


class AntipodalSampler:
    """Proposes collision-free antipodal grasps on a fused cloud; a `CandidateGenerator`.

    Attributes:
        config: The settings.
    """

    def __init__(self, config: AntipodalConfig | None = None) -> None:
        """Keep the settings.

        Args:
            config: Settings; the defaults if None.
        """
        self.config = AntipodalConfig() if config is None else config

    def pick(self, cloud: GeometryCloud, rng: np.random.Generator) -> ActionCandidates:
        """Propose grasps.

        `width_m` is the distance between the two contacts. The poses are free of collision for a
        gripper opened to `approach_opening(width_m)`, on a straight approach of `pregrasp_m`.

        Args:
            cloud: Fused cloud in world coordinates with the table at z = 0. Points of the table
                are ignored, so they may be present or not.
            rng: Spreads the seeds; the same state gives the same bytes.

        Returns:
            At most `max_candidates` grasps, best prior first; none is a normal result.
        """
        surface = extract_surface(cloud.points, cloud.normals, self.config, cloud.colors)
        seeds = choose_seeds(surface.points, self.config, rng)
        candidates = _no_candidates()
        if len(seeds):
            with single_threaded():
                search = self._search(surface, seeds)
                for limits in self.config.passes:
                    candidates = self._finish(search, limits)
                    if len(candidates):
                        break
                candidates = self._add_flat(search, candidates)
        return candidates

    def approach_opening(self, width_m: np.ndarray) -> np.ndarray:
        """Say how wide the gripper opens for the approach.

        Args:
            width_m: (K,) contact widths of candidates, metres.

        Returns:
            (K,) distances between the pads, metres.
        """
        return np.minimum(width_m + self.config.extra_opening_m, self.config.gripper.max_width_m)

    def _search(self, surface: ObjectSurface, seeds: np.ndarray) -> _Search:
        """Scan the strips around the seeds under all orientations that make sense."""
        origins = surface.points[seeds]
        pairs = choose_orientations(surface.points, surface.normals, seeds, self.config)
        coarse = thin(surface.obstacles, self.config.scan_voxel_m)
        profiles, shift_m = scan_strips(coarse, origins, pairs)
        return _Search(
            surface=surface, origins=origins, pairs=pairs, profiles=profiles, shift_m=shift_m
        )

    def _add_flat(self, search: _Search, candidates: ActionCandidates) -> ActionCandidates:
        """Add grasps of flat things that got none."""
        config = self.config
        if config.flat is None:
            return candidates
        is_flat = flat_without_candidate(
            search.surface.points, search.origins, candidates.positions, config.flat_height_m
        )
        if not is_flat.any():
            return candidates
        both = _joined(candidates, self._finish(search, config.flat, is_flat))
        return both.take(select_spread(both.Ts_world_tool, both.prior, config))

    def _place(
        self, search: _Search, limits: Relaxation, is_wanted: np.ndarray | None
    ) -> FingerPlacements:
        """Find all places around the wanted seeds where an object fits between the fingers."""
        config = replace(self.config, min_tip_height_m=limits.min_tip_height_m)
        pairs = search.pairs
        wanted = np.arange(len(pairs.seed))
        if is_wanted is not None:
            # What is flat is held from above: a tilted finger does not get down beside it.
            is_down = pairs.rotations[:, 2, 2] < _DOWN
            wanted = np.flatnonzero(is_wanted[pairs.seed] & is_down[pairs.orientation])
        seed, rotation = pairs.seed[wanted], pairs.rotations[pairs.orientation[wanted]]
        row, depth_m = depth_hypotheses(search.origins[seed, 2], rotation, config)
        return place_fingers(
            seed[row],
            rotation[row],
            depth_m,
            search.profiles[wanted[row]],
            search.shift_m[wanted[row]],
            config,
        )

    def _finish(
        self, search: _Search, limits: Relaxation, is_wanted: np.ndarray | None = None
    ) -> ActionCandidates:
        """Find candidates under the thresholds of one pass, at all seeds or at those wanted."""
        config = self.config
        placements = self._promising(self._place(search, limits, is_wanted), limits)
        contacts = find_contacts(placements, search.origins, search.surface, config)
        poses = self._tool_poses(search.origins, placements, contacts)
        stroke = config.gripper.max_width_m
        prior = grasp_prior(contacts, placements.engagement_m, poses[:, 2, 2], stroke)
        low, high = swept_boxes(self.approach_opening(contacts.width_m), config)
        is_good = prior >= limits.min_prior
        is_good &= contacts.alignment.min(axis=1) > limits.min_alignment
        is_good &= contacts.opposition < limits.max_opposition
        is_good &= contacts.width_m < stroke
        is_good &= chance_of_two(contacts) <= config.max_chance_of_two
        is_good &= table_clearance(poses, low, high) > limits.min_tip_height_m - _ROUNDING_M

        low, high = low - limits.clearance_m, high + limits.clearance_m
        rows = np.flatnonzero(is_good)
        obstacles = search.surface.obstacles
        rows = rows[~hits_points(poses[rows], low[rows], high[rows], thin(obstacles, _COARSE_M))]
        rows = rows[best_per_group(prior[rows], placements.seed[rows], config.max_survivors)]
        rows = rows[~hits_points(poses[rows], low[rows], high[rows], obstacles)]
        rows = rows[select_spread(poses[rows], prior[rows], config)]
        return ActionCandidates(
            kind="pick",
            Ts_world_tool=poses[rows],
            width_m=contacts.width_m[rows],
            prior=prior[rows],
        )

    def _promising(self, placements: FingerPlacements, limits: Relaxation) -> FingerPlacements:
        """Choose the placements worth a closer look, fairly over the seeds."""
        alignment = placements.alignment.min(axis=1)
        is_sound = alignment > limits.min_alignment
        is_sound &= placements.opposition < limits.max_opposition
        engagement = np.minimum(placements.engagement_m / _FULL_ENGAGEMENT_M, 1) ** 0.35
        score = alignment * engagement * (0.6 - 0.4 * placements.rotation[:, 2, 2])
        rows = np.flatnonzero(is_sound)
        best = best_per_group(score[rows], placements.seed[rows], self.config.max_placements)
        return placements.take(rows[best])

    def _tool_poses(
        self, origins: np.ndarray, placements: FingerPlacements, contacts: Contacts
    ) -> np.ndarray:
        """Poses (H, 4, 4) of the tool: centred between the contacts, fingertips at their depth."""
        poses = np.zeros((len(placements.seed), 4, 4))
        poses[:, :3, :3] = placements.rotation
        depth_m = placements.depth_m - self.config.gripper.tip_below_tool_m
        shift = contacts.center_m[:, None] * poses[:, :3, 0] + depth_m[:, None] * poses[:, :3, 2]
        poses[:, :3, 3] = origins[placements.seed] + shift
        poses[:, 3, 3] = 1
        return poses


def _no_candidates() -> ActionCandidates:
    return ActionCandidates(
        kind="pick", Ts_world_tool=np.zeros((0, 4, 4)), width_m=np.zeros(0), prior=np.zeros(0)
    )


def _joined(first: ActionCandidates, second: ActionCandidates) -> ActionCandidates:
    return ActionCandidates(
        kind="pick",
        Ts_world_tool=np.concatenate([first.Ts_world_tool, second.Ts_world_tool]),
        width_m=np.concatenate([first.width_m, second.width_m]),
        prior=np.concatenate([first.prior, second.prior]),
    )
