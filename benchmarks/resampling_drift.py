"""How exactly MNE's FFT resampling and ours keep time: 40 minutes of tones whose every sample is known.

At its default MNE pads to a power of two. 0.512 of that length is no whole number, nor is 0.512 of the padding before
the recording, so the new samples are a little too far apart and begin a little off.
"""

from __future__ import annotations

from collections.abc import Iterator

import mne
import numpy as np

from hrcneuro.eeg import resample

SAMPLES, SOURCE, TARGET = 2_403_019, 1000.0, 512.0  # the length of the synthetic s01
MARGIN, PIECE = 2000, 30_720


def tones(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return 10 µV RMS of tones below 40 Hz and their slope, in µV and µV/s."""
    rng = np.random.default_rng(0)
    signal, slope = np.zeros_like(times), np.zeros_like(times)
    for frequency, phase in zip(rng.uniform(2, 39, 20), rng.uniform(0, 2 * np.pi, 20), strict=True):
        angle = 2 * np.pi * frequency * times + phase
        signal += np.sqrt(10) * np.sin(angle)
        slope += np.sqrt(10) * 2 * np.pi * frequency * np.cos(angle)
    return signal, slope


def delays_ms(found: np.ndarray) -> Iterator[tuple[float, float]]:
    """Yield, minute by minute, the time (s) and by how much the signal comes too late (ms)."""
    exact, slope = tones(np.arange(len(found)) / TARGET)
    for start in range(MARGIN, len(found) - MARGIN - PIECE, PIECE):
        part = slice(start, start + PIECE)
        late = -(found[part] - exact[part]) @ slope[part] / (slope[part] @ slope[part])
        yield start / TARGET, 1000 * late


def main() -> None:
    signal, _ = tones(np.arange(SAMPLES) / SOURCE)
    fill = -SAMPLES % 125
    whole = np.pad(signal, (0, fill), mode="edge")
    made = resample.ratio(SOURCE, TARGET)
    found = {
        "MNE, default": mne.filter.resample(signal, TARGET, SOURCE, npad="auto", pad="edge", verbose="error"),
        "MNE, padding a multiple of 125": mne.filter.resample(
            whole, TARGET, SOURCE, npad=125 * 229, pad="edge", verbose="error"
        ),
        "hrcneuro": resample.resample(signal[None].copy(), made, pass_freq=40.5)[0],
    }
    for name, result in found.items():
        exact, _ = tones(np.arange(len(result)) / TARGET)
        error = np.abs(result - exact)[MARGIN : made.length(SAMPLES) - MARGIN].max()
        (_, first), *_, (_, last) = delays_ms(result[: made.length(SAMPLES)])
        print(f"{name:32} late by {first:+.5f} ms in the first minute, {last:+.5f} in the last; error {error:.0e} µV")


if __name__ == "__main__":
    main()
