"""Convert the UR5 meshes of the PyPI package `example-robot-data` into `models/assets/ur5`.

    pip install example-robot-data
    python tools/convert_ur5_meshes.py

The package (`ur_description`, BSD-3-Clause) is needed for this conversion only, never to run the
project. Vertices are merged and stored as binary STL, metres, in the link frames of its URDF.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import trimesh
import tyro

LINKS = ("base", "shoulder", "upperarm", "forearm", "wrist1", "wrist2", "wrist3")
MESH_FOLDER = "cmeel.prefix/share/example-robot-data/robots/ur_description/meshes/ur5/collision"


@dataclass(frozen=True, kw_only=True)
class ConvertConfig:
    """Where the meshes come from and go to.

    Attributes:
        source: Folder with the STL files; by default that of the installed package.
        dest: Folder that receives the converted files.
    """

    source: Path | None = None
    dest: Path = Path("models/assets/ur5")


def find_source() -> Path:
    """Return the mesh folder of the installed `example-robot-data` package."""
    for entry in map(Path, sys.path):
        if (entry / MESH_FOLDER).is_dir():
            return entry / MESH_FOLDER
    sys.exit("UR5 meshes not found. Install them with: pip install example-robot-data")


def main(config: ConvertConfig) -> None:
    """Write one binary STL per link."""
    source = config.source or find_source()
    config.dest.mkdir(parents=True, exist_ok=True)
    for link in LINKS:
        mesh = trimesh.load_mesh(source / f"{link}.stl")
        mesh.merge_vertices()
        mesh.update_faces(mesh.nondegenerate_faces())
        mesh.export(config.dest / f"{link}.stl")
        print(f"{link}: {len(mesh.faces)} triangles")


if __name__ == "__main__":
    main(tyro.cli(ConvertConfig, description=__doc__))
