"""Tables, the figure and the intermediate signals that the preprocess stage writes."""

from __future__ import annotations

import zipfile
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from hrcneuro.io.tables import Column, Table, write_table

if TYPE_CHECKING:
    from hrcneuro.eeg.cleaning import Cleaned, Signals

_BAD, _GOOD = "#c44e52", "#4c72b0"
_WEIGHT = "weight_"


def quality_table(eog_names: list[str]) -> Table:
    """Return the schema of quality.parquet: a weight column for every EOG channel, ``weight_NAME``."""
    return Table(
        1,
        "one row an EEG channel of the recording",
        {
            "channel": Column("string", "", "channel"),
            "kurtosis": Column("float", "", "m4 / m2² after the filter and the EOG step; null for a flat channel"),
            "z": Column("float", "SD", "kurtosis normalised by the channels' trimmed mean and SD; null where flat"),
            "reason": Column("category", "", "why the channel is bad: kurtosis, flat, marked; null where it is good"),
            "interpolated": Column("bool", "", "the channel was made from the others"),
            "rms_before_uv": Column("float", "µV", "RMS after the band-pass"),
            "rms_after_uv": Column("float", "µV", "RMS of the clean signal; null for a channel left out"),
            **{
                _WEIGHT + name: Column("float", "", f"share of {name} that was subtracted (0 without regression)")
                for name in eog_names
            },
        },
    )


TIMING = Table(
    1,
    "one row: how samples of the recording and of the clean signal correspond",
    {
        "source_sfreq": Column("float", "Hz", "sampling rate of the recording"),
        "sfreq": Column("float", "Hz", "sampling rate of the clean signal: source_sfreq · up / down"),
        "up": Column("int", "", "numerator of the ratio"),
        "down": Column("int", "", "denominator of the ratio"),
        "n_source": Column("int", "samples", "length of the recording"),
        "n_samples": Column("int", "samples", "length of the clean signal"),
    },
)


def write_quality(cleaned: Cleaned, signals: Signals, out: Path) -> None:
    """Write quality.parquet."""
    table = pd.DataFrame(
        {
            "channel": signals.eeg_names,
            "kurtosis": cleaned.kurtosis,
            "z": cleaned.z,
            "reason": [why or None for why in cleaned.reason],
            "interpolated": cleaned.interpolated,
            "rms_before_uv": cleaned.rms_before,
            "rms_after_uv": cleaned.rms_after,
            **{_WEIGHT + name: cleaned.weights[:, i] for i, name in enumerate(signals.eog_names)},
        }
    )
    write_table(table, out / "quality.parquet", quality_table(signals.eog_names))


def write_timing(cleaned: Cleaned, n_source: int, out: Path) -> None:
    """Write timing.parquet."""
    made = cleaned.ratio
    row = {"source_sfreq": made.source, "sfreq": made.sfreq, "up": made.up, "down": made.down, "n_source": n_source}
    table = pd.DataFrame([row | {"n_samples": cleaned.eeg.shape[1]}])
    write_table(table, out / "timing.parquet", TIMING)


class Steps:
    """Writes steps.npz array by array, so that one step's signal is in memory at a time; the same data, same bytes."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __enter__(self) -> Steps:
        self.archive = zipfile.ZipFile(self.path, "w", zipfile.ZIP_STORED)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.archive.close()

    def add(self, name: str, array: Any) -> None:
        """Add an array under the name by which ``numpy.load`` finds it."""
        with self.archive.open(f"{name}.npy", "w", force_zip64=True) as file:
            np.lib.format.write_array(file, np.asarray(array), allow_pickle=False)

    def describe(self, signals: Signals, cleaned: Cleaned, taps: np.ndarray | None) -> None:
        """Add what the signals are: channels, rate, taps, weights and the verdict on the channels."""
        names = np.array(signals.eeg_names)
        self.add("channels", names)
        self.add("reference_channels", names[~cleaned.dropped])
        self.add("eog_channels", np.array(signals.eog_names, dtype="U"))
        self.add("sfreq", signals.sfreq)
        self.add("eog_weights", cleaned.weights)
        self.add("kurtosis", cleaned.kurtosis)
        self.add("z", cleaned.z)
        self.add("rejected", np.array([bool(why) for why in cleaned.reason]))
        if taps is not None:
            self.add("taps", taps)


def draw_quality(cleaned: Cleaned, signals: Signals, threshold: float, path: Path) -> None:
    """Draw, a row a channel: normalised kurtosis with its limits, regression weights, RMS before and after."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    names = signals.eeg_names
    rows = np.arange(len(names))
    bad = np.array([bool(why) for why in cleaned.reason])
    height = max(3.0, 1.2 + 0.2 * len(names))
    figure = Figure(figsize=(11, height))
    FigureCanvasAgg(figure)
    # Margins in inches: a layout engine would draw everything twice.
    figure.subplots_adjust(left=0.06, right=0.99, bottom=0.7 / height, top=1 - 0.35 / height, wspace=0.16)
    left, middle, right = figure.subplots(1, 3, sharey=True, width_ratios=(2, 1.2, 2))
    _draw_kurtosis(left, cleaned, rows, bad, threshold)
    _draw_weights(middle, cleaned, signals.eog_names)
    right.barh(rows - 0.2, cleaned.rms_before, 0.4, color="0.7")
    right.barh(rows + 0.2, np.nan_to_num(cleaned.rms_after), 0.4, color="0.3")
    right.set_xlabel("RMS (µV)")
    right.set_title("band-passed (light), clean (dark)")
    left.set_yticks(rows, names, fontsize="small")
    for label, is_bad in zip(left.get_yticklabels(), bad, strict=True):
        label.set_color(_BAD if is_bad else "black")
    left.set_ylim(len(names) - 0.5, -0.5)
    figure.savefig(path, dpi=100, metadata={"Software": None})


def _draw_kurtosis(axes: Any, cleaned: Cleaned, rows: np.ndarray, bad: np.ndarray, threshold: float) -> None:
    z = np.nan_to_num(cleaned.z, posinf=1e3, neginf=-1e3)
    axes.barh(rows, z, color=np.where(bad, _BAD, _GOOD))
    axes.axvline(-threshold, color="0.5", linestyle="--", linewidth=1)
    axes.axvline(threshold, color="0.5", linestyle="--", linewidth=1)
    # One loose contact would squeeze all others into a line.
    axes.set_xscale("symlog", linthresh=2 * threshold)
    limit = max(2 * threshold, float(np.abs(z).max()) * 4)
    axes.set_xlim(max(-limit, min(float(z.min()) * 1.3, -1.5 * threshold)), limit)
    axes.set_xlabel("normalised kurtosis (SD)")
    axes.set_title(f"{int(bad.sum())} bad, {int(cleaned.interpolated.sum())} interpolated")
    for row, why in enumerate(cleaned.reason):
        if why:
            axes.annotate(why, (z[row], row), (3, 0), textcoords="offset points", va="center", fontsize="x-small")


def _draw_weights(axes: Any, cleaned: Cleaned, eog_names: list[str]) -> None:
    axes.set_title("share of the EOG removed")
    if not eog_names:
        axes.text(0.5, 0.5, "no EOG", transform=axes.transAxes, ha="center", va="center")
        axes.set_xticks([])
        return
    limit = max(float(np.abs(cleaned.weights).max()), 1e-9)
    image = axes.imshow(cleaned.weights, cmap="RdBu_r", vmin=-limit, vmax=limit, aspect="auto")
    axes.set_xticks(np.arange(len(eog_names)), eog_names, fontsize="small", rotation=90 if len(eog_names) > 3 else 0)
    axes.figure.colorbar(image, ax=axes, pad=0.03)
