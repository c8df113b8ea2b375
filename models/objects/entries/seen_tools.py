"""Seen: more tools, kitchen tools, things of the desk and of the bathroom."""

from functools import partial

from models.objects.asset import Matter
from models.objects.entries.kinds import LIQUID, thing
from models.objects.entry import Entry
from models.objects.families import bottles, cleaning, cutlery, desk, hand_tools, household, tools

SEEN_TOOLS: tuple[Entry, ...] = (
    Entry(
        name="phillips_screwdriver",
        shape=partial(
            tools.screwdriver,
            length_m=0.190,
            handle_m=0.029,
            grip=(190, 36, 40),
            accent=(30, 30, 34),
            cross=True,
            seed=151,
        ),
        words=thing(
            "phillips screwdriver", "screwdriver", "cross screwdriver", colors=("red", "black")
        ),
        matter=Matter(mass_kg=0.085, source="YCB 043 scaled to this size"),
    ),
    Entry(
        name="wrench",
        shape=partial(
            hand_tools.wrench,
            length_m=0.190,
            head_m=0.052,
            thickness_m=0.013,
            grip=(40, 44, 52),
            seed=152,
        ),
        words=thing("wrench", "adjustable wrench", "spanner", colors=("gray", "black")),
        matter=Matter(density_kg_m3=2900.0, source="steel, recessed; assumed"),
    ),
    Entry(
        name="claw_hammer",
        shape=partial(
            hand_tools.claw_hammer,
            length_m=0.235,
            head_m=0.100,
            grip=(30, 90, 170),
            shaft=(206, 160, 100),
            seed=153,
        ),
        words=thing("hammer", "claw hammer", colors=("blue",)),
        matter=Matter(mass_kg=0.340, source="light household hammer; assumed"),
    ),
    Entry(
        name="padlock",
        shape=partial(
            hand_tools.padlock,
            body_m=(0.047, 0.042, 0.024),
            shackle_m=0.032,
            color=(206, 168, 72),
            words="LOCK",
            seed=154,
        ),
        words=thing("padlock", "lock", "brass padlock", colors=("yellow",)),
        matter=Matter(density_kg_m3=2900.0, source="brass body, mostly hollow; assumed"),
    ),
    Entry(
        name="wooden_spoon",
        shape=partial(
            cutlery.wooden_spoon,
            length_m=0.205,
            bowl_m=(0.060, 0.042),
            handle_m=0.012,
            wood_color=(214, 170, 112),
            seed=155,
        ),
        words=thing("spoon", "wooden spoon", "cooking spoon", colors=("brown",)),
        matter=Matter(density_kg_m3=700.0, source="beech wood"),
    ),
    Entry(
        name="fork",
        shape=partial(cutlery.fork, length_m=0.190, width_m=0.026, grip=(190, 40, 60), seed=156),
        words=thing("fork", "table fork", colors=("red",), functions=("eat",)),
        matter=Matter(mass_kg=0.034, source="published mass of YCB 030"),
    ),
    Entry(
        name="sponge",
        shape=partial(
            cleaning.sponge,
            size_m=(0.105, 0.068, 0.030),
            foam=(246, 206, 60),
            pad=(48, 120, 72),
            seed=157,
        ),
        words=thing("sponge", "kitchen sponge", colors=("yellow", "green"), functions=("clean",)),
        matter=Matter(density_kg_m3=120.0, source="damp foam; assumed"),
    ),
    Entry(
        name="telephone",
        shape=partial(
            desk.telephone,
            size_m=(0.145, 0.070, 0.010),
            frame=(32, 32, 36),
            screen=(40, 70, 130),
            seed=158,
        ),
        words=thing("phone", "smartphone", "mobile phone", colors=("black",)),
        matter=Matter(mass_kg=0.170, source="telephone of this size; assumed"),
    ),
    Entry(
        name="camera",
        shape=partial(
            desk.camera,
            size_m=(0.098, 0.034, 0.060),
            body=(52, 48, 48),
            trim=(190, 194, 200),
            seed=159,
        ),
        words=thing("camera", "photo camera", colors=("black", "gray")),
        matter=Matter(mass_kg=0.210, source="compact camera; assumed"),
    ),
    Entry(
        name="candle",
        shape=partial(
            desk.candle,
            diameter_m=0.058,
            height_m=0.075,
            wax=(244, 236, 214),
            band=(196, 60, 60),
            seed=160,
        ),
        words=thing("candle", "wax candle", colors=("white",)),
        matter=Matter(density_kg_m3=900.0, source="paraffin"),
    ),
    Entry(
        name="stapler",
        shape=partial(
            desk.stapler,
            length_m=0.130,
            width_m=0.034,
            height_m=0.052,
            color=(196, 44, 48),
            seed=161,
        ),
        words=thing("stapler", "red stapler", colors=("red",)),
        matter=Matter(density_kg_m3=1100.0, source="sheet steel and plastic; assumed"),
    ),
    Entry(
        name="black_mouse",
        shape=partial(
            household.computer_mouse, length_m=0.098, color=(52, 52, 56), wheel=(150, 152, 158)
        ),
        words=thing("black mouse", "computer mouse", "mouse", colors=("black",)),
        matter=Matter(mass_kg=0.080, source="office mouse; assumed"),
    ),
    Entry(
        name="blue_marker",
        shape=partial(
            household.marker, diameter_m=0.0175, length_m=0.138, color=(36, 80, 190), words="BOARD"
        ),
        words=thing("blue marker", "marker", "blue pen", colors=("blue",)),
        matter=Matter(mass_kg=0.017, source="YCB 040 scaled to this size"),
    ),
    Entry(
        name="mouth_rinse",
        shape=partial(
            bottles.bottle,
            width_m=0.058,
            depth_m=0.058,
            height_m=0.150,
            shoulder=0.66,
            neck_m=0.030,
            cap="screw",
            cap_color=(236, 240, 244),
            label=bottles.Label(
                title="MOUTH\nRINSE",
                subtitle="mint",
                body=(110, 210, 200),
                paper=(246, 250, 250),
                ink=(20, 110, 120),
                accent=(40, 160, 160),
                span=(0.1, 0.62),
                emblem="wave",
            ),
            squareness=3.4,
        ),
        words=thing(
            "mouth rinse",
            "mouthwash",
            "bottle of mouthwash",
            colors=("green",),
            functions=("clean",),
        ),
        matter=LIQUID,
    ),
    Entry(
        name="face_cream",
        shape=partial(
            bottles.tube,
            diameter_m=0.040,
            width_m=0.054,
            height_m=0.135,
            cap_color=(196, 200, 208),
            label=bottles.Label(
                title="FACE\nCREAM",
                subtitle="oil control",
                body=(34, 48, 96),
                paper=(34, 48, 96),
                ink=(236, 240, 246),
                accent=(120, 170, 220),
                span=(0.14, 0.84),
                emblem="circle",
            ),
        ),
        words=thing("face cream", "cream", "blue tube", colors=("blue",), functions=("clean",)),
        matter=LIQUID,
    ),
    Entry(
        name="hand_soap",
        shape=partial(
            bottles.bottle,
            width_m=0.066,
            depth_m=0.044,
            height_m=0.165,
            shoulder=0.80,
            neck_m=0.026,
            cap="pump",
            cap_color=(246, 246, 244),
            label=bottles.Label(
                title="HAND\nWASH",
                subtitle="aloe",
                body=(120, 190, 120),
                paper=(240, 248, 236),
                ink=(36, 104, 60),
                accent=(60, 150, 90),
                emblem="leaf",
            ),
            squareness=3.0,
        ),
        words=thing(
            "hand wash", "pump bottle", "soap dispenser", colors=("green",), functions=("clean",)
        ),
        matter=LIQUID,
    ),
)
