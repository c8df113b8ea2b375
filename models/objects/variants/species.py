"""Species of four-legged toy animals, as data."""

from dataclasses import dataclass
from typing import Any, Literal

from models.objects.families.animals import Animal
from models.objects.families.ornaments import Ornament
from models.objects.paint import Color


@dataclass(frozen=True, kw_only=True)
class Species:
    """What makes a four-legged animal recognisable.

    Attributes:
        noun: "giraffe".
        animal: Proportions; lengths in fractions of the trunk, of which `body_m` is typical.
        coats: Natural colours of coat and marks.
        pattern: See `models.objects.families.animals.quadruped`.
        crest: The same.
        trunk: The same.
        extra: The same.
    """

    noun: str
    animal: Animal
    coats: tuple[tuple[Color, Color], ...]
    pattern: Literal["plain", "spots", "stripes", "patches"] = "plain"
    crest: Literal["none", "mane", "ridge"] = "none"
    trunk: bool = False
    extra: Ornament = "none"


_CAT_HEAD: dict[str, Any] = {"neck": (0.18, 0.22), "head": (0.16, 0.14, 0.14), "snout": 0.09}
_SHORT: dict[str, Any] = {"girth": 0.28, "leg": 0.46, "leg_radius": 0.105, "neck_radius": 0.16}
SPECIES: tuple[Species, ...] = (
    Species(
        noun="lion",
        animal=Animal(body_m=0.082),
        coats=(((222, 164, 80), (120, 70, 30)), ((206, 150, 92), (110, 62, 30))),
        crest="mane",
    ),
    Species(
        noun="elephant",
        animal=Animal(
            body_m=0.080,
            girth=0.3,
            leg=0.5,
            leg_radius=0.12,
            neck=(0.22, 0.2),
            neck_radius=0.17,
            head=(0.19, 0.18, 0.2),
            tail=0.34,
        ),
        coats=(((128, 136, 148), (92, 98, 108)), ((160, 164, 170), (110, 112, 120))),
        trunk=True,
    ),
    Species(
        noun="giraffe",
        animal=Animal(
            body_m=0.060,
            girth=0.26,
            leg=0.8,
            neck=(0.26, 0.95),
            neck_radius=0.14,
            head=(0.19, 0.13, 0.13),
            snout=0.16,
            ear=0.07,
            tail=0.5,
        ),
        coats=(((240, 196, 92), (146, 84, 34)), ((246, 208, 120), (120, 66, 30))),
        pattern="spots",
    ),
    Species(
        noun="zebra",
        animal=Animal(body_m=0.078, leg=0.58, neck=(0.22, 0.36), head=(0.19, 0.12, 0.13)),
        coats=(((240, 240, 236), (28, 28, 30)), ((232, 228, 216), (48, 40, 36))),
        pattern="stripes",
        crest="ridge",
    ),
    Species(
        noun="tiger",
        animal=Animal(body_m=0.086, leg=0.48, tail=0.5, **_CAT_HEAD),
        coats=(((232, 140, 44), (34, 30, 30)), ((240, 150, 60), (48, 34, 28))),
        pattern="stripes",
    ),
    Species(
        noun="leopard",
        animal=Animal(body_m=0.084, girth=0.21, leg=0.48, tail=0.52, **_CAT_HEAD),
        coats=(((236, 190, 92), (60, 40, 26)), ((228, 200, 130), (50, 38, 30))),
        pattern="spots",
    ),
    Species(
        noun="horse",
        animal=Animal(
            body_m=0.078, leg=0.66, neck=(0.24, 0.42), head=(0.20, 0.11, 0.12), snout=0.16, tail=0.5
        ),
        coats=(
            ((126, 78, 44), (40, 30, 26)),
            ((236, 234, 228), (150, 150, 150)),
            ((52, 46, 46), (30, 28, 30)),
        ),
        crest="ridge",
    ),
    Species(
        noun="cow",
        animal=Animal(body_m=0.086, girth=0.29, leg=0.50, neck=(0.22, 0.20), snout=0.15),
        coats=(((240, 238, 232), (36, 34, 34)), ((238, 230, 216), (130, 78, 44))),
        pattern="patches",
        extra="horns",
    ),
    Species(
        noun="deer",
        animal=Animal(
            body_m=0.070, girth=0.21, leg=0.68, neck=(0.20, 0.42), head=(0.16, 0.11, 0.11), tail=0.2
        ),
        coats=(((168, 112, 62), (104, 66, 38)), ((186, 130, 76), (120, 80, 46))),
        extra="antlers",
    ),
    Species(
        noun="rhino",
        animal=Animal(body_m=0.088, neck=(0.24, 0.12), head=(0.21, 0.15, 0.15), tail=0.3, **_SHORT),
        coats=(((132, 136, 142), (96, 98, 104)), ((152, 146, 140), (110, 104, 98))),
        extra="nose_horn",
    ),
    Species(
        noun="camel",
        animal=Animal(body_m=0.076, leg=0.70, neck=(0.30, 0.46), head=(0.17, 0.11, 0.12)),
        coats=(((206, 160, 98), (140, 98, 56)), ((188, 140, 84), (122, 84, 48))),
        extra="hump",
    ),
    Species(
        noun="dog",
        animal=Animal(body_m=0.070, girth=0.22, leg=0.50, neck=(0.16, 0.28), ear=0.085, tail=0.34),
        coats=(((150, 98, 56), (90, 56, 32)), ((238, 236, 230), (34, 32, 32))),
        pattern="patches",
    ),
    Species(
        noun="pig",
        animal=Animal(body_m=0.076, neck=(0.20, 0.10), head=(0.16, 0.15, 0.15), tail=0.2, **_SHORT),
        coats=(((240, 168, 176), (206, 120, 132)), ((246, 188, 192), (216, 140, 148))),
    ),
    Species(
        noun="hippo",
        animal=Animal(
            body_m=0.080,
            girth=0.32,
            leg=0.44,
            leg_radius=0.125,
            neck=(0.26, 0.06),
            neck_radius=0.14,
            head=(0.19, 0.17, 0.17),
            snout=0.21,
            ear=0.05,
            tail=0.22,
        ),
        coats=(((150, 112, 150), (110, 80, 112)), ((134, 128, 138), (96, 90, 100))),
    ),
    Species(
        noun="bear",
        animal=Animal(body_m=0.080, neck=(0.20, 0.20), head=(0.17, 0.15, 0.15), tail=0.1, **_SHORT),
        coats=(
            ((112, 70, 40), (70, 44, 28)),
            ((240, 240, 236), (190, 190, 188)),
            ((44, 40, 42), (28, 26, 28)),
        ),
    ),
    Species(
        noun="dinosaur",
        animal=Animal(
            body_m=0.086, girth=0.26, leg=0.44, neck=(0.28, 0.10), head=(0.17, 0.10, 0.10), ear=0.02
        ),
        coats=(((84, 146, 72), (58, 100, 52)), ((126, 130, 76), (90, 92, 50))),
        extra="plates",
    ),
)
