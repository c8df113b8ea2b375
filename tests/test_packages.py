import os
import subprocess
import sys

import pytest

BLOCKED = {
    "perception": ("mujoco", "dm_control", "mink", "trimesh", "lxml", "imageio", "policy", "sr_mj", "models"),
    "policy": ("mujoco", "dm_control", "mink", "open3d", "open_clip", "perception", "sr_mj", "models"),
    "models": ("open3d", "open_clip", "torch", "mink", "perception", "policy", "sr_mj"),
}  # fmt: skip

IMPORT_EVERYTHING = """
import importlib, pkgutil, sys
package, blocked = sys.argv[1], set(sys.argv[2].split(","))
class Block:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in blocked:
            raise ImportError(f"{name} is blocked")
sys.meta_path.insert(0, Block())
root = importlib.import_module(package)
names = [m.name for m in pkgutil.walk_packages(root.__path__, package + ".")]
for name in names:
    importlib.import_module(name)
print(len(names))
"""


@pytest.mark.parametrize("package", BLOCKED)
def test_siblings_import_without_each_other(package):
    done = subprocess.run(
        [sys.executable, "-c", IMPORT_EVERYTHING, package, ",".join(BLOCKED[package])],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) >= 5


@pytest.mark.parametrize(
    "module",
    ["sr_mj.run", "sr_mj.export", "sr_mj.doctor", "perception.lift", "models.import_objects"],
)
def test_help_loads_nothing_heavy(module):
    code = (
        "import sys, runpy; sys.argv = ['x', '--help']\n"
        f"try: runpy.run_module({module!r}, run_name='__main__')\n"
        "except SystemExit as e: assert e.code == 0\n"
        "heavy = {'torch', 'open3d', 'mujoco', 'dm_control', 'open_clip'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "options" in done.stdout


@pytest.mark.parametrize("backend", ["egl", "osmesa"])
def test_simulator_and_torch_load_in_one_process(backend):
    # dm_control loads the graphics library's LLVM, torchvision that of triton.
    code = "import models.tabletop, sr_mj.scene.compose, torchvision, open_clip"
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        env={**os.environ, "MUJOCO_GL": backend, "PYOPENGL_PLATFORM": backend},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
