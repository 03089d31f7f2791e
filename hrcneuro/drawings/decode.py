"""The pictures of decode: a subject's ROC curves and patterns, the group's forest plot."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from pathlib import Path
from typing import Any

from hrcneuro.contract import Caption, Drawing, Drawings, Inputs, Of, Read

_MAPS = 6  # of patterns, in a row


def draw_subject(config: Any, files: Inputs, out: Path) -> None:
    """Draw ROC curves and patterns of what was decoded; nothing where nothing was."""
    from hrcneuro.figures import roc as figure
    from hrcneuro.io.tables import read_table

    roc, scores = (read_table(files.path("decode", f"{name}.parquet")) for name in ("roc", "scores"))
    if roc.empty:
        return
    figure.draw(roc, scores, out / "roc.png")
    _draw_patterns(files, scores, out)


def _draw_patterns(files: Inputs, scores: Any, out: Path) -> None:
    """Draw the patterns of the first decoder that has any, where the channels' places are known."""
    import numpy as np

    from hrcneuro.figures import patterns as figure
    from hrcneuro.io.tables import read_table
    from hrcneuro.tables.maps import read_positions

    table = read_table(files.path("decode", "patterns.parquet"))
    table = table[table["measure"] == "mean"]
    if table.empty:
        return
    decoder = table["decoder"].iloc[0]
    own = scores[scores["decoder"] == decoder].to_dict("records")
    titles = {(row["scenario"], row["problem"]): _compared(row) for row in own}
    rows = []
    channels = list(table["channel"].unique())
    for key, part in table[table["decoder"] == decoder].groupby(["scenario", "problem"], sort=True):
        windows = part[part["channel"] == channels[0]]
        spans = list(zip(windows["start_s"], windows["end_s"], strict=True))
        values = part["pattern"].to_numpy(float).reshape(len(channels), len(spans)).T
        shown = figure.side_by_side(spans, _MAPS)
        if np.isfinite(values).all():
            rows.append(figure.PatternRow(titles[key], [spans[i] for i in shown], values[shown]))
    note = f"{files.unit}; decoder {decoder}, fitted to all trials; windows in ms;\nred: more positive in the first"
    places = read_positions(files.path("decode", "channels.parquet"), channels)
    figure.draw(rows, places, out / "patterns.png", note=note)


def _compared(row: Mapping[Hashable, Any]) -> str:
    """Return the classes of a row of scores.parquet, that of a positive score first."""
    scenario = "" if row["scenario"] == "all" else f"{row['scenario']}: "
    return f"{scenario}{row['class2']} against {row['class1']} ({row['n2']} : {row['n1']} trials)"


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
    libraries=("matplotlib", "numpy", "pandas", "pyarrow", "scipy"),
    subject=Drawing(
        captions={
            "roc.png": Caption(
                "ROC curves of held-out trials, the mean of the folds' curves, with the area under them (AUC); dots: "
                "where the decoder decides"
            ),
            "patterns.png": Caption(
                "What the decoder listens to: how the channels' means in windows of time change with one standard "
                "deviation of its score (patterns after Haufe et al. 2014, not weights)"
            ),
        },
        reads=(Read("decode", ("roc.parquet", "scores.parquet", "patterns.parquet", "channels.parquet")),),
        options=(),
        draw=draw_subject,
    ),
    group=Drawing(
        captions={
            "decoding.png": Caption(
                "Balanced accuracy of every subject with its 95 % interval, the group's mean and, where the paper "
                "prints one, its own",
                "Forest plot",
            )
        },
        reads=(Read("decode", ("subjects.parquet", "table2.parquet"), Of.GROUP),),
        options=(),
        draw=draw,
    ),
)
