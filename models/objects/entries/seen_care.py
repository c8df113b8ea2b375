"""Seen: bottles, tubes and cartons of the bathroom."""

from functools import partial

from models.objects.asset import Matter
from models.objects.entry import Entry
from models.objects.families import bottles, packages
from models.objects.words import ObjectWords

SEEN_CARE: tuple[Entry, ...] = (
    Entry(
        name="dabao_sod",
        shape=partial(
            bottles.bottle,
            width_m=0.052,
            depth_m=0.036,
            height_m=0.13,
            shoulder=0.8,
            neck_m=0.024,
            cap="screw",
            cap_color=(30, 120, 60),
            label=bottles.Label(
                title="DABAO\nSOD",
                subtitle="moisturising milk",
                body=(246, 244, 232),
                paper=(234, 214, 60),
                ink=(22, 96, 48),
                accent=(30, 120, 60),
                emblem="leaf",
            ),
            squareness=3.0,
        ),
        words=ObjectWords(
            label="dabao sod", synonyms=("dabao sod bottle", "lotion bottle"), colors=("white",)
        ),
        matter=Matter(
            density_kg_m3=950.0, source="filled with a water-based product, with head room; assumed"
        ),
    ),
    Entry(
        name="dabao_facewash",
        shape=partial(
            bottles.tube,
            diameter_m=0.044,
            width_m=0.056,
            height_m=0.15,
            cap_color=(240, 240, 240),
            label=bottles.Label(
                title="DABAO\nface wash",
                subtitle="deep cleansing",
                body=(64, 170, 190),
                paper=(64, 170, 190),
                ink=(250, 250, 250),
                accent=(232, 246, 248),
                span=(0.1, 0.86),
                emblem="drop",
            ),
        ),
        words=ObjectWords(
            label="dabao facewash",
            synonyms=("face wash", "facial cleanser", "tube of face wash"),
            colors=("blue",),
            functions=("clean",),
        ),
        matter=Matter(
            density_kg_m3=950.0, source="filled with a water-based product, with head room; assumed"
        ),
    ),
    Entry(
        name="pantene",
        shape=partial(
            bottles.bottle,
            width_m=0.064,
            depth_m=0.04,
            height_m=0.19,
            shoulder=0.84,
            neck_m=0.034,
            cap="flip",
            cap_color=(196, 160, 84),
            label=bottles.Label(
                title="PANTENE",
                subtitle="shampoo",
                body=(246, 244, 240),
                paper=(246, 244, 240),
                ink=(152, 112, 40),
                accent=(204, 168, 92),
                span=(0.12, 0.78),
                emblem="circle",
            ),
            squareness=2.4,
            waist=0.05,
        ),
        words=ObjectWords(
            label="pantene",
            synonyms=("pantene bottle", "pantene shampoo"),
            colors=("white",),
            functions=("clean",),
        ),
        matter=Matter(
            density_kg_m3=950.0, source="filled with a water-based product, with head room; assumed"
        ),
    ),
    Entry(
        name="thera_med",
        shape=partial(
            bottles.tube,
            diameter_m=0.046,
            width_m=0.05,
            height_m=0.165,
            cap_color=(232, 40, 44),
            label=bottles.Label(
                title="THERA\nMED",
                subtitle="2 in 1",
                body=(206, 30, 36),
                paper=(24, 62, 150),
                ink=(250, 250, 250),
                accent=(250, 250, 250),
                span=(0.12, 0.8),
                emblem="wave",
            ),
        ),
        words=ObjectWords(
            label="thera med",
            synonyms=("thera med toothpaste", "red tube"),
            colors=("red",),
            functions=("clean",),
        ),
        matter=Matter(
            density_kg_m3=950.0, source="filled with a water-based product, with head room; assumed"
        ),
    ),
    Entry(
        name="dove",
        shape=partial(
            bottles.bottle,
            width_m=0.068,
            depth_m=0.044,
            height_m=0.175,
            shoulder=0.72,
            neck_m=0.03,
            cap="flip",
            cap_color=(28, 60, 126),
            label=bottles.Label(
                title="DOVE",
                subtitle="body wash",
                body=(240, 242, 246),
                paper=(220, 230, 244),
                ink=(28, 60, 126),
                accent=(206, 172, 90),
                span=(0.16, 0.66),
                emblem="wave",
            ),
            squareness=2.0,
        ),
        words=ObjectWords(
            label="dove",
            synonyms=("dove bottle", "dove body wash"),
            colors=("white",),
            functions=("clean",),
        ),
        matter=Matter(
            density_kg_m3=950.0, source="filled with a water-based product, with head room; assumed"
        ),
    ),
    Entry(
        name="head_shoulders_care",
        shape=partial(
            bottles.bottle,
            width_m=0.06,
            depth_m=0.038,
            height_m=0.195,
            shoulder=0.88,
            neck_m=0.036,
            cap="flip",
            cap_color=(240, 242, 244),
            label=bottles.Label(
                title="HEAD\nSHOULDERS",
                subtitle="care",
                body=(28, 92, 186),
                paper=(242, 246, 250),
                ink=(22, 58, 140),
                accent=(90, 180, 226),
                span=(0.1, 0.8),
                emblem="wave",
            ),
            squareness=3.2,
        ),
        words=ObjectWords(
            label="head shoulders care",
            synonyms=("head shoulders shampoo", "head shoulders bottle"),
            colors=("blue",),
            functions=("clean",),
        ),
        matter=Matter(
            density_kg_m3=950.0, source="filled with a water-based product, with head room; assumed"
        ),
    ),
    Entry(
        name="toothpaste",
        shape=partial(
            bottles.tube,
            diameter_m=0.034,
            width_m=0.05,
            height_m=0.15,
            cap_color=(240, 240, 240),
            label=bottles.Label(
                title="TOOTH\nPASTE",
                subtitle="fresh mint",
                body=(240, 246, 244),
                paper=(20, 150, 120),
                ink=(255, 255, 255),
                accent=(220, 50, 50),
                span=(0.14, 0.84),
                emblem="wave",
            ),
        ),
        words=ObjectWords(
            label="toothpaste",
            synonyms=("tube of toothpaste", "toothpaste tube"),
            colors=("green",),
            functions=("clean",),
        ),
        matter=Matter(
            density_kg_m3=950.0, source="filled with a water-based product, with head room; assumed"
        ),
    ),
    Entry(
        name="darlie_box",
        shape=partial(
            packages.carton,
            size_m=(0.165, 0.036, 0.044),
            title="DARLIE",
            subtitle="toothpaste",
            ground=(244, 206, 36),
            ink=(24, 24, 28),
            accent=(28, 128, 70),
            picture="band",
            seed=19,
        ),
        words=ObjectWords(
            label="darlie box",
            synonyms=("darlie toothpaste box", "yellow box", "box"),
            colors=("yellow",),
        ),
        matter=Matter(density_kg_m3=650.0, source="a tube of paste in a carton; assumed"),
    ),
    Entry(
        name="soap_box",
        shape=partial(
            packages.carton,
            size_m=(0.094, 0.034, 0.060),
            title="SOAP",
            subtitle="olive",
            ground=(238, 240, 226),
            ink=(58, 96, 50),
            accent=(150, 190, 120),
            picture="disc",
            seed=100,
        ),
        words=ObjectWords(
            label="box",
            synonyms=("soap box", "soap carton", "white box"),
            colors=("white",),
        ),
        matter=Matter(density_kg_m3=600.0, source="a bar of soap in a carton; assumed"),
    ),
)
