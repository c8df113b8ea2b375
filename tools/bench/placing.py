"""Measure place candidates against the truth of simulated scenes.

    python -m tools.bench.placing --seeds 100 140
    python -m tools.bench.placing --seeds 100 120 --kind pickplace8

Every third scene has an object to put things in, every third one to put things on. In every scene
some objects, one after another, are taken away with the best grasp on them that is truly good, and
the scene is looked at again without them. Then, for every other object as reference:

- *covered*: at one candidate or more the object's true centre lies in the true region of the
  relation;
- *placed*: the best candidate of those, executed by letting the object fall from the release
  pose, satisfies the protocol's rule. The gripper itself is not simulated here.

Writes one JSON line a scene as it ends and skips what the file already has.

"in" counts open vessels and "on" things with a flat top that are not much smaller than the object,
as the arrangements do; "near" counts everything around which the table has a free spot.
"""

import json
import time
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import shapely
import tyro
from tqdm import tqdm

from models.cameras import camera_preset
from perception.cloud import GeometryCloud
from perception.fusion import FusionConfig, fuse
from policy.actions import ActionCandidates
from sr_mj.candidates import AntipodalSampler
from sr_mj.candidates.held import HeldObject, held_object
from sr_mj.candidates.placing import SurfacePlacer
from sr_mj.gl import select_backend
from sr_mj.scene import Scene, SceneConfig, make_scene
from sr_mj.scene.config import SCENE_KINDS, Split
from sr_mj.scene.layout import state_at_rest
from sr_mj.scene.placement import (
    PlaceRegion,
    find_object,
    footprint,
    is_placed,
    place_region,
    touched_bodies,
)
from sr_mj.sensors.capture import capture_views
from sr_mj.sensors.l515 import L515NoiseConfig
from sr_mj.sensors.renderer import CameraRig
from tools.arrangements.draws import cast_around, reference_pool
from tools.bench.candidates import TrueScene
from tools.bench.policies import wilson_interval

# Where an object waits that was taken away: out of every view.
_AWAY = (0.5, 3.0, 1.0)
_REST_S = 2.0
RELATIONS = ("in", "on", "near")
_LARGEST_SHARE = 1.4
_RELEASE_SPEED = 0.01


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """What to measure.

    Attributes:
        seeds: First seed and one past the last.
        kind: Kind of scene.
        split: Objects.
        taken: Objects taken away in a scene, those first that the drawn relation is possible for.
        out: File of JSON lines.
    """

    seeds: tuple[int, int] = (100, 140)
    kind: str = "place8"
    split: Split = "seen"
    taken: int = 2
    out: Path = Path("outputs/placing.jsonl")


@dataclass(frozen=True, kw_only=True, eq=False)
class Taken:
    """An object that was taken away.

    Attributes:
        name: Its name.
        held: What the robot knows of it.
        pose: (4, 4) its true pose before.
        center: (3,) its true centre of mass before, metres.
    """

    name: str
    held: HeldObject
    pose: np.ndarray
    center: np.ndarray


def look(scene: Scene, rng: np.random.Generator) -> GeometryCloud:
    """Take noisy views and fuse them."""
    x, y, z = scene.workspace.lower
    with CameraRig(scene.model, camera_preset(scene.config.cameras)) as rig:
        views = capture_views(rig, scene.data, L515NoiseConfig(), rng)
    config = FusionConfig(workspace_min=(x, y, z - 0.01), workspace_max=scene.workspace.upper)
    return fuse(views, config)


def draw_scene(config: BenchConfig, seed: int) -> Scene:
    """Make a scene in which the seed's relation is possible to one object at least."""
    kind = SCENE_KINDS[config.kind]
    rng = np.random.default_rng([seed, 1])
    objects = cast_around(RELATIONS[seed % 3], config.split, kind.num_objects, rng)
    return make_scene(
        SceneConfig(scene=config.kind, split=config.split, seed=seed, objects=objects)
    )


def choose_grasps(
    scene: Scene, cloud: GeometryCloud, num: int, rng: np.random.Generator
) -> list[Taken]:
    """Grasp a few objects that have a good grasp; first those that can be put in or on another."""
    sampler = AntipodalSampler()
    picks = sampler.pick(cloud, rng)
    index, is_good = TrueScene(scene).judge(
        picks.Ts_world_tool, sampler.approach_opening(picks.width_m)
    )
    choices = rng.permutation(np.unique(index[is_good]))
    names = [scene.objects[i].name for i in choices]
    last = [all(region.relation == "near" for region in regions(scene, n)) for n in names]
    chosen = choices[np.argsort(last, kind="stable")][:num]
    return [
        _taken(scene, int(i), cloud, picks, np.flatnonzero(is_good & (index == i))[0])
        for i in chosen
    ]


def _taken(
    scene: Scene, index: int, cloud: GeometryCloud, picks: ActionCandidates, row: int
) -> Taken:
    item = scene.objects[index]
    return Taken(
        name=item.name,
        held=held_object(cloud, picks.Ts_world_tool[row], float(picks.width_m[row])),
        pose=scene.T_world_object(item.name),
        center=scene.data.xipos[item.body.body_id].copy(),
    )


def put(scene: Scene, taken: Taken, where: np.ndarray) -> None:
    """Put a taken object somewhere, everything else as it was: by a motion (4, 4) or far away."""
    fresh = state_at_rest(scene.model, scene.settled_qpos)
    mujoco.mj_copyData(scene.data, scene.model, fresh)
    body = find_object(scene, taken.name).body
    qpos = scene.data.qpos[body.qpos]
    if where.shape == (3,):
        qpos[:3] = where
    else:
        pose = where @ taken.pose
        qpos[:3] = pose[:3, 3]
        mujoco.mju_mat2Quat(qpos[3:], pose[:3, :3].ravel())
    # What rests may be asleep, and would stay in the air.
    scene.data.qvel[body.dof_adr + 2] = -_RELEASE_SPEED
    mujoco.mj_forward(scene.model, scene.data)


def regions(scene: Scene, moved: str) -> list[PlaceRegion]:
    """List the regions of all relations, to every other object, that the moved one can satisfy."""
    others = [item.name for item in scene.objects if item.name != moved]
    size = _smaller_side(scene, moved)
    found = []
    for name in others:
        catalogue_name = find_object(scene, name).asset.name
        relations = [r for r in RELATIONS if reference_pool(r, [catalogue_name])]
        if size > _LARGEST_SHARE * _smaller_side(scene, name):
            relations = ["near"]
        # A vessel's floor is for "in".
        elif "in" in relations:
            relations = ["in", "near"]
        found += [place_region(scene, r, name, moved=moved) for r in relations]
    return [region for region in found if not region.area.is_empty]


def _smaller_side(scene: Scene, name: str) -> float:
    corners = shapely.get_coordinates(footprint(scene, name).minimum_rotated_rectangle)
    return float(np.linalg.norm(np.diff(corners[:3], axis=0), axis=1).min())


def let_fall(scene: Scene, taken: Taken, motion: np.ndarray, region: PlaceRegion) -> dict:
    """Let the object fall from a release pose and judge where it comes to rest."""
    put(scene, taken, motion)
    is_free = not touched_bodies(scene, taken.name)
    mujoco.mj_step(scene.model, scene.data, round(_REST_S / scene.model.opt.timestep))
    return {"placed": is_placed(scene, taken.name, region), "free_release": is_free}


def measure(config: BenchConfig, seed: int) -> list[dict]:
    """Measure one scene: a row for every taken object, relation and reference."""
    scene = draw_scene(config, seed)
    rng = np.random.default_rng(seed)
    rows = []
    for taken in choose_grasps(scene, look(scene, rng), config.taken, rng):
        put(scene, taken, np.array(_AWAY))
        rows += [{"seed": seed} | row for row in judge(scene, taken, look(scene, rng), rng)]
    return rows


def judge(scene: Scene, taken: Taken, cloud: GeometryCloud, rng: np.random.Generator) -> list[dict]:
    """Propose places for a taken object, and judge them for every relation and reference."""
    start = time.process_time()
    candidates = SurfacePlacer().place(cloud, taken.held, rng)
    cpu_s = time.process_time() - start
    motions = candidates.Ts_world_tool @ np.linalg.inv(taken.held.T_world_tool)
    centers = motions[:, :3, :3] @ taken.center + motions[:, :3, 3]
    rows = []
    put(scene, taken, np.array(_AWAY))
    for region in regions(scene, taken.name):
        inside = np.flatnonzero(region.contains(centers))
        row = {
            "moved": taken.name,
            "relation": region.relation,
            "reference": region.reference,
            "candidates": len(candidates),
            "in_region": len(inside),
            "cpu_s": cpu_s,
        }
        if len(inside):
            row["prior"] = float(candidates.prior[inside[0]])
            row |= let_fall(scene, taken, motions[inside[0]], region)
        rows.append(row)
    return rows


def report(rows: list[dict]) -> None:
    """Print a line for every relation, and the cost."""
    print("| relation | pairs | covered | placed of covered | placed of all | free at release |")
    print("| --- | --- | --- | --- | --- | --- |")
    groups = defaultdict(list)
    for row in rows:
        groups[row["relation"]].append(row)
    for relation in RELATIONS:
        mine = groups[relation]
        covered = [row for row in mine if row["in_region"]]
        placed = sum(row["placed"] for row in covered)
        free = sum(row["free_release"] for row in covered)
        cells = [
            _share(len(covered), len(mine)),
            _share(placed, len(covered)),
            _share(placed, len(mine)),
            _share(free, len(covered)),
        ]
        print(f"| {relation} | {len(mine)} | " + " | ".join(cells) + " |")
    calls = {(row["seed"], row["moved"]): row for row in rows}.values()
    counts = [row["candidates"] for row in calls]
    print(
        f"held objects: {len(calls)}; candidates: median {np.median(counts):g}, least {min(counts)}"
    )
    cpu_s = [row["cpu_s"] for row in calls]
    print(f"processor time: median {np.median(cpu_s):.3f} s, largest {max(cpu_s):.3f} s")


def _share(part: int, whole: int) -> str:
    if not whole:
        return "-"
    low, high = wilson_interval(part, whole)
    return f"{part}/{whole} = {part / whole:.1%} [{low:.1%}, {high:.1%}]"


def main(config: BenchConfig) -> None:
    """Measure scene after scene and print."""
    select_backend()
    config.out.parent.mkdir(parents=True, exist_ok=True)
    lines = config.out.read_text().splitlines() if config.out.exists() else []
    scenes = [json.loads(line) for line in lines]
    done = {scene["seed"] for scene in scenes}
    todo = [seed for seed in range(*config.seeds) if seed not in done]
    with config.out.open("a") as file:
        for seed in tqdm(todo, desc="scenes"):
            scenes.append({"seed": seed, "rows": measure(config, seed)})
            file.write(json.dumps(scenes[-1]) + "\n")
            file.flush()
    report([row for scene in scenes for row in scene["rows"]])


if __name__ == "__main__":
    main(tyro.cli(BenchConfig, description=__doc__))
