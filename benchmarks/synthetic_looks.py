"""Draws synthetic EEG beside a real recording and prints the numbers: ``python FILE SAMPLE.set [OUT]``.

SAMPLE is the recording that ships with EEGLAB (eeglab_data.set, 128 Hz); the synthetic subject is made at its rate.
"""

from __future__ import annotations

import io
import sys
from pathlib import Path

import mne
import numpy as np
from matplotlib.figure import Figure
from PIL import Image
from scipy.signal import find_peaks, welch

from hrcneuro.eeg import channels, filters, ocular
from hrcneuro.eeg.synthetic import SyntheticParams, generate, planted_average
from hrcneuro.eeg.synthetic.head import CH_NAMES, EEG, head
from hrcneuro.paradigm.session import SessionParams, simulate_session

SHOWN = ("visual", "motor", "positivity", "error", "alpha_middle", "mu_C3", "blink", "horizontal")


class Recording:
    """EEG rows first, then EOG, in µV; raw, band-passed, and with the eyes regressed out."""

    def __init__(
        self, title: str, data: np.ndarray, sfreq: float, names: list[str], places: np.ndarray, onsets: np.ndarray
    ) -> None:
        self.title, self.sfreq, self.names, self.eeg = title, sfreq, names, len(places)
        self.onsets, eeg = onsets, len(places)
        self.info = mne.create_info(names[:eeg], sfreq, "eeg", verbose="error")
        montage = mne.channels.make_dig_montage(dict(zip(names, places, strict=False)), coord_frame="head")
        self.info.set_montage(montage, verbose="error")
        self.raw = data - np.median(data, axis=1, keepdims=True)
        self.band = filters.zero_phase(self.raw.copy(), filters.bandpass_taps(sfreq, 1.0, 40.0))
        clean = self.band.copy()
        self.weights = ocular.regression_weights(clean[:eeg], clean[eeg:])[0]
        self.clean = ocular.remove(clean[:eeg], clean[eeg:], self.weights, offset=False)

    def row(self, *names: str) -> int:
        return next(self.names.index(n) for n in names if n in self.names)

    def epochs(self, data: np.ndarray, at: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return pieces of some rows around samples: rows x pieces x times."""
        index = at[:, None] + np.round(times * self.sfreq).astype(int)
        inside = (index.min(axis=1) >= 0) & (index.max(axis=1) < data.shape[1])
        return data[:, index[inside]]

    def blinks(self) -> np.ndarray:
        """Return the samples of the peaks above 60 µV at the forehead."""
        return find_peaks(self.band[self.row("FPz", "Fp1")], height=60.0, distance=int(0.5 * self.sfreq))[0]


def sample(path: str) -> Recording:
    raw = mne.io.read_raw_eeglab(path, preload=True, verbose="error")
    eog = [n for n in raw.ch_names if "EOG" in n]
    order = [n for n in raw.ch_names if n not in eog] + eog
    places = np.array([raw.info["chs"][raw.ch_names.index(n)]["loc"][:3] for n in order[: -len(eog)]])
    marks = raw.annotations
    onsets = np.round(marks.onset[marks.description == "square"] * raw.info["sfreq"]).astype(int)
    return Recording("EEGLAB's sample", raw.get_data(order) * 1e6, raw.info["sfreq"], order, places, onsets)


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
        "blinks: mean peak at FPz, Fp1, µV": f"{r.band[r.row('FPz', 'Fp1'), r.blinks()].mean():.0f}",
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


def draw_map(axis, values: np.ndarray, info: mne.Info, title: str, limit: float | None = None) -> None:
    places = np.array([ch["loc"][:3] for ch in info["chs"]])
    sphere = (0.0, 0.0, 0.0, float(np.median(np.linalg.norm(places, axis=1))))
    limits = (None, None) if limit is None else (-limit, limit)
    mne.viz.plot_topomap(values, info, axes=axis, show=False, sphere=sphere, vlim=limits, cmap="RdBu_r")
    axis.set_title(title, fontsize=9)


def maps(recordings: list[Recording]) -> Figure:
    """Draw what a look at the data shows, not what was planted: alpha, blinks, and responses trial by trial."""
    figure = Figure((11, 5.4), layout="constrained")
    grid = figure.subplots(2, 4, width_ratios=(1, 1, 1.3, 1.5))
    for row, r in zip(grid, recordings, strict=True):
        clean = r.clean - r.clean.mean(axis=0)
        f, power = welch(clean, r.sfreq, nperseg=int(4 * r.sfreq))
        alpha = 10 * np.log10(power[:, (f >= 8) & (f <= 12)].mean(axis=1))
        draw_map(row[0], alpha - np.median(alpha), r.info, "8-12 Hz, ± 8 dB", limit=8.0)
        row[0].text(-0.25, 0.5, r.title, transform=row[0].transAxes, rotation=90, va="center")
        times = np.arange(-0.4, 0.6, 1 / r.sfreq)
        blinks = r.epochs(r.band, r.blinks(), times)
        mean = blinks.mean(axis=1)
        draw_map(
            row[1], mean[: r.eeg, np.argmin(np.abs(times))], r.info, f"{blinks.shape[1]} blinks, ± 150 µV", limit=150.0
        )
        forehead = r.row("FPz", "Fp1")
        row[2].plot(times, blinks[forehead, :40].T, color="0.8", lw=0.5)
        row[2].plot(times, mean[forehead], color="k", label=r.names[forehead])
        row[2].plot(times, r.epochs(r.clean, r.blinks(), times).mean(axis=1)[forehead], color="C0", label="cleaned")
        row[2].set(title="blinks, µV", xlabel="s", ylim=(-100, 320))
        row[2].legend(frameon=False, fontsize=7)
        erp_rows(row[3], r, clean)
    return figure


def erp_rows(axis, r: Recording, clean: np.ndarray) -> None:
    """Draw the first 80 responses at the back of the head, each a mean of five neighbours in time."""
    times = np.arange(-0.2, 0.8, 1 / r.sfreq)
    name = r.names[r.row("POz", "O1")]
    image = r.epochs(clean[[r.row(name)]], r.onsets, times)[0][:80]
    image -= image[:, times < 0].mean(axis=1, keepdims=True)
    image = np.apply_along_axis(np.convolve, 0, image, np.ones(5) / 5, mode="same")
    axis.imshow(image, aspect="auto", extent=(-0.2, 0.8, len(image), 0), cmap="RdBu_r", vmin=-15, vmax=15)
    axis.set(title=f"{name}, {len(image)} events, ± 15 µV", xlabel="s after onset", ylabel="event")


def topographies(made, info: mne.Info) -> Figure:
    figure = Figure((11, 1.7), layout="constrained")
    for axis, name in zip(figure.subplots(1, len(SHOWN)), SHOWN, strict=True):
        gain = made.truth["topographies"][name].to_numpy()[: len(EEG)]
        draw_map(axis, gain - gain.mean(), info, name)
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


def save(figure: Figure, path: Path) -> None:
    """Write a PNG of 128 colours, a third of the size."""
    memory = io.BytesIO()
    figure.savefig(memory, dpi=90, format="png")
    Image.open(memory).convert("RGB").quantize(128, dither=Image.Dither.NONE).save(path, optimize=True)


def main(path: str, out: Path) -> None:
    mne.set_log_level("error")
    out.mkdir(parents=True, exist_ok=True)
    real = sample(path)
    # Two seeds: both functions spawn their generators, and of one seed the first ones were the same.
    trials = simulate_session(SessionParams(), rng=np.random.default_rng(2))
    made = generate(trials, params=SyntheticParams(), sfreq=real.sfreq, rng=np.random.default_rng(1))
    data, places = made.data_uv.astype(float), head().electrodes[: len(EEG)]
    ours = Recording("synthetic", data, real.sfreq, list(CH_NAMES), places, made.onset_samples)
    figures = {
        "spectra": spectra([real, ours]),
        "traces": traces([real, ours]),
        "maps": maps([real, ours]),
        "topographies": topographies(made, ours.info),
        "responses": erp_image(ours, made, trials),
    }
    for name, figure in figures.items():
        save(figure, out / f"synthetic_{name}.png")
    print("| | EEGLAB's sample | synthetic |\n|---|---|---|")
    for (what, left), right in zip(numbers(real).items(), numbers(ours).values(), strict=True):
        print(f"| {what} | {left} | {right} |")


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2] if len(sys.argv) > 2 else "docs/images"))
