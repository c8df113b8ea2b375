"""Variants as bodies: as sound as the catalogue's objects."""

import functools

import mujoco
import numpy as np
import pytest
from dm_control import mjcf

from models.objects import families
from models.objects.asset import closed_mesh
from models.objects.mjcf_builder import FRICTION, SOLREF, build_object
from models.objects.variants import novelty, sampling
from models.objects.variants.colors import color_name

every_family = pytest.mark.parametrize("family", families.FAMILIES)


@every_family
def test_first_colour_covers_a_good_part_of_the_surface(family, assets):
    named = functools.cache(color_name)
    for asset in assets(family):
        corners = asset.vertices[asset.faces]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = np.linalg.norm(cross, axis=1)
        rng = np.random.default_rng(0)
        chosen = rng.choice(len(area), 1500, p=area / area.sum())
        share = rng.dirichlet((1, 1, 1), 1500)[:, :, None]
        uv = (asset.uv[asset.faces[chosen]] * share).sum(axis=1)
        height, width = asset.texture.shape[:2]
        column = np.minimum((uv[:, 0] * width).astype(int), width - 1)
        row = np.minimum(((1 - uv[:, 1]) * height).astype(int), height - 1)
        texels = (asset.texture[row, column] // 6 * 6 + 3).tolist()
        hits = [named(tuple(texel)) == asset.words.colors[0] for texel in texels]
        assert np.mean(hits) > 0.12, (asset.words, np.mean(hits))


@every_family
def test_variants_are_closed_of_true_size_and_felt_where_they_are_seen(family, assets, reach):
    for asset in assets(family):
        mesh = closed_mesh(asset.vertices, asset.faces)
        assert mesh.is_watertight and mesh.is_winding_consistent
        assert 1000 <= len(asset.faces) <= 8000
        assert max(asset.texture.shape[:2]) <= 512
        smallest, middle, largest = np.sort(asset.size_m)
        assert 0.010 <= smallest and 0.015 <= middle and largest <= 0.260
        assert 0.005 < asset.mass_kg < 1.2
        assert 100 < asset.density_kg_m3 < 3000
        for direction in np.concatenate([np.eye(3), -np.eye(3)]):
            seen = float((asset.vertices @ direction).max())
            felt = max(reach(part, direction) for part in asset.collision)
            assert felt - seen < 0.0025, (asset.words, direction)
            assert seen - felt < 0.030, (asset.words, direction)
        floor = max(reach(part, np.array([0.0, 0.0, -1.0])) for part in asset.collision)
        assert floor == pytest.approx(0, abs=0.0015)


@every_family
def test_parameters_stay_in_bounds_over_many_draws(family):
    rng = np.random.default_rng(13)
    for _ in range(40):
        shape = sampling.draw(rng, family=family).shape
        lengths = [v for k, v in novelty.geometry(shape).items() if "_m" in k]
        assert all(0 <= length <= 0.260 for length in lengths), shape


@pytest.mark.parametrize(
    "family", ["mug", "bottle", "carton", "quadruped", "citrus", "tape_roll", "scissors", "brick"]
)
def test_variants_settle_on_the_table(family, assets):
    asset = assets(family)[1]
    root = mjcf.RootElement()
    root.option.set_attributes(
        timestep=0.002, cone="elliptic", impratio=10, integrator="implicitfast"
    )
    root.worldbody.add("geom", type="plane", size=(3, 3, 0.1), friction=FRICTION, solref=SOLREF)
    frame = root.attach(build_object(asset))
    frame.pos = (0, 0, 0.005)
    frame.add("freejoint")
    model = mjcf.Physics.from_mjcf_model(root).model.ptr
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=1500)
    fastest = 0.0
    for _ in range(100):
        mujoco.mj_step(model, data)
        fastest = max(fastest, float(np.linalg.norm(data.qvel[:3])))
    assert fastest < 0.005, "metres a second"
    assert np.all(data.contact.dist > -0.001)
    assert np.linalg.norm(data.qpos[:2]) < 0.1
