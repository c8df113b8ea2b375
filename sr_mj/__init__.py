"""Language-guided pick and place in clutter with a UR5, in MuJoCo.

`sr_mj` composes the three packages beside it, `models`, `perception` and `policy`, into scenes,
sensors, planning, execution and command lines.
"""

from importlib.metadata import PackageNotFoundError, version

# First of all, for the order in which it loads libraries; see there.
import models as _models  # noqa: F401

try:
    __version__ = version("sr-mj")
except PackageNotFoundError:  # imported from a checkout that was never installed
    __version__ = "unknown"
