"""The figure of a session's timing: each link's latencies over the session, and against the duration of a move."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.figure import Figure

from hrcneuro.figures.style import BLUE, GREY, PLACED, VERMILION, save


def session_timing(moves: pd.DataFrame, links: Mapping[str, str], path: Path) -> None:
    """Draw a row a link: latencies over the session, their distribution, and against the duration of a move.

    Args:
        moves: A row a marker, with ``marker_s``, ``t_f_s`` and a column a link, ms.
        links: Column -> its title; those that the table has.
        path: Of the PNG; the PDF lies beside it.
    """
    known = moves["t_f_s"].notna().any()
    with rc_context(PLACED):
        figure = Figure(figsize=(7.2 if known else 5.6, 0.5 + 1.75 * len(links)))
        grid = figure.subplots(
            len(links), 3 if known else 2, squeeze=False, width_ratios=[2, 1, 1][: 3 if known else 2]
        )
        minutes = (moves["marker_s"] - moves["marker_s"].min()).to_numpy(float) / 60
        for row, (name, title) in zip(grid, links.items(), strict=True):
            values = moves[name].to_numpy(float)
            here = np.isfinite(values)
            middle = float(np.median(values[here]))
            row[0].plot(minutes[here], values[here], ".", ms=2.5, color=BLUE)
            row[0].axhline(middle, color=VERMILION, lw=0.8)
            row[0].set(title=title, ylabel="latency (ms)")
            row[1].hist(values[here], bins=min(40, max(8, here.sum() // 8)), color=GREY, orientation="horizontal")
            row[1].axhline(middle, color=VERMILION, lw=0.8)
            row[1].set(title=f"median {middle:.2f} ms, n = {here.sum():,}")
            if known:
                row[2].plot(moves["t_f_s"].to_numpy(float)[here], values[here], ".", ms=2.5, color=BLUE)
                row[2].set(title="by duration of the move")
            for axes in row[1:]:
                axes.sharey(row[0])
                axes.tick_params(labelleft=False)
        grid[-1, 0].set(xlabel="time in the session (min)")
        grid[-1, 1].set(xlabel="moves")
        if known:
            grid[-1, 2].set(xlabel="duration (s)")
        save(figure, path)
