"""The figures of a multiverse: a specification curve, and what holds in which universe."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hrcneuro.figures.style import BLUE, GREY, INK, PALE, PLACED, VERMILION, save

FITS, DIFFERS, OPEN = "fits", "differs", "cannot tell"
_COLOURS = {FITS: BLUE, DIFFERS: VERMILION, OPEN: GREY}
_LABELS = {FITS: "fits what is printed", DIFFERS: "differs", OPEN: "cannot tell"}
_LINE = 0.135  # inches a row of choices or findings
_WIDTH = 7.2


def draw_curve(
    values: np.ndarray,
    fits: Sequence[str],
    chosen: Sequence[Mapping[str, str]],
    *,
    title: str,
    unit: str,
    printed: float | None = None,
    path: Path,
) -> None:
    """Draw one finding in all analyses from its least value to its largest, and below which choices each one made.

    Args:
        values: ndarray, shape (n_analyses,), in ``unit``; the first is the study's own; NaN is left out.
        fits: What each has to say: ``fits``, ``differs`` or ``cannot tell``.
        chosen: Choice -> value of each; a choice in which none differs is not drawn.
        title: What the finding is.
        unit: Of the values.
        printed: What the paper prints, in ``unit``; None where that is no such number.
        path: The PNG file; the PDF lies beside it.
    """
    rows = _rows(chosen)
    places = np.flatnonzero(np.isfinite(values))
    order = places[np.argsort(values[places], kind="stable")]
    height = 2.1 + _LINE * (len(rows) + 0.6 * len({name for name, _ in rows})) + 0.45
    with rc_context(PLACED):
        figure = Figure(figsize=(_WIDTH, height))
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.1, height - 2.55))
        colours = [_COLOURS[fits[i]] for i in order]
        x = np.arange(len(order))
        if printed is not None:
            above.axhline(printed, color=INK, lw=0.8, ls="--", zorder=0)
        elif values[order].min() < 0 < values[order].max():
            above.axhline(0.0, color=GREY, lw=0.6, zorder=0)
        above.scatter(x, values[order], c=colours, s=_dot(len(order)), lw=0, clip_on=False)
        own = np.flatnonzero(order == 0)
        for axes in (above, below) if len(own) else ():
            axes.axvline(own[0], color=PALE, lw=2.5, zorder=-1)
        above.set(ylabel=unit, xlim=(-1, len(order)))
        above.set_title(title, loc="left")
        _matrix(below, rows, [chosen[i] for i in order], colours)
        below.set_xticks([])
        below.set_xlabel(f"{len(order)} analyses, in the order of their value")
        figure.legend(
            handles=_key(fits, own=bool(len(own)), printed=printed is not None), loc="outside lower left", ncols=5
        )
        save(figure, path)


def draw_findings(
    told: pd.DataFrame, labels: Sequence[str], borders: Sequence[int], *, constant: int, path: Path
) -> None:
    """Draw what each universe has to say on the findings that not all agree on.

    Args:
        told: One row a finding, one column a universe in the order of the chains: ``fits``, ``differs`` or ``cannot
            tell``; missing where a universe has nothing.
        labels: Of the rows.
        borders: Columns at which a new preprocessing chain begins, without the first.
        constant: How many findings are left out, as all universes agree on them.
        path: The PNG file; the PDF lies beside it.
    """
    codes = {FITS: 1, DIFFERS: 2, OPEN: 3}
    cells = told.apply(lambda column: column.map(codes)).fillna(0).to_numpy(int)
    with rc_context(PLACED):
        figure = Figure(figsize=(_WIDTH, 1.0 + _LINE * 1.25 * max(1, len(labels))))
        axes = figure.subplots()
        colours = ListedColormap(["white", *_COLOURS.values()])
        axes.imshow(cells, cmap=colours, vmin=-0.5, vmax=3.5, aspect="auto", interpolation="nearest")
        for border in borders:
            axes.axvline(border - 0.5, color="white", lw=1.6)
        for row in range(1, len(labels)):
            axes.axhline(row - 0.5, color="white", lw=0.8)
        axes.set_yticks(range(len(labels)), labels, fontsize=6.5)
        axes.set_xlabel(f"universes, by preprocessing chain; {constant} findings on which all agree are left out")
        axes.tick_params(length=0)
        axes.set_xticks([])
        axes.spines[:].set_visible(False)
        present = [word for word, code in codes.items() if (cells == code).any()]
        patches = [Patch(color=_COLOURS[word], label=_LABELS[word]) for word in present]
        figure.legend(handles=patches, loc="outside upper right", ncols=3)
        save(figure, path)


def _rows(chosen: Sequence[Mapping[str, str]]) -> list[tuple[str, str]]:
    """Return (choice, value) of each row: the values in the order in which they come, of choices that differ."""
    values = {name: dict.fromkeys(one[name] for one in chosen) for name in chosen[0]}
    return [(name, value) for name, of in values.items() if len(of) > 1 for value in of]


def _matrix(
    axes: Axes, rows: Sequence[tuple[str, str]], chosen: Sequence[Mapping[str, str]], colours: Sequence[str]
) -> None:
    """Draw a mark where a universe, in its column, chose the value of a row; a gap between choices."""
    heights, labels, at, before = [], [], 0.0, ""
    for name, value in rows:
        at += 1.6 if before and name != before else 1.0
        heights.append(at)
        labels.append(f"{name}   {value}" if name != before else value)
        before = name
    for height, (name, value) in zip(heights, rows, strict=True):
        x = [i for i, one in enumerate(chosen) if one[name] == value]
        axes.scatter(x, [height] * len(x), marker="|", s=14, lw=1.0, c=[colours[i] for i in x])
    axes.set_yticks(heights, labels, fontsize=6)
    axes.set_ylim(max(at, 1.0) + 0.7, 0.3)
    axes.tick_params(axis="y", length=0)
    axes.spines[["left"]].set_visible(False)


def _dot(n: int) -> float:
    """Return the area of a dot where there are so many, points²."""
    return float(np.clip(1600 / max(n, 1), 5, 24))


def _key(fits: Sequence[str], *, own: bool, printed: bool) -> list[Line2D]:
    dots = [
        Line2D([], [], color=colour, marker="o", ms=3.5, ls="none", label=_LABELS[word])
        for word, colour in _COLOURS.items()
        if word in fits
    ]
    lines = [Line2D([], [], color=PALE, lw=2.5, label="the study's own")] if own else []
    return [*dots, *lines, *([Line2D([], [], color=INK, lw=0.8, ls="--", label="printed")] if printed else [])]
