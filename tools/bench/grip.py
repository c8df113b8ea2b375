"""Measure how the gripper holds: slip under acceleration, penetration and jitter.

    python -m tools.bench.grip

The gripper closes on a weightless object between its pads, from above. Then gravity acts for ten
seconds together with 1 g of lateral acceleration that turns about the vertical once in two
seconds, as carrying would; then gravity alone. Prints a markdown table; docs/physics.md carries it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
import tyro

from models.gripper import FINGER_ACTUATOR, build_gripper, finger_travel
from models.objects.catalogue import load_object
from models.objects.mjcf_builder import build_object
from models.tabletop import build_tabletop

GRAVITY = 9.81
TOOL_HEIGHT_M, BELOW_TOOL_M = 0.5, 0.01
# An object that has moved this far between the pads, or is as far below, is no longer held.
LOST_M = 0.05
FINGER_SPEED = 0.15
TURN_S = 2.0


@dataclass(frozen=True, kw_only=True)
class Load:
    """What is held.

    Attributes:
        name: Name in the catalogue.
        mass_kg: Mass that it is given.
        label: What to call it in the table.
        off_center_m: How far its centre of mass is moved out of the grip, along the pads' width.
    """

    name: str
    mass_kg: float
    label: str
    off_center_m: float = 0.0


LOADS = (
    Load(name="tomato_soup_can", mass_kg=0.5, label="can, 0.5 kg"),
    Load(name="strawberry", mass_kg=0.02, label="strawberry, 20 g"),
    Load(name="tomato_soup_can", mass_kg=1.0, label="can, 1 kg, off by 10 cm", off_center_m=0.1),
)


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """What to measure.

    Attributes:
        carry_s: Simulated seconds of lateral acceleration.
    """

    carry_s: float = 10.0


Change = Callable[[mujoco.MjModel], None]


def _pads(model: mujoco.MjModel) -> list[int]:
    return [i for i in range(model.ngeom) if model.geom(i).name.endswith("_pad")]


def _force(newton: float) -> Change:
    def change(model: mujoco.MjModel) -> None:
        actuator = model.actuator(f"gripper/{FINGER_ACTUATOR}").id
        model.actuator_forcerange[actuator] = (-newton, newton)

    return change


def _pad(**values: float | tuple[float, float]) -> Change:
    def change(model: mujoco.MjModel) -> None:
        for pad in _pads(model):
            if "friction" in values:
                model.geom_friction[pad, 0] = values["friction"]
            if "condim" in values:
                model.geom_condim[pad] = values["condim"]
            if "solref" in values:
                model.geom_solref[pad, 0] = values["solref"]

    return change


def _option(**values: float) -> Change:
    def change(model: mujoco.MjModel) -> None:
        for name, value in values.items():
            setattr(model.opt, name, value)

    return change


SETTINGS: dict[str, tuple[Change, ...]] = {
    "default (80 N, friction 1, condim 4, 4 ms)": (),
    "2 N": (_force(2),),
    "10 N": (_force(10),),
    "20 N": (_force(20),),
    "40 N": (_force(40),),
    "160 N": (_force(160),),
    "friction 0.5": (_pad(friction=0.5),),
    "friction 1.5": (_pad(friction=1.5),),
    "condim 3": (_pad(condim=3),),
    "condim 6": (_pad(condim=6),),
    "pads 8 ms": (_pad(solref=0.008),),
    "pads 3 ms": (_pad(solref=0.003),),
    "no no-slip pass": (_option(noslip_iterations=0),),
    "steps of 1 ms": (_option(timestep=0.001),),
}


def build(load: Load) -> mujoco.MjModel:
    """Compile a gripper that points down at an object, nothing near."""
    root = build_tabletop("grip")
    # The object's tree is called before the gripper's, so that names stay as they are in scenes.
    gripper = root.attach(build_gripper())
    gripper.pos, gripper.quat = (0.5, 0, TOOL_HEIGHT_M + 0.145), (0, 1, 0, 0)
    asset = load_object(load.name)
    item = build_object(asset, name="load")
    inertial = item.find("body", "object").inertial
    inertial.pos = np.array(inertial.pos) + np.array([0, load.off_center_m, 0])
    held = root.attach(item)
    # A little below the middle of the pads, so that nothing tall leans on the palm.
    held.pos = np.array([0.5, 0, TOOL_HEIGHT_M - BELOW_TOOL_M]) - asset.center_of_mass
    held.add("freejoint")
    model = mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())
    body = model.body("load/object").id
    model.body_inertia[body] *= load.mass_kg / model.body_mass[body]
    model.body_mass[body] = load.mass_kg
    # Fingers feel the acceleration too, and nothing may sleep while gravity turns.
    model.body_gravcomp[:] = 0
    model.opt.enableflags = 0
    return model


class Hold:
    """One simulated hold."""

    def __init__(self, load: Load, changes: tuple[Change, ...]) -> None:
        """Compile, change settings, and close the gripper on the weightless object."""
        self.model = build(load)
        for change in changes:
            change(self.model)
        self.data = mujoco.MjData(self.model)
        self.body = self.model.body("load/object").id
        self.pads = _pads(self.model)
        self.depth_m = 0.0
        self.model.opt.gravity[:] = 0
        actuator = self.model.actuator(f"gripper/{FINGER_ACTUATOR}").id
        step = FINGER_SPEED / 2 * self.model.opt.timestep
        travel = finger_travel(1.0)
        for joint in range(self.model.njnt):
            if "finger" in self.model.joint(joint).name:
                self.data.qpos[self.model.jnt_qposadr[joint]] = travel
        while travel > 0:
            travel = max(travel - step, 0.0)
            self.data.ctrl[actuator] = travel
            self._step()
        self.run(0.5)

    def _step(self) -> None:
        mujoco.mj_step(self.model, self.data)
        contact = self.data.contact
        is_pad = np.isin(contact.geom, self.pads).any(axis=1)
        self.depth_m = max(self.depth_m, -float(contact.dist[is_pad].min(initial=0.0)))

    def run(self, seconds: float, lateral: float = 0.0, vertical: float = 0.0) -> np.ndarray:
        """Simulate with accelerations in m/s^2; return the object's velocities (T, 6)."""
        velocities = []
        for index in range(round(seconds / self.model.opt.timestep)):
            angle = 2 * np.pi * index * self.model.opt.timestep / TURN_S
            pull = lateral * np.array([np.cos(angle), np.sin(angle)])
            self.model.opt.gravity[:] = (*pull, -vertical)
            self._step()
            velocities.append(self.data.qvel[-6:].copy())
        return np.array(velocities)

    @property
    def pose(self) -> tuple[np.ndarray, np.ndarray]:
        """Position (3,) of the centre of mass and orientation (3, 3) of the object."""
        return self.data.xipos[self.body].copy(), self.data.xmat[self.body].reshape(3, 3).copy()


def measure(load: Load, changes: tuple[Change, ...], carry_s: float) -> dict[str, float]:
    """Hold, carry, and look at what moved."""
    hold = Hold(load, changes)
    hold.run(0.5, vertical=GRAVITY)
    before, turned = hold.pose
    hold.run(carry_s, lateral=GRAVITY, vertical=GRAVITY)
    hold.run(0.5, vertical=GRAVITY)
    after, turned_after = hold.pose
    still = hold.run(1.0, vertical=GRAVITY)
    cosine = (np.trace(turned.T @ turned_after) - 1) / 2
    slip_m = float(np.linalg.norm(after - before))
    is_lost = slip_m > LOST_M or after[2] < TOOL_HEIGHT_M - LOST_M
    return {
        "slip_mm": np.inf if is_lost else 1e3 * slip_m,
        "turn_deg": float(np.degrees(np.arccos(np.clip(cosine, -1, 1)))),
        "depth_mm": 1e3 * hold.depth_m,
        "jitter_mm_s": 1e3 * float(np.sqrt((still[:, :3] ** 2).sum(axis=1).mean())),
    }


def main(config: BenchConfig) -> None:
    """Measure every setting with every load."""
    print("| setting | load | slip mm | turn deg | deepest mm | jitter mm/s |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name, changes in SETTINGS.items():
        for load in LOADS:
            row = measure(load, changes, config.carry_s)
            if np.isinf(row["slip_mm"]):
                print(f"| {name} | {load.label} | lost | - | - | - |", flush=True)
                continue
            print(
                f"| {name} | {load.label} | {row['slip_mm']:.2f} | {row['turn_deg']:.1f} "
                f"| {row['depth_mm']:.2f} | {row['jitter_mm_s']:.3f} |",
                flush=True,
            )


if __name__ == "__main__":
    main(tyro.cli(BenchConfig, description=__doc__))
