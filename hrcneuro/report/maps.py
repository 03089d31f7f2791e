"""The group's tested maps, as the verdicts and the figures ask for them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

FRONTAL = ("Fp1", "Fp2", "F7", "F3", "Fz", "F4", "F8", "FC1", "FC2")
MOTOR = ("FC5", "FC1", "FC2", "FC6", "C3", "Cz", "C4", "CP5", "CP6")
LEFT_TEMPORAL = ("T7", "TP9", "P7")
THETA, ALPHA, BETA = (4.0, 7.5), (7.5, 12.5), (12.5, 30.5)


@dataclass(frozen=True)
class Tested:
    """The difference of two conditions over subjects, and where it is significant.

    Attributes:
        n: Subjects.
        channels: Their names.
        times: In seconds from the onset.
        difference: Shape (channels, times) for potentials, (channels, frequencies, times) for magnitudes; microvolt.
        significant: The same shape.
        frequencies: In Hz; empty for potentials.
    """

    n: int
    channels: list[str]
    times: NDArray[np.float64]
    difference: NDArray[np.float64]
    significant: NDArray[np.bool_]
    frequencies: NDArray[np.float64]

    def within(
        self,
        channels: tuple[str, ...] = (),
        *,
        hz: tuple[float, float] | None = None,
        s: tuple[float, float] | None = None,
    ) -> Tested:
        """Return the part with these channels, frequencies and times (edges included)."""
        rows = [i for i, name in enumerate(self.channels) if not channels or name in channels]
        times = np.flatnonzero((self.times >= s[0]) & (self.times <= s[1])) if s else np.arange(len(self.times))
        difference, significant = self.difference[rows][..., times], self.significant[rows][..., times]
        bins = np.arange(len(self.frequencies))
        if hz:
            bins = np.flatnonzero((self.frequencies >= hz[0]) & (self.frequencies <= hz[1]))
            difference, significant = difference[:, bins], significant[:, bins]
        return Tested(
            self.n,
            [self.channels[i] for i in rows],
            self.times[times],
            difference,
            significant,
            self.frequencies[bins],
        )

    @property
    def any(self) -> bool:
        """Whether anything is significant."""
        return bool(self.significant.any())

    @property
    def first_s(self) -> float:
        """The first significant time."""
        return float(self.times[self._columns().argmax()]) if self.any else float("nan")

    def describe(self) -> str:
        """Return where and when the map is significant, in a few words."""
        if not self.any:
            return f"nothing significant (n = {self.n})"
        found = np.flatnonzero(self._columns())
        rows = np.flatnonzero(self.significant.reshape(len(self.channels), -1).any(axis=1))
        names = [self.channels[i] for i in rows]
        where = ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
        first, last = (f"{1000 * self.times[i]:.0f}" for i in (found[0], found[-1]))
        text = f"{where}, {first} to {last} ms" if first != last else f"{where}, {first} ms"
        if len(self.frequencies):
            bins = self.frequencies[self.significant.any(axis=(0, 2))]
            text += f", {bins.min():g} to {bins.max():g} Hz" if len(bins) > 1 else f", {bins[0]:g} Hz"
        return text

    def _columns(self) -> NDArray[np.bool_]:
        return np.asarray(self.significant.reshape(-1, len(self.times)).any(axis=0))


def read(table: pd.DataFrame | None) -> dict[tuple[str, str], Tested]:
    """Return (scenario, contrast) -> what ``erp_stats`` or ``ersp_stats`` holds; empty where there is no table."""
    found: dict[tuple[str, str], Tested] = {}
    if table is None:
        return found
    for (scenario, contrast), part in table.groupby(["scenario", "contrast"], sort=False):
        head = part.iloc[0]
        length = len(head["difference_uv"])
        times = head["start_s"] + head["step_s"] * np.arange(length)
        channels = list(dict.fromkeys(part["channel"]))
        frequencies = np.unique(part["frequency_hz"]) if "frequency_hz" in part else np.zeros(0)
        shape = (len(channels), *([len(frequencies)] if len(frequencies) else []), length)
        found[str(scenario), str(contrast)] = Tested(
            int(head["n"]),
            channels,
            times,
            np.stack(list(part["difference_uv"])).astype(float).reshape(shape),
            np.stack(list(part["significant"])).astype(bool).reshape(shape),
            frequencies,
        )
    return found
