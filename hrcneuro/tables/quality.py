"""What the stage preprocess writes beside the clean recording: quality.parquet, timing.parquet, steps.npz."""

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

_WEIGHT = "weight_"


def quality_table(eog_names: list[str]) -> Table:
    """Return the schema of quality.parquet: a weight column for every EOG channel, ``weight_NAME``."""
    return Table(
        1,
        "one row an EEG channel of the recording",
        {
            "channel": Column("string", "", "channel"),
            "kurtosis": Column("float", "", "m4 / m2² after the filter and the EOG step; null for a flat channel"),
            "z": Column("float", "SD", "kurtosis normalised by the trimmed mean and SD; null where flat or marked"),
            "reason": Column("category", "", "why the channel is bad: kurtosis, flat, marked; null where it is good"),
            "interpolated": Column("bool", "", "the channel was made from the others"),
            "rms_before_uv": Column("float", "µV", "RMS after the band-pass"),
            "rms_after_uv": Column("float", "µV", "RMS of the clean signal; null for a channel left out"),
            **{
                _WEIGHT + name: Column(
                    "float",
                    "",
                    f"share of {name} that was subtracted (0 without regression, or where it is marked bad)",
                )
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


def weights(table: pd.DataFrame) -> dict[str, np.ndarray]:
    """Return EOG channel -> the share of it that was subtracted from each EEG channel, ndarray, shape (n_eeg,).

    Args:
        table: Rows of quality.parquet.
    """
    return {
        name.removeprefix(_WEIGHT): table[name].to_numpy(float) for name in table.columns if name.startswith(_WEIGHT)
    }


def write_quality(cleaned: Cleaned, signals: Signals, out: Path) -> None:
    """Write quality.parquet into the folder ``out``: the channels' verdicts, weights and amplitudes."""
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
    """Write timing.parquet into the folder ``out``; ``n_source`` is the length of the recording, in samples."""
    ratio = cleaned.ratio
    row = {"source_sfreq": ratio.source, "sfreq": ratio.sfreq, "up": ratio.up, "down": ratio.down, "n_source": n_source}
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
