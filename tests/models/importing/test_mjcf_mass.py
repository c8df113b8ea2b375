"""Masses of objects described in MJCF: as their authors meant them."""

import mujoco
import numpy as np
import pytest
import trimesh


def test_masses_of_nested_bodies_add_up(plain, read, compiled):
    item = read(plain)
    original = mujoco.MjModel.from_xml_path(str(plain))
    data = mujoco.MjData(original)
    mujoco.mj_forward(original, data)
    assert item.mass_kg == pytest.approx(0.3)
    np.testing.assert_allclose(
        item.center_of_mass - compiled(item).geom("collision_0").pos + (0, 0, 0.05),
        (0.2 * np.array([0.01, 0, 0]) + 0.1 * np.array([0, 0, 0.1])) / 0.3,
        atol=1e-7,
    )
    # Two points of 0.2 and 0.1 kg, 0.01 and 0.1 m apart, besides the bodies' own inertia; the
    # second is turned a quarter about y.
    arm = np.array([0.01, 0, -0.1])
    apart = 0.2 * 0.1 / 0.3 * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    own = np.diag([1e-4, 2e-4, 2e-4]) + np.diag([2e-5, 1e-5, 1e-5])
    np.testing.assert_allclose(item.inertia, apart + own, atol=1e-9)


def test_a_given_mass_scales_the_inertia(libero, read):
    own, given = read(libero), read(libero, mass_kg=0.3)
    assert given.mass_kg == 0.3
    np.testing.assert_allclose(given.inertia, own.inertia * (0.3 / own.mass_kg), rtol=1e-4)
    np.testing.assert_array_equal(given.center_of_mass, own.center_of_mass)


def test_a_massless_object_takes_the_given_mass_of_its_hull(libero, read):
    libero.write_text(libero.read_text().replace('density="100"', 'mass="0"'))
    item = read(libero, mass_kg=0.12)
    # A box of 80 x 60 x 70 mm.
    expected = 0.01 * np.diag([0.06**2 + 0.07**2, 0.08**2 + 0.07**2, 0.08**2 + 0.06**2])
    np.testing.assert_allclose(item.inertia, expected, atol=1e-9)
    np.testing.assert_allclose(item.center_of_mass, (0, 0, 0.035), atol=1e-6)


def test_an_open_mesh_weighs_as_much_as_its_hull(obj2mjcf, read):
    box = trimesh.creation.box((0.08, 0.06, 0.07))
    trimesh.Trimesh(box.vertices, box.faces[:-1]).export(obj2mjcf.parent / "scan_collision_0.obj")
    item = read(obj2mjcf)
    assert item.mass_kg == pytest.approx(1000 * 0.08 * 0.06 * 0.07)
    np.testing.assert_allclose(item.center_of_mass, (0, 0, 0.035), atol=1e-6)
