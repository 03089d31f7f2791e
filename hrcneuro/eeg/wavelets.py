"""Which wavelets a study uses. Values only, so that a configuration loads without NumPy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from hrcneuro.contract import option

if TYPE_CHECKING:
    from hrcneuro.eeg.morlet import Wavelets


@dataclass(frozen=True)
class WaveletFamily:
    """Frequencies, cycles and length of Morlet wavelets (paper §2.5.3)."""

    low_hz: float = option(2.0, "lowest frequency", unit="Hz", low=0, open_low=True)
    high_hz: float = option(30.0, "highest frequency", unit="Hz", low=0, open_low=True)
    step_hz: float = option(2.0, "distance of the frequencies", unit="Hz", low=0, open_low=True)
    low_cycles: float = option(2.0, "cycles of the lowest frequency's wavelet", low=0, open_low=True)
    high_cycles: float = option(10.0, "cycles of the highest one's; evenly spaced between", low=0, open_low=True)
    kernel_s: float = option(1.0, "length of the wavelets", unit="s", low=0, open_low=True)

    def at(self, sfreq: float) -> Wavelets:
        """Return the wavelets at a sampling rate, Hz.

        Raises:
            ValueError: A frequency does not lie below half of it.
        """
        import numpy as np

        from hrcneuro.eeg.morlet import Wavelets, linear_cycles

        count = int((self.high_hz - self.low_hz) / self.step_hz + 1 + 1e-9)
        frequencies = tuple(float(f) for f in self.low_hz + self.step_hz * np.arange(count))
        cycles = linear_cycles(frequencies, first=self.low_cycles, last=self.high_cycles)
        return Wavelets(frequencies, cycles, sfreq, self.kernel_s)
