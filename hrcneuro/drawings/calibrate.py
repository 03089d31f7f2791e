"""The pictures of calibrate: held-out blocks and scores, and what the decoder that is handed on listens to."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from pathlib import Path
from typing import Any

from hrcneuro.contract import Caption, Drawing, Drawings, Inputs, Read

_MAPS = 6  # of patterns, in a row
_RULES = {"prev_error": "after an error", "turn": "before a turn"}


def draw(config: Any, files: Inputs, out: Path) -> None:
    """Draw one subject's blocks, scores and patterns; nothing where there is no problem."""
    from hrcneuro.figures import calibrate as figure
    from hrcneuro.io.tables import read_table

    names = ("scores", "blocks", "baselines", "trials", "patterns")
    tables = {name: read_table(files.path("calibrate", f"{name}.parquet")) for name in names}
    rows = tables["scores"].to_dict("records")
    if not rows:
        return
    panels = [_panel(figure, row, tables) for row in rows]
    rules = " or ".join(_RULES.values())
    note = f"{files.unit}; decoders that have not seen the block; rules without EEG: takeover {rules}"
    figure.draw(panels, out / "calibration.png", note=note)
    _draw_patterns(files, tables["patterns"], rows, out)


def _panel(figure: Any, row: Mapping[Hashable, Any], tables: Mapping[str, Any]) -> Any:
    own = {name: table[table["problem"] == row["problem"]] for name, table in tables.items()}
    blocks, trials, rules = own["blocks"], own["trials"], own["baselines"]
    scores = [trials.loc[trials["label"] == label, "score"].to_numpy(float) for label in (0, 1)]
    return figure.CalibratedPanel(
        title=_compared(row),
        classes=(str(row["class1"]), str(row["class2"])),
        blocks=list(zip(blocks["block"].astype(int), blocks["bacc"].astype(float), strict=True)),
        scenarios=[str(one) if isinstance(one, str) else "" for one in blocks["scenario"]],
        mean=(float(row["bacc"]), float(row["bacc_se"])),
        rules=[(_RULES[r["rule"]], float(r["bacc"])) for r in rules.to_dict("records") if r["rule"] in _RULES],
        scores=(scores[0], scores[1]),
        slope=float(row["slope"]),
        offset=float(row["offset"]),
    )


def _draw_patterns(files: Inputs, table: Any, scores: Any, out: Path) -> None:
    """Draw the patterns where the channels' places are known."""
    import numpy as np

    from hrcneuro.figures import patterns as figure
    from hrcneuro.tables.maps import read_positions

    channels, rows = list(table["channel"].unique()), []
    for row in scores:
        part = table[table["problem"] == row["problem"]]
        windows = part[part["channel"] == channels[0]]
        spans = list(zip(windows["start_s"], windows["end_s"], strict=True))
        values = part["pattern"].to_numpy(float).reshape(len(channels), len(spans)).T
        shown = figure.side_by_side(spans, _MAPS)
        if np.isfinite(values).all():
            rows.append(figure.PatternRow(_compared(row), [spans[i] for i in shown], values[shown]))
    places = read_positions(files.path("calibrate", "channels.parquet"), channels)
    note = f"{files.unit}; fitted to all trials; windows in ms;\nred: more positive in the first"
    figure.draw(rows, places, out / "patterns.png", note=note)


def _compared(row: Mapping[Hashable, Any]) -> str:
    """Return the classes of a row of scores.parquet, that of a positive score first."""
    return f"{row['class2']} against {row['class1']} ({row['n2']} : {row['n1']} trials)"


DRAWINGS = Drawings(
    name="calibrate",
    libraries=("matplotlib", "numpy", "pandas", "pyarrow", "scipy"),
    subject=Drawing(
        captions={
            "calibration.png": Caption(
                "Left: balanced accuracy on each block of decoders that have not seen it, over all of them with its "
                "95 % interval, and of rules that look at no EEG. Right: the scores of held-out trials, and the "
                "probability of takeover that they are turned into"
            ),
            "patterns.png": Caption(
                "What the decoder listens to: how the channels' means in windows of time change with one standard "
                "deviation of its score (patterns after Haufe et al. 2014, not weights)"
            ),
        },
        reads=(
            Read(
                "calibrate",
                tuple(
                    f"{name}.parquet" for name in ("scores", "blocks", "baselines", "trials", "patterns", "channels")
                ),
            ),
        ),
        options=(),
        draw=draw,
    ),
)
