"""Which object of the catalogue stands in for which object of GraspNet-1Billion.

Public test cases name their objects by the numbers of that data set, "000" to "087". Numbers and
names are those of its object list: H.-S. Fang et al., "GraspNet-1Billion: A Large-Scale Benchmark
for General Object Grasping", CVPR 2020, https://graspnet.net.
"""

from dataclasses import dataclass

from models.errors import UnknownNameError


@dataclass(frozen=True, kw_only=True)
class StandIn:
    """An object of the catalogue in the place of one of GraspNet-1Billion.

    Attributes:
        graspnet_id: Three digits.
        graspnet_name: Name in the data set's list, or None if it has none.
        object_name: Name in the catalogue.
        identified: The catalogue's object is of the same kind. False where a toy takes the place
            of something that its name alone does not describe, such as a machine part.
    """

    graspnet_id: str
    graspnet_name: str | None
    object_name: str
    identified: bool


# Name in the data set and in the catalogue, in the order of the numbers.
_SAME_KIND = {
    "000": ("cracker_box", "box"),
    "001": ("sugar_box", "sugar_1"),
    "002": ("tomato_soup_can", "tomato_soup_can"),
    "003": ("mustard_bottle", "mustard_bottle"),
    "004": ("potted_meat_can", "potted_meat_can"),
    "005": ("banana", "banana"),
    "006": ("bowl", "red_bowl"),
    "007": ("mug", "red_mug"),
    "008": ("power_drill", "power_drill"),
    "009": ("scissors", "scissors"),
    "010": ("chips_can", "chips_can"),
    "011": ("strawberry", "strawberry"),
    "012": ("apple", "apple"),
    "013": ("lemon", "lemon"),
    "014": ("peach", "peach"),
    "015": ("pear", "pear"),
    "016": ("orange", "orange"),
    "017": ("plum", "plum"),
    "018": ("knife", "knife"),
    "019": ("phillips_screwdriver", "phillips_screwdriver"),
    "020": ("flat_screwdriver", "flat_screwdriver"),
    "021": ("racquetball", "racquetball"),
    "022": ("b_cups", "cup"),
    "023": ("d_cups", "orange_cup"),
    "024": ("a_toy_airplane", "toy_airplane"),
    "025": ("c_toy_airplane", "toy_airplane_blue"),
    "026": ("d_toy_airplane", "toy_airplane"),
    "027": ("f_toy_airplane", "toy_airplane_blue"),
    "028": ("h_toy_airplane", "toy_airplane"),
    "029": ("i_toy_airplane", "toy_airplane_blue"),
    "030": ("j_toy_airplane", "toy_airplane"),
    "031": ("k_toy_airplane", "toy_airplane_blue"),
    "032": ("padlock", "padlock"),
    "033": ("dragon", "toy_dinosaur"),
    "034": ("secret_repair", "face_cream"),
    "035": ("jvr_cleansing_foam", "face_cream"),
    "036": ("dabao_wash_soup", "hand_soap"),
    "037": ("nzskincare_mouth_rinse", "mouth_rinse"),
    "038": ("dabao_sod", "dabao_sod"),
    "039": ("soap_box", "soap_box"),
    "040": ("kispa_cleanser", "hand_soap"),
    "041": ("darlie_toothpaste", "toothpaste"),
    "042": ("nivea_men_oil_control", "face_cream"),
    "043": ("baoke_marker", "blue_marker"),
    "044": ("hosjam", "hand_soap"),
    "045": ("pitcher_cap", "pitcher_lid"),
    "046": ("dish", "white_dish"),
    "047": ("white_mouse", "white_mouse"),
    "048": ("camel", "toy_camel"),
    "049": ("deer", "toy_deer"),
    "050": ("zebra", "toy_zebra"),
    "051": ("large_elephant", "toy_elephant"),
    "052": ("rhinocero", "toy_rhino"),
    "053": ("small_elephant", "toy_elephant"),
    "054": ("monkey", "toy_monkey"),
    "055": ("giraffe", "toy_giraffe"),
    "056": ("gorilla", "toy_gorilla"),
    "057": ("weiquan", "drink_can"),
    "058": ("darlie_box", "darlie_box"),
    "059": ("soap", "soap"),
    "060": ("black_mouse", "black_mouse"),
    "061": ("dabao_facewash", "dabao_facewash"),
    "062": ("pantene", "pantene"),
    "063": ("head_shoulders_supreme", "head_shoulders_care"),
    "064": ("thera_med", "thera_med"),
    "065": ("dove", "dove"),
    "066": ("head_shoulders_care", "head_shoulders_care"),
    "067": ("lion", "lion"),
    "068": ("coconut_juice_box", "juice_box"),
    "069": ("hippo", "toy_hippo"),
    "070": ("tape", "tape"),
    "071": ("rubiks_cube", "puzzle_cube"),
    "084": ("pawn", "toy_pawn"),
    "087": ("vase", "vase"),
}
_IN_PLACE_OF = {
    "072": ("peeler_cover", "block_plank"),
    "073": ("peeler", "block_cylinder"),
    "074": ("ice_cube_mould", "toy_brick"),
    "075": ("bar_clamp", "block_arch"),
    "076": ("climbing_hold", "block_cube"),
    "077": ("endstop_holder", "block_arch"),
    "078": ("gearbox", "toy_nut"),
    "079": ("mount1", "block_plank"),
    "080": ("mount2", "block_arch"),
    "081": ("nozzle", "block_cylinder"),
    "082": ("part1", "toy_brick"),
    "083": ("part3", "block_cube"),
    "085": ("pipe_connector", "toy_nut"),
    "086": ("turbine_housing", "rubber_ring"),
}
STAND_INS: dict[str, StandIn] = {
    number: StandIn(
        graspnet_id=number,
        graspnet_name=theirs,
        object_name=ours,
        identified=number in _SAME_KIND,
    )
    for number, (theirs, ours) in sorted({**_SAME_KIND, **_IN_PLACE_OF}.items())
}


def stand_in(graspnet_id: str) -> StandIn:
    """Return the catalogue's object for an object of GraspNet-1Billion.

    Args:
        graspnet_id: Its number, three digits, "000" to "087".

    Returns:
        The stand-in.

    Raises:
        UnknownNameError: If the data set has no such number.
    """
    try:
        return STAND_INS[graspnet_id]
    except KeyError:
        raise UnknownNameError(
            f"Unknown GraspNet-1Billion object {graspnet_id!r}. Objects: three digits, "
            "'000' to '087'. Use the stem of the object's URDF file."
        ) from None
