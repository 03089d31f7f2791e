"""The picture that joins acquire and preprocess: how clean everybody's recordings are."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.contract import Caption, Drawing, Drawings, Inputs, Of, Read

if TYPE_CHECKING:
    import mne
    import numpy as np

    from hrcneuro.figures.quality_group import Blinks

# So much of the middle of a recording holds two dozen blinks.
_SPAN_S = 90.0
# More lines than these would hide each other, and each recording takes its time to open.
_MOST = 4
_FRONTAL = ("Fp1", "Fp2", "FPz", "AF3", "AF4", "F3", "F4", "Fz")


def draw(config: Any, files: Inputs, out: Path) -> None:
    """Draw everyone's channels, the spectra of the included subjects, and the blinks of up to four of them."""
    from hrcneuro.figures import quality_group
    from hrcneuro.io.tables import read_table
    from hrcneuro.tables.quality import read_spectrum

    everyone = [unit for unit in files.units("preprocess") if files.has("preprocess", "quality.parquet", unit=unit)]
    if not everyone:
        return
    channels = {unit: read_table(files.path("preprocess", "quality.parquet", unit=unit)) for unit in everyone}
    told = [unit for unit in everyone if files.has("preprocess", "spectrum.parquet", unit=unit)]
    spectra = [read_spectrum(files.path("preprocess", "spectrum.parquet", unit=unit)) for unit in told]
    included = [unit for unit in everyone if files.has("preprocess", "{unit}_clean_raw.fif", unit=unit)]
    shown = included[:: -(-len(included) // _MOST)] if included else []
    blinks = [_blinks(files, unit) for unit in shown if files.has("acquire", "{unit}_raw.fif", unit=unit)]
    quality_group.draw(
        # A recording of a few samples has no spectrum.
        channels, [one for one in spectra if one], [one for one in blinks if one], out / "quality_group.png"
    )  # fmt: skip


def _blinks(files: Inputs, unit: str) -> Blinks | None:
    """Return the mean blinks of the middle of a recording, as recorded and clean; None where it has none."""
    from hrcneuro.eeg.blinks import blink_peaks, mean_blink
    from hrcneuro.figures.quality_group import Blinks
    from hrcneuro.io.fif import read_raw

    raw = read_raw(files.path("acquire", "{unit}_raw.fif", unit=unit))
    frontal = [name for name in _FRONTAL if name in raw.ch_names][:2]
    if "eog" not in raw or not frontal:
        return None
    clean = read_raw(files.path("preprocess", "{unit}_clean_raw.fif", unit=unit))
    if not set(frontal) <= set(clean.ch_names):
        return None
    start = max(0.0, (min(raw.times[-1], clean.times[-1]) - _SPAN_S) / 2)
    peaks = blink_peaks(*_span(raw, start, "eog"))
    return Blinks(*(mean_blink(*_span(one, start, frontal), peaks) for one in (raw, clean))) if len(peaks) else None


def _span(raw: mne.io.BaseRaw, start: float, picks: str | list[str]) -> tuple[np.ndarray, float]:
    """Return the span from ``start`` seconds on, shape (n_channels, n_times), µV, and its sampling rate in Hz."""
    sfreq = float(raw.info["sfreq"])
    first = int(start * sfreq)
    stop = min(raw.n_times, first + int(_SPAN_S * sfreq))
    return 1e6 * raw.get_data(picks=picks, start=first, stop=stop, verbose="error"), sfreq


DRAWINGS = Drawings(
    name="quality",
    libraries=("matplotlib", "mne", "numpy", "pandas", "pyarrow", "scipy"),
    group=Drawing(
        captions={
            "quality_group.png": Caption(
                "Left: normalised kurtosis of every channel, replaced ones crossed, steadily noisy ones (deviation and "
                "correlation of PREP) framed. "
                "Middle: spectra of the recordings, no excluded ones, as recorded and clean. Right: the mean blink "
                "in 90 s from the middle of up to four of them",
                "Signal quality",
            )
        },
        # A subject whose recording failed is missing from the picture; the others are drawn.
        reads=(
            Read("preprocess", ("quality.parquet",), Of.EVERYONE, required=False),
            Read("preprocess", ("spectrum.parquet", "*_clean_raw*.fif"), Of.INCLUDED, required=False),
            Read("acquire", ("*_raw*.fif",), Of.INCLUDED, required=False),
        ),
        options=(),
        draw=draw,
    ),
    chapter="preprocess",
)
