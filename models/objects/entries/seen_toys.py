"""Seen: toys."""

from functools import partial

from models.objects.asset import Matter
from models.objects.entry import Entry, ycb
from models.objects.families import animals, toys
from models.objects.families.animals import Animal
from models.objects.words import ObjectWords

SEEN_TOYS: tuple[Entry, ...] = (
    Entry(
        name="racquetball",
        shape=partial(
            toys.ball,
            diameter_m=0.0553,
            color=(38, 74, 168),
            seam=(28, 52, 124),
            words="PRO",
            seed=20,
        ),
        words=ObjectWords(
            label="racquetball",
            synonyms=("blue ball", "rubber ball"),
            category="toy",
            colors=("blue",),
            shapes=("round",),
            functions=("play",),
        ),
        matter=ycb("057", 0.041),
    ),
    Entry(
        name="toy_airplane",
        shape=partial(
            toys.airplane,
            length_m=0.17,
            span_m=0.15,
            body=(222, 52, 44),
            wing=(246, 204, 52),
            seed=21,
        ),
        words=ObjectWords(
            label="toy airplane",
            synonyms=("toy plane", "airplane", "toy aeroplane"),
            category="toy",
            colors=("red", "yellow"),
            functions=("play",),
        ),
        matter=Matter(density_kg_m3=600.0, source="moulded plastic, partly hollow; assumed"),
    ),
    Entry(
        name="lion",
        shape=partial(
            animals.quadruped,
            animal=Animal(body_m=0.085),
            coat=(222, 164, 80),
            marks=(120, 70, 30),
            crest="mane",
            crest_color=(132, 72, 28),
            seed=22,
        ),
        words=ObjectWords(
            label="lion",
            synonyms=("toy lion", "lion figure"),
            category="toy",
            colors=("brown",),
            functions=("play",),
        ),
        matter=Matter(density_kg_m3=800.0, source="moulded plastic animal; assumed"),
    ),
    Entry(
        name="toy_elephant",
        shape=partial(
            animals.quadruped,
            animal=Animal(
                body_m=0.085,
                girth=0.3,
                leg=0.5,
                leg_radius=0.12,
                neck=(0.22, 0.2),
                neck_radius=0.17,
                head=(0.19, 0.18, 0.2),
                tail=0.34,
            ),
            coat=(128, 136, 148),
            marks=(92, 98, 108),
            trunk=True,
            seed=23,
        ),
        words=ObjectWords(
            label=None,
            synonyms=("toy elephant", "elephant"),
            category="toy",
            colors=("gray",),
            functions=("play",),
        ),
        matter=Matter(density_kg_m3=800.0, source="moulded plastic animal; assumed"),
    ),
    Entry(
        name="toy_giraffe",
        shape=partial(
            animals.quadruped,
            animal=Animal(
                body_m=0.062,
                girth=0.26,
                leg=0.8,
                leg_radius=0.085,
                neck=(0.26, 0.98),
                neck_radius=0.14,
                head=(0.19, 0.13, 0.13),
                snout=0.16,
                ear=0.07,
                tail=0.5,
            ),
            coat=(240, 196, 92),
            marks=(146, 84, 34),
            pattern="spots",
            seed=24,
        ),
        words=ObjectWords(
            label=None,
            synonyms=("toy giraffe", "giraffe"),
            category="toy",
            colors=("yellow",),
            functions=("play",),
        ),
        matter=Matter(density_kg_m3=800.0, source="moulded plastic animal; assumed"),
    ),
    Entry(
        name="toy_zebra",
        shape=partial(
            animals.quadruped,
            animal=Animal(
                body_m=0.08, leg=0.58, neck=(0.22, 0.36), head=(0.19, 0.12, 0.13), snout=0.15
            ),
            coat=(240, 240, 236),
            marks=(28, 28, 30),
            pattern="stripes",
            crest="ridge",
            crest_color=(28, 28, 30),
            seed=25,
        ),
        words=ObjectWords(
            label=None,
            synonyms=("toy zebra", "zebra"),
            category="toy",
            colors=("white",),
            functions=("play",),
        ),
        matter=Matter(density_kg_m3=800.0, source="moulded plastic animal; assumed"),
    ),
    Entry(
        name="block_cube",
        shape=partial(
            toys.block, size_m=(0.045, 0.045, 0.045), color=(240, 190, 30), letter="A", seed=26
        ),
        words=ObjectWords(
            label=None,
            synonyms=("toy block", "yellow cube", "wooden block"),
            category="toy",
            colors=("yellow",),
            functions=("play",),
        ),
        matter=Matter(density_kg_m3=700.0, source="beech wood"),
    ),
    Entry(
        name="block_cylinder",
        shape=partial(
            toys.block_cylinder, diameter_m=0.038, height_m=0.06, color=(64, 158, 78), seed=27
        ),
        words=ObjectWords(
            label=None,
            synonyms=("toy cylinder", "green cylinder", "wooden cylinder"),
            category="toy",
            colors=("green",),
            functions=("play",),
        ),
        matter=Matter(density_kg_m3=700.0, source="beech wood"),
    ),
    Entry(
        name="block_arch",
        shape=partial(toys.block_arch, size_m=(0.09, 0.03, 0.045), color=(44, 104, 190), seed=28),
        words=ObjectWords(
            label=None,
            synonyms=("toy bridge", "blue arch", "wooden arch"),
            category="toy",
            colors=("blue",),
            functions=("play",),
        ),
        matter=Matter(density_kg_m3=700.0, source="beech wood"),
    ),
)
