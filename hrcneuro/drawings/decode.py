"""The picture of decode: the group's forest plot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hrcneuro.contract import Caption, Drawing, Drawings, Inputs, Of, Read


def draw(config: Any, files: Inputs, out: Path) -> None:
    """Draw every subject's balanced accuracy from subjects.parquet, and the group's from table2.parquet."""
    import numpy as np

    from hrcneuro.figures import decode
    from hrcneuro.io.tables import read_table

    scores = read_table(files.path("decode", "subjects.parquet"))
    table2 = read_table(files.path("decode", "table2.parquet"))
    if scores.empty:
        return
    # The first row is the first decoder's, the one that others are compared with.
    decoder = scores["decoder"].iloc[0]
    scores = scores[(scores["decoder"] == decoder) & np.isfinite(scores["bacc"])]
    if len(scores):
        decode.draw(scores, table2[table2["decoder"] == decoder], out / "decoding.png")


DRAWINGS = Drawings(
    name="decode",
    libraries=("matplotlib", "numpy", "scipy", "pandas", "pyarrow"),
    group=Drawing(
        captions={
            "decoding.png": Caption(
                "Balanced accuracy of every subject with its 95 % interval, the group's mean and the published one",
                "Forest plot",
            )
        },
        reads=(Read("decode", ("subjects.parquet", "table2.parquet"), Of.GROUP),),
        options=(),
        draw=draw,
    ),
)
