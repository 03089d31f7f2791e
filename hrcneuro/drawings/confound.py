"""The confound panel, which joins the group's decoding with the subjects' numbers of trials."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hrcneuro.contract import Caption, Drawing, Drawings, Inputs, Of, Read


def draw(config: Any, files: Inputs, out: Path) -> None:
    """Draw what qualifies the first decoder's accuracy; no picture where nothing was decoded or no trial has a cue."""
    import numpy as np
    import pandas as pd

    from hrcneuro.figures import confound
    from hrcneuro.io.tables import read_table

    scores = read_table(files.path("decode", "subjects.parquet"))
    if scores.empty:
        return
    scores = scores[(scores["decoder"] == scores["decoder"].iloc[0]) & np.isfinite(scores["bacc"])]
    if not np.isfinite(scores[confound.QUALIFIERS].to_numpy(float)).any():
        return
    units = [unit for unit in files.units("decode") if files.has("decode", "strata.parquet", unit=unit)]
    strata = [read_table(files.path("decode", "strata.parquet", unit=unit)) for unit in units]
    table2 = read_table(files.path("decode", "table2.parquet"))
    confound.draw(scores, table2, pd.concat(strata) if strata else None, out / "confound_panel.png")


DRAWINGS = Drawings(
    name="confound",
    libraries=("matplotlib", "numpy", "pandas", "pyarrow"),
    group=Drawing(
        captions={
            "confound_panel.png": Caption(
                "Is it the takeover that is decoded, or the error and the turn that go with it? Balanced accuracy of "
                "held-out trials: mean and 95 % interval over subjects, dots are subjects, triangles the smallest "
                "mean that a one-sided t test finds with 80 % power; at the right trials a class and subject. "
                "Trained on all, scored within: decoders of all trials, on those of a stratum alone. After an error "
                "and after none, anticipation keeps its level (a response to turns does so, too) and a response to "
                "errors falls to 50 %; before a turn, a response to turns falls to 50 %, one to errors need not. "
                "Trained and scored within, where there are trials enough: with fewer to learn from, accuracy is lost "
                "whatever is decoded. A rule without EEG: from the previous error, or the turn ahead, alone",
                "Confound panel",
            )
        },
        reads=(
            Read("decode", ("subjects.parquet", "table2.parquet"), Of.GROUP),
            Read("decode", ("strata.parquet",), Of.INCLUDED, required=False),
        ),
        options=(),
        draw=draw,
    ),
    chapter="decode",
)
