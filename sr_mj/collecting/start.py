"""Makes a worker in a fresh process; imports nothing heavy before the process is prepared."""

import warnings

from sr_mj.collecting.work import Work, WorkSetting


def start_worker(setting: WorkSetting) -> Work:
    """Choose the graphics library, then load all that a scene needs.

    Args:
        setting: What all scenes share.

    Returns:
        What does a scene.
    """
    # GLFW warns about a missing display on import, on every headless machine.
    warnings.filterwarnings("ignore", message=".*DISPLAY.*")
    from sr_mj.gl import select_backend

    # Before anything imports dm_control, which binds OpenGL to one library for good.
    select_backend()
    from sr_mj.collecting.worker import make_worker

    return make_worker(setting)
