"""Sign-flip tests with extreme statistics over 11 subjects, all 2¹¹ flips, against ``mne.stats.permutation_t_test``."""

from __future__ import annotations

import _measure
import mne
import numpy as np

from hrcneuro.eeg.permutation import extremes, extremes_plain, sign_flip_test, sign_patterns

SUBJECTS = 11
MAPS = {"ERP max-t": ((27, 717), 8), "ERSP max-t": ((27, 15, 359), 12)}


def maps(shape: tuple[int, ...]) -> np.ndarray:
    return np.random.default_rng(1).standard_normal((SUBJECTS, *shape))


def ours(x: np.ndarray) -> object:
    return sign_flip_test(x, np.random.default_rng(0))


def peer(x: np.ndarray) -> tuple[np.ndarray, ...]:
    return mne.stats.permutation_t_test(
        x.reshape(len(x), -1), n_permutations=2**SUBJECTS, tail=0, n_jobs=1, verbose="error"
    )


def difference(x: np.ndarray) -> str:
    """Return how far t, the extremes of every flip, and the plain loop's are from ours."""
    t, _, largest = peer(x)
    found = ours(x)
    signs, _ = sign_patterns(SUBJECTS, np.random.default_rng(0), exact_to=16, count=1)
    lows, highs = extremes(x, signs)
    plain = extremes_plain(x, signs[:64])
    gaps = {
        "t": np.abs(found.t.ravel() - t).max(),
        "max t of the flips": np.abs(np.sort(np.maximum(highs, -lows))[::-1] - _halved(largest)).max(),
        "plain loop": max(np.abs(a[:64] - b).max() for a, b in zip((lows, highs), plain, strict=True)),
    }
    return ", ".join(f"{name} {gap:.0e}" for name, gap in gaps.items())


def _halved(largest: np.ndarray) -> np.ndarray:
    # A pattern and its opposite have the same largest |t|; MNE may list one of the two or both.
    ordered = np.sort(np.asarray(largest))[::-1]
    return ordered if len(ordered) == 2 ** (SUBJECTS - 1) else ordered[: 2**SUBJECTS : 2]


def main() -> None:
    chosen = _measure.options(__doc__)
    _measure.heading()
    for name, (shape, target) in MAPS.items():
        x = maps(shape)
        times = _measure.in_turns(chosen.repeats, lambda x=x: peer(x), lambda x=x: ours(x))
        label = f"{name}, 11 × {' × '.join(map(str, shape))}, 2¹¹ flips"
        _measure.row(label, *times, target, difference(x))
        memory = [_measure.peak_mb(work, prepare=_Prepared(shape)) for work in (peer, ours)]
        print(f"  memory above the maps: {' MB, ours '.join(f'{peak - before:.0f}' for before, peak in memory)} MB")


class _Prepared:
    def __init__(self, shape: tuple[int, ...]) -> None:
        self.shape = shape

    def __call__(self) -> np.ndarray:
        return maps(self.shape)


if __name__ == "__main__":
    main()
