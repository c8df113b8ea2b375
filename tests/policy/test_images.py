import re

import numpy as np
import pytest

from policy.errors import InvalidArrayError
from policy.images import PictureFrame

# 100 pixels a metre from 1 m above, x to the right and y downwards in the picture; the camera
# stands over (0, 0) and looks down.
DOWN = np.array([[100.0, 0, -50, 50], [0, -100.0, -30, 30], [0, 0, -1.0, 1]])


def _frame(**changes) -> PictureFrame:
    return PictureFrame(**({"P_pixel_world": DOWN, "width": 100, "height": 60} | changes))


@pytest.mark.parametrize(
    ("pixel", "part"),
    [
        ((0, 0), 0),
        ((-0.5, -0.5), 0),
        ((24.4, 0), 0),
        ((24.6, 0), 1),
        ((99.4, 0), 3),
        ((0, 14.4), 0),
        ((0, 14.6), 4),
        ((99.4, 59.4), 15),
        ((-0.6, 0), -1),
        ((0, -0.6), -1),
        ((99.6, 0), -1),
        ((0, 59.6), -1),
    ],
)
def test_the_part_in_which_a_pixel_lies(pixel: tuple[float, float], part: int) -> None:
    position = np.array([[(pixel[0] - 50) / 100, (30 - pixel[1]) / 100, 0.0]])
    assert _frame().parts_of(position, 4).tolist() == [part]


def test_nothing_behind_the_camera_or_at_it_is_in_the_picture() -> None:
    middle = np.array([[0.01, 0.01, z] for z in (0.0, 0.9, 1.0, 1.1, 2.0)])
    assert _frame().parts_of(middle, 1).tolist() == [0, 0, -1, -1, -1]


def test_finer_parts_lie_within_coarser_ones() -> None:
    positions = np.random.default_rng(0).uniform(-0.6, 0.6, (500, 3))
    frame = _frame()
    coarse, fine = frame.parts_of(positions, 3), frame.parts_of(positions, 6)
    np.testing.assert_array_equal(coarse >= 0, fine >= 0)
    row, column = np.divmod(fine, 6)
    np.testing.assert_array_equal(coarse, np.where(fine >= 0, row // 2 * 3 + column // 2, -1))
    assert set(coarse) == set(range(-1, 9))


def test_no_positions() -> None:
    assert _frame().parts_of(np.zeros((0, 3)), 4).shape == (0,)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"P_pixel_world": np.eye(3)}, "P_pixel_world: got shape (3, 3), expected (3, 4)."),
        (
            {"P_pixel_world": np.full((3, 4), np.inf)},
            "P_pixel_world: got 12 values that are NaN or infinite, expected finite values.",
        ),
        ({"width": 0}, "width: got 0, expected above 0."),
        ({"height": -1}, "height: got -1, expected above 0."),
    ],
)
def test_bad_frame(changes, message: str) -> None:
    with pytest.raises(InvalidArrayError, match=f"^{re.escape(message)}$"):
        _frame(**changes)
