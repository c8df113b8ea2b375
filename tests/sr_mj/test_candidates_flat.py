"""Flat things, and pairs of things: clouds of boxes of which every face was seen."""

from dataclasses import replace

import numpy as np
import pytest

from perception.cloud import GeometryCloud
from sr_mj.candidates import AntipodalConfig, AntipodalSampler, Relaxation
from sr_mj.candidates.collision import swept_boxes, table_clearance
from sr_mj.candidates.contacts import Contacts
from sr_mj.candidates.flat import flat_without_candidate
from sr_mj.candidates.ranking import chance_of_two, grasp_prior
from sr_mj.errors import ConfigError

CONFIG = AntipodalConfig()
STEP_M = 0.002
RED, BLUE, GREY = (0.8, 0.1, 0.1), (0.1, 0.1, 0.8), (0.5, 0.5, 0.5)


def _box(center, size, color, *, sides=True):
    """Rows (N, 9) of points, normals and colours on the top, and the sides, of a box."""
    half = np.asarray(size) / 2
    x, y, z = (np.arange(-h + STEP_M / 2, h, STEP_M) for h in half)
    faces = [(np.stack(np.meshgrid(x, y, [half[2]]), -1), (0, 0, 1))]
    for sign in (-1, 1) if sides else ():
        faces.append((np.stack(np.meshgrid([sign * half[0]], y, z), -1), (sign, 0, 0)))
        faces.append((np.stack(np.meshgrid(x, [sign * half[1]], z), -1), (0, sign, 0)))
    rows = []
    for points, normal in faces:
        points = points.reshape(-1, 3) + np.array([*center, half[2]])
        rows.append(np.hstack([points, np.tile([*normal, *color], (len(points), 1))]))
    return np.concatenate(rows)


def _cloud(*boxes):
    rows = np.concatenate(boxes).astype(np.float32)
    return GeometryCloud(points=rows[:, :3], normals=rows[:, 3:6], colors=rows[:, 6:])


def _pick(cloud, config=CONFIG):
    return AntipodalSampler(config).pick(cloud, np.random.default_rng(0))


def _tips_m(picks):
    low, high = swept_boxes(AntipodalSampler().approach_opening(picks.width_m), CONFIG)
    return table_clearance(picks.Ts_world_tool, low, high)


def _contacts(**values):
    """One contact of a good grasp, with some values changed."""
    usual = {
        "center_m": 0.0, "width_m": 0.04, "opposition": -0.9, "area": 0.5, "offset_m": 0.0,
        "gap": 0.1, "contrast": 0.02,
    }  # fmt: skip
    arrays = {name: np.array([value]) for name, value in (usual | values).items()}
    return Contacts(alignment=np.full((1, 2), 0.95), **arrays)


def test_flat_parts_without_candidate_are_found():
    plate = _box((0.5, 0), (0.06, 0.12, 0.010), GREY)
    box = _box((0.6, 0.1), (0.04, 0.04, 0.05), GREY)
    speck = _box((0.4, 0.1), (0.004, 0.004, 0.010), GREY)
    points = np.concatenate([plate, box, speck])[:, :3]
    points = points[points[:, 2] > CONFIG.object_min_height_m]
    origins = np.array([[0.5, 0.05, 0.01], [0.51, -0.05, 0.01], [0.6, 0.1, 0.05], [0.4, 0.1, 0.01]])
    nothing = np.zeros((0, 3))
    found = flat_without_candidate(points, origins, nothing, 0.018)
    assert found.tolist() == [True, True, False, False]
    # A candidate anywhere on a part serves all of it; one elsewhere, or off the table, does not.
    on_plate, elsewhere = [[0.5, -0.02, 0.01]], [[0.6, 0.1, 0.04], [3.0, -3.0, 0.0]]
    assert not flat_without_candidate(points, origins, np.array(on_plate), 0.018).any()
    again = flat_without_candidate(points, origins, np.array(elsewhere), 0.018)
    assert again.tolist() == found.tolist()
    assert not flat_without_candidate(points, origins, nothing, 0.009).any()


def test_flat_plate_is_held_from_above_nearer_to_the_table():
    cloud = _cloud(_box((0.5, 0), (0.05, 0.14, 0.009), GREY, sides=False))
    assert len(_pick(cloud, replace(CONFIG, flat=None))) == 0
    picks = _pick(cloud)
    assert len(picks) >= 5
    assert (picks.Ts_world_tool[:, 2, 2] < -0.99).all()
    assert (np.abs(picks.Ts_world_tool[:, 0, 0]) > np.cos(np.radians(31))).all()
    assert _tips_m(picks).min() > 0.0019
    assert _tips_m(picks).min() < 0.003
    assert (np.diff(picks.prior) <= 0).all()


def test_flat_pass_adds_to_what_other_objects_got():
    box = _box((0.58, 0.12), (0.05, 0.04, 0.05), GREY)
    plate = _box((0.45, -0.08), (0.05, 0.14, 0.009), GREY, sides=False)
    without = _pick(_cloud(box, plate), replace(CONFIG, flat=None))
    picks = _pick(_cloud(box, plate))
    on_plate = picks.positions[:, 1] < 0.02
    assert on_plate.sum() >= 5
    assert len(without) > 10
    kept = picks.take(np.flatnonzero(~on_plate))
    assert kept.Ts_world_tool.tobytes() == without.Ts_world_tool.tobytes()
    assert (np.diff(picks.prior) <= 0).all()
    few = _pick(_cloud(box, plate), replace(CONFIG, max_candidates=20))
    assert len(few) <= 20
    assert (few.positions[:, 1] < 0.02).any()


def test_two_boxes_side_by_side_are_not_held_together():
    size, apart = (0.03, 0.06, 0.05), 0.01

    def across(colors):
        boxes = [
            _box((0.5 + side * (size[0] + apart) / 2, 0), size, color)
            for side, color in zip((-1, 1), colors, strict=True)
        ]
        picks = _pick(_cloud(*boxes))
        along_x = np.abs(picks.Ts_world_tool[:, 0, 0]) > 0.9
        return picks, along_x & (picks.width_m > 0.06)

    picks, both = across((RED, BLUE))
    assert not both.any()
    assert len(picks) > 10
    # Of one colour they may well be one thing, the walls of a cup for example.
    picks, both = across((GREY, GREY))
    assert both.any()


def test_chance_of_two_grows_with_gap_and_contrast():
    contrasts = [float(chance_of_two(_contacts(contrast=c))[0]) for c in (0.0, 0.1, 0.3, 0.4, 1.5)]
    assert contrasts == sorted(contrasts)
    assert contrasts[-1] == contrasts[-2]
    shallow, deep = (float(chance_of_two(_contacts(gap=gap))[0]) for gap in (0.1, 0.6))
    assert shallow < 0.05 < deep
    assert float(chance_of_two(_contacts(gap=0.6, contrast=0.4))[0]) > CONFIG.max_chance_of_two


@pytest.mark.parametrize(
    ("worse", "better"),
    [
        ({"gap": 0.6}, {"gap": 0.1}),
        ({"contrast": 0.3}, {"contrast": 0.0}),
        ({"width_m": 0.084}, {"width_m": 0.08}),
        ({"offset_m": 0.03}, {"offset_m": 0.01}),
        ({"area": 0.2}, {"area": 0.4}),
    ],
)
def test_prior_prefers(worse, better):
    bad, good = (
        grasp_prior(_contacts(**values), np.array([0.02]), np.array([-1.0]), 0.085)[0]
        for values in (worse, better)
    )
    assert bad < good


def test_bad_flat_pass_is_refused_in_one_line():
    usual = {"min_alignment": 0.3, "max_opposition": 0.0, "clearance_m": 0.0}
    with pytest.raises(ConfigError) as caught:
        Relaxation(**usual, min_tip_height_m=0.03)
    assert str(caught.value) == "Relaxation: min_tip_height_m is 0.03, expected 0 to 0.02."
    with pytest.raises(ConfigError) as caught:
        Relaxation(**usual, min_prior=1.5)
    assert str(caught.value) == "Relaxation: min_prior is 1.5, expected 0 to 1."
    with pytest.raises(ConfigError) as caught:
        replace(CONFIG, max_chance_of_two=-0.1)
    assert str(caught.value) == "AntipodalConfig: max_chance_of_two is -0.1, expected 0 to 1."
