"""MJCF models: UR5, gripper, table and bin, cameras, and the catalogue of everyday objects.

Everything here is geometry and physics as data; no rendering, planning or perception.
"""

import contextlib
import importlib
import sys

# dm_control loads the graphics library on import. Mesa's software renderer and torch's compiler
# backend each bring an LLVM: with triton first they get along, the other way round importing
# torchvision later ends the process with a segmentation fault. Without triton there is no clash;
# once dm_control is there, loading triton would do the harm itself.
if "dm_control" not in sys.modules:
    with contextlib.suppress(ImportError):
        importlib.import_module("triton._C.libtriton")
