"""The table with its bin and lights, and the physics options that every scene shares.

The table's surface is the plane z = 0; the robot's base stands on it at the origin.
"""

import numpy as np
from dm_control import mjcf

TABLE_GEOM = "table"
BIN_CENTER = (0.15, -0.58, 0.0)
"""Centre of the bin's floor: outside every workspace, so that no camera's crop contains it."""
BIN_HALF_M = 0.16
BIN_HEIGHT_M = 0.10

_TABLE_CENTER, _TABLE_HALF = (0.4, 0.0), (0.7, 0.85)
_TABLE_THICKNESS = 0.04
_WOOD = (0.74, 0.70, 0.65, 1.0)
_BIN_BLUE = (0.30, 0.42, 0.58, 1.0)


def set_physics_options(root: mjcf.RootElement) -> None:
    """Set time step, solver and contact options; docs/physics.md has the measurements."""
    root.option.timestep = 0.002
    root.option.integrator = "implicitfast"
    root.option.cone = "elliptic"
    root.option.impratio = 10
    root.option.iterations = 30
    root.option.ls_iterations = 20
    # Soft friction creeps by up to millimetres a second where objects lean on each other; the
    # no-slip pass stops that, and what then lies still may sleep until something touches it.
    root.option.noslip_iterations = 5
    root.option.flag.sleep = "enable"
    # At MuJoCo's own 1 mm/s heaps of many-part objects tremble on for ever, moving nowhere.
    root.option.sleep_tolerance = 0.005
    root.size.memory = "256M"


def _add_visuals(root: mjcf.RootElement) -> None:
    root.visual.headlight.set_attributes(
        ambient=(0.35,) * 3, diffuse=(0.18,) * 3, specular=(0,) * 3
    )
    root.asset.add(
        "texture", name="sky", type="skybox", builtin="gradient",
        rgb1=(0.75, 0.80, 0.86), rgb2=(0.42, 0.46, 0.52), width=64, height=64,
    )  # fmt: skip
    # Two lights without shadows: software rendering spends a third of its time on a shadow map.
    for name, pos in {"key": (0.1, -0.6, 1.6), "fill": (0.9, 0.7, 1.6)}.items():
        root.worldbody.add(
            "light",
            name=name,
            pos=pos,
            dir=np.subtract((0.5, 0, 0), pos),
            type="directional",
            diffuse=(0.30,) * 3,
            specular=(0.1,) * 3,
            castshadow=False,
        )


def _add_bin(root: mjcf.RootElement) -> None:
    body = root.worldbody.add("body", name="bin", pos=BIN_CENTER)
    wall = 0.005
    half, height = BIN_HALF_M, BIN_HEIGHT_M / 2
    body.add("geom", name="bin_floor", pos=(0, 0, 0.002), size=(half, half, 0.002), dclass="bin")
    for name, x, y in (("back", -1, 0), ("front", 1, 0), ("right", 0, -1), ("left", 0, 1)):
        size = (wall, half, height) if x else (half, wall, height)
        body.add(
            "geom", name=f"bin_{name}", pos=(x * half, y * half, height), size=size, dclass="bin"
        )


def build_tabletop(model_name: str = "tabletop") -> mjcf.RootElement:
    """Build table, bin, floor, lights and physics options: the root into which a scene is attached.

    Args:
        model_name: Name of the MJCF model.

    Returns:
        The root element; bodies and geoms carry no prefix.
    """
    root = mjcf.RootElement(model=model_name)
    root.compiler.angle = "radian"
    root.compiler.autolimits = True
    set_physics_options(root)
    # Clipping planes scale with it; computed by MuJoCo it would change with the objects.
    root.statistic.set_attributes(center=(0.4, 0, 0.2), extent=1.5)
    _add_visuals(root)
    bin_class = root.default.add("default", dclass="bin")
    bin_class.geom.set_attributes(type="box", rgba=_BIN_BLUE, group=1)
    root.worldbody.add(
        "geom",
        name=TABLE_GEOM,
        type="box",
        pos=(*_TABLE_CENTER, -_TABLE_THICKNESS / 2),
        size=(*_TABLE_HALF, _TABLE_THICKNESS / 2),
        rgba=_WOOD,
        group=1,
        friction=(0.7, 0.005, 0.0001),
        solref=(0.008, 1),
    )
    root.worldbody.add(
        "geom", name="floor", type="plane", pos=(0, 0, -0.75), size=(3, 3, 0.1),
        rgba=(0.5, 0.5, 0.52, 1), group=1,
    )  # fmt: skip
    _add_bin(root)
    return root
