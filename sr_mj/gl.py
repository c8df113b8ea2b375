"""The graphics library for offscreen rendering, chosen by proof rather than by name.

MuJoCo renders through EGL, OSMesa or GLFW and leaves the choice to the variable `MUJOCO_GL`. Where
the user has not set it, `select_backend` takes the first of them that renders a frame here. Each is
proven in a process of its own, because a broken library often crashes, and because PyOpenGL binds
to one library for the life of a process. The result is cached, so that later starts cost
milliseconds. A cached library that was removed is noticed at once; one that fails only in use is
replaced for the next start (`backend_failure`).
"""

import ctypes
import hashlib
import importlib
import importlib.metadata
import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sr_mj.errors import RenderError, unknown_name_message

BACKENDS = ("egl", "osmesa", "glfw")
"""Names of the backends, in the order in which they are tried."""

MEND = "apt-get install libegl1 libosmesa6"
"""The command that installs what the headless backends need on Debian and Ubuntu."""

# The other values of MUJOCO_GL that `mujoco.rendering.classic.gl_context` accepts on Linux.
_MEANS_GLFW = ("glx", "on", "true", "1", "enable", "enabled")
_MEANS_OFF = ("off", "false", "0", "disable", "disabled")

_LIBRARIES = {
    "egl": ("libEGL.so.1", "libEGL.so"),
    "osmesa": ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"),
}
_PROBE = Path(__file__).with_name("gl_probe.py")
_PROBE_TIMEOUT_S = 120.0

_selected_here: str | None = None


@dataclass(frozen=True, kw_only=True)
class BackendProof:
    """Whether a backend rendered a frame in a process of its own.

    Attributes:
        backend: One of `BACKENDS`.
        renderer: What OpenGL calls itself, for example `llvmpipe (LLVM 15.0.6, 256 bits)`; empty
            if no frame was rendered.
        failure: Why no frame was rendered, in one line; empty if one was.
    """

    backend: str
    renderer: str = ""
    failure: str = ""

    @property
    def works(self) -> bool:
        """Tell whether a frame was rendered."""
        return not self.failure


def select_backend() -> str:
    """Choose the graphics library of this process and write it into `MUJOCO_GL`.

    A value that the user set is respected. Everything in `sr_mj.sensors` works whenever this is
    called; `mujoco.Renderer` and dm_control read `MUJOCO_GL` once, when they are imported, and use
    the same library only if this was called before.

    Returns:
        One of `BACKENDS`.

    Raises:
        RenderError: If `MUJOCO_GL` is unusable, or if no backend renders here.
    """
    requested = os.environ.get("MUJOCO_GL", "").strip().lower()
    if requested:
        return _canonical_name(requested)
    return _adopt(_read_cache() or _prove_and_remember())


def backend_failure(backend: str, reason: str) -> RenderError:
    """Explain why a selected backend failed in this process; if it came from the cache, replace it.

    Only a new process can use another backend: PyOpenGL is bound for good, and MuJoCo aborts when
    it loads OpenGL a second time after it has failed once.

    Args:
        backend: The backend that failed.
        reason: How it failed, in one line.

    Returns:
        The error to raise, which says what to do.
    """
    if backend != _selected_here:
        return RenderError(
            f"MUJOCO_GL={os.environ.get('MUJOCO_GL')!r} is set, but {backend} cannot render here "
            f"({reason}). Unset MUJOCO_GL to have a working library chosen."
        )
    _cache_file().unlink(missing_ok=True)
    try:
        replacement = _prove_and_remember()
    except RenderError as error:
        return error
    if replacement == backend:
        return RenderError(
            f"{backend} renders in a new process, but not in this one ({reason}). "
            "Call sr_mj.gl.select_backend() before other modules use OpenGL."
        )
    return RenderError(
        f"{backend} no longer renders here ({reason}); {replacement} does and is chosen from now "
        "on. Start the program again."
    )


def prove_backend(backend: str) -> BackendProof:
    """Render one frame with a backend in a new process.

    Args:
        backend: One of `BACKENDS`.

    Returns:
        What rendered it, or why nothing did.

    Raises:
        RenderError: If there is no such backend.
    """
    if backend not in BACKENDS:
        raise RenderError(unknown_name_message("backend", backend, BACKENDS))
    environment = {k: v for k, v in os.environ.items() if k != "PYOPENGL_PLATFORM"}
    environment["MUJOCO_GL"] = backend
    try:
        done = subprocess.run(
            # -P keeps this package's directory out of the path, where it would shadow others.
            [sys.executable, "-P", str(_PROBE)],
            env=environment,
            capture_output=True,
            text=True,
            timeout=_PROBE_TIMEOUT_S,
        )
    except subprocess.TimeoutExpired:
        return BackendProof(backend=backend, failure=f"no frame within {_PROBE_TIMEOUT_S:.0f} s")
    if done.returncode < 0:
        return BackendProof(backend=backend, failure=f"crashed with signal {-done.returncode}")
    if done.returncode:
        return BackendProof(backend=backend, failure=_last_error_line(done.stderr))
    frame = json.loads(done.stdout.splitlines()[-1])
    if frame["is_uniform"]:
        return BackendProof(backend=backend, failure="the rendered frame is empty")
    return BackendProof(backend=backend, renderer=frame["renderer"])


def gl_context_class(backend: str) -> Any:
    """Import MuJoCo's OpenGL context class of a backend, whatever `mujoco` itself has chosen.

    Args:
        backend: One of `BACKENDS`.

    Returns:
        A class with the constructor `(max_width, max_height)` and the methods `make_current`
        and `free`.
    """
    return importlib.import_module(f"mujoco.{backend}").GLContext


def cache_dir() -> Path:
    """Return the directory for what can be found out again: `SR_MJ_CACHE`, or the user's cache."""
    if own := os.environ.get("SR_MJ_CACHE"):
        return Path(own)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "sr_mj"


def _canonical_name(requested: str) -> str:
    if requested in _MEANS_OFF:
        raise RenderError(
            f"MUJOCO_GL={requested!r} turns rendering off. "
            f"Unset it, or set it to one of: {', '.join(BACKENDS)}."
        )
    if requested in _MEANS_GLFW:
        return "glfw"
    if requested not in BACKENDS:
        raise RenderError(unknown_name_message("MUJOCO_GL value", requested, BACKENDS))
    return requested


def _adopt(backend: str) -> str:
    """Make a backend the choice of this process and of its children."""
    global _selected_here
    if backend != "glfw":
        bound = _bound_pyopengl_platform()
        if bound not in (None, backend):
            raise RenderError(
                f"This process has bound PyOpenGL to {bound}, but only {backend} renders here. "
                "Call sr_mj.gl.select_backend() before importing dm_control, "
                f"or set MUJOCO_GL={backend}."
            )
        os.environ["PYOPENGL_PLATFORM"] = backend
    os.environ["MUJOCO_GL"] = backend
    _selected_here = backend
    return backend


def _bound_pyopengl_platform() -> str | None:
    """Name the library to which PyOpenGL is bound already, None if it can still be chosen."""
    module = sys.modules.get("OpenGL.platform")
    if module is None:
        return None
    return type(module.PLATFORM).__name__.removesuffix("Platform").lower()


def _prove_and_remember() -> str:
    failures = []
    for backend in BACKENDS:
        proof = prove_backend(backend)
        if proof.works:
            _write_cache(proof)
            return backend
        failures.append(f"{backend}: {proof.failure}")
    raise RenderError(f"No graphics library renders here ({'; '.join(failures)}). Run: {MEND}")


def _last_error_line(stderr: str) -> str:
    """Pick the exception's line out of a traceback; PyOpenGL's exceptions span several lines."""
    lines = [line for line in stderr.splitlines() if line and not line[0].isspace()]
    named = [line for line in lines if line[0].isalpha() and ("Error" in line or ":" in line)]
    return " ".join((named or lines or ["no message"])[-1].split())[:200]


def _cache_file() -> Path:
    """Name the cache entry after everything on which the choice depends."""
    depends_on = (
        importlib.metadata.version("mujoco"),
        importlib.metadata.version("PyOpenGL"),
        platform.node(),
        platform.machine(),
        *(os.environ.get(name, "") for name in ("DISPLAY", "MUJOCO_EGL_DEVICE_ID")),
    )
    digest = hashlib.sha256("\n".join(depends_on).encode()).hexdigest()[:12]
    return cache_dir() / f"gl-{digest}.json"


def _read_cache() -> str | None:
    try:
        backend = json.loads(_cache_file().read_text())["backend"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    if backend in BACKENDS and _is_loadable(_LIBRARIES.get(backend, ())):
        return backend
    return None


def _write_cache(proof: BackendProof) -> None:
    """Remember a proof; a cache that cannot be written costs time, not the run."""
    path = _cache_file()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile("w", dir=path.parent, delete=False) as file:
            json.dump({"backend": proof.backend, "renderer": proof.renderer}, file)
        os.replace(file.name, path)
    except OSError:
        return


def _is_loadable(sonames: Iterable[str]) -> bool:
    """Tell whether a library is still installed, before PyOpenGL binds to it for good."""
    names = tuple(sonames)
    for name in names:
        try:
            ctypes.CDLL(name)
        except OSError:
            continue
        return True
    return not names
