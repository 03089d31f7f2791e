"""Draws synthetic EEG beside a real recording and prints the numbers: ``python FILE SAMPLE.set [OUT]``.

SAMPLE is the recording that ships with EEGLAB (eeglab_data.set, 128 Hz); the synthetic subject is made at its rate.
"""

from __future__ import annotations

import sys
from pathlib import Path

import mne
import numpy as np
from matplotlib.figure import Figure
from scipy.signal import welch

from hrcneuro.eeg import channels, filters, ocular
from hrcneuro.eeg.synthetic import SyntheticParams, generate, planted_average
from hrcneuro.eeg.synthetic.head import CH_NAMES, EEG, head
from hrcneuro.paradigm.session import SessionParams, simulate_session

SHOWN = ("visual", "motor", "positivity", "error", "alpha_middle", "mu_C3", "blink", "horizontal")


class Recording:
    """EEG rows first, then EOG, in µV; raw, band-passed, and with the eyes regressed out."""

    def __init__(self, title: str, data: np.ndarray, sfreq: float, names: list[str], eeg: int) -> None:
        self.title, self.sfreq, self.names, self.eeg = title, sfreq, names, eeg
        self.raw = data - np.median(data, axis=1, keepdims=True)
        self.band = filters.zero_phase(self.raw.copy(), filters.bandpass_taps(sfreq, 1.0, 40.0))
        clean = self.band.copy()
        self.weights = ocular.regression_weights(clean[:eeg], clean[eeg:])[0]
        self.clean = ocular.remove(clean[:eeg], clean[eeg:], self.weights, offset=False)

    def row(self, *names: str) -> int:
        return next(self.names.index(n) for n in names if n in self.names)


def sample(path: str) -> Recording:
    raw = mne.io.read_raw_eeglab(path, preload=True, verbose="error")
    eog = [n for n in raw.ch_names if "EOG" in n]
    order = [n for n in raw.ch_names if n not in eog] + eog
    return Recording("EEGLAB's sample", raw.get_data(order) * 1e6, raw.info["sfreq"], order, len(order) - len(eog))


def numbers(r: Recording) -> dict[str, str]:
    """Return what a person compares, as text."""
    eeg, eog = r.clean, r.band[r.eeg :]
    f, power = welch(r.raw, r.sfreq, nperseg=int(4 * r.sfreq))
    band = (f >= 2) & (f <= 30) & ~((f > 7) & (f < 14))
    slope = np.polyfit(np.log(f[band]), np.log(power[: r.eeg, band]).T, 1)[0]
    back = power[[r.row("O1"), r.row("O2")]].mean(axis=0)
    alpha = (f >= 7) & (f <= 13)
    flank = np.sqrt(back[(f >= 5) & (f < 6.5)].mean() * back[(f > 14) & (f < 16)].mean())
    mean_free = eeg - eeg.mean(axis=0)
    pairs = np.triu_indices(r.eeg, 1)
    kurtosis = np.array([channels.kurtosis(row) for row in eeg])
    largest = eog[np.abs(eog).max(axis=1).argmax()]
    peaks = mne.preprocessing.peak_finder(np.abs(largest), thresh=60.0, verbose="error")[1]
    return {
        "RMS 1-40 Hz, median channel, µV": f"{np.median(r.band[: r.eeg].std(axis=1)):.1f}",
        "the same, eyes regressed out": f"{np.median(eeg.std(axis=1)):.1f}",
        "the same, common average": f"{np.median(mean_free.std(axis=1)):.1f}",
        "slope of the spectrum, 2-30 Hz, median channel": f"{np.median(slope):.2f}",
        "alpha peak at O1, O2, Hz": f"{f[alpha][back[alpha].argmax()]:.2f}",
        "alpha peak over its flanks": f"{back[alpha].max() / flank:.1f}",
        "blinks: median EOG peak above 60 µV": f"{np.median(peaks):.0f}",
        "EOG RMS, µV": ", ".join(f"{v:.0f}" for v in eog.std(axis=1)),
        "mean |r| between channels, common average": f"{np.abs(np.corrcoef(mean_free)[pairs]).mean():.2f}",
        "r of a channel and its nearest, median": f"{np.median(np.sort(np.corrcoef(eeg), axis=1)[:, -2]):.2f}",
        "kurtosis, 10th, 50th, 90th percentile": ", ".join(f"{v:.2f}" for v in np.percentile(kurtosis, [10, 50, 90])),
        "channels replaced": str(int((np.abs(channels.trimmed_z(kurtosis)) > 2).sum())),
    }


def spectra(recordings: list[Recording]) -> Figure:
    figure = Figure((9, 3.6), layout="constrained")
    for axis, r in zip(figure.subplots(1, 2, sharey=True), recordings, strict=True):
        f, power = welch(r.raw, r.sfreq, nperseg=int(4 * r.sfreq))
        axis.loglog(f[2:], power[: r.eeg, 2:].T, color="0.75", lw=0.6)
        axis.loglog(f[2:], power[r.row("O1"), 2:], color="C0", label="O1")
        axis.loglog(f[2:], power[r.row("Fz"), 2:], color="C1", label="Fz")
        axis.set(title=r.title, xlabel="Hz", xlim=(0.5, r.sfreq / 2))
        axis.legend(frameon=False)
    figure.axes[0].set_ylabel("µV²/Hz")
    return figure


def traces(recordings: list[Recording], start_s: float = 40.0, length_s: float = 10.0) -> Figure:
    figure = Figure((11, 6.5), layout="constrained")
    for axis, r in zip(figure.subplots(1, 2), recordings, strict=True):
        rows = [r.row(n) for n in ("F3", "Fz", "F4", "C3", "Cz", "C4", "P3", "Pz", "P4", "O1", "O2")]
        rows = [r.row("FPz", "Fp1"), *rows, *range(r.eeg, len(r.names))]
        a = int(start_s * r.sfreq)
        t = np.arange(int(length_s * r.sfreq)) / r.sfreq
        for k, i in enumerate(rows):
            axis.plot(t, r.band[i, a : a + len(t)] - 100 * k, color="C3" if i >= r.eeg else "0.2", lw=0.6)
        axis.set(title=f"{r.title}, 1-40 Hz, 100 µV a line", xlabel="s", xlim=(0, length_s))
        axis.set_yticks([-100 * k for k in range(len(rows))], [r.names[i] for i in rows])
    return figure


def topographies(made) -> Figure:
    info = mne.create_info(list(EEG), 100.0, "eeg", verbose="error")
    places = dict(zip(EEG, head().electrodes[: len(EEG)], strict=True))
    info.set_montage(mne.channels.make_dig_montage(places, coord_frame="head"), verbose="error")
    figure = Figure((11, 2.2), layout="constrained")
    for axis, name in zip(figure.subplots(1, len(SHOWN)), SHOWN, strict=True):
        gain = made.truth["topographies"][name].to_numpy()[: len(EEG)]
        sphere = (0.0, 0.0, 0.0, 0.095)
        mne.viz.plot_topomap(gain - gain.mean(), info, axes=axis, show=False, sphere=sphere)
        axis.set_title(name, fontsize=9)
    return figure


def erp_image(r: Recording, made, trials) -> Figure:
    times = np.arange(-0.2, 1.2, 1 / r.sfreq)
    clean = r.clean - r.clean.mean(axis=0)
    epochs = clean[:, made.onset_samples[:, None] + np.round(times * r.sfreq).astype(int)]
    epochs -= epochs[:, :, times < 0].mean(axis=2, keepdims=True)
    case = trials["condition_before"].astype(object)
    figure = Figure((11, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    inside = trials["soa_s"].notna().to_numpy()
    order = np.flatnonzero(inside)[np.argsort(trials["soa_s"].to_numpy(float)[inside])]
    image = epochs[CH_NAMES.index("O1")][order]
    kernel = np.ones(50) / 50
    image = np.apply_along_axis(np.convolve, 0, image, kernel, mode="same")
    left.imshow(image, aspect="auto", extent=(-0.2, 1.2, len(order), 0), cmap="RdBu_r", vmin=-8, vmax=8)
    left.plot(trials["soa_s"].to_numpy(float)[order], np.arange(len(order)), color="k", lw=1)
    left.set(
        title="O1, moves sorted by the next onset (line), mean of 50",
        xlim=(-0.2, 1.2),
        xlabel="s after onset",
        ylabel="move",
    )
    for name, color in (("RH", "C3"), ("RR", "0.4")):
        rows = (case == name).to_numpy(bool)
        right.plot(times, epochs[CH_NAMES.index("Cz"), rows].mean(axis=0), color=color, label=f"{name}, {rows.sum()}")
        planted = planted_average(made.truth, times, rows)[: len(EEG)]
        planted = (planted - planted.mean(axis=0))[CH_NAMES.index("Cz")]
        right.plot(times, planted - planted[times < 0].mean(), color=color, ls="--", lw=1, label=f"{name}, planted")
    right.axvspan(0.6, 1.2, color="0.93")
    right.set(title="Cz, one subject; next onsets in the shade", xlabel="s after onset", ylabel="µV", xlim=(-0.2, 1.2))
    right.legend(frameon=False)
    return figure


def main(path: str, out: Path) -> None:
    mne.set_log_level("error")
    out.mkdir(parents=True, exist_ok=True)
    real = sample(path)
    trials = simulate_session(SessionParams(), rng=np.random.default_rng(1))
    made = generate(trials, params=SyntheticParams(), sfreq=real.sfreq, rng=np.random.default_rng(1))
    ours = Recording("synthetic", made.data_uv.astype(float), real.sfreq, list(CH_NAMES), len(EEG))
    figures = {
        "spectra": spectra([real, ours]),
        "traces": traces([real, ours]),
        "topographies": topographies(made),
        "responses": erp_image(ours, made, trials),
    }
    for name, figure in figures.items():
        figure.savefig(out / f"synthetic_{name}.png", dpi=90, metadata={"Software": None})
    print("| | EEGLAB's sample | synthetic |\n|---|---|---|")
    for (what, left), right in zip(numbers(real).items(), numbers(ours).values(), strict=True):
        print(f"| {what} | {left} | {right} |")


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2] if len(sys.argv) > 2 else "docs/images"))
