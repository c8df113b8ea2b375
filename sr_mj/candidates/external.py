"""Grasps proposed elsewhere: read from a file, or asked of a local HTTP service.

Both speak the layout of GraspNet, 17 numbers a grasp: score, width, height, depth, the rotation row
by row, translation, object id. The frame is that of graspnetAPI (`Grasp` and `plot_gripper_pro_max`
in github.com/graspnet/graspnetAPI): x is the approach, y the closing direction; the translation is
a point on the object, and the fingertips reach `depth` beyond it along the approach.
"""

import io
import json
import urllib.error
import urllib.request
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from models.gripper_geometry import GripperGeometry
from perception.cloud import GeometryCloud
from policy.actions import ActionCandidates
from sr_mj.candidates.antipodal import AntipodalSampler
from sr_mj.candidates.collision import hits_points, swept_boxes, table_clearance
from sr_mj.candidates.config import AntipodalConfig
from sr_mj.candidates.generator import CandidateGenerator
from sr_mj.candidates.ranking import select_spread
from sr_mj.candidates.surface import extract_surface
from sr_mj.errors import ConfigError, SrMjError

GRASP_LENGTH = 17
_DEPTH, _ROTATION, _TRANSLATION = 3, slice(4, 13), slice(13, 16)
# Networks answer in half precision at times.
_ROTATION_TOLERANCE = 0.02
_FILE, _HTTP = "file:", ("http://", "https://")
_NAMES = "antipodal, file:PATH or http://HOST:PORT/PATH"


class GraspServiceError(SrMjError, ConnectionError):
    """A grasp service does not answer, or answers nonsense."""


@dataclass(frozen=True, kw_only=True)
class ExternalConfig:
    """What is done with grasps from elsewhere.

    Attributes:
        checks: Gripper, clearances and limits, those of the sampler: what collides with cloud or
            table or is wider than the stroke is refused, near-duplicates are suppressed.
        timeout_s: Longest wait for a service, seconds.

    Raises:
        ConfigError: If the time limit is not positive.
    """

    checks: AntipodalConfig = field(default_factory=AntipodalConfig)
    timeout_s: float = 10.0

    def __post_init__(self) -> None:
        """Check the range."""
        if not self.timeout_s > 0:
            raise ConfigError(
                f"ExternalConfig: timeout_s is {self.timeout_s}, expected more than 0."
            )


def tool_poses(grasps: np.ndarray, gripper: GripperGeometry) -> np.ndarray:
    """Convert grasps to poses of the tool.

    The tool frame has z along the approach, x along the closing direction, and its origin midway
    between the pads, `tip_below_tool_m` behind the fingertips.

    Args:
        grasps: (K, 17) grasps in some frame.
        gripper: The gripper.

    Returns:
        (K, 4, 4) poses of the tool in the same frame; rotations are made exactly orthonormal.
    """
    rotation = grasps[:, _ROTATION].reshape(-1, 3, 3)
    left, _, right = np.linalg.svd(rotation)
    # (approach, closing, side) -> (closing, side, approach): a cyclic change keeps the handedness.
    rotation = (left @ right)[:, :, [1, 2, 0]]
    poses = np.tile(np.eye(4), (len(grasps), 1, 1))
    poses[:, :3, :3] = rotation
    reach = grasps[:, [_DEPTH]] - gripper.tip_below_tool_m
    poses[:, :3, 3] = grasps[:, _TRANSLATION] + reach * rotation[:, :, 2]
    return poses


class ExternalGenerator:
    """Checks and ranks grasps that something else proposes; a `CandidateGenerator`.

    Args:
        fetch: Returns grasps (K, 17) for a cloud and the pose (4, 4) of their frame in the world.
        config: Checks and limits.
    """

    def __init__(
        self,
        fetch: Callable[[GeometryCloud], tuple[np.ndarray, np.ndarray]],
        config: ExternalConfig | None = None,
    ) -> None:
        """Keep the source and the settings."""
        self.config = config or ExternalConfig()
        self._fetch = fetch

    def pick(self, cloud: GeometryCloud, rng: np.random.Generator) -> ActionCandidates:
        """Fetch grasps and keep those that the gripper can carry out.

        Args:
            cloud: Fused cloud in world coordinates with the table at z = 0.
            rng: Unused; what proposes the grasps has its own randomness.

        Returns:
            At most `max_candidates` grasps, best first. `prior` is the score, divided by the
            largest one where that is over 1.

        Raises:
            ConfigError: If a file cannot be read as grasps.
            GraspServiceError: If a service does not answer with grasps.
        """
        grasps, T_world_frame = self._fetch(cloud)
        checks = self.config.checks
        poses = T_world_frame @ tool_poses(grasps, checks.gripper)
        score, width_m = grasps[:, 0], grasps[:, 1]
        prior = (score / max(score.max(initial=1.0), 1.0)).clip(0, 1)
        opening = np.minimum(width_m + checks.extra_opening_m, checks.gripper.max_width_m)
        low, high = swept_boxes(opening, checks)
        is_good = (width_m > 0) & (width_m < checks.gripper.max_width_m)
        is_good &= table_clearance(poses, low, high) > checks.min_tip_height_m
        rows = np.flatnonzero(is_good)
        obstacles = extract_surface(cloud.points, cloud.normals, checks).obstacles
        low, high = low - checks.clearance_m, high + checks.clearance_m
        rows = rows[~hits_points(poses[rows], low[rows], high[rows], obstacles)]
        rows = rows[select_spread(poses[rows], prior[rows], checks)]
        return ActionCandidates(
            kind="pick", Ts_world_tool=poses[rows], width_m=width_m[rows], prior=prior[rows]
        )


def file_generator(path: Path | str, config: ExternalConfig | None = None) -> ExternalGenerator:
    """Read grasps from a file at every look, so that another program may rewrite it.

    Args:
        path: `.npy` with (K, 17) grasps in world coordinates; `.npz` with `grasps` and, if they
            are in another frame, its pose `T_world_frame` (4, 4); or `.json` with the same names.
        config: Checks and limits.

    Returns:
        The generator.
    """
    path = Path(path)

    def fetch(_: GeometryCloud) -> tuple[np.ndarray, np.ndarray]:
        try:
            content = path.read_bytes()
        except OSError as error:
            raise ConfigError(
                f"Grasp file {str(path)!r} cannot be read: {error.strerror}; give an .npy, .npz "
                "or .json file."
            ) from error
        try:
            return parse_grasps(content)
        except ValueError as error:
            raise ConfigError(f"Grasp file {str(path)!r}: {error}") from error

    return ExternalGenerator(fetch, config)


def http_generator(url: str, config: ExternalConfig | None = None) -> ExternalGenerator:
    """Ask a service for grasps at every look.

    The cloud is sent as the body of a POST: an `.npz` with `points`, `colors` and `normals`, (N, 3)
    float32 each, in world coordinates. The answer is what `file_generator` reads.

    Args:
        url: Where the service listens.
        config: Checks and limits.

    Returns:
        The generator.
    """
    config = config or ExternalConfig()

    def fetch(cloud: GeometryCloud) -> tuple[np.ndarray, np.ndarray]:
        body = io.BytesIO()
        np.savez(body, points=cloud.points, colors=cloud.colors, normals=cloud.normals)
        headers = {"Content-Type": "application/octet-stream"}
        try:
            request = urllib.request.Request(url, data=body.getvalue(), headers=headers)
            with urllib.request.urlopen(request, timeout=config.timeout_s) as response:
                content = response.read()
        except urllib.error.HTTPError as error:
            raise GraspServiceError(
                f"Grasp service {url} answered with status {error.code}, expected 200; see its log."
            ) from error
        except (OSError, ValueError) as error:
            cause = getattr(error, "reason", error)
            raise GraspServiceError(
                f"Grasp service {url} does not answer within {config.timeout_s:g} s ({cause}); "
                "start it, or check the address."
            ) from error
        try:
            return parse_grasps(content)
        except ValueError as error:
            raise GraspServiceError(f"Grasp service {url}: {error}") from error

    return ExternalGenerator(fetch, config)


def parse_grasps(content: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read grasps from the bytes of an `.npy`, `.npz` or JSON document.

    Args:
        content: The document.

    Returns:
        (K, 17) float64 grasps, and the pose (4, 4) of their frame in the world, the identity if
        the document gives none.

    Raises:
        ValueError: If it is not a document of grasps; one line.
    """
    document = _decode(content)
    if not isinstance(document, dict):
        document = {"grasps": document}
    if "grasps" not in document:
        raise ValueError(f"got the names {', '.join(document) or 'none'}, expected 'grasps'.")
    try:
        grasps = np.asarray(document["grasps"], np.float64)
        pose = np.asarray(document.get("T_world_frame", np.eye(4)), np.float64)
    except (TypeError, ValueError):
        raise ValueError("got something else than numbers, expected K rows of 17.") from None
    if grasps.size == 0:
        grasps = grasps.reshape(0, GRASP_LENGTH)
    if grasps.ndim != 2 or grasps.shape[1] != GRASP_LENGTH:
        raise ValueError(f"got grasps of shape {grasps.shape}, expected (K, {GRASP_LENGTH}).")
    if not np.isfinite(grasps).all():
        raise ValueError("got grasps with NaN or infinity, expected finite numbers.")
    _check_rotations("grasps", grasps[:, _ROTATION].reshape(-1, 3, 3))
    if pose.shape != (4, 4) or not np.isfinite(pose).all():
        raise ValueError(f"got T_world_frame of shape {pose.shape}, expected a pose (4, 4).")
    _check_rotations("T_world_frame", pose[None, :3, :3])
    return grasps, pose


def _decode(content: bytes) -> Any:
    if content[:6] == b"\x93NUMPY" or content[:2] == b"PK":
        try:
            loaded = np.load(io.BytesIO(content), allow_pickle=False)
            return loaded if isinstance(loaded, np.ndarray) else dict(loaded)
        except Exception as error:
            raise ValueError(f"got a broken .npy or .npz document ({error}).") from None
    try:
        return json.loads(content)
    except ValueError:
        raise ValueError(f"got {len(content)} bytes that are no .npy, .npz or JSON.") from None


def _check_rotations(name: str, rotations: np.ndarray) -> None:
    error = np.abs(rotations @ rotations.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    bad = np.flatnonzero((error > _ROTATION_TOLERANCE) | (np.linalg.det(rotations) < 0))
    if len(bad):
        raise ValueError(
            f"{name}: the rotation of row {bad[0]} is none, expected an orthonormal matrix with "
            "determinant 1, row by row."
        )


def check_generator_name(name: str) -> None:
    """Refuse what `load_generator` would not know.

    Args:
        name: Name of a generator.

    Raises:
        ConfigError: If there is no such generator.
    """
    is_file = name.startswith(_FILE) and len(name) > len(_FILE)
    if name != "antipodal" and not is_file and not name.startswith(_HTTP):
        raise ConfigError(f"Unknown generator {name!r}. Generators: {_NAMES}.")


def load_generator(name: str, config: ExternalConfig | None = None) -> CandidateGenerator:
    """Make a generator of grasps by name.

    Args:
        name: `antipodal`, `file:PATH`, or the `http://` address of a service.
        config: Checks and limits; the sampler uses `checks`.

    Returns:
        The generator.

    Raises:
        ConfigError: If there is no such generator.
    """
    check_generator_name(name)
    config = config or ExternalConfig()
    if name == "antipodal":
        return AntipodalSampler(config.checks)
    if name.startswith(_FILE):
        return file_generator(name.removeprefix(_FILE), config)
    return http_generator(name, config)
