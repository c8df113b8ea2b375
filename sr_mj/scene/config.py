"""What a scene is made from: the registry of kinds of scene, and the configuration of one."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from models.arrangements.arrangement import Arrangement
from models.arrangements.library import arrangement_names, load_arrangement, summary
from models.cameras import camera_preset
from models.workspace import (
    GRASP_WORKSPACE,
    PICK_PLACE_WORKSPACE,
    PICK_ZONE,
    PLACE_ZONE,
    Workspace,
)
from sr_mj.errors import ConfigError, UnknownNameError, unknown_name_message

Split = Literal["seen", "unseen"]
SPLITS: tuple[Split, ...] = ("seen", "unseen")


@dataclass(frozen=True, kw_only=True)
class SceneKind:
    """How many objects of a scene are arranged, and how.

    Attributes:
        num_heaped: Objects dropped one after another into one region, so that they stack.
        num_spread: Objects set down apart from each other.
        workspace: Box that the objects must stay in and that perception looks at.
        pick_zone: Part of it from which a goal to pick and place takes things; None for all of it.
        place_zone: Part of it into which such a goal puts them.
        heap_center: x, y about which heaped objects drop, metres.
        heap_half_m: Half width of the square in which they drop.
        spread_lower: Smallest x, y of the centres of spread objects.
        spread_upper: Largest x, y of the centres of spread objects.
        min_spacing_m: Least distance between the centres of spread objects.
        description: One line for people.
    """

    description: str
    num_heaped: int = 0
    num_spread: int = 0
    workspace: Workspace = GRASP_WORKSPACE
    pick_zone: Workspace | None = None
    place_zone: Workspace | None = None
    heap_center: tuple[float, float] = (0.5, 0.0)
    heap_half_m: float = 0.13
    spread_lower: tuple[float, float] = (0.33, -0.17)
    spread_upper: tuple[float, float] = (0.67, 0.17)
    min_spacing_m: float = 0.1

    @property
    def num_objects(self) -> int:
        """Number of objects in the scene."""
        return self.num_heaped + self.num_spread


SCENE_KINDS: dict[str, SceneKind] = {
    "cluttered15": SceneKind(num_heaped=15, description="15 objects dropped at random, stacked"),
    "place8": SceneKind(num_spread=8, description="8 objects set apart, centres 0.1 m or more"),
    "pickplace8": SceneKind(
        num_heaped=5,
        num_spread=3,
        workspace=PICK_PLACE_WORKSPACE,
        pick_zone=PICK_ZONE,
        place_zone=PLACE_ZONE,
        heap_center=(0.5, -0.17),
        heap_half_m=0.09,
        spread_lower=(0.33, 0.10),
        spread_upper=(0.67, 0.26),
        description="5 objects heaped in the grasp zone (y < 0), 3 set apart in the place zone",
    ),
    "heavy30": SceneKind(num_heaped=30, description="30 objects dropped at random, stacked"),
    "single": SceneKind(num_heaped=1, heap_half_m=0.08, description="one object alone"),
    "empty": SceneKind(description="robot, table and bin without objects"),
}


@dataclass(frozen=True, kw_only=True)
class SceneConfig:
    """One scene, completely determined: the same configuration gives the same bytes.

    Attributes:
        scene: Kind of scene, one of `SCENE_KINDS`; that of the arrangement if there is one.
        split: Which part of the catalogue the objects come from; that of the arrangement if there
            is one. Without meaning for imported objects, which have no splits.
        seed: Draws the objects, how they fall, and the goal. An arrangement fixes all three.
        goal: The instruction; drawn from the protocol's templates, or the arrangement's, when None.
        objects: Names of catalogue objects to use instead of drawing them; as many as the scene
            has, or none.
        cameras: Camera preset, one of `models.cameras.CAMERA_PRESETS`.
        arrangement: A fixed arrangement, or the name of one in `models.arrangements.library`;
            objects, poses, targets and goal are then its own.
        catalogue: Folder of imported objects to use instead of the built-in catalogue.

    Raises:
        UnknownNameError: If scene, split, cameras or arrangement do not exist.
        ConfigError: If the seed is negative, the goal is blank, or objects are named besides an
            arrangement.
    """

    scene: str = "cluttered15"
    split: Split = "seen"
    seed: int = 0
    goal: str | None = None
    objects: tuple[str, ...] = ()
    cameras: str = "sr"
    arrangement: Arrangement | str | None = None
    catalogue: Path | None = None

    def __post_init__(self) -> None:
        """Check names and values; take scene and split from the arrangement."""
        if self.arrangement is not None:
            self._adopt(self.arrangement)
        if self.scene not in SCENE_KINDS:
            raise UnknownNameError(unknown_name_message("scene", self.scene, SCENE_KINDS))
        if self.split not in SPLITS:
            raise UnknownNameError(unknown_name_message("split", self.split, SPLITS))
        camera_preset(self.cameras)
        if self.seed < 0:
            raise ConfigError(f"Seed is {self.seed}; expected an integer of 0 or more.")
        if self.goal is not None and not self.goal.strip():
            raise ConfigError("The goal is blank; say what to grasp, or leave the goal out.")

    def _adopt(self, arrangement: Arrangement | str) -> None:
        if self.objects:
            raise ConfigError("An arrangement brings its own objects; name one or the other.")
        if isinstance(arrangement, str):
            arrangement = load_arrangement(arrangement)
        for field in ("scene", "split"):
            object.__setattr__(self, field, getattr(arrangement, field))
        object.__setattr__(self, "arrangement", arrangement)

    @property
    def arranged(self) -> Arrangement | None:
        """The arrangement itself, if there is one."""
        assert not isinstance(self.arrangement, str)
        return self.arrangement

    @property
    def kind(self) -> SceneKind:
        """The scene's entry in the registry."""
        return SCENE_KINDS[self.scene]

    @property
    def title(self) -> str:
        """What to call the scene: kind, split and seed, or the arrangement's name."""
        if self.arranged is not None:
            return self.arranged.name
        return f"{self.scene} ({self.split}, seed {self.seed})"


def scene_config(scene: str, **options: Any) -> SceneConfig:
    """Configure a scene by the name of its kind or of an arrangement.

    Args:
        scene: One of `SCENE_KINDS` or of `arrangement_names()`.
        options: Further attributes of `SceneConfig`.

    Returns:
        The configuration.

    Raises:
        UnknownNameError: If no scene and no arrangement has that name.
        ConfigError: As `SceneConfig`.
    """
    if scene in SCENE_KINDS:
        return SceneConfig(scene=scene, **options)
    if scene in arrangement_names():
        return SceneConfig(arrangement=scene, **options)
    known = (*SCENE_KINDS, *arrangement_names())
    message = unknown_name_message("scene", scene, known)
    raise UnknownNameError(message.replace(", ".join(arrangement_names()), summary()))
