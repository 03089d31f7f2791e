"""What preprocess writes beside the clean recording: quality.parquet, timing.parquet, spectrum.parquet, steps.npz."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from hrcneuro.io.tables import Column, Table, read_table, write_table

if TYPE_CHECKING:
    from hrcneuro.eeg.cleaning import Cleaned, Signals

_WEIGHT = "weight_"


def quality_table(eog_names: list[str]) -> Table:
    """Return the schema of quality.parquet: a weight column for every EOG channel, ``weight_NAME``."""
    return Table(
        2,
        "one row an EEG channel of the recording",
        {
            "channel": Column("string", "", "channel"),
            "kurtosis": Column("float", "", "m4 / m2² after the filter and the EOG step; null for a flat channel"),
            "z": Column("float", "SD", "kurtosis normalised by the trimmed mean and SD; null where flat or marked"),
            "reason": Column("category", "", "why it is bad: kurtosis, flat, marked, noisy; null where it is good"),
            "deviation": Column("float", "SD", "robust z of the channel's robust SD (PREP); null where flat or marked"),
            "alone": Column("float", "", "share of seconds in which it goes with no other (PREP); null as above"),
            "noisy": Column("category", "", "deviation, correlation or both: by what it is noisy; null elsewhere"),
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

SPECTRUM = Table(
    1,
    "one row a signal, channel and frequency: its power, from windows of 2 s",
    {
        "signal": Column("category", "", "recorded, or clean: what the stage writes"),
        "channel": Column("category", "", "EEG channel; one that was left out is not among the clean ones"),
        "frequency_hz": Column("float", "Hz", "frequency, 0.5 to 60 Hz"),
        "power_uv2_hz": Column("float", "µV²/Hz", "power spectral density"),
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
            "deviation": cleaned.noise.deviation,
            "alone": cleaned.noise.alone,
            "noisy": [why or None for why in cleaned.noise.reason],
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


def write_spectrum(signals: Mapping[str, tuple[list[str], np.ndarray, np.ndarray]], out: Path) -> None:
    """Write spectrum.parquet into the folder ``out``.

    Args:
        signals: Which one -> its channels, frequencies in Hz, and power, shape (n_channels, n_freqs), µV²/Hz.
        out: The folder.
    """
    frames = [
        pd.DataFrame(
            {
                "signal": which,
                "channel": np.repeat(names, len(hz)),
                "frequency_hz": np.tile(hz, len(names)),
                "power_uv2_hz": power.ravel(),
            }
        )
        for which, (names, hz, power) in signals.items()
    ]
    write_table(pd.concat(frames, ignore_index=True), out / "spectrum.parquet", SPECTRUM)


def read_spectrum(path: Path) -> dict[str, pd.DataFrame]:
    """Return which signal -> its power in µV²/Hz: a row a frequency (Hz), a column a channel, in their order."""
    table = read_table(path)
    return {
        str(which): part.pivot_table(index="frequency_hz", columns="channel", values="power_uv2_hz", sort=False)
        for which, part in table.groupby("signal", sort=False)
    }


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
