"""Render one frame with the library that `MUJOCO_GL` names, and say on stdout what rendered it.

`sr_mj.gl` runs this file in a process of its own: a graphics library that is broken often crashes
instead of raising, and PyOpenGL binds to one library for the life of a process.
"""

import json

import mujoco
from OpenGL import GL

_SCENE = """
<mujoco>
  <worldbody>
    <light pos="0 0 2"/>
    <geom type="plane" size="1 1 0.1" rgba="0.2 0.3 0.4 1"/>
    <geom type="sphere" size="0.2" pos="0 0 0.2" rgba="0.9 0.2 0.1 1"/>
  </worldbody>
</mujoco>
"""


def main() -> None:
    """Print `{"renderer": name, "is_uniform": bool}` for one rendered frame."""
    model = mujoco.MjModel.from_xml_string(_SCENE)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with mujoco.Renderer(model, height=48, width=64) as renderer:
        renderer.update_scene(data)
        image = renderer.render()
        name = bytes(GL.glGetString(GL.GL_RENDERER) or b"").decode()
    print(json.dumps({"renderer": name, "is_uniform": bool((image == image[0, 0]).all())}))


if __name__ == "__main__":
    main()
