"""The picture of preprocess: how good the channels are and what was done to them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hrcneuro.contract import Caption, Drawing, Drawings, Inputs, Read


def draw(config: Any, files: Inputs, out: Path) -> None:
    """Draw one subject's channels from quality.parquet."""
    from hrcneuro.figures import quality
    from hrcneuro.io.tables import read_table
    from hrcneuro.tables.quality import weights

    channels = read_table(files.path("preprocess", "quality.parquet"))
    quality.draw(channels, weights(channels), config.preprocess.threshold, out / "quality.png")


DRAWINGS = Drawings(
    name="preprocess",
    libraries=("matplotlib", "numpy", "pandas", "pyarrow"),
    subject=Drawing(
        captions={
            "quality.png": Caption("Channels: kurtosis and what was interpolated, eye movements removed, amplitude")
        },
        reads=(Read("preprocess", ("quality.parquet",)),),
        options=("preprocess.threshold",),
        draw=draw,
    ),
)
