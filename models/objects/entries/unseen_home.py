"""Unseen: tableware, tools and things of house and desk."""

from functools import partial

from models.objects.asset import Matter
from models.objects.entry import Entry, ycb
from models.objects.families import containers, household, tools
from models.objects.words import ObjectWords

UNSEEN_HOME: tuple[Entry, ...] = (
    Entry(
        name="black_marker",
        shape=partial(
            household.marker, diameter_m=0.018, length_m=0.121, color=(34, 34, 38), words="MARKER"
        ),
        words=ObjectWords(
            label="black marker", synonyms=("black pen", "black felt pen"), colors=("black",)
        ),
        matter=ycb("040", 0.0158),
    ),
    Entry(
        name="red_marker",
        shape=partial(
            household.marker,
            diameter_m=0.02,
            length_m=0.135,
            color=(206, 28, 34),
            words="PERMANENT",
        ),
        words=ObjectWords(
            label="red marker", synonyms=("red pen", "red felt pen"), colors=("red",)
        ),
        matter=Matter(mass_kg=0.019, source="YCB 040 scaled to this size"),
    ),
    Entry(
        name="remote_controller",
        shape=partial(
            household.remote_control, size_m=(0.165, 0.046, 0.02), color=(42, 42, 46), seed=34
        ),
        words=ObjectWords(
            label="remote controller", synonyms=("remote control", "tv remote"), colors=("black",)
        ),
        matter=Matter(mass_kg=0.11, source="with two AAA cells; assumed"),
    ),
    Entry(
        name="small_clamp",
        shape=partial(
            tools.clamp,
            length_m=0.085,
            width_m=0.065,
            thickness_m=0.012,
            body=(36, 36, 40),
            tip=(236, 120, 30),
        ),
        words=ObjectWords(
            label="small clamp", synonyms=("clamp", "spring clamp"), colors=("black",)
        ),
        matter=ycb("049", 0.0192),
    ),
    Entry(
        name="two_color_hammer",
        shape=partial(
            tools.mallet,
            length_m=0.22,
            head_m=(0.036, 0.088),
            faces=((206, 34, 34), (240, 196, 40)),
            seed=35,
        ),
        words=ObjectWords(
            label="two color hammer",
            synonyms=("hammer", "mallet", "red and yellow hammer"),
            colors=("red", "yellow"),
        ),
        matter=Matter(density_kg_m3=950.0, source="rubber head, wooden handle; assumed"),
    ),
    Entry(
        name="soap_dish",
        shape=partial(
            household.soap_dish,
            size_m=(0.112, 0.074, 0.026),
            wall_m=0.004,
            color=(236, 176, 190),
            groove=(196, 120, 140),
            seed=36,
        ),
        words=ObjectWords(
            label="soap dish",
            synonyms=("pink dish", "soap holder"),
            category="container",
            colors=("pink",),
            functions=("hold other things",),
        ),
        matter=Matter(density_kg_m3=1050.0, source="polystyrene"),
    ),
    Entry(
        name="yellow_bowl",
        shape=partial(
            containers.bowl,
            diameter_m=0.14,
            height_m=0.056,
            foot_m=0.066,
            wall_m=0.004,
            outside=(244, 204, 36),
            inside=(250, 226, 110),
            rim=(214, 166, 20),
            seed=37,
        ),
        words=ObjectWords(
            label="yellow bowl",
            synonyms=("yellow dish",),
            category="container",
            colors=("yellow",),
            functions=("hold other things",),
        ),
        matter=Matter(density_kg_m3=1000.0, source="melamine and air bubbles; assumed"),
    ),
    Entry(
        name="yellow_cup",
        shape=partial(
            containers.cup,
            top_m=0.072,
            bottom_m=0.058,
            height_m=0.08,
            wall_m=0.0035,
            outside=(246, 200, 32),
            inside=(250, 236, 190),
            stripe=(222, 120, 24),
            seed=38,
        ),
        words=ObjectWords(
            label="yellow cup",
            synonyms=("yellow tumbler", "yellow beaker"),
            category="container",
            colors=("yellow",),
            functions=("drink", "hold other things"),
        ),
        matter=Matter(density_kg_m3=1050.0, source="polystyrene"),
    ),
    Entry(
        name="green_tub",
        shape=partial(
            containers.cup,
            top_m=0.11,
            bottom_m=0.092,
            height_m=0.045,
            wall_m=0.004,
            outside=(52, 150, 84),
            inside=(120, 196, 140),
            stripe=(226, 240, 228),
            squareness=6.0,
            aspect=0.66,
            seed=39,
        ),
        words=ObjectWords(
            label=None,
            synonyms=("green tub", "plastic tub", "lunch box"),
            category="container",
            colors=("green",),
            functions=("hold other things",),
        ),
        matter=Matter(density_kg_m3=920.0, source="polypropylene"),
    ),
    Entry(
        name="steel_tin",
        shape=partial(
            containers.cup,
            top_m=0.068,
            bottom_m=0.068,
            height_m=0.062,
            wall_m=0.0035,
            outside=(158, 162, 168),
            inside=(192, 196, 202),
            stripe=(120, 124, 130),
            seed=40,
        ),
        words=ObjectWords(
            label=None,
            synonyms=("open tin", "metal tin", "empty can"),
            category="container",
            colors=("gray",),
            functions=("hold other things",),
        ),
        matter=Matter(mass_kg=0.07, source="open steel can; assumed"),
    ),
)
