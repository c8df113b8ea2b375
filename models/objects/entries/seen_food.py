"""Seen: fruit and groceries."""

from functools import partial

from models.objects.asset import Matter
from models.objects.entry import Entry, ycb
from models.objects.families import fruit, packages
from models.objects.words import ObjectWords

SEEN_FOOD: tuple[Entry, ...] = (
    Entry(
        name="apple",
        shape=partial(
            fruit.apple,
            diameter_m=0.075,
            height_m=0.068,
            base=(206, 120, 52),
            blush=(186, 22, 30),
            blush_amount=1.15,
            seed=1,
        ),
        words=ObjectWords(
            label="apple",
            synonyms=("red apple",),
            category="fruit",
            colors=("red",),
            shapes=("round",),
            functions=("eat",),
        ),
        matter=ycb("013", 0.068),
    ),
    Entry(
        name="banana",
        shape=partial(
            fruit.banana,
            diameter_m=0.036,
            length_m=0.19,
            peel=(248, 214, 48),
            shade=(214, 172, 36),
            seed=2,
        ),
        words=ObjectWords(
            label="banana",
            synonyms=("ripe banana",),
            category="fruit",
            colors=("yellow",),
            functions=("eat",),
        ),
        matter=ycb("011", 0.066),
    ),
    Entry(
        name="strawberry",
        shape=partial(
            fruit.strawberry,
            diameter_m=0.0438,
            length_m=0.055,
            base=(206, 24, 32),
            shade=(158, 12, 24),
            seed=3,
        ),
        words=ObjectWords(
            label="strawberry",
            synonyms=("red berry",),
            category="fruit",
            colors=("red",),
            functions=("eat",),
        ),
        matter=ycb("012", 0.018),
    ),
    Entry(
        name="lemon",
        shape=partial(
            fruit.citrus,
            diameter_m=0.054,
            length_m=0.068,
            nub_m=0.01,
            peel=(248, 222, 44),
            shade=(222, 184, 24),
            seed=4,
        ),
        words=ObjectWords(
            label="lemon",
            synonyms=("yellow citrus fruit",),
            category="fruit",
            colors=("yellow",),
            functions=("eat",),
        ),
        matter=ycb("014", 0.029),
    ),
    Entry(
        name="peach",
        shape=partial(
            fruit.drupe,
            diameter_m=0.059,
            base=(246, 178, 92),
            blush=(214, 74, 58),
            blush_amount=0.8,
            fuzz=1.0,
            seed=9,
        ),
        words=ObjectWords(
            label="peach",
            synonyms=("ripe peach",),
            category="fruit",
            colors=("orange",),
            shapes=("round",),
            functions=("eat",),
        ),
        matter=ycb("015", 0.033),
    ),
    Entry(
        name="pear",
        shape=partial(
            fruit.pear,
            diameter_m=0.0662,
            height_m=0.1,
            base=(150, 184, 62),
            blush=(186, 190, 70),
            seed=10,
        ),
        words=ObjectWords(
            label="pear",
            synonyms=("green pear",),
            category="fruit",
            colors=("green",),
            functions=("eat",),
        ),
        matter=ycb("016", 0.049),
    ),
    Entry(
        name="orange",
        shape=partial(
            fruit.citrus,
            diameter_m=0.073,
            length_m=0.073,
            nub_m=0.0,
            peel=(246, 142, 26),
            shade=(222, 112, 14),
            seed=11,
        ),
        words=ObjectWords(
            label="orange",
            synonyms=("ripe orange",),
            category="fruit",
            colors=("orange",),
            shapes=("round",),
            functions=("eat",),
        ),
        matter=ycb("017", 0.047),
    ),
    Entry(
        name="plum",
        shape=partial(
            fruit.drupe,
            diameter_m=0.052,
            base=(112, 34, 72),
            blush=(62, 20, 62),
            blush_amount=0.9,
            fuzz=0.1,
            seed=12,
        ),
        words=ObjectWords(
            label="plum",
            synonyms=("purple plum",),
            category="fruit",
            colors=("purple",),
            shapes=("round",),
            functions=("eat",),
        ),
        matter=ycb("018", 0.025),
    ),
    Entry(
        name="tomato_soup_can",
        shape=partial(
            packages.can,
            diameter_m=0.066,
            height_m=0.101,
            title="TOMATO\nSOUP",
            subtitle="condensed",
            top=(190, 26, 32),
            bottom=(246, 240, 226),
            ink=(250, 246, 236),
            accent=(204, 160, 56),
            seed=5,
        ),
        words=ObjectWords(
            label="tomato soup can",
            synonyms=("soup can", "red can", "tin of tomato soup"),
            colors=("red",),
            functions=("eat",),
        ),
        matter=ycb("005", 0.349),
    ),
    Entry(
        name="box",
        shape=partial(
            packages.carton,
            size_m=(0.072, 0.045, 0.125),
            title="CRACKERS",
            subtitle="crisp & salted",
            ground=(196, 34, 36),
            ink=(250, 244, 230),
            accent=(240, 190, 60),
            picture="rays",
            seed=8,
        ),
        words=ObjectWords(
            label="box",
            synonyms=("cracker box", "red box", "carton"),
            colors=("red",),
            functions=("eat",),
        ),
        matter=Matter(
            density_kg_m3=240.0, source="crackers loosely packed, about a quarter of water; assumed"
        ),
    ),
)
