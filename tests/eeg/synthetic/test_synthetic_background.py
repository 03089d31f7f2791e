import numpy as np
import pytest

from hrcneuro.eeg.synthetic.background import stretch


@pytest.mark.parametrize(
    ("samples", "sfreq", "every_s"),
    [(200_001, 1000.0, 10.0), (99_999, 512.0, 5.0), (30_000, 128.0, 7.3), (5000, 1000.0, 5.0), (5001, 1000.0, 5.0),
     (1, 1000.0, 5.0), (40_000, 1000.0, 0.05)],
)  # fmt: skip
def test_lines_drawn_one_by_one_are_those_of_interpolation_to_the_bit(samples, sfreq, every_s):
    knots = np.exp(np.random.default_rng(samples).standard_normal(int(samples / sfreq / every_s) + 3))
    at = np.arange(samples) / (sfreq * every_s)
    expected = np.interp(at, np.arange(len(knots)), knots).astype(np.float32)
    assert stretch(knots, samples, sfreq, every_s).tobytes() == expected.tobytes()


def test_behind_the_last_knot_its_value_holds():
    line = stretch(np.array([1.0, 2.0]), 5000, 1000.0, 2.0)
    assert line[2000:].tolist() == [2.0] * 3000
