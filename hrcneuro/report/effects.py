"""Printed effects on brain signals: where, when and of what sign a difference must be significant to count as shown."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hrcneuro import published
from hrcneuro.eeg.significance import SignificanceMap
from hrcneuro.eeg.spans import spans

# An effect shorter than one period of its rhythm is no change of that rhythm; of a potential, whose parts reach up to
# the edge of the pass band, than the quickest period that is left in it.
_POTENTIAL_S = 1 / published.PASS_BAND_HZ.value[1]
# One channel is enough: the tests are corrected over all of them, so that how many pass depends on the sample.
_OF_SIGN = 0.9


@dataclass(frozen=True)
class Effect:
    """A difference, takeover less continuation, as the paper prints it.

    Attributes:
        region: What the channels are, in words.
        channels: Where it is.
        sign: 1 where the takeover has more, -1 where it has less.
        hz: Of the rhythm, from and to, edges included; None for a potential.
        s: When it must be there, from and to, edges included; None at any time.
        starts_s: When it must begin; None where the paper does not say.
        peaks: Whether it must be largest within ``s``.
    """

    region: str
    channels: tuple[str, ...]
    sign: int
    hz: tuple[float, float] | None = None
    s: tuple[float, float] | None = None
    starts_s: tuple[float, float] | None = None
    peaks: bool = False

    @property
    def criterion(self) -> str:
        """What is asked for, in words."""
        what = f"{self.hz[0]:g} to {self.hz[1]:g} Hz, for one period" if self.hz else f"for {1000 * _POTENTIAL_S:g} ms"
        when = f", {_ms(self.s)}" if self.s else ""
        parts = [
            f"significantly {'larger' if self.sign > 0 else 'smaller'} over {self.region}, {what} or more{when}",
            f"{100 * _OF_SIGN:g} % of the significant points of this sign",
            *([f"first in {_ms(self.starts_s)}"] if self.starts_s else []),
            *(["largest there"] if self.peaks else []),
        ]
        return "; ".join(parts)


@dataclass(frozen=True)
class Shown:
    """What a tested map shows of an effect.

    Attributes:
        agrees: Whether it is there as printed.
        text: Where and when the map is significant, and how much of that has the printed sign.
        points: Significant points of the printed sign, where and when it must be.
        starts_s: When the effect begins, at whatever time; NaN where it is nowhere.
        strongest: The greatest significant difference of the printed sign, without the sign, µV; 0 without one.
        mean: The mean difference, significant or not, where and when the effect must be, µV; NaN of no point.
    """

    agrees: bool
    text: str
    points: int
    starts_s: float
    strongest: float
    mean: float


def shown(tested: SignificanceMap, effect: Effect) -> Shown:
    """Return what a tested map, takeover less continuation, shows of an effect."""
    region = tested.within(effect.channels, hz=effect.hz)
    part = region.within(s=effect.s)
    right = _of_sign(part, effect.sign)
    points, all_points = int(right.significant.sum()), int(part.significant.sum())
    lasting = _lasting(right)
    channels = int(lasting.reshape(len(part.channels), -1).any(axis=1).sum()) if lasting.size else 0
    everywhen = _of_sign(region, effect.sign)
    begun = replace(everywhen, significant=_lasting(everywhen))
    largest = np.where(everywhen.significant, effect.sign * region.difference, 0.0)
    agrees = (
        channels > 0
        and points >= _OF_SIGN * all_points
        and (effect.starts_s is None or effect.starts_s[0] <= begun.first_s <= effect.starts_s[1])
        and (not effect.peaks or _peaks_within(largest, region.times, effect.s))
    )
    text = part.describe()
    if all_points:
        word = "larger" if effect.sign > 0 else "smaller"
        text += f", {word} in {100 * points / all_points:.0f} % of {all_points} points"
        text += f", long enough on {channels} of {len(part.channels)} channels"
        if effect.starts_s and begun.any:
            text += f"; from {1000 * begun.first_s:.0f} ms"
    mean = float(part.difference.mean()) if part.difference.size else float("nan")
    return Shown(agrees, text, points, begun.first_s, float(largest.max(initial=0.0)), mean)


def _of_sign(tested: SignificanceMap, sign: int) -> SignificanceMap:
    """Return the map in which only differences of one sign are significant."""
    return replace(tested, significant=tested.significant & (sign * tested.difference > 0))


def _lasting(tested: SignificanceMap) -> np.ndarray:
    """Return where significance lasts a period on one channel (and frequency): ndarray, the map's shape, bool."""
    kept = np.zeros_like(tested.significant)
    if len(tested.times) < 2:
        return kept
    step = float(tested.times[1] - tested.times[0])
    periods = 1 / tested.frequencies if len(tested.frequencies) else np.array([_POTENTIAL_S])
    for row in np.ndindex(tested.significant.shape[:-1]):
        # (channel,) of a potential, (channel, frequency) of magnitudes.
        period = periods[row[1] if len(row) > 1 else 0]
        kept[row] = _long_runs(tested.significant[row], int(np.ceil(period / step - 1e-9)))
    return kept


def _long_runs(flags: np.ndarray, least: int) -> np.ndarray:
    """Return the flags, shape (n_times,), without runs shorter than ``least``."""
    kept = np.zeros_like(flags)
    for start, stop in spans(flags):
        kept[start:stop] = stop - start >= least
    return kept


def _peaks_within(largest: np.ndarray, times: np.ndarray, s: tuple[float, float] | None) -> bool:
    at = times[np.unravel_index(int(largest.argmax()), largest.shape)[-1]]
    return s is None or bool(s[0] <= at <= s[1])


def _ms(s: tuple[float, float]) -> str:
    return f"{1000 * s[0]:.0f} to {1000 * s[1]:.0f} ms"
