"""An offscreen OpenGL context that holds the meshes and textures of one compiled model."""

import atexit
import weakref
from typing import Any

import mujoco
import numpy as np

from sr_mj.errors import RenderError
from sr_mj.gl import backend_failure, gl_context_class, select_backend

_open_contexts: "weakref.WeakSet[OffscreenContext]" = weakref.WeakSet()


class OffscreenContext:
    """The OpenGL side of one model: graphics context, model data on the GPU, one framebuffer.

    The framebuffer has a single sample a pixel. Multisampling triples the time of software
    rendering, and blends foreground and background depths along every edge.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int) -> None:
        """Open a context on the backend that `sr_mj.gl.select_backend` chooses.

        Args:
            model: The model whose meshes and textures are uploaded.
            width: Width of the framebuffer in pixels.
            height: Height of the framebuffer in pixels.

        Raises:
            RenderError: If no graphics library renders here.
        """
        self._gl: Any = None
        self._mjr: mujoco.MjrContext | None = None
        backend = select_backend()
        try:
            self._open(backend, model, width, height)
        # PyOpenGL and MuJoCo fail with ImportError, AttributeError, GLError, FatalError, ...
        except Exception as error:
            self.close()
            raise backend_failure(backend, _one_line(error)) from error

    def _open(self, backend: str, model: mujoco.MjModel, width: int, height: int) -> None:
        self._gl = gl_context_class(backend)(width, height)
        _close_before_gl_terminates(self)
        self._gl.make_current()
        mjr = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50.value)
        self._mjr = mjr
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, mjr)
        # The model says how large and how finely sampled the buffer is; we know better. MuJoCo
        # rebuilds it only when the size changes, hence the detour.
        mjr.offSamples = 0
        mujoco.mjr_resizeOffscreen(1, 1, mjr)
        mujoco.mjr_resizeOffscreen(width, height, mjr)
        mjr.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR

    def draw(
        self,
        scene: mujoco.MjvScene,
        width: int,
        height: int,
        *,
        rgb: np.ndarray | None = None,
        depth: np.ndarray | None = None,
    ) -> None:
        """Render a scene once and read colour, depth or both from that one pass.

        Args:
            scene: What to draw, and from where.
            width: Width of the image in pixels, at most that of the framebuffer.
            height: Height of the image in pixels, at most that of the framebuffer.
            rgb: (height, width, 3) uint8 to be filled, bottom row first.
            depth: (height, width) float32 to be filled with the depth buffer, bottom row first:
                1 at the near plane, 0 at the far plane.

        Raises:
            RenderError: If the context is closed.
        """
        if self._mjr is None:
            raise RenderError("The renderer is closed. Make a new one.")
        self._gl.make_current()
        rectangle = mujoco.MjrRect(0, 0, width, height)
        mujoco.mjr_render(rectangle, scene, self._mjr)
        mujoco.mjr_readPixels(rgb, depth, rectangle, self._mjr)

    def close(self) -> None:
        """Free everything; calling it again does nothing."""
        mjr, self._mjr = self._mjr, None
        gl, self._gl = self._gl, None
        if mjr is not None:
            gl.make_current()
            mjr.free()
        if gl is not None:
            gl.free()

    def __del__(self) -> None:
        """Free what was not closed, with its own context current instead of another rig's."""
        self.close()


def _close_before_gl_terminates(context: OffscreenContext) -> None:
    """Arrange that an open context is freed at exit, while its library still works.

    Exit handlers run in reverse order, and MuJoCo registers the one that shuts EGL down when the
    first context is made. This must be called after that.
    """
    if not _open_contexts:
        atexit.unregister(_close_open_contexts)
        atexit.register(_close_open_contexts)
    _open_contexts.add(context)


def _close_open_contexts() -> None:
    for context in list(_open_contexts):
        context.close()


def _one_line(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())[:200]
