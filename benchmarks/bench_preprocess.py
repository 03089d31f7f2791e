"""Raw to clean EEG, 27 + 3 channels × 2.7 million samples (45 min at 1000 Hz) in double precision, against MNE.

Both run the same steps: the 3301-tap band-pass with edge padding, EOG regression (MNE's form), Perrin's splines for the
channels that our kurtosis step finds (which MNE has not: only we pay for it), common average, 512 Hz. MNE's FFT
resampling pads to a power of two, which is no multiple of 125: its grid drifts against the true one, so the signals are
compared with padding that fits.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import _measure
import mne
import numpy as np
from mne.preprocessing import EOGRegression
from scipy.signal import lfilter

from hrcneuro.contract import Inputs
from hrcneuro.eeg import cleaning
from hrcneuro.io.fif import write_raw
from hrcneuro.stages import preprocess

SFREQ, TARGET_SFREQ = 1000.0, 512.0
# As many as the paper's, and as evenly spread.
EEG = [f"F{x}" for x in "z3478"] + ["FC1", "FC2", "FC5", "FC6", "Cz", "C3", "C4", "T7", "T8"]
EEG += ["CPz", "CP1", "CP2", "CP5", "CP6", "Pz", "P3", "P4", "P7", "P8", "Oz", "O1", "O2"]
EOG = ["EOG1", "EOG2", "EOG3"]
PARAMS = cleaning.CleaningParams(sfreq=TARGET_SFREQ, eog_offset=False, interpolation="perrin")
TARGET = 5
PAD_THAT_FITS = 90_000


def recording(n_samples: int) -> mne.io.RawArray:
    """Return drifting noise with blinks and two channels of bursts, in volts."""
    rng = np.random.default_rng(0)
    data = np.empty((len(EEG) + len(EOG), n_samples))
    for channel in data:
        channel[:] = lfilter([1.0], [1.0, -0.95], rng.standard_normal(n_samples)) * 3
    blink = np.zeros(n_samples)
    for start in rng.integers(0, n_samples - 400, n_samples // 4000):
        blink[start : start + 400] += 150 * np.hanning(400)
    data += np.concatenate([rng.uniform(0.05, 0.4, len(EEG)), [1.0, 0.8, 0.3]])[:, None] * blink
    for channel, starts in zip((4, 17), rng.integers(0, n_samples - 600, (2, n_samples // 30_000)), strict=True):
        for start in starts:
            data[channel, start : start + 600] += 60 * rng.standard_normal(600)
    info = mne.create_info(EEG + EOG, SFREQ, ["eeg"] * len(EEG) + ["eog"] * len(EOG))
    raw = mne.io.RawArray(data * 1e-6, info, verbose="error")
    with mne.utils.use_log_level("error"):
        raw.set_montage("standard_1005", on_missing="ignore")
    return raw


def ours(raw: mne.io.BaseRaw) -> cleaning.Cleaned:
    positions = np.array([ch["loc"][:3] for ch in raw.info["chs"][: len(EEG)]])
    centre = mne.bem.fit_sphere_to_headshape(raw.info, units="m", verbose="error")[1]
    data = raw.get_data()
    data *= 1e6
    return cleaning.clean(cleaning.Signals(data, SFREQ, EEG, EOG, positions - centre), PARAMS)


def peer(raw: mne.io.BaseRaw, bads: list[str], **resampling: object) -> mne.io.BaseRaw:
    with mne.utils.use_log_level("error"):
        raw = raw.copy()
        raw.filter(
            1,
            40,
            picks="all",
            l_trans_bandwidth=1,
            h_trans_bandwidth=1,
            filter_length=f"{3301}ms",
            pad="edge",
            n_jobs=1,
        )
        raw.set_eeg_reference([])
        raw = EOGRegression(picks="eeg", picks_artifact="eog").fit(raw).apply(raw, copy=False)
        raw.pick("eeg", exclude=())
        raw.info["bads"] = bads
        raw.interpolate_bads()
        raw.set_eeg_reference("average")
        return raw.resample(TARGET_SFREQ, **resampling)


def difference(raw: mne.io.BaseRaw, bads: list[str]) -> str:
    """Return the largest difference in µV, away from the ends, where both resamplers see what is not there."""
    found, theirs = ours(raw).eeg, peer(raw, bads, npad=PAD_THAT_FITS).get_data() * 1e6
    inner = slice(1024, min(found.shape[1], theirs.shape[1]) - 1024)
    return f"{np.abs(found[:, inner] - theirs[:, inner]).max():.0e} µV"


def stage(folder: str) -> dict:
    here = Path(folder)
    (here / "out").mkdir()
    return preprocess.run(preprocess.Config(), Inputs.of("s01", acquire=here), here / "out")


def stage_peak(raw: mne.io.BaseRaw) -> tuple[float, float]:
    """Return the stage's peak memory from file to files, and the recording's size in double precision, in MB."""
    with tempfile.TemporaryDirectory() as folder:
        write_raw(raw, Path(folder) / "s01_raw.fif")
        _, peak = _measure.peak_mb(stage, folder)
    return peak, raw.get_data().nbytes / 2**20


def main() -> None:
    chosen = _measure.options(__doc__)
    n_samples = 270_000 if chosen.quick else 2_700_000
    raw = recording(n_samples)
    bads = [name for name, why in zip(EEG, ours(raw).reason, strict=True) if why]
    fft, polyphase, us = _measure.in_turns(
        chosen.repeats,
        lambda: peer(raw, bads),
        lambda: peer(raw, bads, method="polyphase"),
        lambda: ours(raw),
        warm=False,
    )
    _measure.heading()
    label = f"preprocess, 30 × {n_samples} in float64, {len(bads)} channels bad; MNE"
    _measure.row(label, fft, us, TARGET, difference(raw, bads))
    _measure.row(f"{label} with polyphase resampling", polyphase, us, None, "another anti-alias filter")
    peak, size = stage_peak(raw)
    print(f"  peak of the whole stage: {peak:.0f} MB, {peak / size:.2f} × the float64 recording (limit 2)")


if __name__ == "__main__":
    main()
