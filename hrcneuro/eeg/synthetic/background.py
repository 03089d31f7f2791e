"""What goes on without the task: 1/f background, occipital and central rhythms, hum, drift and sensor noise."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy import fft

from hrcneuro.eeg.synthetic.head import EEG, head, to_mastoids

BAND_HZ = (1.0, 40.0)  # the study's band-pass; RMS values of this package are meant in it
_LONG = 200  # samples between knots, above which lines are drawn one by one
_FLAT_BELOW_HZ = 0.2  # a power law without an end has no variance


def shaped_noise(rng: np.random.Generator, density: np.ndarray, samples: int, sfreq: float) -> np.ndarray:
    """Return Gaussian noise, shape (samples,), float32, whose RMS between 1 and 40 Hz is one.

    Args:
        rng: Generator.
        density: Amplitude at the frequencies of :func:`frequencies`.
        samples: Length.
        sfreq: Sampling rate in hertz.
    """
    bins = len(density)
    length = 2 * (bins - 1)
    low, high = BAND_HZ
    f = frequencies(samples, sfreq)
    power = float(np.sum(density[(f >= low) & (f <= high)].astype(float) ** 2))
    spectrum = rng.standard_normal(2 * bins, dtype=np.float32).view(np.complex64)
    spectrum *= density * np.float32(length / 2 / np.sqrt(power))
    return fft.irfft(spectrum, length, overwrite_x=True)[:samples]


def frequencies(samples: int, sfreq: float) -> np.ndarray:
    """Return the frequency bins in hertz of noise of at least ``samples`` samples (a length that FFTs like)."""
    return fft.rfftfreq(fft_length(samples), 1 / sfreq).astype(np.float32)


def fft_length(samples: int) -> int:
    """Return the even length, at least ``samples``, at which noise is made."""
    length: int = fft.next_fast_len(samples, real=True)
    while length % 2:
        length = fft.next_fast_len(length + 1, real=True)
    return length


def power_law(f: np.ndarray, exponent: float) -> np.ndarray:
    """Return amplitudes whose power falls as 1/f**exponent above 0.2 Hz and is flat below, shape as ``f``, float32."""
    return np.maximum(f, _FLAT_BELOW_HZ).astype(np.float32) ** np.float32(-exponent / 2)


def peak(f: np.ndarray, centre_hz: float, width_hz: float) -> np.ndarray:
    """Return amplitudes of a rhythm: a Gaussian of SD ``width_hz`` around ``centre_hz``, shape as ``f``, float32."""
    return np.exp(-0.5 * ((f - np.float32(centre_hz)) / np.float32(width_hz)) ** 2)


def dipole_mixing(rng: np.random.Generator, dipoles: int) -> np.ndarray:
    """Return the channels' mixing of independent processes that equals many random dipoles, shape (30, 30).

    ``dipoles`` dipoles at random places and orientations with lognormal strength, all with the same spectrum, are
    jointly Gaussian with the spatial covariance G Gᵀ (G the gains, 30 × dipoles). Thirty independent processes with
    that spectrum, mixed by a square root of G Gᵀ, have the same distribution, so only thirty are drawn. The symmetric
    root makes each of them a patch around one electrode. The result is against the mastoids, scaled to a mean EEG
    variance of one.
    """
    model = head()
    place = rng.integers(len(model.dipoles), size=dipoles)
    orientation = rng.standard_normal((dipoles, 3))
    orientation /= np.linalg.norm(orientation, axis=1, keepdims=True)
    strength = np.exp(0.5 * rng.standard_normal(dipoles))
    gain = np.einsum("cdk,dk->cd", model.gain[:, place], orientation) * strength
    power, axes = np.linalg.eigh(np.einsum("cd,ed->ce", gain, gain))
    mixing = to_mastoids(np.einsum("cs,es->ce", axes * np.sqrt(np.maximum(power, 0.0)), axes))
    return mixing / np.sqrt((mixing[: len(EEG)] ** 2).sum(axis=1).mean())


def slow_gain(rng: np.random.Generator, samples: int, sfreq: float, *, spread: float, every_s: float) -> np.ndarray:
    """Return a slowly changing gain, shape (samples,), float32: lognormal, SD ``spread``, knots ``every_s`` apart."""
    knots = int(samples / sfreq / every_s) + 3
    level = np.exp(spread * rng.standard_normal(knots))
    return stretch(level, samples, sfreq, every_s)


def stretch(knots: np.ndarray, samples: int, sfreq: float, every_s: float) -> np.ndarray:
    """Return values at knots ``every_s`` apart as straight lines between them, shape (samples,), float32."""
    at = _places(samples, sfreq * every_s)
    if len(knots) * _LONG > samples or at[-1] >= len(knots) - 1:
        return np.interp(at, np.arange(len(knots)), knots).astype(np.float32)
    # The same line by line, to the bit: np.interp looks up where each sample lies, which takes three times as long.
    line = np.empty(samples, dtype=np.float32)
    edges = [0, *np.searchsorted(at, np.arange(1, int(at[-1]) + 1)), samples]
    for k, (a, b) in enumerate(pairwise(edges)):
        line[a:b] = (knots[k + 1] - knots[k]) * (at[a:b] - k) + knots[k]
    return line


@lru_cache(maxsize=1)
def _places(samples: int, step: float) -> np.ndarray:
    # Where samples lie, in knots; the channels come one after the other and ask for the same.
    at = np.arange(samples) / step
    at.flags.writeable = False
    return at


def hum(rng: np.random.Generator, samples: int, sfreq: float, *, line_hz: float) -> np.ndarray:
    """Return the power line's sine and cosine with a slowly changing amplitude, shape (2, samples), float32.

    Mains frequency wanders by some hundredths of a hertz. Above the Nyquist frequency there is none: zeros.
    """
    if line_hz >= sfreq / 2:
        return np.zeros((2, samples), dtype=np.float32)
    wander = stretch(np.cumsum(0.05 * rng.standard_normal(int(samples / sfreq / 5) + 3)), samples, sfreq, 5.0)
    amplitude = slow_gain(rng, samples, sfreq, spread=0.3, every_s=20.0)
    phase = 2 * np.pi * (np.arange(samples) * (line_hz / sfreq) % 1.0) + wander
    return np.stack([amplitude * np.sin(phase), amplitude * np.cos(phase)]).astype(np.float32)


def drift(rng: np.random.Generator, samples: int, sfreq: float) -> np.ndarray:
    """Return one electrode's slow drift with RMS of about one, shape (samples,), float32; it forgets within 60 s."""
    knots = int(samples / sfreq / 5) + 3
    decay = np.exp(-5 / 60)
    level = np.empty(knots)
    level[0] = rng.standard_normal()
    steps = np.sqrt(1 - decay**2) * rng.standard_normal(knots)
    for k in range(1, knots):
        level[k] = decay * level[k - 1] + steps[k]
    return stretch(level, samples, sfreq, 5.0)


def desynchronised(
    samples: int, sfreq: float, onset_s: np.ndarray, *, from_s: float, to_s: float, depth: float
) -> np.ndarray:
    """Return a rhythm's gain, shape (samples,), float32: 1, falling to 1 − depth around each onset, smooth edges.

    Args:
        samples, sfreq: Length and sampling rate.
        onset_s: The onsets in seconds.
        from_s, to_s: The span of lower power relative to an onset.
        depth: How much of the amplitude is lost.
    """
    every = 0.05
    t = np.arange(int(samples / sfreq / every) + 3) * every
    lost = np.zeros(len(t))
    first, last = np.searchsorted(t, onset_s + from_s), np.searchsorted(t, onset_s + to_s)
    np.add.at(lost, np.minimum(first, len(t) - 1), 1.0)
    np.add.at(lost, np.minimum(last, len(t) - 1), -1.0)
    inside = (np.cumsum(lost) > 0.5).astype(float)
    soft = np.convolve(inside, np.hanning(7) / np.hanning(7).sum(), mode="same")
    return stretch(1 - depth * soft, samples, sfreq, every)
