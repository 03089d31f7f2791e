"""How often a decoder is right in the four situations of Table 1."""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np

from hrcneuro.learning.params import RateParams


@dataclass(frozen=True)
class Rates(RateParams):
    """Per cent of correct decisions in the four situations of Table 1; the first letter acted last, the second next.

    Raises:
        ValueError: A rate is no percentage.
    """

    def __post_init__(self) -> None:
        for name, value in zip(("TNR_HH", "TPR_HR", "TNR_RR", "TPR_RH"), astuple(self), strict=True):
            if not 0 <= value <= 100:
                raise ValueError(f"{name} is {value:g} %; allowed are 0 to 100")

    @classmethod
    def level(cls, percent: float) -> Rates:
        """Return four equal rates (the hypothetical levels of SIM2)."""
        return cls(percent, percent, percent, percent)

    @property
    def by_case(self) -> np.ndarray:
        """The rates by :func:`case`: ndarray, shape (4,), %: RR, RH, HR, HH."""
        return np.array([self.tnr_rr, self.tpr_rh, self.tpr_hr, self.tnr_hh])


PAPER = Rates()


def case(before: np.ndarray, acting: np.ndarray) -> np.ndarray:
    """Return the situation of each event as 2·(human before) + (human now), uint8: RR 0, RH 1, HR 2, HH 3."""
    return (before.view(np.uint8) << 1) | acting.view(np.uint8)
