"""What all episodes of an evaluation share, and how a line of results proves that it does."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import policy
from models.arrangements.arrangement import to_record
from models.arrangements.library import load_arrangement
from sr_mj.errors import ConfigError
from sr_mj.evaluation.plan import Episode, PolicyChoice

if TYPE_CHECKING:
    from policy.base import Policy
    from sr_mj.scene import Scene

BLANK = "blank"
"""Name of the encoder that sees nothing."""

BLIND_POLICIES = ("oracle", "random")
"""Policies that do not look at features, so that no network has to compute them."""

PRIVILEGED_POLICIES = ("oracle",)
"""Policies that read ground truth."""

SceneMaker = Callable[[Episode], "Scene"]


@dataclass(frozen=True, kw_only=True)
class Setting:
    """What the workers need to know, apart from the episode.

    Attributes:
        policies: All policies that run.
        encoder: Name of the image and text encoder.
        encoder_fingerprint: Hash of it.
        encoder_fingerprints: Those that stand for the same features, its own among them.
        generator: Where grasps come from.
        cameras: Camera preset.
        attempts: Grasps that may be tried.
        keep_unreachable: Leave what cannot be reached to the policy.
        allow_download: Whether missing weights of the encoder may be fetched.
        pictures: Folder for pictures, None for none.
        picture_seeds: Seeds whose episodes are pictured.
        versions: Of all packages that results depend on.
        revision: Of the code.
        make_random_scene: Makes random scenes instead of `sr_mj.scene.make_scene`; a function of a
            module, so that other processes find it.
    """

    policies: tuple[PolicyChoice, ...]
    encoder: str = "embedded"
    encoder_fingerprint: str = ""
    encoder_fingerprints: tuple[str, ...] = ()
    generator: str = "antipodal"
    cameras: str = "sr"
    attempts: int = 8
    keep_unreachable: bool = False
    allow_download: bool = False
    pictures: Path | None = None
    picture_seeds: tuple[int, ...] = ()
    versions: dict[str, str] | None = None
    revision: str | None = None
    make_random_scene: SceneMaker | None = None

    def choice(self, label: str) -> PolicyChoice:
        """Return the policy with a label."""
        return next(choice for choice in self.policies if choice.label == label)

    def encoder_for(self, label: str) -> str:
        """Return the encoder that a policy looks through."""
        return BLANK if self.choice(label).name in BLIND_POLICIES else self.encoder


def weights_hash(choice: PolicyChoice) -> str | None:
    """Hash the weights of a policy.

    Args:
        choice: The policy.

    Returns:
        SHA-256 of its checkpoint, or of the one shipped under its name; None if it has none.
    """
    shipped = Path(policy.__file__).parent / "weights" / f"{choice.name.replace('-', '_')}"
    path = choice.checkpoint or shipped.with_suffix(".safetensors")
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else None


def load_choice(choice: PolicyChoice, encoder_fingerprints: tuple[str, ...]) -> "Policy":
    """Load a policy, which refuses features of another encoder than it was trained with.

    Args:
        choice: Any policy but one that reads the scene.
        encoder_fingerprints: Of the encoder in use.

    Returns:
        The policy.

    Raises:
        PolicyError: If its weights are missing, damaged, or were trained on other features.
    """
    from policy.registry import load_policy

    return load_policy(choice.name, checkpoint=choice.checkpoint, encoder=encoder_fingerprints)


class Identity:
    """Says what an episode's result depends on; the same for equal inputs.

    Args:
        setting: What all episodes share.
    """

    def __init__(self, setting: Setting) -> None:
        """Hash the policies' weights once."""
        self._setting = setting
        self._weights = {choice.label: weights_hash(choice) for choice in setting.policies}
        self._arrangements: dict[str, str] = {}

    def of(self, episode: Episode) -> dict[str, Any]:
        """Return names, hashes and settings as plain JSON values."""
        setting, choice = self._setting, self._setting.choice(episode.policy)
        encoder = setting.encoder_for(episode.policy)
        return {
            "privileged": choice.name in PRIVILEGED_POLICIES,
            "weights_sha256": self._weights[episode.policy],
            "encoder": encoder,
            "encoder_fingerprint": encoder if encoder == BLANK else setting.encoder_fingerprint,
            "arrangement_sha256": self._arrangement(episode),
            "generator": setting.generator,
            "cameras": setting.cameras,
            "max_attempts": setting.attempts,
            "keep_unreachable": setting.keep_unreachable,
        }

    def check(self, episode: Episode, record: dict[str, Any]) -> None:
        """Refuse an earlier result that was made with something else.

        Args:
            episode: What is to be run.
            record: The earlier result of the same episode.

        Raises:
            ConfigError: If an entry differs.
        """
        for name, expected in self.of(episode).items():
            if record.get(name) != expected:
                raise ConfigError(
                    f"The results to resume have {name} {record.get(name)!r} in episode "
                    f"{episode.key}, this run has {expected!r}; use the same options and files, "
                    "or a new --out."
                )

    def _arrangement(self, episode: Episode) -> str | None:
        if not episode.is_arranged:
            return None
        name = episode.scene
        if name not in self._arrangements:
            self._arrangements[name] = to_record(load_arrangement(name))["sha256"]
        return self._arrangements[name]
