"""Objects as other projects describe them in MJCF."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import trimesh
from dm_control import mjcf
from PIL import Image

from models.importing.mjcf_folder import read_mjcf_object
from models.objects.mjcf_builder import build_object
from models.objects.mjcf_object import MjcfObject
from models.objects.words import ObjectWords

# As robosuite keeps them: a picture on all sides of a cube, the mesh both seen and felt, twice
# drawn, and sites that tell where the object ends.
ROBOSUITE = """
<mujoco model="tin">
  <asset>
    <mesh file="meshes/tin.stl" name="tin_mesh"/>
    <texture file="../textures/tin.png" name="tex-tin"/>
    <material name="paint" texture="tex-tin" texuniform="true" texrepeat="5 5" reflectance="0.7"/>
  </asset>
  <worldbody>
    <body>
      <body name="collision">
        <geom type="mesh" mesh="tin_mesh" density="100" friction="0.95 0.3 0.1" group="1"
          solref="0.001 1" solimp="0.998 0.998 0.001" condim="4" euler="0 0 0.5"/>
      </body>
      <body name="visual">
        <geom type="mesh" mesh="tin_mesh" material="paint" contype="0" conaffinity="0" group="0"
          mass="0.0001" euler="0 0 0.5"/>
        <geom type="mesh" mesh="tin_mesh" material="paint" contype="0" conaffinity="0" group="1"
          mass="0.0001" euler="0 0 0.5"/>
      </body>
      <site name="bottom_site" pos="0 0 -0.03"/>
      <site name="top_site" pos="0 0 0.03"/>
      <site name="horizontal_radius_site" pos="0.02 0.02 0"/>
    </body>
  </worldbody>
</mujoco>
"""
# As LIBERO keeps them: a scaled scan, and boxes that cover it.
LIBERO = """
<mujoco model="textured">
  <asset>
    <texture file="map.png" name="tex" type="2d"/>
    <material name="textured" texture="tex" texuniform="false"/>
    <mesh file="visual/scan.obj" name="scan" scale="0.01 0.01 0.01"/>
  </asset>
  <worldbody>
    <body>
      <body name="object" pos="0.3 0.1 0.7">
        <geom type="mesh" mesh="scan" material="textured" density="100" contype="0" conaffinity="0"
          group="1"/>
        <geom type="box" size="0.04 0.03 0.025" density="100" group="0" rgba="0.8 0.8 0.8 0.3"/>
        <geom type="box" size="0.04 0.02 0.01" density="100" pos="0 0 0.025" quat="0 1 0 0"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
# As obj2mjcf writes them: classes, names taken from files, one hull a file.
OBJ2MJCF = """
<mujoco model="scan">
  <default>
    <default class="visual"><geom group="2" type="mesh" contype="0" conaffinity="0"/></default>
    <default class="collision"><geom group="3" type="mesh"/></default>
  </default>
  <asset>
    <texture type="2d" name="skin" file="map.png"/>
    <material name="skin" texture="skin" specular="0.4" shininess="0.1"/>
    <mesh file="scan.obj"/>
    <mesh file="scan_collision_0.obj"/>
  </asset>
  <worldbody>
    <body name="scan">
      <freejoint/>
      <geom material="skin" mesh="scan" class="visual"/>
      <geom mesh="scan_collision_0" class="collision"/>
    </body>
  </worldbody>
</mujoco>
"""
PLAIN = """
<mujoco>
  <worldbody>
    <body>
      <inertial pos="0.01 0 0" mass="0.2" diaginertia="1e-4 2e-4 2e-4"/>
      <geom type="cylinder" size="0.02 0.05" pos="0 0 0.05"/>
      <body pos="0 0 0.1" euler="0 90 0">
        <inertial pos="0 0 0" mass="0.1" diaginertia="1e-5 1e-5 2e-5"/>
        <geom type="capsule" size="0.01" fromto="0 0 0 0.05 0 0.02"/>
        <geom type="ellipsoid" size="0.01 0.02 0.03" pos="0 0.02 0"/>
        <geom type="sphere" size="0.015" pos="0 -0.02 0"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def textured_box(extents, path):
    """Save a box with texture coordinates, each side with the whole picture."""
    box = trimesh.creation.box(extents)
    corners = box.vertices[box.faces].reshape(-1, 3)
    along = np.abs(np.repeat(box.face_normals, 3, axis=0)).argmax(axis=1)
    kept = np.array([(1, 2), (0, 2), (0, 1)])[along]
    uv = np.take_along_axis(corners / extents + 0.5, kept, axis=1)
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"vt {u} {v}" for u, v in uv]
    lines += [f"f {i}/{i} {i + 1}/{i + 1} {i + 2}/{i + 2}" for i in range(1, 37, 3)]
    path.write_text("\n".join(lines) + "\n")


def picture(path, mode="RGB"):
    path.parent.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(4)
    channels = len(mode)
    pixels = rng.integers(0, 256, (24, 24, channels), dtype=np.uint8)
    pixels[:12, :, 0] = 250
    Image.fromarray(pixels.squeeze(), mode).resize((96, 96), Image.Resampling.NEAREST).save(path)


@pytest.fixture
def robosuite(tmp_path):
    (tmp_path / "objects" / "meshes").mkdir(parents=True)
    trimesh.creation.cylinder(0.03, 0.07).export(tmp_path / "objects" / "meshes" / "tin.stl")
    picture(tmp_path / "textures" / "tin.png")
    path = tmp_path / "objects" / "tin.xml"
    path.write_text(ROBOSUITE)
    return path


@pytest.fixture
def libero(tmp_path):
    textured_box(np.array([8, 6, 7]), tmp_path / "visual" / "scan.obj")
    picture(tmp_path / "map.png")
    path = tmp_path / "textured.xml"
    path.write_text(LIBERO)
    return path


@pytest.fixture
def obj2mjcf(tmp_path):
    textured_box(np.array([0.08, 0.06, 0.07]), tmp_path / "scan.obj")
    trimesh.creation.box((0.08, 0.06, 0.07)).export(tmp_path / "scan_collision_0.obj")
    picture(tmp_path / "map.png")
    path = tmp_path / "scan.xml"
    path.write_text(OBJ2MJCF)
    return path


@pytest.fixture
def plain(tmp_path):
    path = tmp_path / "plain.xml"
    path.write_text(PLAIN)
    return path


@pytest.fixture(scope="session")
def words() -> ObjectWords:
    return ObjectWords(label="thing", synonyms=("object",), colors=("red",))


@pytest.fixture(scope="session")
def read(words: ObjectWords) -> Callable[..., MjcfObject]:
    """Reads an object that may take files from the folder above its own."""

    def read(path: Path, **options: Any) -> MjcfObject:
        return read_mjcf_object(path, name="thing", words=words, root=path.parents[1], **options)

    return read


@pytest.fixture(scope="session")
def compiled() -> Callable[[MjcfObject], mujoco.MjModel]:
    """Compiles an object alone."""

    def compile_alone(item: MjcfObject) -> mujoco.MjModel:
        return mjcf.Physics.from_mjcf_model(build_object(item)).model.ptr

    return compile_alone
