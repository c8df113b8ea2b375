"""What every command line shares: configuration from arguments, errors in one line."""

import errno
import sys
import warnings
from collections.abc import Callable
from typing import TypeVar

import tyro

Config = TypeVar("Config")

USAGE_ERROR = 2
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)

_SIM_PACKAGES = (
    *("daqp", "dm_control", "imageio", "jsonschema", "lxml", "manifold3d"),
    *("mink", "mujoco", "shapely", "trimesh"),
)


def run_command(config_type: type[Config], body: Callable[[Config], int], description: str) -> None:
    """Parse the arguments, run the command, and exit with its status.

    Mistakes that a user can make end in one line on stderr and status 2, without a traceback.

    Args:
        config_type: Frozen dataclass whose fields become options.
        body: The command; imports what is heavy itself, so that `--help` answers at once.
        description: Text of `--help`.
    """
    config = tyro.cli(config_type, description=description)
    # GLFW warns about a missing display on import, on every headless machine.
    warnings.filterwarnings("ignore", message=".*DISPLAY.*")
    from models.errors import ModelsError
    from perception.errors import PerceptionError
    from policy.errors import PolicyError
    from sr_mj.errors import SrMjError

    try:
        status = body(config)
    except ModuleNotFoundError as error:
        if error.name not in _SIM_PACKAGES:
            raise
        print(
            f"error: {error.name} is not installed; pip install '.[sim]' in a clone",
            file=sys.stderr,
        )
        status = USAGE_ERROR
    except (SrMjError, ModelsError, PerceptionError, PolicyError) as error:
        print(f"error: {error}", file=sys.stderr)
        status = USAGE_ERROR
    except OSError as error:
        # A path that cannot be read or written, a full disk; anything else is a fault of ours.
        if error.filename is not None:
            print(f"error: {error.filename}: {error.strerror}.", file=sys.stderr)
        elif error.errno in _FULL:
            print(f"error: {error.strerror}; make room and try again.", file=sys.stderr)
        else:
            raise
        status = USAGE_ERROR
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        status = 130
    sys.exit(status)
