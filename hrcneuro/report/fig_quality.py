"""How clean the recordings are: which channels were repaired, spectra and blinks before and after."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcneuro.figures.style import COLOURS, CONTINUATION, GREY, STYLE
from hrcneuro.report.results import Results

Floats = NDArray[np.float64]
# So much of the middle of a recording tells its spectrum and holds two dozen blinks.
_SECONDS = 90.0
_BLINK_UV = 60.0
_AROUND_S = 0.5
# More lines than these would hide each other, and each recording takes its time to open.
_MOST = 4


def draw(results: Results) -> Figure | None:
    """Return the figure; None where no recording has been preprocessed."""
    units = results.units("preprocess")
    tables = {u: results.table("preprocess", u, "quality.parquet") for u in units}
    if not units:
        return None
    included = [u for u in units if u in results.settings.included]
    shown = included[:: -(-len(included) // _MOST)] if included else []
    looked = [_look(results, unit) for unit in shown]
    with rc_context(STYLE):
        figure = Figure(figsize=(9.4, 1.2 + max(2.4, 0.2 * len(units) + 0.9)), layout="constrained")
        left, middle, right = figure.subplots(1, 3, width_ratios=[1.9, 1, 1])
        _channels(figure, left, tables)
        _spectra(middle, [one for one in looked if one])
        _blinks(right, [one for one in looked if one and one["blinks"]])
    return figure


def _channels(figure: Figure, axes: Axes, tables: dict[str, Any]) -> None:
    names = list(dict.fromkeys(name for t in tables.values() for name in t["channel"]))
    z = np.full((len(tables), len(names)), np.nan)
    fixed = np.zeros(z.shape, bool)
    for row, table in enumerate(tables.values()):
        columns = [names.index(name) for name in table["channel"]]
        z[row, columns] = table["z"].astype(float)
        fixed[row, columns] = table["interpolated"].fillna(False).astype(bool)
    image = axes.imshow(z, cmap="RdBu_r", vmin=-6, vmax=6, aspect="auto", interpolation="nearest")
    crossed = np.argwhere(fixed)
    axes.plot(crossed[:, 1], crossed[:, 0], "x", color="k", ms=4, mew=1)
    axes.set_xticks(range(len(names)), names, rotation=90, fontsize=6.5)
    axes.set_yticks(range(len(tables)), list(tables))
    axes.set_title("normalised kurtosis of the channels (SD); x: replaced")
    bar = figure.colorbar(image, ax=axes, pad=0.01, fraction=0.04, extend="both")
    bar.ax.tick_params(labelsize=6)


def _spectra(axes: Axes, looked: list[dict[str, Any]]) -> None:
    for which, colour, label in (("before", CONTINUATION, "as recorded"), ("after", COLOURS[0], "clean")):
        for i, one in enumerate(looked):
            hz, power = one[which]
            axes.semilogy(hz, power, color=colour, lw=0.8, alpha=0.7, label=label if i == 0 else "_nolegend_")
    if looked:
        axes.set_ylim(bottom=min(float(one["before"][1].min()) for one in looked) / 30)
    axes.set_xlim(0, 60)
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel("power, median over channels (µV²/Hz)")
    axes.set_title(f"spectra, n = {len(looked)}")
    axes.legend(loc="lower left")


def _blinks(axes: Axes, looked: list[dict[str, Any]]) -> None:
    axes.set_title(f"blinks, n = {len(looked)}")
    axes.set_xlabel("time from the peak (ms)")
    axes.set_ylabel("frontal channels (µV)")
    if not looked:
        axes.text(0.5, 0.5, "no EOG channel, or no blink", transform=axes.transAxes, ha="center", color=GREY)
        return
    for which, colour, label in (("blink_before", CONTINUATION, "as recorded"), ("blink_after", COLOURS[0], "clean")):
        for i, one in enumerate(looked):
            ms = 1000 * np.linspace(-_AROUND_S, _AROUND_S, len(one[which]))
            axes.plot(ms, one[which], color=colour, lw=0.8, alpha=0.7, label=label if i == 0 else "_nolegend_")
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.15 * (high - low))  # room for the legend
    axes.legend(loc="upper right")


def _look(results: Results, unit: str) -> dict[str, Any] | None:
    """Return spectra and mean blinks of the middle of a recording, as recorded and clean."""
    from hrcneuro.io.fif import read_raw

    raw_path = results.path("acquire", unit, f"{unit}_raw.fif")
    clean_path = results.path("preprocess", unit, f"{unit}_clean_raw.fif")
    if raw_path is None or clean_path is None:
        return None
    raw, clean = read_raw(raw_path), read_raw(clean_path)
    start = max(0.0, (min(raw.times[-1], clean.times[-1]) - _SECONDS) / 2)
    before, sfreq = _middle(raw, start)
    after, clean_sfreq = _middle(clean, start)
    peaks = _peaks(raw, start)
    found = {"before": _spectrum(before, sfreq), "after": _spectrum(after, clean_sfreq), "blinks": len(peaks)}
    frontal = [n for n in ("Fp1", "Fp2", "FPz", "AF3", "AF4", "F3", "F4", "Fz") if n in raw.ch_names][:2]
    if len(peaks) and frontal and set(frontal) <= set(clean.ch_names):
        found["blink_before"] = _around(_middle(raw, start, frontal)[0], peaks, sfreq)
        found["blink_after"] = _around(_middle(clean, start, frontal)[0], peaks, clean_sfreq)
    else:
        found["blinks"] = 0
    return found


def _middle(raw: Any, start: float, picks: Any = "eeg") -> tuple[Floats, float]:
    sfreq = float(raw.info["sfreq"])
    first = int(start * sfreq)
    data = raw.get_data(picks=picks, start=first, stop=min(raw.n_times, first + int(_SECONDS * sfreq)), verbose="error")
    return 1e6 * data, sfreq


def _spectrum(data: Floats, sfreq: float) -> tuple[Floats, Floats]:
    from scipy.signal import welch

    hz, power = welch(data, sfreq, nperseg=min(data.shape[1], int(2 * sfreq)))
    kept = (hz >= 0.5) & (hz <= 60)
    return hz[kept], np.median(power[:, kept], axis=0)


def _peaks(raw: Any, start: float) -> Floats:
    """Return the times of blinks, in seconds from the start of the looked-at span."""
    from scipy.signal import butter, find_peaks, sosfiltfilt

    if "eog" not in raw:
        return np.zeros(0)
    data, sfreq = _middle(raw, start, "eog")
    slow = sosfiltfilt(butter(2, [1, 10], "bandpass", fs=sfreq, output="sos"), data, axis=1)
    # A blink stands out of the channel nearest the lids: the one with the heaviest tail.
    tail = ((slow / slow.std(axis=1, keepdims=True)) ** 4).mean(axis=1)
    lid = slow[int(tail.argmax())]
    lid = lid * np.sign((lid**3).mean())
    peaks, _ = find_peaks(lid, height=max(_BLINK_UV, 2.5 * lid.std()), distance=int(0.5 * sfreq))
    return peaks / sfreq


def _around(data: Floats, peaks: Floats, sfreq: float) -> Floats:
    half = int(_AROUND_S * sfreq)
    signal = data.mean(axis=0)
    cuts = [signal[i - half : i + half] for i in (peaks * sfreq).astype(int) if half <= i < len(signal) - half]
    if not cuts:
        return np.zeros(2)
    mean = np.mean(cuts, axis=0)
    return np.asarray(mean - mean[: half // 4].mean())
