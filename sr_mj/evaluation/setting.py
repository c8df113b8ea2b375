"""What all episodes of an evaluation share."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

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
        scene_makers: By kind of random scene, what makes it instead of `sr_mj.scene.make_scene`: a
            function of a module, so that other processes find it. Lines of results name it.
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
    scene_makers: Mapping[str, SceneMaker] = field(default_factory=dict)

    def choice(self, label: str) -> PolicyChoice:
        """Return the policy with a label."""
        return next(choice for choice in self.policies if choice.label == label)

    def encoder_for(self, label: str) -> str:
        """Return the encoder that a policy looks through."""
        return BLANK if self.choice(label).name in BLIND_POLICIES else self.encoder


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
