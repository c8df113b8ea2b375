"""Tools: power drill, scissors, knife, screwdriver, clamp, hammer."""

import numpy as np
from scipy.spatial.transform import Rotation

from models.objects import collision
from models.objects.asset import Shape
from models.objects.atlas import Panel, Solid
from models.objects.paint import BLACK, WHITE, Color, Poster, brushed_metal, plain, shade, wood
from models.objects.surface import circle, plate, refined, revolve, rounded_box, sweep

# Spacing of points along the outlines of blades.
_STEP_M = 0.0038


def scissors(*, length_m: float, width_m: float, handle: Color, seed: int) -> Shape:
    """Shape scissors lying flat, slightly open, two finger rings.

    Args:
        length_m: Extent along x from ring to tip, closed.
        width_m: Extent across both rings.
        handle: Colour of the plastic.
        seed: Varies the grinding marks.
    """
    metal = brushed_metal(np.random.default_rng(seed))
    thickness, opening = 0.0035, 0.10
    pivot_x = 0.04 * length_m
    tip, ring_x = 0.5 * length_m, -0.5 * length_m
    ring_half = np.array([0.17 * length_m, 0.22 * width_m])
    solids, parts = [], []
    for sign in (1, -1):
        # One blade above the other, as the pivot joins them.
        low = 0.0045 + (thickness - 0.0002 if sign > 0 else 0.0)
        blade = np.array(
            [(-0.015, 0.007), (0.0, -0.008), (tip, -0.001), (tip - 0.004, 0.003), (0.01, 0.009)]
        )
        blade[:, 1] *= sign
        outline = blade if sign > 0 else blade[::-1]
        turn = Rotation.from_euler("z", sign * opening)
        shift = (pivot_x, 0, 0)
        surface = plate(refined(outline, _STEP_M), thickness, bevel_m=0.0008, base_m=low)
        solids.append(Solid.of(surface.moved(shift, turn), metal))
        board = collision.prism(outline[[0, 1, 2, 4]], low, low + thickness)
        parts.append(board.moved(shift, turn))

        center = np.array([ring_x + ring_half[0], -sign * (width_m / 2 - ring_half[1]), 0.007])
        angle = np.arange(36) * (2 * np.pi / 36)
        oval = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
        path = center + oval * [*(ring_half - 0.005), 0]
        ring = sweep(path, np.array([[0.005, 0.007]] * 36), num_columns=10, loop=True)
        solids.append(Solid.of(ring, plain(handle)))
        corners = path[np.arange(0, 37, 6) % 36]
        parts += collision.capsule_chain(0.0065, corners)
        start = center + np.array([0.75 * ring_half[0], sign * 0.5 * ring_half[1], 0])
        arm = np.linspace(start, [pivot_x - 0.004, 0, 0.007], 5)
        shank = sweep(arm, np.array([[0.0055, 0.0055]] * 5), num_columns=10)
        solids.append(Solid.of(shank, plain(handle)))
        parts.append(collision.capsule(0.005, arm[0], arm[-1]))
    screw = revolve([(0, 0.003), (0.005, 0.003), (0.005, 0.013), (0.004, 0.014), (0, 0.014)])
    solids.append(Solid.of(screw.moved((pivot_x, 0, 0)), plain((120, 124, 130))))
    return Shape(solids=solids, collision=parts, gloss=0.6)


def knife(*, length_m: float, handle: Color, rivet: Color, seed: int) -> Shape:
    """Shape a kitchen knife lying on its side: steel blade, riveted handle."""
    metal = brushed_metal(np.random.default_rng(seed), (196, 200, 206))
    grip, height = 0.42 * length_m, 0.115 * length_m
    blade_length = length_m - grip
    t = np.linspace(0, 1, 9)
    belly = np.stack([blade_length * t, -height / 2 + 0.55 * height * t**3], axis=1)
    back = np.stack([blade_length * t[::-1], height / 2 - 0.45 * height * t[::-1] ** 4], axis=1)
    outline = np.concatenate([belly, back[1:]])
    thickness = 0.0022
    blade = plate(
        refined(outline, _STEP_M), thickness, bevel_m=0.0008, base_m=0.0072 - thickness / 2
    )
    along = np.linspace(-grip, 0.004, 9)
    swell = 1 + 0.10 * np.cos(np.linspace(0, 4 * np.pi, 9))
    path = np.stack([along, 0 * along + 0.12 * height, 0 * along + 0.0072], axis=1)
    half = np.stack([0.40 * height * swell, np.full(9, 0.0072)], axis=1)
    body = sweep(path, half, section=circle(20, 4.0), up=(0, 0, 1))
    wood_print = wood(np.random.default_rng(seed + 1), handle, shade(handle, 0.7), (64, 64))
    solids = [Solid.of(blade, metal), Solid.of(body, wood_print)]
    for x in (-0.75, -0.45, -0.15):
        pin = revolve([(0, 0), (0.0035, 0), (0.0035, 0.0149), (0, 0.0149)], num_columns=14)
        solids.append(Solid.of(pin.moved((x * grip, 0.12 * height, 0)), plain(rivet)))
    parts = [
        collision.box((grip, 0.84 * height, 0.0144), (-grip / 2, 0.12 * height, 0.0072)),
        collision.prism(outline[[0, 4, 6, 8, 12, 16]], 0.0058, 0.0086),
    ]
    return Shape(solids=solids, collision=parts, gloss=0.6)


def screwdriver(
    *,
    length_m: float,
    handle_m: float,
    grip: Color,
    accent: Color,
    cross: bool = False,
    seed: int,
) -> Shape:
    """Shape a screwdriver lying on its side.

    Args:
        length_m: Length.
        handle_m: Diameter of the handle.
        grip: Colour of the handle.
        accent: Colour of its stripes.
        cross: Give it a Phillips tip instead of a flat one.
        seed: Varies the grinding marks.
    """
    metal = brushed_metal(np.random.default_rng(seed), (188, 190, 196))
    radius, split = handle_m / 2, 0.46 * length_m
    level = np.array([0, 0.0, 0.03, 0.10, 0.35, 0.60, 0.74, 0.82, 0.90, 1.0, 1.0])
    share = np.array([0, 0.72, 0.93, 1.0, 1.0, 0.97, 0.80, 0.64, 0.80, 0.52, 0])
    profile = np.stack([radius * share, split * level], axis=1)
    angle = np.arange(48) * (2 * np.pi / 48)
    fluted = circle(48) * (1 - 0.05 * (1 + np.cos(6 * angle)))[:, None]
    handle = revolve(profile, section=fluted / np.linalg.norm(fluted, axis=1).max(), v=level)
    stripes = Poster(grip, (128, 192))
    for stripe in range(6):
        stripes.rectangle(((stripe + 0.36) / 6, 0.36, (stripe + 0.64) / 6, 0.97), accent)
    stripes.rectangle((0, 0.14, 1, 0.22), accent)
    shaft_radius = 0.105 * handle_m + 0.0008
    blade_start = length_m - 0.016
    shaft = revolve(
        [(0, split - 0.01), (shaft_radius, split - 0.01)]
        + [(shaft_radius, z) for z in np.linspace(split + 0.01, blade_start, 6)]
        + [(0, blade_start)],
        num_columns=16,
    )
    tip_path = np.array(
        [(0, 0, blade_start - 0.002), (0, 0, blade_start + 0.006), (0, 0, length_m)]
    )
    flat = np.array(
        [
            [shaft_radius] * 2,
            [1.45 * shaft_radius, 0.6 * shaft_radius],
            [1.3 * shaft_radius, 0.0006],
        ]
    )
    if cross:
        star = (
            circle(48) * (1 - 0.28 * np.abs(np.sin(2 * np.arange(48) * (2 * np.pi / 48))))[:, None]
        )
        cone = shaft_radius * np.array([[1.0, 1.0], [1.0, 1.0], [0.25, 0.25]])
        tip = sweep(tip_path, cone, section=star, up=(0, 1, 0))
    else:
        tip = sweep(tip_path, flat, section=circle(16, 4.0), up=(0, 1, 0))
    lying = Rotation.from_euler("y", 90, degrees=True)
    images = [(handle, stripes.image()), (shaft, metal), (tip, metal)]
    parts = [
        collision.rod(0.97 * radius, (0, 0, 0.001), (0, 0, 0.68 * split)),
        collision.rod(0.70 * radius, (0, 0, 0.68 * split), (0, 0, split)),
        collision.rod(shaft_radius, (0, 0, split), (0, 0, length_m)),
    ]
    return Shape(
        solids=[Solid.of(surface.moved(rotation=lying), image) for surface, image in images],
        collision=[part.moved(rotation=lying) for part in parts],
        rolls=True,
        gloss=0.5,
    )


def power_drill(*, length_m: float, height_m: float, body: Color, trim: Color, words: str) -> Shape:
    """Shape a cordless drill standing on its battery, chuck towards +x."""
    axis_z, base_height = height_m - 0.028, 0.030
    rear, front, tip = (share * length_m for share in (-0.42, 0.22, 0.58))
    grip_path = np.linspace((-0.050, 0, base_height - 0.01), (-0.030, 0, axis_z - 0.01), 7)
    base_size, base_center = (0.098, 0.054, base_height), (-0.030, 0, base_height / 2)
    solids = [
        _drill_barrel(rear, front, axis_z, body, trim, words),
        _drill_chuck(front, tip, axis_z),
        *_drill_grip(grip_path, axis_z, body, trim),
        _drill_battery(base_size, base_center, trim),
    ]
    parts = [
        collision.rod(0.0272, (rear, 0, axis_z), (front, 0, axis_z)),
        collision.rod(0.0185, (front, 0, axis_z), (tip - 0.012, 0, axis_z)),
        collision.capsule(0.008, (tip - 0.012, 0, axis_z), (tip - 0.008, 0, axis_z)),
        collision.convex(_sheared_box(grip_path, (0.020, 0.0158))),
        collision.box(base_size, base_center),
        collision.box((0.018, 0.014, 0.034), (-0.010, 0, axis_z - 0.036)),
    ]
    return Shape(solids=solids, collision=parts, gloss=0.35)


def _drill_barrel(
    rear: float, front: float, axis_z: float, body: Color, trim: Color, words: str
) -> Solid:
    """Build the motor housing with air slots and words on both flanks."""
    x = np.array([rear, rear + 0.006, rear + 0.02, 0.0, front - 0.02, front])
    r = np.array([0.017, 0.023, 0.0265, 0.0275, 0.0255, 0.021])
    path = np.stack([x, 0 * x, 0 * x + axis_z], axis=1)
    side = Poster(body, (192, 224))
    # u = 0 is the left flank, 0.25 the top, 0.5 the right flank; v runs forwards.
    side.words(words, (0.035, 0.22, 0.165, 0.62), WHITE, turn_deg=270)
    side.words(words, (0.335, 0.22, 0.465, 0.62), WHITE, turn_deg=90)
    side.rectangle((0, 0.90, 1, 1), trim).rectangle((0, 0.0, 1, 0.10), trim)
    for slot in range(5):
        side.rectangle((0, 0.70 + 0.035 * slot, 1, 0.715 + 0.035 * slot), shade(body, 0.5))
    return Solid.of(sweep(path, np.stack([r, r], 1), num_columns=28), side.image())


def _drill_chuck(front: float, tip: float, axis_z: float) -> Solid:
    """Build the knurled chuck."""
    x = np.array([front - 0.004, front + 0.004, front + 0.03, tip - 0.014, tip])
    r = np.array([0.020, 0.020, 0.0185, 0.015, 0.008])
    path = np.stack([x, 0 * x, 0 * x + axis_z], axis=1)
    knurled = Poster(BLACK, (32, 96))
    for rib in range(24):
        knurled.rectangle((rib / 24, 0.1, (rib + 0.4) / 24, 0.8), (72, 72, 76))
    return Solid.of(sweep(path, np.stack([r, r], 1), num_columns=24), knurled.image())


def _drill_grip(path: np.ndarray, axis_z: float, body: Color, trim: Color) -> list[Solid]:
    """Build the handle with rubber front and back, and the trigger."""
    half = np.array([[0.0165, 0.0225], [0.0160, 0.0200], [0.0155, 0.0185], [0.0155, 0.0185]])
    half = np.concatenate([half, [[0.0160, 0.0195], [0.0170, 0.0220], [0.0180, 0.0240]]])
    image = Poster(body, (128, 96))
    for low, high in ((0.12, 0.38), (0.62, 0.88)):
        image.rectangle((low, 0, high, 1), trim)
    grip = sweep(path, half, section=circle(24, 3.0), up=(1, 0, 0))
    trigger = sweep(
        np.array([(-0.012, 0, axis_z - 0.052), (-0.014, 0, axis_z - 0.022)]),
        np.array([[0.007, 0.009], [0.007, 0.010]]),
        num_columns=12,
        up=(1, 0, 0),
    )
    return [Solid.of(grip, image.image()), Solid.of(trigger, plain((150, 28, 26)))]


def _drill_battery(
    size: tuple[float, float, float], center: tuple[float, float, float], trim: Color
) -> Solid:
    """Build the battery that is the foot, its voltage printed on both long sides."""
    volts = Poster(trim, (48, 128)).words("18V", (0.3, 0.2, 0.7, 0.8), WHITE).image()
    bare = plain(trim)
    images = [bare, bare, volts, volts, bare, bare]
    return Solid(
        panels=tuple(
            Panel(surface=surface.moved(center), image=image)
            for surface, image in zip(rounded_box(size, 0.005), images, strict=True)
        )
    )


def _sheared_box(path: np.ndarray, half: tuple[float, float]) -> np.ndarray:
    """Return the 8 corners of a slanted column from the first to the last point of a path."""
    corners = [(sx * half[0], sy * half[1], 0.0) for sx in (-1, 1) for sy in (-1, 1)]
    return np.concatenate([path[0] + corners, path[-1] + corners])


def clamp(*, length_m: float, width_m: float, thickness_m: float, body: Color, tip: Color) -> Shape:
    """Shape a spring clamp lying flat: two crossed arms, handles apart, jaws together."""
    solids, parts = [], []
    half = thickness_m / 2
    for sign in (1, -1):
        spine = np.array(
            [
                (-0.50 * length_m, sign * 0.44 * width_m, half),
                (-0.28 * length_m, sign * 0.31 * width_m, half),
                (-0.04 * length_m, sign * 0.15 * width_m, half),
                (0.14 * length_m, sign * 0.16 * width_m, half),
                (0.32 * length_m, sign * 0.17 * width_m, half),
                (0.46 * length_m, sign * 0.06 * width_m, half),
            ]
        )
        half_width = np.array([0.0050, 0.0062, 0.0070, 0.0062, 0.0052, 0.0045])
        radii = np.stack([half_width, np.full(6, half)], axis=1)
        arm = sweep(spine, radii, section=circle(20, 5.0))
        solids.append(Solid.of(arm, plain(body)))
        pad = rounded_box((0.012, 0.008, thickness_m * 0.98), 0.002)
        center = (0.46 * length_m, sign * 0.0042, half)
        panels = tuple(Panel(surface=s.moved(center), image=plain(tip)) for s in pad)
        solids.append(Solid(panels=panels))
        grip = sweep(spine[:2], radii[:2] * 1.06, section=circle(20, 5.0))
        solids.append(Solid.of(grip, plain(tip)))
        for index in range(5):
            wide = float(half_width[index : index + 2].mean())
            parts.append(_bar(spine[index], spine[index + 1], wide, half))
        parts.append(collision.box((0.012, 0.008, thickness_m), center))
    coil = revolve(
        [(0, 0.0006), (0.0075, 0.0006), (0.0075, thickness_m - 0.0006), (0, thickness_m - 0.0006)],
        num_columns=24,
    )
    solids.append(Solid.of(coil.moved((-0.01 * length_m, 0, 0)), plain((176, 180, 186))))
    bridge = collision.box((0.020, 0.22 * width_m, thickness_m), (0.0, 0, half))
    cross = rounded_box((0.016, 0.24 * width_m, thickness_m * 0.8), 0.002)
    panels = tuple(
        Panel(surface=s.moved((0.01 * length_m, 0, half)), image=plain(body)) for s in cross
    )
    solids.append(Solid(panels=panels))
    return Shape(solids=solids, collision=[*parts, bridge], gloss=0.35)


def _bar(
    start: np.ndarray, end: np.ndarray, half_width: float, half_height: float
) -> collision.CollisionPart:
    """Return a flat box along a horizontal segment."""
    along = end - start
    box = collision.box((float(np.linalg.norm(along)), 2 * half_width, 2 * half_height))
    turn = Rotation.from_euler("z", np.arctan2(along[1], along[0]))
    return box.moved((start + end) / 2, turn)


def mallet(
    *, length_m: float, head_m: tuple[float, float], faces: tuple[Color, Color], seed: int
) -> Shape:
    """Shape a mallet lying down: a head of two colours across a wooden handle.

    Args:
        length_m: Length of handle and head.
        head_m: Diameter and length of the head.
        faces: Colours of the two halves of the head.
        seed: Varies the grain.
    """
    rng = np.random.default_rng(seed)
    radius, head_length = head_m[0] / 2, head_m[1]
    handle_radius = 0.38 * radius
    head_x = length_m - radius
    y = np.array([-0.5, -0.49, -0.42, -0.36, -0.14, 0.14, 0.36, 0.42, 0.49, 0.5]) * head_length
    share = np.array([0.90, 0.96, 1.0, 0.97, 0.93, 0.93, 0.97, 1.0, 0.96, 0.90])
    path = np.stack([0 * y + head_x, y, 0 * y + radius], axis=1)
    head_image = Poster(faces[0], (128, 32)).rectangle((0, 0, 1, 0.40), faces[1])
    head_image.rectangle((0, 0.40, 1, 0.60), (44, 44, 48))
    head = sweep(path, np.stack([radius * share] * 2, 1), num_columns=40)
    # The handle runs straight, so its end hangs above the table; the mallet tips onto it.
    tilt = Rotation.from_euler("y", -np.arcsin((radius - handle_radius) / head_x))
    x = np.linspace(0, length_m - 0.3 * radius, 9)
    swell = np.array([0.85, 1.08, 1.1, 1.0, 0.92, 0.88, 0.85, 0.82, 0.8]) * handle_radius
    stick = np.stack([x, 0 * x, 0 * x + radius], axis=1)
    grain = np.rot90(wood(rng, (222, 182, 122), (184, 138, 84), (96, 192))).copy()
    handle = sweep(stick, np.stack([swell, swell], 1), num_columns=18)
    parts = [
        collision.rod(radius, path[0], path[-1]),
        collision.capsule(handle_radius, (handle_radius, 0, radius), (head_x, 0, radius)),
    ]
    pivot = np.array([head_x, 0, radius])
    shift = pivot - tilt.apply(pivot)
    solids = [Solid.of(head, head_image.image()), Solid.of(handle, grain)]
    return Shape(
        solids=[
            Solid.of(s.panels[0].surface.moved(shift, tilt), s.panels[0].image) for s in solids
        ],
        collision=[part.moved(shift, tilt) for part in parts],
        rolls=True,
        gloss=0.3,
    )
