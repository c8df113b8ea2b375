"""Take textured meshes or MJCF objects into a catalogue folder.

    python -m models.import_objects SRC DEST --labels words.yaml

SRC is a mesh (OBJ, GLB, STL, PLY), an MJCF file, an object's folder, or a folder of such folders as
YCB, GraspNet-1Billion, Google Scanned Objects, LIBERO, robosuite and obj2mjcf lay them out. The
folder DEST then serves as `--objects DEST` wherever a scene is made. Objects that are there already
are skipped, so an interrupted import goes on where it stopped. docs/importing.md has the details.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from models.errors import ImportRefusedError, ModelsError

_SIM_PACKAGES = ("dm_control", "lxml", "manifold3d", "mujoco", "shapely", "trimesh")
_USAGE_ERROR = 2


@dataclass(frozen=True, kw_only=True)
class ImportConfig:
    """Options of `python -m models.import_objects`."""

    src: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="SRC")]
    """A mesh, an MJCF file, or a folder of objects."""
    dest: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="DEST")]
    """Catalogue folder; made if there is none."""
    labels: Path | None = None
    """YAML file with the words of each object: label, synonyms, colours, mass, ..."""
    unlabelled: Literal["refuse", "skip", "stem"] = "refuse"
    """Objects that the words file lacks: refuse to start, skip them, or take the name of the
    folder or file for the label."""
    scale: float = 1.0
    """Factor that turns the unit of meshes into metres, 0.001 for millimetres."""
    up: Literal["z", "y"] = "z"
    """Axis of meshes that points up."""
    density: float = 400.0
    """Density in kg/m3 of meshes for which the words file has neither mass nor density."""
    threshold: float = 0.05
    """Concavity that coacd may leave in a convex part, 0.01 (fine, slow) to 1."""
    root: Path | None = None
    """Folder that meshes and MJCF files may take textures from; by default the object's own."""


def run(config: ImportConfig) -> int:
    """Import, and print what became of each object.

    Args:
        config: The options.

    Returns:
        Exit status: 0, or 2 if an object was refused.

    Raises:
        ModelsError: If nothing could be done; the message says why and what to do.
    """
    _check(config)
    from models.importing.decompose import Decomposition
    from models.importing.importer import import_objects, match_labels
    from models.importing.labels import read_labels
    from models.importing.mesh_object import MeshSettings
    from models.importing.sources import find_sources
    from models.importing.store import CatalogueStore

    settings = MeshSettings(
        scale=config.scale,
        up=config.up,
        density_kg_m3=config.density,
        decomposition=Decomposition(threshold=config.threshold),
    )
    store = CatalogueStore(config.dest)
    labels = {} if config.labels is None else read_labels(config.labels)
    matched = match_labels(find_sources(config.src, config.root), labels, config.unlabelled)
    tally = import_objects(matched, store, settings)
    for line in tally.notes:
        print(f"note: {line}", file=sys.stderr)
    for line in tally.refused:
        print(f"error: {line}", file=sys.stderr)
    print(
        f"{config.dest}: {len(tally.imported)} imported, {len(tally.kept)} already there, "
        f"{len(tally.refused)} refused"
    )
    return _USAGE_ERROR if tally.refused else 0


def _check(config: ImportConfig) -> None:
    """Refuse numbers that cannot be meant."""
    for option, value in (("--scale", config.scale), ("--density", config.density)):
        if not 0 < value < float("inf"):
            raise ImportRefusedError(f"{option} is {value}; expected a positive number.")
    if not 0.01 <= config.threshold <= 1:
        raise ImportRefusedError(f"--threshold is {config.threshold}; expected 0.01 to 1.")
    if config.root is not None and not config.root.is_dir():
        raise ImportRefusedError(f"--root {config.root} is no folder; name one that contains SRC.")


def main() -> None:
    """Parse the command line, import, exit; mistakes end in one line and status 2."""
    config = tyro.cli(ImportConfig, description=__doc__)
    try:
        status = run(config)
    except ModuleNotFoundError as error:
        if error.name not in _SIM_PACKAGES:
            raise
        print(
            f"error: {error.name} is not installed; pip install '.[sim]' in a clone",
            file=sys.stderr,
        )
        status = _USAGE_ERROR
    except ModelsError as error:
        print(f"error: {error}", file=sys.stderr)
        status = _USAGE_ERROR
    except OSError as error:
        reason = error.strerror or type(error).__name__
        print(f"error: {error.filename or config.dest}: {reason}", file=sys.stderr)
        status = _USAGE_ERROR
    except KeyboardInterrupt:
        print("interrupted; the same command goes on from here", file=sys.stderr)
        status = 130
    sys.exit(status)


if __name__ == "__main__":
    main()
