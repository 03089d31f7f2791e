"""The picture of the evidence: where its points are drawn."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hrcneuro.figures import evidence


@given(st.lists(st.tuples(st.floats(0, 100), st.integers(0, 2)), min_size=1, max_size=60))
def test_points_are_moved_sideways_alone_so_that_none_covers_another_and_none_leaves_the_scale(points):
    x, y = np.array([p[0] for p in points]), np.array([10.0 * p[1] for p in points])
    drawn = evidence._apart(x, y)
    assert (drawn >= 0).all()
    assert (drawn <= 100).all()
    for height in np.unique(y):
        gaps = np.diff(np.sort(drawn[y == height]))
        assert (gaps > evidence._BESIDE - 1e-9).all()


def test_points_that_cover_none_stay():
    x = np.array([50.0, 60.0, 60.0, 99.9, 100.0])
    drawn = evidence._apart(x, np.array([10.0, 10.0, 20.0, 100.0, 100.0]))
    assert drawn[:3].tolist() == [50.0, 60.0, 60.0]
    assert np.allclose(drawn[3:], [99.0, 100.0])
