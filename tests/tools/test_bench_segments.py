import re

import numpy as np
import pytest

from policy.errors import InvalidConfigError
from policy.segments import MIN_POINTS
from sr_mj.errors import UnknownNameError
from tools.bench.segments import SegmentsConfig, best_overlaps, components, main


def test_an_object_is_compared_with_the_segment_that_fits_it_best():
    n = MIN_POINTS
    # The first segment is the first object; the second holds the rest of all; the third object is
    # too small to count, and some points belong to none.
    labels = np.repeat([0, 1, 1, 1], [n, 2 * n, n - 1, 5])
    owners = np.repeat([4, 7, 2, -1], [n, 2 * n, n - 1, 5])
    expected = [1.0, 2 * n / (3 * n + 4)]
    # Objects in the order of their indices: 4, 7.
    np.testing.assert_allclose(best_overlaps(labels, owners), expected)
    # In two equal halves, either fits as well.
    np.testing.assert_allclose(best_overlaps(np.arange(2 * n) % 2, np.zeros(2 * n, int)), 0.5)
    assert not len(best_overlaps(labels, np.full(len(labels), -1)))


def test_components_are_what_hangs_together():
    line = np.arange(20) * 0.008
    points = np.zeros((40, 3))
    points[:20, 0], points[20:, 0], points[20:, 1] = line, line, 0.013
    labels = components(points)
    assert len(set(labels[:20])) == len(set(labels[20:])) == 1 and labels[0] != labels[20]
    points[20:, 1] = 0.011
    assert len(set(components(points))) == 1


def test_the_table_has_a_row_for_each_method(capsys):
    assert main(SegmentsConfig(scene="single", seeds=(0, 1))) == 0
    heading, _, hills, whole = capsys.readouterr().out.splitlines()
    assert heading == "| segments | mean IoU, 1 objects | above 0.5, % | seconds |"
    assert hills.startswith("| hills (`policy.segments`) | ")
    # A single object hangs together, and nothing else is there.
    found = re.match(r"\| connected components \| (\S+) \| 100 ", whole)
    assert found and float(found[1]) > 0.9


def test_bad_options_are_refused():
    with pytest.raises(UnknownNameError, match=r"Unknown scene 'clutered15'"):
        main(SegmentsConfig(scene="clutered15"))
    with pytest.raises(InvalidConfigError, match=r"seeds: got \(5, 5\), among which no object"):
        main(SegmentsConfig(seeds=(5, 5)))
