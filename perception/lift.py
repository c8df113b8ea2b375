"""Lift text-aligned features from RGB-D views onto a point cloud, and find what texts name.

    python -m perception.lift VIEWS --text "banana" "red mug" --out DIR
    python -m perception.lift --rgb color.png --depth depth.png --depth-scale 1000
        --intrinsics 631 631 638 366 --text "banana" --out DIR

VIEWS is a folder: rgb/, depth/ and cameras.json, a BOP or GraspNet-1Billion scene, a TUM RGB-D
sequence, or images with an Open3D pinhole trajectory. Writes the cloud with its features
(cloud.npz), and for each text a cloud coloured by similarity (.ply) and a heat map for each view.
"""

import os
import sys
import time
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from perception.errors import InvalidOptionError, PerceptionError

if TYPE_CHECKING:
    from perception.lifter import LifterConfig
    from perception.readers.frames import ReadOptions
    from perception.views import CameraView

USAGE_ERROR = 2
INTERRUPTED = 130


@dataclass(frozen=True, kw_only=True)
class LiftConfig:
    """Options of `python -m perception.lift`."""

    views: Annotated[Path | None, tyro.conf.Positional] = None
    """Folder of views; leave it out for a single pair."""
    rgb: Path | None = None
    """Colour image of a single pair."""
    depth: Path | None = None
    """Depth image of a single pair, registered to the colour image: 16-bit PNG or .npy."""
    intrinsics: tuple[float, float, float, float] | None = None
    """FX FY CX CY in pixels: needed for a pair, elsewhere in place of the folder's own."""
    depth_scale: float | None = None
    """Depth units in a metre, 1000 for millimetres: needed for a pair with PNG depth, elsewhere in
    place of the folder's own."""
    layout: str = "auto"
    """Layout of the folder: auto, folder, bop, graspnet, tum, open3d or pair."""
    frames: tuple[str, ...] = ()
    """Names of the views to take; by default as many as --max-views allows, spread evenly."""
    max_views: int = 12
    """Most views to take of a folder."""
    text: tuple[str, ...] = ()
    """Phrases or instructions, each in quotes: "banana" "put the mug next to the red box"."""
    out: Path
    """New folder for the results."""
    encoder: str = "embedded"
    """Image and text encoder: embedded (comes with the package), or ViT-L-14, ViT-B-16, ... from
    open_clip, optionally with a tag or file after a colon."""
    allow_download: bool = False
    """Let the encoder fetch missing weights from the hub."""
    workspace: tuple[float, float, float, float, float, float] | None = None
    """Box to look at, X0 Y0 Z0 X1 Y1 Z1 in metres, world; by default all that has depth."""
    max_depth: float = 3.0
    """Depth in metres beyond which nothing counts."""
    voxel_size: float | None = None
    """Edge of the voxels of the fine cloud in metres; by default two pixels at the median depth."""


def run(config: LiftConfig) -> int:
    """Read views, lift, answer, write.

    Args:
        config: Options.

    Returns:
        Exit status.

    Raises:
        PerceptionError: If anything given cannot be used.
    """
    _check(config)
    from perception.language import parse_instruction
    from perception.readers.frames import ReadOptions
    from perception.text_scores import check_length

    for text in config.text:  # mistakes first: what follows takes longer
        parse_instruction(text)
        check_length(text)
    views = _read(
        config,
        ReadOptions(
            names=config.frames,
            max_views=config.max_views,
            depth_scale=config.depth_scale,
            intrinsics=config.intrinsics,
            max_depth_m=config.max_depth,
        ),
    )
    from perception.encoders import load_encoder
    from perception.lifter import MultiViewLifter
    from perception.report import write_results

    lifter_config = _lifter_config(config, views)
    encoder = load_encoder(config.encoder, allow_download=config.allow_download)
    lifter = MultiViewLifter(encoder, lifter_config)
    start = time.perf_counter()
    scene = lifter.lift(views)
    seconds = time.perf_counter() - start
    for line in write_results(config.out, views, scene, config.text, lifter_config, seconds):
        print(line)
    return 0


def _check(config: LiftConfig) -> None:
    """Refuse what can be refused before anything heavy is loaded."""
    is_pair = config.rgb is not None or config.depth is not None
    if is_pair == (config.views is not None) or (config.rgb is None) != (config.depth is None):
        raise InvalidOptionError(
            "Expected either a folder of views, or both --rgb and --depth of a single pair."
        )
    out = config.out
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InvalidOptionError(
            f"--out {out}: exists and is not an empty folder; choose a new one."
        )
    ancestor = next(path for path in (out, *out.absolute().parents) if path.exists())
    if not (ancestor.is_dir() and os.access(ancestor, os.W_OK)):
        raise InvalidOptionError(
            f"--out {out}: cannot be made, since {ancestor} is no folder that can be written to."
        )


def _read(config: LiftConfig, options: "ReadOptions") -> "tuple[CameraView, ...]":
    from perception.readers import detect_layout, list_views, read_pair, read_views

    if config.views is None:
        assert config.rgb is not None and config.depth is not None
        views = (read_pair(config.rgb, config.depth, options),)
        print(f"Views   {config.rgb} with {config.depth}")
        return views
    layout = detect_layout(config.views) if config.layout == "auto" else config.layout
    num_frames = len(list_views(config.views, layout, options))
    views = read_views(config.views, layout, options)
    names = ", ".join(view.name for view in views)
    print(f"Views   {len(views)} of {num_frames} in {config.views} (layout {layout}): {names}")
    return views


def _lifter_config(config: LiftConfig, views: "tuple[CameraView, ...]") -> "LifterConfig":
    from perception.fitting import fit_config

    return fit_config(views, workspace=config.workspace, voxel_size_m=config.voxel_size)


def main() -> None:
    """Entry point of the command line: mistakes end in one line on stderr and status 2."""
    config = tyro.cli(LiftConfig, description=__doc__)
    # Open3D's notebook parts warn about packages that nothing here needs.
    warnings.filterwarnings("ignore", category=DeprecationWarning)
    try:
        status = run(config)
    except (PerceptionError, OSError) as error:  # OSError: a full disk, a lost drive
        print(f"error: {error}", file=sys.stderr)
        status = USAGE_ERROR
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        status = INTERRUPTED
    sys.exit(status)


if __name__ == "__main__":
    main()
