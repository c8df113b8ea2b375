"""Export a settled scene as plain MJCF for use without this project.

    python -m sr_mj.export --scene cluttered15 --seed 0 --out my_scene

The folder loads anywhere with mujoco.MjModel.from_xml_path("my_scene/scene.xml"); its keyframe
"settled" holds the objects at rest and the robot at home.
"""

import json
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from sr_mj.cli import run_command
from sr_mj.errors import ConfigError

if TYPE_CHECKING:
    from sr_mj.scene import Scene, SceneConfig

XML_NAME = "scene.xml"
ASSET_FOLDER = "assets"
KEYFRAME = "settled"

_README = """# {title}

A tabletop scene with a UR5 and a parallel gripper, exported by sr-mj {version}.

    import mujoco
    model = mujoco.MjModel.from_xml_path("{xml}")
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("{keyframe}").id)

`scene.json` has the instruction, the objects that satisfy it, every object's words and pose, and
the cameras (OpenCV axes, pixel centres at integer coordinates). World frame: robot base at the
origin, z up, table surface at z = 0; SI units. Position actuators: six joints of the arm in
radians, and the travel of each finger in metres (0 closed, 0.0425 open).

Made with {versions}. Another version of MuJoCo may simulate it slightly differently.

Licences: the scene and its objects are made by sr-mj (MIT). The UR5's meshes, link masses and
joint limits come from `ur_description` (BSD-3-Clause).
"""


@dataclass(frozen=True, kw_only=True)
class ExportConfig:
    """Options of `python -m sr_mj.export`."""

    out: Annotated[Path, tyro.conf.arg(metavar="DIR")]
    """Folder to create."""
    scene: str = "cluttered15"
    """Kind of scene (cluttered15, place8, pickplace8, heavy30, single, empty), or a fixed
    arrangement such as place-seen-03."""
    split: str = "seen"
    """Objects to use: seen or unseen."""
    seed: int = 0
    """Draws objects, how they fall, and goal."""
    objects: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Folder of objects made by `python -m models.import_objects`, to use instead of ours."""
    goal: str | None = None
    """Instruction in free words; drawn from templates by default."""
    cameras: str = "sr"
    """Camera preset: sr or a2."""


def scene_xml(scene: "Scene") -> str:
    """Write a scene as one MJCF document with its keyframe; assets lie in `ASSET_FOLDER`.

    Args:
        scene: The scene, in any state; the keyframe holds the state in which it was made.

    Returns:
        The XML. Numbers keep 17 digits, so that they read back bit for bit.
    """
    from lxml import etree

    from sr_mj.scene.compose import home_state

    tree = etree.fromstring(scene.root.to_xml_string())
    compiler = tree.find("compiler")
    compiler.set("meshdir", ASSET_FOLDER)
    compiler.set("texturedir", ASSET_FOLDER)
    key = etree.SubElement(etree.SubElement(tree, "keyframe"), "key", name=KEYFRAME)
    key.set("qpos", " ".join(f"{x:.17g}" for x in scene.settled_qpos))
    key.set("ctrl", " ".join(f"{x:.17g}" for x in home_state(scene.model).ctrl))
    return etree.tostring(tree, pretty_print=True, encoding="unicode")


def scene_description(scene: "Scene") -> dict[str, Any]:
    """Describe a scene as plain JSON values: goal, targets, objects, cameras, workspace."""
    from dataclasses import asdict

    from models.cameras import camera_preset
    from sr_mj.provenance import git_revision, package_versions

    qpos = scene.settled_qpos
    return {
        "config": _config_record(scene.config),
        "goal": scene.goal.text,
        "targets": list(scene.goal.targets),
        "place": None if scene.goal.place is None else asdict(scene.goal.place),
        "objects": [
            {
                "name": item.name,
                "object": item.asset.name,
                "body": f"{item.name}/",
                "words": asdict(item.words),
                "mass_kg": item.asset.mass_kg,
                "position_m": qpos[item.body.qpos][:3].tolist(),
                "quat_wxyz": qpos[item.body.qpos][3:].tolist(),
            }
            for item in scene.objects
        ],
        "cameras": [
            {
                "name": camera.name,
                "intrinsics": asdict(camera.sensor),
                "T_world_cam_cv": camera.T_world_cam_cv().tolist(),
            }
            for camera in camera_preset(scene.config.cameras)
        ],
        "workspace": asdict(scene.workspace),
        "keyframe": KEYFRAME,
        "versions": package_versions(),
        "git_revision": git_revision(),
    }


def _config_record(config: "SceneConfig") -> dict[str, Any]:
    """Write a configuration as JSON values; an arrangement by its name."""
    from dataclasses import asdict

    plain = asdict(config)
    plain["arrangement"] = None if config.arranged is None else config.arranged.name
    plain["catalogue"] = None if config.catalogue is None else str(config.catalogue)
    return plain


def export_scene(scene: "Scene", out: Path) -> None:
    """Write a scene as a self-contained folder; it appears only when it is complete.

    Args:
        scene: The scene.
        out: Folder to create; its parent exists.

    Raises:
        ConfigError: If the folder exists and is not empty, or its parent does not exist.
    """
    from sr_mj.provenance import package_versions

    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise ConfigError(f"Cannot export to {str(out)!r}: it exists and is not empty.")
    if not out.absolute().parent.is_dir():
        raise ConfigError(f"Cannot export to {str(out)!r}: create its parent folder first.")
    versions = package_versions()
    with tempfile.TemporaryDirectory(dir=out.absolute().parent, prefix=".export-") as scratch:
        folder = Path(scratch) / "scene"
        (folder / ASSET_FOLDER).mkdir(parents=True)
        (folder / XML_NAME).write_text(scene_xml(scene))
        for name, content in scene.root.get_assets().items():
            (folder / ASSET_FOLDER / name).write_bytes(content)
        description = json.dumps(scene_description(scene), indent=2)
        (folder / "scene.json").write_text(description + "\n")
        readme = _README.format(
            title=scene.config.title,
            version=versions["sr-mj"],
            xml=XML_NAME,
            keyframe=KEYFRAME,
            versions=", ".join(f"{name} {versions[name]}" for name in ("mujoco", "dm-control")),
        )
        (folder / "README.md").write_text(readme)
        if out.exists():
            out.rmdir()
        folder.rename(out)


def export(config: ExportConfig) -> int:
    """Make a scene and export it; returns exit status 0."""
    from sr_mj.scene import make_scene, scene_config

    scene = make_scene(
        scene_config(
            config.scene,
            split=config.split,
            seed=config.seed,
            goal=config.goal,
            cameras=config.cameras,
            catalogue=config.objects,
        )
    )
    export_scene(scene, config.out)
    print(f"{config.out / XML_NAME}: {len(scene.objects)} objects, goal {scene.goal.text!r}")
    return 0


def main() -> None:
    """Entry point of the command line."""
    run_command(ExportConfig, export, description=__doc__ or "")


if __name__ == "__main__":
    sys.exit(main())
