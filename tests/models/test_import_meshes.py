import json
import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from scipy.spatial import KDTree

from models.drop_test import drop_object, find_faults
from models.errors import ImportRefusedError
from models.importing.decimate import MAX_FACES, make_skin, orient, simplify
from models.importing.decompose import Decomposition, decompose
from models.importing.labels import label_from_stem
from models.importing.mesh_object import MeshSettings, mesh_key, read_mesh_object
from models.importing.scan import Piece, Scan, read_scan
from models.objects.cache import encode
from models.objects.collision import MAX_VERTICES

COARSE = Decomposition(threshold=0.5, mcts_iterations=20, resolution=200, preprocess_resolution=20)
QUICK = MeshSettings(decomposition=COARSE)
LABEL = label_from_stem("thing")


@pytest.fixture(autouse=True)
def _own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SR_MJ_CACHE", str(tmp_path / "cache"))


def write_textured(path, mesh=None, picture=None):
    """Write an OBJ with an MTL and a PNG; the picture is red on the left, blue on the right."""
    mesh = trimesh.creation.box((0.06, 0.04, 0.08)) if mesh is None else mesh
    path.parent.mkdir(parents=True, exist_ok=True)
    if picture is None:
        picture = np.zeros((64, 64, 3), np.uint8)
        picture[:, :32, 0], picture[:, 32:, 2] = 255, 255
    uv = (mesh.vertices[:, :2] - mesh.bounds[0, :2]) / mesh.extents[:2]
    lines = ["mtllib thing.mtl", "usemtl skin"]
    lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.vertices]
    lines += [f"vt {u:.6f} {v:.6f}" for u, v in uv]
    lines += ["f " + " ".join(f"{i + 1}/{i + 1}" for i in face) for face in mesh.faces]
    path.write_text("\n".join(lines) + "\n")
    (path.parent / "thing.mtl").write_text("newmtl skin\nKd 0.8 0.8 0.8\nmap_Kd skin.png\n")
    Image.fromarray(picture).save(path.parent / "skin.png")
    return path


def read(path, label=LABEL, settings=QUICK):
    return read_mesh_object(path, path.parent, label, settings)


def test_a_textured_box_keeps_its_texture_and_weighs_what_its_volume_says(tmp_path):
    imported = read(write_textured(tmp_path / "box.obj"))
    asset = imported.asset
    assert imported.notes == ()
    np.testing.assert_allclose(asset.vertices.min(axis=0), (-0.03, -0.02, 0), atol=1e-9)
    np.testing.assert_allclose(asset.vertices.max(axis=0), (0.03, 0.02, 0.08), atol=1e-9)
    assert asset.texture.shape == (64, 64, 3) and len(asset.faces) == 12
    assert asset.mass_kg == pytest.approx(400 * 0.06 * 0.04 * 0.08)
    np.testing.assert_allclose(asset.center_of_mass, (0, 0, 0.04), atol=1e-6)
    expected = (
        asset.mass_kg / 12 * np.diag([0.04**2 + 0.08**2, 0.06**2 + 0.08**2, 0.06**2 + 0.04**2])
    )
    np.testing.assert_allclose(asset.inertia, expected, rtol=1e-6, atol=1e-12)
    (part,) = asset.collision
    corners = part.vertices + part.position
    np.testing.assert_allclose(corners.max(axis=0), (0.03, 0.02, 0.08), atol=1e-6)
    assert not asset.rolls
    assert find_faults(drop_object(asset)) == []


def test_the_same_file_gives_the_same_bytes(tmp_path):
    ball = trimesh.creation.icosphere(2, 0.03)
    ball.visual.vertex_colors = np.random.default_rng(0).integers(0, 255, (len(ball.vertices), 4))
    path = tmp_path / "ball.ply"
    ball.export(path)
    assert encode(read(path).asset) == encode(read(path).asset)


def test_large_pictures_shrink_to_512(tmp_path):
    picture = np.zeros((600, 1200, 3), np.uint8)
    path = write_textured(tmp_path / "box.obj", picture=picture)
    assert read(path).asset.texture.shape == (256, 512, 3)


def test_a_heavy_mesh_is_decimated_and_keeps_shape_and_colours(tmp_path):
    ball = trimesh.creation.icosphere(5, 0.03)
    assert len(ball.faces) > MAX_FACES
    path = write_textured(tmp_path / "ball.obj", ball)
    scan = read_scan(path, tmp_path)
    light = simplify(orient(scan.welded()))
    skin = make_skin(scan, light)
    assert len(skin.faces) <= MAX_FACES and max(skin.texture.shape) <= 512
    np.testing.assert_allclose(np.linalg.norm(skin.vertices, axis=1), 0.03, atol=1e-4)
    # The middles of faces must have the colour that the original has there: red at x < 0.
    middles = skin.vertices[skin.faces].mean(axis=1)
    column, row = (skin.uv[skin.faces].mean(axis=1) * (1, -1) + (0, 1)).T
    rows, columns = skin.texture.shape[:2]
    seen = skin.texture[(row * rows).astype(int), (column * columns).astype(int)].astype(int)
    clear = np.abs(middles[:, 0]) > 0.001
    expected = np.where(middles[:, :1] < 0, (255, 0, 0), (0, 0, 255))
    assert np.abs(seen - expected)[clear].max() <= 2


def test_both_sides_of_a_thin_sheet_keep_their_own_colours():
    sheet = trimesh.creation.box((0.1, 0.1, 0.001)).subdivide_loop(0).subdivide().subdivide()
    colors = np.where(sheet.face_normals[:, 2:] > 0, (1.0, 0, 0), (0, 0, 1.0))
    corners = np.repeat(colors[:, None], 3, axis=1)
    piece = Piece(
        vertices=np.asarray(sheet.vertices), faces=np.asarray(sheet.faces),
        uv=None, image=None, corner_colors=corners,
    )  # fmt: skip
    scan = Scan(pieces=(piece,))
    skin = make_skin(scan, scan.welded())
    triangles = skin.vertices[skin.faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    column, row = (skin.uv[skin.faces].mean(axis=1) * (1, -1) + (0, 1)).T
    rows, columns = skin.texture.shape[:2]
    seen = skin.texture[(row * rows).astype(int), (column * columns).astype(int)]
    flat = np.abs(normals[:, 2]) > 0.9 * np.linalg.norm(normals, axis=1)
    assert flat.sum() > 20
    assert np.all((seen[flat][:, 0] > 250) == (normals[flat][:, 2] > 0))


@pytest.mark.parametrize("suffix", ["glb", "ply", "stl"])
def test_other_formats(tmp_path, suffix):
    mesh = trimesh.creation.cylinder(radius=0.03, height=0.1)
    if suffix == "ply":
        mesh.visual.vertex_colors = (0, 200, 0, 255)
    path = tmp_path / f"can.{suffix}"
    mesh.export(path)
    asset = read(path).asset
    np.testing.assert_allclose(asset.size_m, (0.06, 0.06, 0.1), atol=1e-4)
    assert asset.rolls
    if suffix == "ply":
        assert np.all(asset.texture == (0, 200, 0))


def test_axis_unit_and_weight_follow_the_settings(tmp_path):
    path = write_textured(tmp_path / "box.obj", trimesh.creation.box((60, 40, 80)))
    with pytest.raises(
        ImportRefusedError, match=r"is 80 m large; .* millimetre: add --scale 0\.001"
    ):
        read(path)
    settings = MeshSettings(scale=0.001, up="y", density_kg_m3=1000.0, decomposition=COARSE)
    asset = read(path, settings=settings).asset
    np.testing.assert_allclose(asset.size_m, (0.06, 0.08, 0.04), atol=1e-9)
    assert asset.mass_kg == pytest.approx(0.192)


def test_a_mesh_that_is_not_closed_is_weighed_by_its_hull(tmp_path):
    box = trimesh.creation.box((0.06, 0.06, 0.06))
    box.update_faces(box.face_normals[:, 2] < 0.5)
    path = write_textured(tmp_path / "open.obj", box)
    imported = read(path, settings=MeshSettings(decomposition=Decomposition(threshold=1.0)))
    assert imported.notes == (
        f"{path} is not watertight: mass and inertia are those of its convex hull.",
    )
    assert imported.asset.mass_kg == pytest.approx(400 * 0.06**3)


def test_a_hollow_stays_open_and_parts_stay_small(tmp_path):
    mesh = trimesh.creation.annulus(r_min=0.03, r_max=0.04, height=0.02)
    parts = decompose(mesh, Decomposition(threshold=0.1, mcts_iterations=20, resolution=500))
    assert 3 <= len(parts) <= 24
    hulls = [trimesh.convex.convex_hull(part.vertices + part.position) for part in parts]
    assert max(len(part.vertices) for part in parts) <= MAX_VERTICES
    # Nothing fills the middle, and every point of the ring is near some part.
    assert not any(hull.contains([(0, 0, 0)])[0] for hull in hulls)
    ring = mesh.sample(300, seed=0)
    surfaces = np.concatenate([hull.sample(800, seed=0) for hull in hulls])
    assert KDTree(surfaces).query(ring)[0].max() < 0.006


def test_a_decomposition_is_remembered(tmp_path):
    mesh = trimesh.creation.annulus(r_min=0.03, r_max=0.04, height=0.02)
    first = decompose(mesh, COARSE)
    (file,) = (tmp_path / "cache" / "decompositions").iterdir()
    stamp = file.stat().st_mtime_ns
    again = decompose(mesh, COARSE)
    assert file.stat().st_mtime_ns == stamp
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.vertices, other.vertices)
    file.write_bytes(b"half")
    assert len(decompose(mesh, COARSE)) == len(first)
    assert file.stat().st_size > 100


def test_the_key_follows_everything_that_shapes_the_object(tmp_path):
    path = write_textured(tmp_path / "box.obj")
    key = mesh_key(path, tmp_path, LABEL, QUICK)
    assert mesh_key(path, tmp_path, LABEL, QUICK) == key
    assert mesh_key(path, tmp_path, LABEL, MeshSettings()) != key
    Image.new("RGB", (8, 8)).save(tmp_path / "skin.png")
    assert mesh_key(path, tmp_path, LABEL, QUICK) != key


def broken_glb():
    text = json.dumps({"asset": {"version": "2.0"}, "images": [{"uri": "/etc/x.png"}]}).encode()
    return b"glTF" + np.array([2, 20 + len(text), len(text)], "<u4").tobytes() + b"JSON" + text


def edit(name, old, new):
    def change(folder):
        path = folder / name
        path.write_text(path.read_text().replace(old, new))

    return change


def put(name, data):
    return lambda folder: (folder / name).write_bytes(data)


def link_outside(folder):
    outside = folder.parent / "outside.png"
    Image.new("RGB", (4, 4)).save(outside)
    (folder / "skin.png").unlink()
    (folder / "skin.png").symlink_to(outside)


BAD = [
    (edit("thing.mtl", "skin.png", "none.png"), "box.obj", "{at}/thing.mtl names 'none.png', which does not exist; put the texture there."),
    (edit("thing.mtl", "skin.png", "/data/skin.png"), "box.obj", "{at}/thing.mtl names '/data/skin.png' by an absolute path; make it relative to the file."),
    (edit("box.obj", "thing.mtl", "C:/thing.mtl"), "box.obj", "{at}/box.obj names 'C:/thing.mtl' by an absolute path; make it relative to the file."),
    (edit("box.obj", "thing.mtl", "../x.mtl"), "box.obj", "{at}/box.obj names '../x.mtl', which leaves {at}; copy the file into the folder, or name a folder that contains both with --root."),
    (edit("box.obj", "thing.mtl", "none.mtl"), "box.obj", "{at}/box.obj names 'none.mtl', which does not exist; put the material file there, or remove the line mtllib."),
    (link_outside, "box.obj", "{at}/thing.mtl names 'skin.png', which leaves {at}; copy the file into the folder, or name a folder that contains both with --root."),
    (put("skin.png", b"\x89PNG but not for long"), "box.obj", "Texture {at}/skin.png cannot be read (cannot identify image file); replace the file."),
    (put("a.glb", b"gltf"), "a.glb", "{at}/a.glb is not a GLB file (unpack requires a buffer of 20 bytes); export it again."),
    (put("a.glb", broken_glb()), "a.glb", "{at}/a.glb names the file '/etc/x.png'; export the GLB with everything embedded."),
    (put("a.ply", b"plx"), "a.ply", "{at}/a.ply is not a PLY mesh with faces; export it again."),
    (put("a.obj", b"v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 1 2 3\n"), "a.obj", "{at}/a.obj has no thickness or no area (extents 100 x 100 x 0 mm); it must be a body."),
    (put("a.obj", b"v 0 0 0\n" + b"f 1 1 1\n" * 2_000_001), "a.obj", "{at}/a.obj has 2000001 triangles, at most 2000000 are read; decimate it first."),
]  # fmt: skip


@pytest.mark.parametrize(("change", "name", "message"), BAD, ids=range(len(BAD)))
def test_malformed_input_gets_one_clear_line(tmp_path, change, name, message):
    folder = tmp_path / "thing"
    write_textured(folder / "box.obj")
    change(folder)
    with pytest.raises(ImportRefusedError) as caught:
        read(folder / name)
    assert str(caught.value) == message.format(at=folder)


@pytest.mark.skipif(
    "SR_MJ_SHARED_DATA" not in os.environ, reason="SR_MJ_SHARED_DATA names no folder with ycb"
)
def test_a_real_scan_settles(tmp_path):
    folder = Path(os.environ["SR_MJ_SHARED_DATA"]) / "ycb" / "banana"
    path = folder / "textured_simple_reoriented.obj"
    imported = read(path, settings=MeshSettings(decomposition=COARSE))
    assert imported.notes == ()
    assert find_faults(drop_object(imported.asset)) == []
