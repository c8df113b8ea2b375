"""Shared by all tests: the graphics library is chosen before MuJoCo or dm_control load."""

import warnings

import pytest
import torch

from sr_mj.gl import select_backend

# dm_control imports GLFW, which warns about a missing display on every headless machine.
warnings.filterwarnings("ignore", message=".*DISPLAY.*")
select_backend()
torch.set_num_threads(min(2, torch.get_num_threads()))


@pytest.fixture(scope="session")
def cluttered_scene():
    """A settled `cluttered15` scene; read only: make a scene of your own to act in it."""
    from sr_mj.scene import SceneConfig, make_scene

    return make_scene(SceneConfig(scene="cluttered15", seed=0))
