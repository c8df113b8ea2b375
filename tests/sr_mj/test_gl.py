import ctypes.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from sr_mj import gl
from sr_mj.errors import RenderError

pytestmark = pytest.mark.render

ROOT = Path(__file__).parents[2]
GRAPHICS_VARIABLES = ("MUJOCO_GL", "PYOPENGL_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY")
# Settings of the libraries themselves that break them for good, as a broken driver would.
NO_EGL = {"__EGL_VENDOR_LIBRARY_FILENAMES": "/dev/null"}
NO_LIBRARY = {**NO_EGL, "GALLIUM_DRIVER": "none"}
RENDER = """
import os
import mujoco
from sr_mj.sensors.offscreen import OffscreenContext
model = mujoco.MjModel.from_xml_string("<mujoco/>")
OffscreenContext(model, 8, 8)
print(os.environ["MUJOCO_GL"])
"""
SELECT = "from sr_mj.gl import select_backend; print(select_backend())"

needs_osmesa = pytest.mark.skipif(
    ctypes.util.find_library("OSMesa") is None, reason="libosmesa6 is not installed"
)


@pytest.fixture
def run(tmp_path):
    """Run a program with a cache of its own and without a display; return its last words."""

    def run(program: str, **variables: str) -> str:
        inherited = {k: v for k, v in os.environ.items() if k not in GRAPHICS_VARIABLES}
        environment = {
            **inherited,
            "PYTHONPATH": str(ROOT),
            "SR_MJ_CACHE": str(tmp_path),
            "PYTHONWARNINGS": "ignore",
            **variables,
        }
        done = subprocess.run(
            [sys.executable, "-c", program], env=environment, capture_output=True, text=True
        )
        return done.stdout.strip() or done.stderr.strip().splitlines()[-1]

    return run


@pytest.fixture
def cached_backend(tmp_path):
    """Read what the one cache entry says."""

    def read() -> str:
        (entry,) = tmp_path.glob("gl-*.json")
        return json.loads(entry.read_text())["backend"]

    return read


@pytest.fixture
def remember(monkeypatch, tmp_path):
    """Write a cache entry for the environment of the tests' programs."""

    def remember(backend: str) -> None:
        with monkeypatch.context() as patch:
            patch.setenv("SR_MJ_CACHE", str(tmp_path))
            patch.delenv("DISPLAY", raising=False)
            gl._write_cache(gl.BackendProof(backend=backend))

    return remember


@pytest.fixture(scope="module")
def works_here():
    """Name the backend that renders here."""
    backend = next((name for name in gl.BACKENDS if gl.prove_backend(name).works), None)
    if backend not in ("egl", "osmesa"):
        pytest.skip("no headless backend renders here")
    return backend


def test_a_working_backend_is_found_and_used_even_after_mujoco_was_imported(run, cached_backend):
    backend = run("import mujoco\n" + RENDER)
    assert backend in gl.BACKENDS
    assert cached_backend() == backend
    # A second start proves nothing again: without an interpreter it could not.
    assert run("import sys; sys.executable = '/nonexistent'\n" + SELECT) == backend


def test_mujoco_s_own_renderer_uses_the_selected_backend(run, remember, works_here):
    remember(works_here)
    program = (
        "from sr_mj.gl import select_backend; select_backend()\n"
        "import mujoco\n"
        "model = mujoco.MjModel.from_xml_string('<mujoco/>')\n"
        "with mujoco.Renderer(model, 8, 8) as renderer: print(renderer.width)\n"
    )
    assert run(program) == "8"


def test_dm_control_may_be_imported_before(run, remember, works_here):
    if works_here != "egl":
        pytest.skip("dm_control itself binds PyOpenGL to EGL")
    remember("egl")
    assert run("from dm_control import mjcf\n" + RENDER) == "egl"


@needs_osmesa
def test_osmesa_renders_where_egl_does_not(run, cached_backend):
    assert run(RENDER, **NO_EGL) == "osmesa"
    assert cached_backend() == "osmesa"


def test_a_cached_backend_that_fails_is_replaced_for_the_next_start(run, remember, cached_backend):
    remember("glfw")  # cannot work without a display
    message = run(RENDER)
    backend = cached_backend()
    assert backend in ("egl", "osmesa")
    assert message.startswith("sr_mj.errors.RenderError: glfw no longer renders here (")
    assert message.endswith(
        f"); {backend} does and is chosen from now on. Start the program again."
    )
    assert run(RENDER) == backend


@needs_osmesa
def test_a_driver_that_breaks_is_replaced_for_the_next_start(run, remember, cached_backend):
    remember("egl")
    message = run(RENDER, **NO_EGL)
    assert message.startswith("sr_mj.errors.RenderError: egl no longer renders here (ImportError:")
    assert message.endswith("); osmesa does and is chosen from now on. Start the program again.")
    assert cached_backend() == "osmesa"
    assert run(RENDER, **NO_EGL) == "osmesa"


@needs_osmesa
def test_a_process_bound_to_another_library_is_told_how_to_avoid_it(run, remember):
    remember("osmesa")
    assert run(
        "import os; os.environ['PYOPENGL_PLATFORM'] = 'egl'; import OpenGL.GL\n" + SELECT
    ) == (
        "sr_mj.errors.RenderError: This process has bound PyOpenGL to egl, but only osmesa renders "
        "here. Call sr_mj.gl.select_backend() before importing dm_control, or set MUJOCO_GL=osmesa."
    )


def test_if_nothing_renders_the_error_says_what_was_tried_and_what_to_install(run, tmp_path):
    message = run(SELECT, **NO_LIBRARY)
    assert message.startswith("sr_mj.errors.RenderError: No graphics library renders here (egl: ")
    assert "; osmesa: " in message
    assert "; glfw: " in message
    assert message.endswith("). Run: apt-get install libegl1 libosmesa6")
    assert not list(tmp_path.iterdir())


def test_the_user_s_choice_is_respected_and_blamed(run, tmp_path):
    message = run(RENDER, MUJOCO_GL="glfw")
    assert message.startswith(
        "sr_mj.errors.RenderError: MUJOCO_GL='glfw' is set, but glfw cannot render here ("
    )
    assert message.endswith("). Unset MUJOCO_GL to have a working library chosen.")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("value", "backend"),
    [("egl", "egl"), (" EGL ", "egl"), ("osmesa", "osmesa"), ("glx", "glfw"), ("on", "glfw")],
)
def test_values_that_mujoco_understands_are_understood(monkeypatch, value, backend):
    monkeypatch.setenv("MUJOCO_GL", value)
    assert gl.select_backend() == backend
    assert os.environ["MUJOCO_GL"] == value


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (
            "off",
            "MUJOCO_GL='off' turns rendering off. Unset it, or set it to one of: "
            "egl, osmesa, glfw.",
        ),
        (
            "elg",
            "Unknown MUJOCO_GL value 'elg'. MUJOCO_GL values: egl, osmesa, glfw. "
            "Did you mean 'egl'?",
        ),
    ],
)
def test_values_that_cannot_render_are_refused(monkeypatch, value, message):
    monkeypatch.setenv("MUJOCO_GL", value)
    with pytest.raises(RenderError) as error:
        gl.select_backend()
    assert str(error.value) == message


def test_unknown_backends_cannot_be_proven():
    with pytest.raises(RenderError) as error:
        gl.prove_backend("vulkan")
    assert str(error.value) == "Unknown backend 'vulkan'. Backends: egl, osmesa, glfw."


@pytest.mark.parametrize("content", ["", "{}", "[]", "3", '{"backend": "metal"}', '{"backend": 1}'])
def test_a_damaged_cache_counts_as_none(monkeypatch, tmp_path, content):
    monkeypatch.setenv("SR_MJ_CACHE", str(tmp_path))
    gl._cache_file().write_text(content)
    assert gl._read_cache() is None


def test_the_cache_forgets_a_library_that_was_removed(monkeypatch, tmp_path):
    monkeypatch.setenv("SR_MJ_CACHE", str(tmp_path))
    monkeypatch.setitem(gl._LIBRARIES, "egl", ("libSrMjNoSuchLibrary.so.1",))
    gl._write_cache(gl.BackendProof(backend="egl", renderer="gone"))
    assert gl._read_cache() is None


def test_a_cache_that_cannot_be_written_is_no_error(monkeypatch):
    monkeypatch.setenv("SR_MJ_CACHE", "/dev/null/sr_mj")
    gl._write_cache(gl.BackendProof(backend="egl", renderer="r"))
    assert gl._read_cache() is None


def test_the_cache_directory_follows_the_environment(monkeypatch):
    monkeypatch.setenv("SR_MJ_CACHE", "/a")
    monkeypatch.setenv("XDG_CACHE_HOME", "/b")
    assert gl.cache_dir() == Path("/a")
    monkeypatch.delenv("SR_MJ_CACHE")
    assert gl.cache_dir() == Path("/b/sr_mj")
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert gl.cache_dir() == Path.home() / ".cache" / "sr_mj"
