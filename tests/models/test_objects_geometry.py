import functools

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from models.errors import AssetError
from models.objects import collision
from models.objects.asset import Matter, Shape, assemble, closed_mesh
from models.objects.atlas import ATLAS_PX, Panel, Solid, join_panels
from models.objects.catalogue import build_asset, object_names
from models.objects.collision import CollisionPart
from models.objects.paint import noise, plain
from models.objects.surface import (
    Surface,
    circle,
    disc,
    ellipsoid,
    join,
    plate,
    revolve,
    rounded_box,
    sweep,
)
from models.objects.words import ObjectWords

build = functools.cache(build_asset)

_PATH = np.stack([np.linspace(0, 1, 9), np.sin(np.linspace(0, 1, 9)), np.zeros(9)], axis=1)
_TURN = np.linspace(0, 2 * np.pi, 64, endpoint=False)
_HOOP = np.stack([np.cos(_TURN), np.sin(_TURN), 0 * _TURN], axis=1)


def _mesh(surface: Surface) -> trimesh.Trimesh:
    return closed_mesh(surface.vertices, surface.faces)


# Volumes of the exact bodies; polygons of n sides fall short by 2 pi^2 / (3 n^2) or so.
CLOSED = {
    "cylinder": (revolve([(0, 0), (1, 0), (1, 2), (0, 2)], num_columns=200), 2 * np.pi),
    "cone": (revolve([(0, 0), (1, 0), (0, 3)], num_columns=200), np.pi),
    "ring": (
        revolve([(2, -0.5), (3, -0.5), (3, 0.5), (2, 0.5)], num_columns=200, loop=True),
        5 * np.pi,
    ),
    "ellipsoid": (
        ellipsoid((1, 2, 3), num_rings=120, num_columns=120),
        8 * np.pi,
    ),
    "torus": (
        sweep(_HOOP, 0.1, num_columns=64, loop=True),
        2 * np.pi**2 * 0.01,
    ),
    "slanted rod": (
        sweep(np.array([(0, 0, 0), (1, 1, 1)]), 0.2, num_columns=100),
        np.pi * 0.04 * np.sqrt(3),
    ),
    "plate": (plate(circle(200), 0.5), np.pi / 2),
    "box": (join(rounded_box((1, 2, 3), 0.001)), 6.0),
}


@pytest.mark.parametrize("kind", CLOSED)
def test_surfaces_are_closed_outward_and_of_the_right_volume(kind):
    surface, volume = CLOSED[kind]
    mesh = _mesh(surface)
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(volume, rel=4e-3)
    assert surface.uv.min() >= -1e-12 and surface.uv.max() <= 1 + 1e-12


def test_moving_a_surface_keeps_volume_and_moves_the_centroid():
    surface = CLOSED["cone"][0]
    turn = Rotation.from_rotvec([0.3, -0.2, 0.9])
    moved = _mesh(surface.moved((1, 2, 3), turn))
    assert moved.volume == pytest.approx(_mesh(surface).volume)
    expected = np.add(turn.apply(_mesh(surface).center_mass), [1, 2, 3])
    np.testing.assert_allclose(moved.center_mass, expected, atol=1e-9)


def test_disc_faces_the_way_it_is_told():
    ring = np.column_stack([circle(12), np.zeros(12)])
    for faces_up, sign in ((True, 1), (False, -1)):
        surface = disc(ring, faces_up=faces_up)
        mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
        np.testing.assert_allclose(mesh.face_normals[:, 2], sign)


def test_atlas_gives_every_panel_its_own_colours():
    colors = [(255, 0, 0), (0, 255, 0), (0, 0, 255), (9, 9, 9)]
    images = [np.full((20 + 30 * k, 90, 3), color, np.uint8) for k, color in enumerate(colors)]
    panels = [Panel(surface=ellipsoid((1, 1, 1)), image=image) for image in images]
    surface, texture = join_panels(panels)
    column = np.minimum((surface.uv[:, 0] * texture.shape[1]).astype(int), texture.shape[1] - 1)
    row = np.minimum(((1 - surface.uv[:, 1]) * texture.shape[0]).astype(int), len(texture) - 1)
    expected = np.repeat(colors, len(panels[0].surface.vertices), axis=0)
    np.testing.assert_array_equal(texture[row, column], expected)


def test_atlas_refuses_what_does_not_fit():
    image = np.zeros((ATLAS_PX, 300, 3), np.uint8)
    panels = [Panel(surface=ellipsoid((1, 1, 1)), image=image + k) for k in range(2)]
    with pytest.raises(AssetError) as caught:
        join_panels(panels)
    assert str(caught.value) == (
        "Images of 2 panels do not fit a 512 px texture; paint them smaller."
    )


def test_open_solid_is_refused():
    ring = np.column_stack([circle(12), np.zeros(12)])
    shape = Shape(solids=[Solid.of(disc(ring, faces_up=True), plain((1, 2, 3)))], collision=[])
    with pytest.raises(AssetError, match=r"^Solid 0 of object 'lid' is not closed with its faces"):
        assemble(
            shape,
            name="lid",
            family="test",
            split="seen",
            words=ObjectWords(label="lid"),
            matter=Matter(source="test", mass_kg=1.0),
        )


def test_overlap_of_solids_counts_once():
    cube = Solid(
        panels=tuple(Panel(surface=s, image=plain((9, 9, 9))) for s in rounded_box((1, 1, 1), 1e-4))
    )
    half = Solid(
        panels=tuple(
            Panel(surface=s.moved((0.5, 0, 0)), image=plain((9, 9, 9)))
            for s in rounded_box((1, 0.5, 0.5), 1e-4)
        )
    )
    asset = assemble(
        Shape(solids=[cube, half], collision=[]),
        name="two",
        family="test",
        split="seen",
        words=ObjectWords(label="two"),
        matter=Matter(source="test", density_kg_m3=1000.0),
    )
    assert asset.mass_kg == pytest.approx(1125, rel=1e-3)


def test_noise_wraps_and_stays_in_range():
    image = noise(np.random.default_rng(0), (64, 128), (4, 8), 4)
    assert image.min() >= -1 and image.max() <= 1
    # The seam is no rougher than the rest.
    seam = np.abs(image[:, 0] - image[:, -1]).mean()
    inside = np.abs(np.diff(image, axis=1)).mean()
    assert seam < 2 * inside


BAD_PARTS = [
    (
        {"kind": "box", "size": (1.0, 1.0)},
        "A box part has sizes (1.0, 1.0); expected 3 positive numbers.",
    ),
    (
        {"kind": "sphere", "size": (0.0,)},
        "A sphere part has sizes (0.0,); expected 1 positive numbers.",
    ),
    (
        {"kind": "convex", "vertices": np.zeros((33, 3))},
        "A convex part has 33 vertices; convex parts have 4 to 32, primitives none.",
    ),
    (
        {"kind": "convex"},
        "A convex part has 0 vertices; convex parts have 4 to 32, primitives none.",
    ),
    (
        {"kind": "sphere", "size": (1.0,), "vertices": np.zeros((4, 3))},
        "A sphere part has 4 vertices; convex parts have 4 to 32, primitives none.",
    ),
]


@pytest.mark.parametrize(("fields", "message"), BAD_PARTS)
def test_bad_parts_are_refused(fields, message):
    with pytest.raises(AssetError) as caught:
        CollisionPart(**fields)
    assert str(caught.value) == message


@pytest.mark.parametrize("make", [collision.capsule, collision.rod])
def test_capsules_and_rods_reach_both_ends(make, reach):
    start, end = np.array([0.1, -0.2, 0.3]), np.array([-0.2, 0.1, -0.4])
    part = make(0.01, start, end)
    axis = (end - start) / np.linalg.norm(end - start)
    cap = 0.01 if part.kind == "capsule" else 0.0
    assert reach(part, axis) == pytest.approx(float(end @ axis) + cap, abs=1e-8)
    assert reach(part, -axis) == pytest.approx(float(-start @ axis) + cap, abs=1e-8)


@pytest.mark.parametrize("name", object_names())
def test_collision_parts_follow_the_mesh(name, reach):
    asset = build(name)
    for direction in np.concatenate([np.eye(3), -np.eye(3)]):
        seen = float((asset.vertices @ direction).max())
        felt = max(reach(part, direction) for part in asset.collision)
        # What is felt is seen; thin stems, leaves and tails are seen but not felt.
        assert felt - seen < 0.0025
        assert seen - felt < 0.025
    below = np.array([0.0, 0.0, -1.0])
    assert max(reach(part, below) for part in asset.collision) == pytest.approx(0, abs=0.0012)
