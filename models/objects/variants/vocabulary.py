"""Products: the words printed on packages with the noun that names what is inside.

Rows are the printed title, the noun ("cookie|cookies" where one and many differ), and the small
print below the title. No trade marks.
"""

import functools
from dataclasses import dataclass
from typing import Literal

from models.objects.variants.novelty import may_print

Function = Literal["eat", "drink", "clean"]


@dataclass(frozen=True, kw_only=True)
class Product:
    """What a package holds.

    Attributes:
        title: Large print; lines split at newlines.
        noun: What is inside, as in "cookie box".
        content: What is inside, as in "box of cookies".
        note: Small print.
        function: What it is for, or None.
    """

    title: str
    noun: str
    content: str
    note: str
    function: Function | None


_Row = tuple[str, str, str]

_CARTON_FOOD: tuple[_Row, ...] = (
    ("CORN\nFLAKES", "corn flakes", "crunchy"),
    ("OATS", "oats", "whole grain"),
    ("MUESLI", "muesli", "with nuts"),
    ("CEREAL", "cereal", "honey hoops"),
    ("COOKIES", "cookie|cookies", "choco chip"),
    ("BISCUITS", "biscuit|biscuits", "with butter"),
    ("WAFERS", "wafer|wafers", "vanilla"),
    ("PASTA", "pasta", "penne"),
    ("RICE", "rice", "long grain"),
    ("FLOUR", "flour", "for baking"),
    ("PUDDING", "pudding", "vanilla"),
    ("CAKE\nMIX", "cake mix", "just add eggs"),
    ("RAISINS", "raisin|raisins", "sun dried"),
    ("POPCORN", "popcorn", "butter"),
    ("SALT", "salt", "fine"),
    ("BUTTER", "butter", "unsalted"),
    ("CHOCO\nBAR", "chocolate", "dark"),
    ("CANDY", "candy", "fruit drops"),
    ("NOODLES", "noodle|noodles", "instant"),
    ("PRETZELS", "pretzel|pretzels", "salted"),
)
_CARTON_DRINK: tuple[_Row, ...] = (
    ("MILK", "milk", "fresh"),
    ("ORANGE\nJUICE", "orange juice", "not from concentrate"),
    ("APPLE\nJUICE", "apple juice", "clear"),
    ("SOY\nDRINK", "soy milk", "unsweetened"),
    ("OAT\nDRINK", "oat milk", "barista"),
)
_CARTON_POWDER: tuple[_Row, ...] = (
    ("COCOA", "cocoa", "hot chocolate"),
    ("ESPRESSO", "coffee capsule|coffee capsules", "10 capsules"),
    ("COFFEE", "instant coffee", "20 sticks"),
)
_CARTON_CLEAN: tuple[_Row, ...] = (
    ("LAUNDRY", "washing powder", "color"),
    ("DISH\nTABS", "dishwasher tablet|dishwasher tablets", "all in one"),
    ("TISSUES", "tissue|tissues", "soft"),
)
_CARTON_OTHER: tuple[_Row, ...] = (
    ("BATTERIES", "battery|batteries", "8 pieces"),
    ("CRAYONS", "crayon|crayons", "12 colours"),
    ("MATCHES", "match|matches", "long"),
    ("BULB", "light bulb|light bulbs", "warm"),
    ("PLASTERS", "plaster|plasters", "first aid"),
    ("NAILS", "nail|nails", "40 mm"),
    ("PUZZLE", "puzzle", "100 pieces"),
    ("CHALK", "chalk", "for boards"),
)
_CAN_FOOD: tuple[_Row, ...] = (
    ("CORN", "corn", "sweet"),
    ("PEAS", "pea|peas", "garden"),
    ("BEANS", "bean|beans", "in sauce"),
    ("TOMATO", "tomato|tomatoes", "chopped"),
    ("PEACHES", "peach|peaches", "halves"),
    ("PINEAPPLE", "pineapple", "rings"),
    ("LENTILS", "lentil|lentils", "cooked"),
    ("CHILI", "chili", "hot"),
    ("CHICKEN\nSOUP", "chicken soup", "with noodles"),
    ("MUSHROOM\nSOUP", "mushroom soup", "creamy"),
    ("RAVIOLI", "ravioli", "cheese"),
    ("OLIVES", "olive|olives", "pitted"),
    ("COCONUT", "coconut milk", "creamy"),
    ("CHERRIES", "cherry|cherries", "pitted"),
    ("DOG\nFOOD", "dog food", "beef"),
    ("CAT\nFOOD", "cat food", "salmon"),
)
_CAN_FLAT: tuple[_Row, ...] = (
    ("TUNA", "tuna", "in oil"),
    ("SALMON", "salmon", "wild"),
    ("PATE", "pate", "country style"),
    ("HAM", "ham", "cooked"),
)
_CAN_DRINK: tuple[_Row, ...] = (
    ("COLA", "cola", "330 ml"),
    ("SODA", "soda", "sparkling"),
    ("ROOT BEER", "root beer", "sweet"),
    ("CIDER", "cider", "dry"),
    ("SPRITZ", "spritzer", "apple"),
    ("ENERGY", "energy drink", "250 ml"),
    ("GINGER\nALE", "ginger ale", "spicy"),
    ("LEMONADE", "lemonade", "cold"),
    ("ICED\nCOFFEE", "iced coffee", "with milk"),
    ("COFFEE", "coffee", "ground"),
)
_JAR_FOOD: tuple[_Row, ...] = (
    ("PLUM\nJAM", "plum jam", ""),
    ("CHERRY\nJAM", "cherry jam", ""),
    ("PEANUT", "peanut butter", ""),
    ("HONEY", "honey", ""),
    ("PICKLES", "pickle|pickles", ""),
    ("SALSA", "salsa", ""),
    ("PESTO", "pesto", ""),
    ("CAPERS", "caper|capers", ""),
    ("OLIVES", "olive|olives", ""),
    ("NUT\nSPREAD", "hazelnut spread", ""),
)
_BOTTLE_CARE: tuple[_Row, ...] = (
    ("HAIR\nCARE", "shampoo", "for dry hair"),
    ("CONDI\nTIONER", "conditioner", "smooth"),
    ("BODY\nLOTION", "body lotion", "with almond"),
    ("SHOWER\nGEL", "shower gel", "ocean"),
    ("BABY\nOIL", "baby oil", "mild"),
    ("SUN\nCARE", "sunscreen", "factor 30"),
    ("BUBBLE\nBATH", "bubble bath", "tears free"),
    ("MOUTH\nWASH", "mouthwash", "mint"),
    ("HAND\nSOAP", "liquid soap", "citrus"),
    ("TONIC", "hair tonic", "daily"),
)
_BOTTLE_CLEANER: tuple[_Row, ...] = (
    ("DISH\nSOAP", "dish soap", "lemon fresh"),
    ("GLASS\nSHINE", "glass cleaner", "streak free"),
    ("FLOOR\nCARE", "floor cleaner", "pine"),
    ("BATH\nFOAM", "bathroom cleaner", "against lime"),
    ("FABRIC\nSOFT", "fabric softener", "spring"),
    ("DETERGENT", "detergent", "liquid"),
    ("STAIN\nAWAY", "stain remover", "oxygen"),
)
_BOTTLE_DRINK: tuple[_Row, ...] = (
    ("WATER", "water", "still"),
    ("JUICE", "juice", "mixed fruit"),
    ("SYRUP", "syrup", "raspberry"),
    ("SMOOTHIE", "smoothie", "mango"),
    ("YOGHURT", "yoghurt drink", "strawberry"),
    ("SPORT", "sports drink", "isotonic"),
)
_BOTTLE_SAUCE: tuple[_Row, ...] = (
    ("KETCHUP", "ketchup", "tomato"),
    ("MUSTARD", "mustard", "medium hot"),
    ("MAYO", "mayonnaise", "real"),
    ("BBQ", "barbecue sauce", "smoky"),
    ("HONEY", "honey", "squeezy"),
    ("OLIVE\nOIL", "olive oil", "extra virgin"),
    ("VINEGAR", "vinegar", "apple"),
    ("SOY\nSAUCE", "soy sauce", "brewed"),
)
_BOTTLE_OTHER: tuple[_Row, ...] = (
    ("GLUE", "glue", "for wood"),
    ("PAINT", "paint", "acrylic"),
    ("VITAMINS", "vitamin|vitamins", "60 tablets"),
    ("COUGH\nSYRUP", "cough syrup", "200 ml"),
)
_TUBE_CLEAN: tuple[_Row, ...] = (
    ("DENTAL\nMINT", "toothpaste", "whitening"),
    ("SMILE", "toothpaste", "for kids"),
    ("FACE\nSCRUB", "face scrub", "apricot"),
    ("SHAVE\nGEL", "shaving gel", "cool"),
)
_TUBE_OTHER: tuple[_Row, ...] = (
    ("HAND\nCREAM", "hand cream", "aloe"),
    ("SUN\nBLOCK", "sunscreen", "factor 50"),
    ("BALM", "balm", "soothing"),
    ("HAIR\nGEL", "hair gel", "strong hold"),
    ("OINTMENT", "ointment", "50 g"),
    ("ACRYLIC", "paint", "artist"),
    ("SUPER\nGLUE", "glue", "all materials"),
)
_TUBE_FOOD: tuple[_Row, ...] = (
    ("WASABI", "wasabi", "hot"),
    ("TOMATO\nPASTE", "tomato paste", "double"),
)
_SPRAY_OTHER: tuple[_Row, ...] = (
    ("HAIR\nSPRAY", "hairspray", "extra hold"),
    ("DEO", "deodorant", "48 h"),
    ("SPRAY\nPAINT", "spray paint", "gloss"),
    ("LACQUER", "lacquer", "matt"),
    ("AIR\nFRESH", "air freshener", "vanilla"),
    ("LUBE\nOIL", "oil spray", "penetrating"),
)
_SPRAY_CLEAN: tuple[_Row, ...] = (
    ("SHAVE\nFOAM", "shaving foam", "sensitive"),
    ("OVEN\nFOAM", "oven cleaner", "strong"),
    ("POLISH", "furniture polish", "beeswax"),
)
_SPRAY_FOOD: tuple[_Row, ...] = (("CREAM", "whipped cream", "sweet"),)

_TABLES: dict[str, tuple[tuple[Function | None, tuple[_Row, ...]], ...]] = {
    "carton": (
        ("eat", _CARTON_FOOD),
        ("drink", _CARTON_POWDER),
        ("clean", _CARTON_CLEAN),
        (None, _CARTON_OTHER),
    ),
    "drink carton": (("drink", _CARTON_DRINK),),
    "can": (("eat", _CAN_FOOD),),
    "flat can": (("eat", _CAN_FLAT),),
    "drink can": (("drink", _CAN_DRINK),),
    "jar": (("eat", _JAR_FOOD),),
    "care bottle": (("clean", _BOTTLE_CARE),),
    "cleaner bottle": (("clean", _BOTTLE_CLEANER),),
    "drink bottle": (("drink", _BOTTLE_DRINK),),
    "sauce bottle": (("eat", _BOTTLE_SAUCE),),
    "small bottle": ((None, _BOTTLE_OTHER),),
    "tube": (("clean", _TUBE_CLEAN), (None, _TUBE_OTHER), ("eat", _TUBE_FOOD)),
    "spray can": ((None, _SPRAY_OTHER), ("clean", _SPRAY_CLEAN), ("eat", _SPRAY_FOOD)),
}
VESSELS = tuple(_TABLES)


@functools.cache
def products(vessel: str) -> tuple[Product, ...]:
    """List what comes in a kind of vessel, without titles that `novelty` reserves.

    Args:
        vessel: One of `VESSELS`.

    Returns:
        The products.
    """
    return tuple(
        _product(title, noun, note, function)
        for function, rows in _TABLES[vessel]
        for title, noun, note in rows
        if may_print(title) and may_print(note)
    )


def _product(title: str, noun: str, note: str, function: Function | None) -> Product:
    """Read a row."""
    one, _, many = noun.partition("|")
    return Product(title=title, noun=one, content=many or one, note=note, function=function)
