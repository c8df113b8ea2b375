"""Unseen: things of kinds, shapes and colours that no seen object has."""

from functools import partial

from models.objects.asset import Matter
from models.objects.entries.kinds import DRINK, GLAZED, MOULDED, PLASTIC, thing, toy
from models.objects.entry import Entry
from models.objects.families import (
    animals,
    cleaning,
    containers,
    cutlery,
    desk,
    figures,
    fruit,
    games,
    groceries,
    hand_tools,
    vehicles,
)
from models.objects.families.animals import Animal

UNSEEN_MORE: tuple[Entry, ...] = (
    Entry(
        name="lime",
        shape=partial(
            fruit.citrus,
            diameter_m=0.050,
            length_m=0.058,
            nub_m=0.005,
            peel=(104, 160, 44),
            shade=(64, 120, 30),
            seed=201,
        ),
        words=thing("lime", "green fruit", category="fruit", colors=("green",), functions=("eat",)),
        matter=Matter(density_kg_m3=900.0, source="citrus fruit; assumed"),
    ),
    Entry(
        name="cola_can",
        shape=partial(
            groceries.drink_can,
            diameter_m=0.058,
            height_m=0.132,
            title="CHERRY COLA",
            color=(196, 24, 40),
            swoosh=(246, 246, 244),
            seed=202,
        ),
        words=thing("cola can", "cola", "can of cola", colors=("red",), functions=("drink",)),
        matter=DRINK,
    ),
    Entry(
        name="coffee_jar",
        shape=partial(
            groceries.jar,
            diameter_m=0.070,
            height_m=0.110,
            content=(74, 44, 28),
            lid=(40, 40, 44),
            paper=(214, 178, 120),
            title="COFFEE",
            seed=203,
        ),
        words=thing(
            "coffee jar", "jar of coffee", "instant coffee", colors=("brown",), functions=("drink",)
        ),
        matter=Matter(density_kg_m3=600.0, source="instant coffee in glass; assumed"),
    ),
    Entry(
        name="white_mug",
        shape=partial(
            containers.mug,
            diameter_m=0.084,
            height_m=0.072,
            wall_m=0.0045,
            handle_m=0.032,
            outside=(240, 240, 236),
            inside=(250, 250, 248),
            band=(40, 40, 48),
            seed=204,
        ),
        words=thing(
            "white mug",
            "mug",
            "coffee mug",
            category="container",
            colors=("white",),
            functions=("drink", "hold other things"),
        ),
        matter=GLAZED,
    ),
    Entry(
        name="calculator",
        shape=partial(
            desk.calculator,
            size_m=(0.128, 0.074, 0.014),
            color=(96, 100, 110),
            key=(222, 222, 216),
            seed=205,
        ),
        words=thing("calculator", "pocket calculator", colors=("gray",)),
        matter=Matter(mass_kg=0.110, source="pocket calculator; assumed"),
    ),
    Entry(
        name="glasses_case",
        shape=partial(
            desk.glasses_case,
            size_m=(0.155, 0.060, 0.040),
            color=(120, 72, 44),
            lining=(222, 190, 140),
            seed=206,
        ),
        words=thing("glasses case", "spectacle case", "leather case", colors=("brown",)),
        matter=Matter(density_kg_m3=320.0, source="hollow case with glasses; assumed"),
    ),
    Entry(
        name="pliers",
        shape=partial(
            hand_tools.pliers, length_m=0.165, width_m=0.052, grip=(206, 40, 34), seed=207
        ),
        words=thing("pliers", "pair of pliers", "red pliers", colors=("red",)),
        matter=Matter(mass_kg=0.125, source="light combination pliers; assumed"),
    ),
    Entry(
        name="spatula",
        shape=partial(
            cutlery.turner,
            length_m=0.245,
            blade_m=(0.080, 0.062),
            grip=(48, 48, 52),
            blade=(70, 72, 78),
            seed=208,
        ),
        words=thing("spatula", "kitchen turner", colors=("black",)),
        matter=Matter(mass_kg=0.0515, source="published mass of YCB 033"),
    ),
    Entry(
        name="scrub_brush",
        shape=partial(
            cleaning.brush,
            length_m=0.185,
            head_m=(0.085, 0.050),
            height_m=0.045,
            back=(190, 140, 86),
            bristle=(226, 214, 180),
            seed=209,
        ),
        words=thing(
            "brush", "scrubbing brush", "dish brush", colors=("brown",), functions=("clean",)
        ),
        matter=Matter(density_kg_m3=500.0, source="beech wood and bristles; assumed"),
    ),
    Entry(
        name="foam_die",
        shape=partial(
            games.die, edge_m=0.048, color=(60, 160, 170), pips=(250, 250, 246), seed=210
        ),
        words=toy("die", "dice", "large die", colors=("blue",)),
        matter=Matter(density_kg_m3=200.0, source="dense foam; assumed"),
    ),
    Entry(
        name="toy_bus",
        shape=partial(
            vehicles.car,
            kind="bus",
            size_m=(0.120, 0.044, 0.056),
            color=(246, 190, 30),
            stripe=(34, 34, 38),
            words="SCHOOL",
            seed=211,
        ),
        words=toy("toy bus", "school bus", "yellow bus", colors=("yellow",)),
        matter=PLASTIC,
    ),
    Entry(
        name="toy_pig",
        shape=partial(
            animals.quadruped,
            animal=Animal(
                body_m=0.080,
                girth=0.31,
                leg=0.40,
                leg_radius=0.095,
                neck=(0.22, 0.08),
                neck_radius=0.135,
                head=(0.17, 0.17, 0.17),
                snout=0.15,
                muzzle=0.50,
                nose=0.46,
                ear=0.075,
                tail=0.16,
            ),
            coat=(240, 160, 172),
            marks=(214, 116, 136),
            nose_color=(222, 112, 136),
            seed=212,
        ),
        words=toy("toy pig", "pig", "pink pig", colors=("pink",)),
        matter=MOULDED,
    ),
    Entry(
        name="toy_bear",
        shape=partial(
            figures.sitting_animal,
            height_m=0.088,
            fur=(196, 150, 92),
            face=(238, 214, 170),
            ear=(0.34, 0.80),
            head=0.29,
            seed=213,
        ),
        words=toy("toy bear", "teddy bear", "bear", colors=("brown",)),
        matter=MOULDED,
    ),
)
