"""The synthetic recording: latent processes mixed to channels block by block, then spoilt, with the truth kept."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.eeg.refusals import MovesError, SlowSamplingError
from hrcneuro.eeg.synthetic import background, defects, ocular, responses
from hrcneuro.eeg.synthetic.head import CH_NAMES, CH_TYPES, MASTOIDS, site, to_mastoids, topography
from hrcneuro.eeg.synthetic.params import SyntheticParams

_SFREQ_MIN = 100.0
_TAIL_S = 5.0  # recorded after the last move
_BLOCK = 2048  # samples mixed at a time: two rows of them fit the smallest cache
# SD of the log amplitude of each patch over time: channels then have a kurtosis of 3.2 to 4, as real EEG has.
_RESTLESS = 0.5
_SOURCE_HZ = 120.0  # the truth's time courses are kept at about this rate: all of them end below 60 Hz
# Every part draws from a stream of its own: recordings with one seed and two effects differ in the effect alone.
_STREAMS = (
    "trials", "places", "background", "rhythms", "eyes", "electrodes", "hum", "defects", "jolts", "triggers",
)  # fmt: skip


@dataclass(frozen=True)
class Synthetic:
    """A synthetic recording and its ground truth.

    ``truth`` holds data frames and one dict: ``trials`` (a row a move: ``onset_s`` of the movement itself, ``carries``,
    amplitudes in µV at the peak channel, ``latency_ms``), ``bad_channels`` (spans), ``jolts`` (spans; none unless
    contaminated), ``blinks``, ``saccades``, ``topographies`` (a row a channel: gain of each source), ``sources``
    (continuous time courses in µV at about 120 Hz, ``time_s``), ``subject`` (dict of this subject's values).
    """

    data_uv: np.ndarray  # (30, samples) float32, against the mean of TP9 and TP10
    sfreq: float
    onset_samples: np.ndarray  # (moves,) int64, the triggers
    truth: dict[str, Any]
    ch_names: tuple[str, ...] = CH_NAMES
    ch_types: tuple[str, ...] = CH_TYPES


@dataclass
class _Latent:
    """What the latent processes of one recording share: moves, length, rate, parameters, streams of random numbers."""

    trials: pd.DataFrame
    onset_s: np.ndarray
    samples: int
    sfreq: float
    params: SyntheticParams
    streams: dict[str, np.random.Generator]
    sitting: int = 0
    subject: dict[str, Any] = field(default_factory=dict)

    def by_chance(self, rng: np.random.Generator) -> np.random.Generator:
        """Return what draws that which differs from sitting to sitting, once the subject's own has been drawn."""
        return rng if not self.sitting else rng.spawn(self.sitting)[-1]


def generate(
    trials: pd.DataFrame,
    *,
    params: SyntheticParams,
    sfreq: float,
    rng: np.random.Generator,
    contaminated: bool = False,
    sitting: int = 0,
) -> Synthetic:
    """Return a continuous recording in which these moves happened.

    Args:
        trials: A row a move in temporal order, columns ``onset_s actor error prev_error condition_before turn
            scenario`` as in trials.parquet.
        params: What is planted.
        sfreq: Sampling rate in hertz.
        rng: The subject's generator; each part draws from its own child of it.
        contaminated: Add jolts of millivolts throughout, so that many epochs exceed 1000 µV.
        sitting: Which recording of this subject it is, from 0: the head, its rhythms and responses are the same, what
            comes by chance is another.

    Raises:
        MovesError: There are no moves, or an onset is missing, negative or out of order.
        SlowSamplingError: The sampling rate is below 100 Hz.
    """
    if sfreq < _SFREQ_MIN:
        raise SlowSamplingError(
            f"synthetic EEG at {sfreq:g} Hz would miss part of the band of 1-40 Hz; {_SFREQ_MIN:g} Hz is the least"
        )
    onset_s = _onsets(trials)
    streams = dict(zip(_STREAMS, rng.spawn(len(_STREAMS)), strict=True))
    samples = int(np.ceil((onset_s[-1] + _TAIL_S) * sfreq))
    latent = _Latent(trials, onset_s, samples, sfreq, params, streams, sitting)
    table, latent.subject = responses.single_trials(trials, params=params, rng=streams["trials"])
    where, courses, truth = _sources(latent, table)
    data = _background(latent)
    gains, sources = np.stack(list(where.values()), axis=1), np.stack(list(courses.values()))
    for a in range(0, samples, _BLOCK):
        data[:, a : a + _BLOCK] += _product(gains, sources[:, a : a + _BLOCK])
    _electrodes(data, latent)
    truth["bad_channels"] = defects.plant(streams["defects"], data, sfreq, params=params)
    truth["jolts"] = defects.contaminate(streams["jolts"], data, sfreq) if contaminated else defects.no_jolts()
    jitter = params.trigger_jitter_ms / 1000 * streams["triggers"].standard_normal(len(onset_s))
    triggers = np.clip(np.round((onset_s + jitter) * sfreq), 0, samples - 1).astype(np.int64)
    table.insert(0, "onset_s", onset_s)
    step = max(int(sfreq // _SOURCE_HZ), 1)
    kept = {"time_s": np.arange(0, samples, step) / sfreq, **dict(zip(courses, sources[:, ::step], strict=True))}
    truth |= {
        "trials": table,
        "topographies": pd.DataFrame(where, index=pd.Index(CH_NAMES, name="channel")),
        "sources": pd.DataFrame(kept),
        "subject": {"effect": params.effect, "nominal_uv": params.size_uv, **latent.subject},
    }
    return Synthetic(data, sfreq, triggers, truth)


def _onsets(trials: pd.DataFrame) -> np.ndarray:
    if not len(trials):
        raise MovesError("a synthetic recording needs moves, got none")
    onset_s = trials["onset_s"].to_numpy(dtype=float, na_value=np.nan)
    wrong = np.flatnonzero(~np.isfinite(onset_s) | (np.diff(onset_s, prepend=0.0) < 0))
    if len(wrong):
        raise MovesError(
            f"move {wrong[0]} has onset_s = {onset_s[wrong[0]]}; onsets must be given, positive and in temporal order"
        )
    return onset_s


def _sources(
    latent: _Latent, table: pd.DataFrame
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray], dict[str, Any]]:
    """Return the gains (30,) and time courses (samples,) of all named sources, and the tables of eye events."""
    samples, sfreq, params = latent.samples, latent.sfreq, latent.params
    eyes, mains = latent.streams["eyes"], latent.streams["hum"]
    where = responses.topographies(latent.streams["places"], variability=params.variability)
    courses = {c: responses.course(c, table, latent.onset_s, samples, sfreq) for c in responses.COMPONENTS}
    where |= ocular.propagation(eyes, variability=params.variability)
    eyes = latent.by_chance(eyes)
    blinks = ocular.blinks(eyes, samples / sfreq, params=params)
    saccades = ocular.saccades(eyes, samples / sfreq, latent.onset_s, params=params)
    courses["blink"] = ocular.blink_course(blinks, "amplitude_uv", samples, sfreq)
    courses["horizontal"] = ocular.gaze_course(saccades, "x_uv", samples, sfreq)
    courses["vertical"] = ocular.gaze_course(saccades, "y_uv", samples, sfreq)
    courses["lid"] = ocular.blink_course(blinks, "lid_uv", samples, sfreq)
    for name, gain, wave in _rhythms(latent):
        where[name], courses[name] = gain, wave
    phases = background.hum(mains, samples, sfreq, line_hz=params.line_hz)
    for name, wave in zip(("hum_sin", "hum_cos"), phases, strict=True):
        where[name] = to_mastoids(1 + 0.5 * mains.standard_normal(len(CH_NAMES)))
        courses[name] = np.float32(params.line_uv) * wave
    return where, courses, {"blinks": blinks, "saccades": saccades}


def _rhythms(latent: _Latent) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Yield (name, gain (30,), time course (samples,)): alpha over the occiput, mu and beta over both hand areas."""
    rng, places = latent.streams["rhythms"], latent.streams["places"]
    samples, sfreq, params, subject = latent.samples, latent.sfreq, latent.params, latent.subject
    f = background.frequencies(samples, sfreq)
    own = params.variability * rng.standard_normal(4)
    subject["alpha_hz"] = params.alpha_hz + 0.6 * float(own[0])
    subject["mu_hz"] = params.alpha_hz + 1.0 + 0.6 * float(own[1])
    subject["alpha_uv"] = params.alpha_uv * float(np.exp(0.4 * own[2]))
    subject["mu_uv"] = params.mu_uv * float(np.exp(0.3 * own[3]))
    human_s = latent.onset_s[responses.is_(latent.trials, "actor", "human")]
    watching = background.desynchronised(samples, sfreq, latent.onset_s, from_s=0.15, to_s=0.60, depth=0.25)
    moving = background.desynchronised(samples, sfreq, human_s, from_s=-0.4, to_s=0.4, depth=0.5)
    rng = latent.by_chance(rng)
    middle = site("O1") + site("O2")
    sites = {"alpha_left": site("O1"), "alpha_right": site("O2"), "alpha_middle": middle / np.sqrt(np.sum(middle**2))}
    jitter = 0.006 * params.variability
    for name, place in sites.items():
        gain = topography(place, depth=0.62, tilt=0.6 * places.standard_normal(3), jitter_m=jitter, rng=places)
        wave = background.shaped_noise(rng, background.peak(f, subject["alpha_hz"], 0.7), samples, sfreq)
        yield name, gain, np.float32(subject["alpha_uv"] / np.sqrt(3)) * wave * watching
    for side in ("C3", "C4"):
        gain = topography(site(side), depth=0.76, tilt=np.zeros(3), jitter_m=jitter, rng=places)
        for band, hz, width, share in (("mu", subject["mu_hz"], 0.8, 1.0), ("beta", 2 * subject["mu_hz"], 2.0, 0.4)):
            wave = background.shaped_noise(rng, background.peak(f, hz, width), samples, sfreq)
            yield f"{band}_{side}", gain, np.float32(share * subject["mu_uv"]) * wave * moving


def _background(latent: _Latent) -> np.ndarray:
    """Return the channels' 1/f background, shape (30, samples), float32."""
    rng, params, samples, sfreq = latent.streams["background"], latent.params, latent.samples, latent.sfreq
    own = params.variability * rng.standard_normal(2)
    latent.subject["background_uv"] = params.background_uv * float(np.exp(0.12 * own[0]))
    latent.subject["exponent"] = params.exponent + 0.1 * float(own[1])
    density = background.power_law(background.frequencies(samples, sfreq), latent.subject["exponent"])
    mixing = background.dipole_mixing(rng, params.dipoles) * latent.subject["background_uv"]
    rng = latent.by_chance(rng)
    data = np.empty((len(CH_NAMES), samples), dtype=np.float32)
    for row in data:
        row[:] = background.shaped_noise(rng, density, samples, sfreq)
        row *= background.slow_gain(rng, samples, sfreq, spread=_RESTLESS, every_s=10.0)
    for a in range(0, samples, _BLOCK):
        data[:, a : a + _BLOCK] = _product(mixing, data[:, a : a + _BLOCK])
    return data


def _product(mixing: np.ndarray, block: np.ndarray) -> np.ndarray:
    # BLAS gives other bits with another number of threads; einsum's own loop does not.
    return np.einsum("cs,st->ct", mixing.astype(np.float32), block)


def _electrodes(data: np.ndarray, latent: _Latent) -> None:
    """Add sensor noise, drift and offset of every electrode to ``data`` in place, the mastoids' being everyone's."""
    rng, params, sfreq = latent.by_chance(latent.streams["electrodes"]), latent.params, latent.sfreq
    low, high = background.BAND_HZ
    # The RMS up to the Nyquist frequency of white noise that has the wanted RMS within 1-40 Hz.
    white = np.float32(params.sensor_uv * np.sqrt(sfreq / 2 / (min(high, sfreq / 2) - low)))
    reference = np.zeros(latent.samples, dtype=np.float32)
    for i, row in enumerate(data):
        noise = rng.standard_normal(latent.samples, dtype=np.float32) * white
        noise += np.float32(params.drift_uv) * background.drift(rng, latent.samples, sfreq)
        noise += np.float32(100.0 * rng.standard_normal())
        row += noise
        if i in MASTOIDS:
            reference += noise / np.float32(len(MASTOIDS))
    data -= reference
