"""Fruit: revolved or swept bodies with painted skin, stems and leaves."""

import itertools

import numpy as np
from scipy.spatial.transform import Rotation

from models.objects import collision
from models.objects.asset import Shape
from models.objects.atlas import Solid
from models.objects.paint import Color, as_image, grid, lay, mix, noise, plain
from models.objects.surface import Surface, revolve, skin, sweep

_SKIN_PX = (192, 384)
_STEM: Color = (92, 66, 38)
_LEAF: Color = (64, 128, 44)


def _profile(radius: float, height: float, *, dimples: tuple[float, float]) -> np.ndarray:
    """Outline of a round fruit with dimples (depths, metres) at the bottom and the top."""
    latitude = np.linspace(-np.pi / 2, np.pi / 2, 25)
    from_pole = np.pi / 2 - np.abs(latitude)
    depth = np.where(latitude < 0, *dimples)
    sink = depth * np.exp(-((from_pole / 0.30) ** 2))
    z = height / 2 * np.sin(latitude) - np.sign(latitude) * sink
    r = radius * np.cos(latitude) ** 0.92
    r[[0, -1]] = 0.0
    return np.stack([r, z], axis=1)


def _stem(base: float, length: float, radius: float, lean: float = 0.25) -> Solid:
    """Make a slightly bent stem that starts at height `base` on the axis."""
    t = np.linspace(0, 1, 5)
    path = np.stack([lean * length * t**2, 0 * t, base + length * t], axis=1)
    surface = sweep(path, radius * (1 - 0.3 * t + 0.6 * t**6), num_columns=7, up=(0, 1, 0))
    return Solid.of(surface, plain(_STEM))


def _leaf(base: np.ndarray, length: float, heading: float) -> Solid:
    """Make a pointed leaf that rises from `base` and points along `heading` radians."""
    t = np.linspace(0.02, 0.98, 9)
    path = np.stack([length * t, 0 * t, 0.45 * length * np.sin(2.2 * t)], axis=1)
    half_width = 0.24 * length * np.sin(np.pi * t) ** 0.8
    surface = sweep(path, np.stack([half_width, np.full(9, 0.0007)], axis=1), num_columns=8)
    turned = surface.moved(base, Rotation.from_euler("z", heading))
    return Solid.of(turned, plain(_LEAF))


def _speckled_skin(
    rng: np.random.Generator, base: Color, blush: Color, blush_amount: float, speckle: float
) -> np.ndarray:
    """Paint a base colour with a blush on one side, fine streaks and pale pores."""
    u, v = grid(_SKIN_PX)
    side = 0.5 + 0.5 * np.cos(2 * np.pi * (u - 0.3))
    cloud = noise(rng, _SKIN_PX, (3, 6), 4)
    streaks = noise(rng, _SKIN_PX, (2, 48), 2)
    weight = blush_amount * (0.35 + 0.9 * side + 0.5 * cloud + 0.25 * streaks)
    image = mix(base, blush, weight)
    pores = (rng.random(_SKIN_PX) < 0.008) * speckle
    image = lay(image, (236, 222, 170), pores)
    poles = np.exp(-((np.minimum(v, 1 - v) / 0.05) ** 2))
    return lay(image, (110, 112, 44), 0.55 * poles)


def apple(
    *, diameter_m: float, height_m: float, base: Color, blush: Color, blush_amount: float, seed: int
) -> Shape:
    """Shape an apple: dimpled at both ends, blushed on one side, with stem and leaf."""
    rng = np.random.default_rng(seed)
    radius = diameter_m / 2
    dimple = 0.10 * height_m
    profile = _profile(radius, height_m + 0.7 * dimple, dimples=(0.6 * dimple, dimple))
    # Apples are widest above the middle.
    profile[:, 0] *= 1 + 0.08 * np.sin(profile[:, 1] * 2.2 / height_m)
    profile[:, 0] *= radius / profile[:, 0].max()
    skin_image = as_image(_speckled_skin(rng, base, blush, blush_amount, 0.5))
    top = profile[-1, 1]
    solids = [
        Solid.of(revolve(profile), skin_image),
        _stem(top - 0.002, 0.30 * height_m, 0.0016),
        _leaf(np.array([0.002, 0, top + 0.012]), 0.028, 0.8),
    ]
    half_height = np.ptp(profile[:, 1]) / 2
    middle = (profile[:, 1].max() + profile[:, 1].min()) / 2
    parts = [collision.ellipsoid((radius, radius, half_height), (0, 0, middle))]
    return Shape(solids=solids, collision=parts, rolls=True, gloss=0.45)


def drupe(
    *, diameter_m: float, base: Color, blush: Color, blush_amount: float, fuzz: float, seed: int
) -> Shape:
    """Shape a peach or a plum: round, with a furrow from stem to tip."""
    rng = np.random.default_rng(seed)
    radius = diameter_m / 2
    profile = _profile(radius, 1.0 * diameter_m, dimples=(0.0, 0.09 * diameter_m))
    body = revolve(profile, num_columns=48)

    def press_furrow(points: np.ndarray) -> np.ndarray:
        angle = np.arctan2(points[:, 1], points[:, 0])
        depth = 0.07 * np.exp(-((angle / 0.28) ** 2))
        return points * np.stack([1 - depth, 1 - depth, np.ones_like(depth)], axis=1)

    image = _speckled_skin(rng, base, blush, blush_amount, 0.25 * (1 - fuzz))
    u, _ = grid(_SKIN_PX)
    furrow = np.exp(-((np.minimum(u, 1 - u) / 0.012) ** 2))
    image = lay(image, np.asarray(blush) * 0.55, 0.6 * furrow)
    bloom = np.clip(noise(rng, _SKIN_PX, (5, 9), 4), 0, 1)
    image = lay(image, (226, 205, 205), (0.15 + 0.25 * fuzz) * bloom)
    top = profile[-1, 1]
    solids = [
        Solid.of(body.mapped(press_furrow), as_image(image)),
        _stem(top - 0.002, 0.009, 0.0016, lean=0.1),
    ]
    return Shape(
        solids=solids,
        collision=[collision.sphere(radius)],
        rolls=True,
        gloss=0.5 * (1 - fuzz) + 0.02,
    )


def citrus(
    *, diameter_m: float, length_m: float, nub_m: float, peel: Color, shade: Color, seed: int
) -> Shape:
    """Shape an orange (`nub_m` 0, standing on its end) or a lemon (lying, a nub at each end)."""
    rng = np.random.default_rng(seed)
    radius = diameter_m / 2
    latitude = np.linspace(-np.pi / 2, np.pi / 2, 31)
    body_length = length_m - 2 * nub_m * 0.55
    nub = nub_m * np.exp(-(((np.pi / 2 - np.abs(latitude)) / 0.34) ** 2))
    z = body_length / 2 * np.sin(latitude) + np.sign(latitude) * nub * 0.55
    r = radius * np.cos(latitude)
    r[[0, -1]] = 0.0
    surface = revolve(np.stack([r, z], axis=1))
    pores = noise(rng, _SKIN_PX, (48, 96), 1)
    image = mix(peel, shade, 0.25 + 0.35 * noise(rng, _SKIN_PX, (3, 5), 3) - 0.28 * pores)
    _, v = grid(_SKIN_PX)
    image = lay(image, (96, 120, 40), 0.9 * np.exp(-(((1 - v) / 0.028) ** 2)))
    image = lay(image, (150, 130, 60), 0.6 * np.exp(-((v / 0.02) ** 2)))
    parts = [collision.ellipsoid((radius, radius, body_length / 2))]
    if nub_m > 0:
        reach = length_m / 2 - 0.3 * radius
        parts.append(collision.capsule(0.3 * radius, (0, 0, -reach), (0, 0, reach)))
        lying = Rotation.from_euler("y", 90, degrees=True)
        surface = surface.moved(rotation=lying)
        parts = [part.moved(rotation=lying) for part in parts]
    return Shape(
        solids=[Solid.of(surface, as_image(image))], collision=parts, rolls=True, gloss=0.35
    )


def pear(*, diameter_m: float, height_m: float, base: Color, blush: Color, seed: int) -> Shape:
    """Shape a pear lying on its side, with a stem."""
    rng = np.random.default_rng(seed)
    radius = diameter_m / 2
    low, neck = np.array([0.0, radius]), np.array([0.0, height_m - 0.42 * radius])
    t = np.linspace(0, np.pi, 31)
    z = height_m * (1 - np.cos(t)) / 2
    belly = np.sqrt(np.clip(radius**2 - (z - low[1]) ** 2, 0, None))
    tip = np.sqrt(np.clip((0.42 * radius) ** 2 - (z - neck[1]) ** 2, 0, None))
    blend = radius * (1 - 0.60 * np.clip((z - low[1]) / (neck[1] - low[1]), 0, 1) ** 0.85)
    between = (z > low[1]) & (z < neck[1])
    r = np.where(between, blend, np.maximum(belly, tip))
    r[[0, -1]] = 0.0
    surface = revolve(np.stack([r, z], axis=1))
    image = as_image(_speckled_skin(rng, base, blush, 0.35, 0.8))
    tilt = np.arcsin(0.56 * radius / (neck[1] - low[1]))
    lying = Rotation.from_euler("y", np.pi / 2 + tilt)
    # The stem bends away from the table.
    stem = _stem(height_m - 0.002, 0.020, 0.0017, lean=-0.35)
    solids = [Solid.of(surface, image), stem]
    middle = (low[1] + neck[1]) / 2
    parts = [
        collision.sphere(radius, (0, 0, low[1])),
        collision.sphere(0.72 * radius, (0, 0, middle)),
        collision.sphere(0.42 * radius, (0, 0, neck[1])),
    ]
    return Shape(
        solids=[_turned(solid, lying) for solid in solids],
        collision=[part.moved(rotation=lying) for part in parts],
        rolls=True,
        gloss=0.25,
    )


def _turned(solid: Solid, rotation: Rotation) -> Solid:
    """Rotate a one-panel solid."""
    (panel,) = solid.panels
    return Solid.of(panel.surface.moved(rotation=rotation), panel.image)


def strawberry(
    *, diameter_m: float, length_m: float, base: Color, shade: Color, seed: int
) -> Shape:
    """Shape a strawberry lying on its side: cone with seeds, crown of leaves."""
    rng = np.random.default_rng(seed)
    radius = diameter_m / 2
    t = np.linspace(0, 1, 23)
    z = length_m * (1 - np.cos(np.pi * t)) / 2
    h = z / length_m
    r = radius * 1.32 * np.sqrt(np.clip(h, 0, 1)) * (1 - h) ** 0.30 * (1 - 0.12 * h)
    r *= radius / r.max()
    r[[0, -1]] = 0.0
    body = revolve(np.stack([r, z], axis=1))
    flesh = as_image(_seeded_skin(rng, base, shade))
    crown = _crown(1.02 * radius, num_leaves=7).moved((0, 0, length_m + 0.0012))
    stem = _stem(length_m - 0.002, 0.010, 0.0013)
    stem = Solid.of(stem.panels[0].surface, plain(_LEAF))
    lying = Rotation.from_euler("y", np.pi / 2 - 0.20)
    solids = [Solid.of(body, flesh), Solid.of(crown, plain(_LEAF)), stem]
    heights = (0.20, 0.45, 0.68, 0.80)
    parts = [
        collision.sphere(float(np.interp(k, h, r)) * 0.99, (0, 0, k * length_m))
        for k in heights[1:]
    ]
    parts.append(collision.sphere(0.19 * length_m, (0, 0, heights[0] * length_m)))
    return Shape(
        solids=[_turned(solid, lying) for solid in solids],
        collision=[part.moved(rotation=lying) for part in parts],
        rolls=True,
        gloss=0.5,
    )


def _seeded_skin(rng: np.random.Generator, base: Color, shade: Color) -> np.ndarray:
    """Paint red flesh with staggered rows of pale seeds, each in a dark pit."""
    u, v = grid(_SKIN_PX)
    image = mix(base, shade, 0.3 + 0.5 * noise(rng, _SKIN_PX, (4, 6), 3))
    num_rows, num_seeds = 11, 15
    row = np.floor(v * num_rows)
    across = (u * num_seeds + 0.5 * (row % 2)) % 1 - 0.5
    along = (v * num_rows) % 1 - 0.5
    # Cells shrink towards the tip; the seeds do not.
    squeeze = np.clip(np.sin(np.pi * np.clip(v, 0.05, 0.95)), 0.25, 1)
    distance = np.hypot(across * 1.6 * squeeze, along * 1.1)
    image = lay(image, np.asarray(shade) * 0.6, np.clip((0.30 - distance) / 0.08, 0, 0.8))
    image = lay(image, (243, 214, 120), np.clip((0.17 - distance) / 0.06, 0, 1))
    return lay(image, (238, 190, 150), 0.5 * np.clip((v - 0.93) / 0.05, 0, 1))


def _crown(radius: float, num_leaves: int) -> Surface:
    """Make a flat star of leaves about the z axis, tips hanging."""
    num = num_leaves * 6
    angle = np.arange(num) * (2 * np.pi / num)
    reach = 0.28 + 0.72 * np.abs(np.cos(num_leaves * angle / 2)) ** 1.5
    direction = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    rings = []
    for share, lift in ((0, 0.0), (0.6, 0.0006), (1.0, 0.0), (0.6, 0.0022), (0, 0.0030)):
        ring = direction * (share * reach * radius)[:, None]
        ring[:, 2] = lift - 0.5 * radius * (share * reach) ** 2
        rings.append(ring)
    return skin(np.stack(rings))


def banana(*, diameter_m: float, length_m: float, peel: Color, shade: Color, seed: int) -> Shape:
    """Shape a banana lying on its side: bent, five-edged, brown at stem and tip."""
    rng = np.random.default_rng(seed)
    bend = 1.25
    # The ends stand out beyond the centre line's chord.
    arc_radius = 0.966 * length_m / (2 * np.sin(bend / 2))
    t = np.linspace(0, 1, 31)
    angle = bend * (t - 0.5)
    path = np.stack([np.sin(angle), np.cos(angle), 0 * angle], axis=1) * arc_radius
    body = np.clip(t * (1 - t) * 4, 0, 1) ** 0.33
    thickness = diameter_m / 2 * np.where(t < 0.13, 0.33 + 2.0 * t, body)
    thickness = np.minimum(thickness, diameter_m / 2 * np.maximum(body, 0.33 * (t < 0.5)))
    thickness[-1] = 0.16 * diameter_m
    across = np.arange(20) * (2 * np.pi / 20)
    edges = 1 + 0.045 * np.cos(5 * across)
    section = edges[:, None] * np.stack([np.cos(across), np.sin(across)], axis=1) / 1.045
    surface = sweep(path, thickness, section=section)
    shape = (128, 256)
    # v runs along the fruit, u around it.
    u, v = grid((shape[1], shape[0]))
    ridge = 0.5 + 0.5 * np.cos(2 * np.pi * 5 * u)
    image = mix(peel, shade, 0.15 + 0.4 * ridge**6 + 0.25 * noise(rng, u.shape, (8, 4), 3))
    spots = noise(rng, u.shape, (24, 12), 2)
    image = lay(image, (120, 82, 30), np.clip((spots - 0.52) * 6, 0, 0.7))
    image = lay(image, (148, 160, 60), 0.5 * np.clip((0.16 - v) / 0.08, 0, 1))
    image = lay(image, (74, 54, 32), np.clip((0.055 - v) / 0.02, 0, 1))
    image = lay(image, (58, 42, 28), np.clip((v - 0.955) / 0.015, 0, 1))
    nodes = np.array([2, 6, 12, 18, 24, 28])
    middle = [thickness[a:b].mean() * 0.97 for a, b in itertools.pairwise(nodes)]
    parts = collision.capsule_chain(np.array(middle), path[nodes])
    return Shape(
        solids=[Solid.of(surface, as_image(image))], collision=parts, rolls=True, gloss=0.2
    )
