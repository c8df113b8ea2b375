"""Measure physics settings: speed, penetration and drift of settled scenes, and stability.

    python -m tools.bench.physics --seeds 5

Prints a markdown table; docs/physics.md carries one.
"""

import time
from dataclasses import dataclass

import mujoco
import numpy as np
import tyro


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """What to measure.

    Attributes:
        seeds: Number of `cluttered15` scenes a setting.
        seconds: Simulated seconds of drift.
        stability_seeds: Number of scenes to make with the default settings, seen and unseen in
            turn, counting failures; 0 skips it.
    """

    seeds: int = 5
    seconds: float = 10.0
    stability_seeds: int = 0


_AWAKE = {"enableflags": 0}
SETTINGS: dict[str, dict] = {
    "default (5 no-slip passes, sleeping)": {},
    "without sleeping": _AWAKE,
    "without sleeping, no no-slip pass": {**_AWAKE, "noslip_iterations": 0},
    "same, 1 ms": {**_AWAKE, "noslip_iterations": 0, "timestep": 0.001},
    "same, 4 ms": {**_AWAKE, "noslip_iterations": 0, "timestep": 0.004},
    "same, pyramidal cone": {
        **_AWAKE,
        "noslip_iterations": 0,
        "cone": mujoco.mjtCone.mjCONE_PYRAMIDAL,
    },
    "same, impratio 1": {**_AWAKE, "noslip_iterations": 0, "impratio": 1},
    "same, impratio 100": {**_AWAKE, "noslip_iterations": 0, "impratio": 100},
    "without sleeping, 10 no-slip passes": {**_AWAKE, "noslip_iterations": 10},
    "sleeping, no no-slip pass": {"noslip_iterations": 0},
}


def measure(scene, options: dict, seconds: float) -> dict[str, float]:
    """Simulate a settled scene with other options."""
    model = scene.model
    saved = {name: getattr(model.opt, name) for name in options}
    for name, value in options.items():
        setattr(model.opt, name, value)
    data = mujoco.MjData(model)
    data.qpos[:], data.ctrl[:] = scene.settled_qpos, scene.data.ctrl
    steps = round(seconds / model.opt.timestep)
    start = time.process_time()
    mujoco.mj_step(model, data, steps)
    elapsed = time.process_time() - start
    drift = [
        float(np.linalg.norm(data.qpos[b.qpos][:3] - scene.settled_qpos[b.qpos][:3]))
        for b in (item.body for item in scene.objects)
    ]
    depth = -data.contact.dist[: data.ncon].min(initial=0)
    for name, value in saved.items():
        setattr(model.opt, name, value)
    return {
        "steps_per_s": steps / elapsed,
        "real_time": seconds / elapsed,
        "penetration_mm": 1e3 * depth,
        "median_mm": 1e3 * float(np.median(drift)),
        "worst_mm": 1e3 * max(drift),
        "moved": sum(d > 1e-3 for d in drift),
        "contacts": data.ncon,
    }


def main(config: BenchConfig) -> None:
    """Measure every setting on the same scenes."""
    from sr_mj.scene import SceneConfig, make_scene

    scenes = [make_scene(SceneConfig(seed=seed)) for seed in range(config.seeds)]
    print(
        "| setting | steps/s | real-time factor | deepest contact mm | median drift mm | "
        "worst drift mm | objects over 1 mm |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name, options in SETTINGS.items():
        rows = [measure(scene, options, config.seconds) for scene in scenes]
        print(
            f"| {name} | {np.median([r['steps_per_s'] for r in rows]):,.0f} "
            f"| {np.median([r['real_time'] for r in rows]):.1f} "
            f"| {max(r['penetration_mm'] for r in rows):.2f} "
            f"| {np.median([r['median_mm'] for r in rows]):.3f} "
            f"| {max(r['worst_mm'] for r in rows):.2f} "
            f"| {sum(r['moved'] for r in rows)} of {15 * len(rows)} |",
            flush=True,
        )
    if config.stability_seeds:
        count_failures(config.stability_seeds)


def count_failures(num: int) -> None:
    """Make scenes of both splits; count failures, list them, and time it."""
    from sr_mj.errors import SceneError
    from sr_mj.scene import SPLITS, SceneConfig, make_scene

    failures, times = [], []
    for seed in range(num):
        start = time.process_time()
        try:
            make_scene(SceneConfig(split=SPLITS[seed % 2], seed=1000 + seed))
        except SceneError as error:
            failures.append((seed, str(error)))
        times.append(time.process_time() - start)
    print(f"{num} scenes made, {len(failures)} failed; {np.mean(times):.2f} s each (mean)")
    for failure in failures:
        print(failure)


if __name__ == "__main__":
    main(tyro.cli(BenchConfig, description=__doc__))
