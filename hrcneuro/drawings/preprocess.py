"""The pictures of preprocess: how good the channels are, what was done to them, and what their spectra became."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hrcneuro.contract import Caption, Drawing, Drawings, Inputs, Read


def draw(config: Any, files: Inputs, out: Path) -> None:
    """Draw one subject's channels from quality.parquet, and their spectra from spectrum.parquet."""
    from hrcneuro.figures import quality, spectrum
    from hrcneuro.io.tables import read_table
    from hrcneuro.tables.quality import read_spectrum, weights

    channels = read_table(files.path("preprocess", "quality.parquet"))
    quality.draw(channels, weights(channels), config.preprocess.threshold, out / "quality.png")
    signals, options = read_spectrum(files.path("preprocess", "spectrum.parquet")), config.preprocess
    # A recording of a few samples has no frequency to show.
    if signals:
        low = options.causal_l_freq if options.filter == "causal" else options.l_freq
        spectrum.draw(signals, (low, options.h_freq), out / "spectrum.png")


DRAWINGS = Drawings(
    name="preprocess",
    libraries=("matplotlib", "numpy", "pandas", "pyarrow"),
    subject=Drawing(
        captions={
            "quality.png": Caption(
                "Channels: kurtosis and what was interpolated, eye movements removed, amplitude, and by which "
                "criterion of PREP a channel is noisy all the time"
            ),
            "spectrum.png": Caption(
                "Power spectrum as recorded and clean: thin, every channel, thick, the median over channels; a channel "
                "far above it is named"
            ),
        },
        reads=(Read("preprocess", ("quality.parquet", "spectrum.parquet")),),
        options=tuple(f"preprocess.{name}" for name in ("threshold", "filter", "l_freq", "causal_l_freq", "h_freq")),
        draw=draw,
    ),
)
