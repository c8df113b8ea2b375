"""Seen: tableware, tools and things of house and desk."""

from functools import partial

from models.objects.asset import Matter
from models.objects.entry import Entry, ycb
from models.objects.families import containers, household, tools
from models.objects.words import ObjectWords

SEEN_HOME: tuple[Entry, ...] = (
    Entry(
        name="red_bowl",
        shape=partial(
            containers.bowl,
            diameter_m=0.159,
            height_m=0.053,
            foot_m=0.08,
            wall_m=0.004,
            outside=(184, 26, 30),
            inside=(206, 38, 38),
            rim=(150, 16, 22),
            seed=6,
        ),
        words=ObjectWords(
            label="red bowl",
            synonyms=("bowl", "red dish"),
            category="container",
            colors=("red",),
            functions=("hold other things",),
        ),
        matter=ycb("024", 0.147),
    ),
    Entry(
        name="red_mug",
        shape=partial(
            containers.mug,
            diameter_m=0.08,
            height_m=0.082,
            wall_m=0.004,
            handle_m=0.037,
            outside=(190, 24, 30),
            inside=(236, 230, 220),
            band=(150, 14, 22),
            seed=7,
        ),
        words=ObjectWords(
            label="red mug",
            synonyms=("mug", "coffee mug"),
            category="cup",
            colors=("red",),
            functions=("drink", "hold other things"),
        ),
        matter=ycb("025", 0.118),
    ),
    Entry(
        name="cup",
        shape=partial(
            containers.cup,
            top_m=0.074,
            bottom_m=0.052,
            height_m=0.088,
            wall_m=0.0035,
            outside=(36, 96, 190),
            inside=(212, 222, 236),
            stripe=(240, 240, 236),
            seed=13,
        ),
        words=ObjectWords(
            label="cup",
            synonyms=("blue cup", "tumbler", "beaker"),
            category="cup",
            colors=("blue",),
            functions=("drink", "hold other things"),
        ),
        matter=Matter(density_kg_m3=1050.0, source="polystyrene"),
    ),
    Entry(
        name="power_drill",
        shape=partial(
            tools.power_drill,
            length_m=0.184,
            height_m=0.187,
            body=(232, 112, 26),
            trim=(40, 40, 42),
            words="DRILL",
        ),
        words=ObjectWords(
            label="power drill", synonyms=("drill", "cordless drill"), colors=("orange",)
        ),
        matter=ycb("035", 0.895),
    ),
    Entry(
        name="scissors",
        shape=partial(tools.scissors, length_m=0.2, width_m=0.087, handle=(30, 104, 186), seed=14),
        words=ObjectWords(label="scissors", synonyms=("pair of scissors",), colors=("blue",)),
        matter=ycb("037", 0.082),
    ),
    Entry(
        name="knife",
        shape=partial(
            tools.knife, length_m=0.215, handle=(86, 52, 34), rivet=(206, 190, 140), seed=15
        ),
        words=ObjectWords(label="knife", synonyms=("kitchen knife",)),
        matter=Matter(mass_kg=0.075, source="small kitchen knife; assumed"),
    ),
    Entry(
        name="flat_screwdriver",
        shape=partial(
            tools.screwdriver,
            length_m=0.215,
            handle_m=0.031,
            grip=(226, 178, 24),
            accent=(34, 34, 36),
            seed=16,
        ),
        words=ObjectWords(
            label="flat screwdriver",
            synonyms=("screwdriver", "slotted screwdriver"),
            colors=("yellow",),
        ),
        matter=ycb("044", 0.0984),
    ),
    Entry(
        name="white_mouse",
        shape=partial(
            household.computer_mouse, length_m=0.105, color=(238, 238, 236), wheel=(70, 72, 76)
        ),
        words=ObjectWords(
            label="white mouse", synonyms=("computer mouse", "mouse"), colors=("white",)
        ),
        matter=Matter(mass_kg=0.085, source="office mouse; assumed"),
    ),
    Entry(
        name="tape",
        shape=partial(
            household.tape_roll,
            outer_m=0.072,
            inner_m=0.046,
            width_m=0.024,
            tape=(46, 110, 196),
            core=(196, 160, 112),
            seed=17,
        ),
        words=ObjectWords(
            label="tape", synonyms=("roll of tape", "adhesive tape"), colors=("blue",)
        ),
        matter=Matter(density_kg_m3=950.0, source="polypropylene film; assumed"),
    ),
    Entry(
        name="soap",
        shape=partial(
            household.soap,
            size_m=(0.085, 0.055, 0.028),
            color=(172, 212, 160),
            words="SOAP",
            seed=18,
        ),
        words=ObjectWords(
            label="soap",
            synonyms=("bar of soap", "green soap"),
            colors=("green",),
            functions=("clean",),
        ),
        matter=Matter(density_kg_m3=1050.0, source="toilet soap; assumed"),
    ),
)
