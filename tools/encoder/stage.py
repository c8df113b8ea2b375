"""A stage for training pictures: a table, a batch of objects, and cameras all around."""

import dataclasses
import io
from dataclasses import dataclass

import mujoco
import numpy as np
from dm_control import mjcf
from PIL import Image
from scipy.ndimage import gaussian_filter

from models.camera_mjcf import add_cameras
from models.cameras import L515, CameraPlacement, camera_preset
from models.objects import families
from models.objects.asset import ObjectAsset
from models.objects.catalogue import load_object, object_names
from models.objects.mjcf_builder import build_object
from models.tabletop import TABLE_GEOM, build_tabletop
from sr_mj.scene.compose import compile_mjcf

NUM_OBJECTS = 24
NUM_CAMERAS = 16
# The sensor of the scenes, so that pictures have their sharpness; close-ups come nearer to it.
SENSOR = dataclasses.replace(L515, range_m=(0.15, 9.0))
# Shares of the catalogue's seen split; the rest is drawn from the families.
CATALOGUE_SHARE = {"train": 0.25, "val": 0.0, "seen": 1.0, "unseen": 1.0}


@dataclass(frozen=True, kw_only=True, eq=False)
class Stage:
    """A compiled stage.

    Attributes:
        model: The compiled model.
        assets: The objects.
        qpos_adr: Address of every object's free joint in `qpos`.
        body_ids: Body of every object.
        cameras: The cameras.
    """

    model: mujoco.MjModel
    assets: tuple[ObjectAsset, ...]
    qpos_adr: tuple[int, ...]
    body_ids: tuple[int, ...]
    cameras: tuple[CameraPlacement, ...]


def build_stage(split: str, rng: np.random.Generator) -> Stage:
    """Draw objects, cameras and a table, and compile them.

    Args:
        split: One of `CATALOGUE_SHARE`: "train" and "val" draw from the families, "train" also
            from the seen objects, "seen" and "unseen" from a split of the catalogue alone.
        rng: Source of randomness.

    Returns:
        The stage.
    """
    assets = _draw_assets(split, rng)
    cameras = _draw_cameras(rng)
    root = build_tabletop("stage")
    root.visual.map.znear = 0.05
    root.option.timestep = 0.004
    root.option.noslip_iterations = 0
    root.option.flag.sleep = "disable"
    if rng.random() < 0.5:
        _paint_table(root, rng)
    add_cameras(root, cameras)
    for index, asset in enumerate(assets):
        frame = root.attach(build_object(asset, name=f"object_{index}"))
        frame.add("freejoint")
    model = compile_mjcf(root)
    frames = [model.body(f"object_{index}/") for index in range(len(assets))]
    return Stage(
        model=model,
        assets=assets,
        qpos_adr=tuple(int(model.joint(int(f.jntadr[0])).qposadr[0]) for f in frames),
        body_ids=tuple(model.body(f"object_{i}/object").id for i in range(len(assets))),
        cameras=cameras,
    )


def _draw_assets(split: str, rng: np.random.Generator) -> tuple[ObjectAsset, ...]:
    names = list(object_names("unseen" if split == "unseen" else "seen"))
    num_known = min(len(names), round(CATALOGUE_SHARE[split] * NUM_OBJECTS))
    known = [load_object(str(name)) for name in rng.permutation(names)[:num_known]]
    if CATALOGUE_SHARE[split] == 1.0:
        return tuple(known)
    drawn = [families.sample(rng) for _ in range(NUM_OBJECTS - num_known)]
    return tuple(known + drawn)


def _draw_cameras(rng: np.random.Generator) -> tuple[CameraPlacement, ...]:
    """Draw cameras: half of them near those of preset `sr`, half closer, from any side."""
    placements = []
    preset = camera_preset("sr")
    for index in range(NUM_CAMERAS // 2):
        near = preset[index % len(preset)]
        position = np.asarray(near.position) + rng.normal(0, 0.03, 3)
        target = np.asarray(near.target) + rng.normal(0, 0.02, 3)
        placements.append(_placement(index, position, target, near.up))
    for index in range(NUM_CAMERAS // 2, NUM_CAMERAS):
        azimuth, distance = rng.uniform(0, 2 * np.pi), rng.uniform(0.32, 0.7)
        elevation = np.deg2rad(rng.uniform(25, 80))
        target = np.array([*rng.uniform((0.4, -0.1), (0.6, 0.1)), 0.03])
        direction = np.array([np.cos(azimuth), np.sin(azimuth), np.tan(elevation)])
        position = target + distance * direction / np.linalg.norm(direction)
        placements.append(_placement(index, position, target, (0.0, 0.0, 1.0)))
    return tuple(placements)


def _placement(
    index: int, position: np.ndarray, target: np.ndarray, up: tuple[float, float, float]
) -> CameraPlacement:
    x, y, z = position.tolist()
    u, v, w = target.tolist()
    return CameraPlacement(
        name=f"camera_{index}", position=(x, y, z), target=(u, v, w), up=up, sensor=SENSOR
    )


def _paint_table(root: mjcf.RootElement, rng: np.random.Generator) -> None:
    """Give the table a grained texture: stretched noise between two shades."""
    sigma = rng.uniform(0.5, 12, 2)
    noise = gaussian_filter(rng.normal(size=(256, 256)), sigma, mode="wrap")
    noise = np.clip(0.5 + noise / (6 * noise.std()), 0, 1)[..., None]
    dark = rng.uniform(0.3, 0.95, 3)
    image = (255 * (dark + (1 - dark) * noise)).astype(np.uint8)
    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, format="PNG")
    texture = root.asset.add(
        "texture", name="grain", type="2d", file=mjcf.Asset(buffer.getvalue(), ".png")
    )
    repeat = rng.uniform(1, 6)
    material = root.asset.add(
        "material", name="grain", texture=texture, texrepeat=(repeat, repeat), texuniform=True
    )
    root.find("geom", TABLE_GEOM).material = material
