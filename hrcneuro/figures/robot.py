"""The figures of a session on the arm: where it went and how closely, and how punctual it was."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from hrcneuro.figures.style import BLUE, GREY, PALE, PLACED, VERMILION, save
from hrcneuro.paradigm.design import T_F_S
from hrcneuro.paradigm.grid import SIZE
from hrcneuro.robot.cell import Cell
from hrcneuro.robot.minimum_jerk import minimum_jerk
from hrcneuro.robot.record import APPROACH, PHASES

# mm: what the arm in this process promises at t_f = 0.6 s, and what a controller beyond sockets does.
LIMIT, LIMIT_SOCKETS, LIMIT_END = 0.8, 2.5, 0.1
_EQUAL_MS = 1e-3
# Viridis without its yellow, which is lost on white.
_ERRORS = ListedColormap(colormaps["viridis_r"](np.linspace(0.15, 1.0, 256)))


def robot(telemetry: pd.DataFrame, moves: pd.DataFrame, cell: Cell, path: Path, *, limit: float = LIMIT) -> None:
    """Draw the tip's path, its error in the course of a move, the moves' errors, and the entry into the radius.

    Args:
        telemetry: Rows of telemetry.parquet.
        moves: Rows of moves.parquet.
        cell: Where the tiles are.
        path: Of the PNG; the PDF lies beside it.
        limit: Greatest error allowed on the way at t_f = 0.6 s, mm.
    """
    with rc_context(PLACED):
        figure = Figure(figsize=(7.2, 6.2))
        axes = figure.subplots(2, 2)
        moved = moves[moves["max_error_mm"].notna()]
        _path(axes[0, 0], telemetry, moved, cell, figure)
        _error_course(axes[0, 1], telemetry, moved)
        _errors(axes[1, 0], moved, limit)
        _entry(axes[1, 1], moved, cell)
        save(figure, path)


def _path(axes: Axes, telemetry: pd.DataFrame, moved: pd.DataFrame, cell: Cell, figure: Figure) -> None:
    _tiles(axes)
    x, y = (telemetry[f"tool_{axis}_m"].to_numpy(float) for axis in "xy")
    row, column = cell.steps(x, y)
    between = (telemetry["phase"] == PHASES[APPROACH]).to_numpy()
    axes.plot(np.where(between, column, np.nan), np.where(between, row, np.nan), color=PALE, lw=0.5, zorder=1)
    ways = moved.groupby(["start_row", "start_col", "row", "col"])["max_error_mm"].max()
    # The two directions of an edge are drawn side by side.
    lines, values = [], []
    for (r0, c0, r1, c1), worst in zip(ways.index.to_list(), ways.to_numpy(), strict=True):
        side = 0.09 * np.array([r0 - r1, c1 - c0])
        lines.append([np.array([c0, r0]) + side, np.array([c1, r1]) + side])
        values.append(worst)
    axes.plot(np.where(between, np.nan, column), np.where(between, np.nan, row), color="black", lw=0.5, zorder=3)
    drawn = LineCollection(lines, array=np.array(values), cmap=_ERRORS, lw=2.2, capstyle="round", zorder=2)
    axes.add_collection(drawn)
    if values:
        figure.colorbar(drawn, ax=axes, shrink=0.7, label="greatest error on the way (mm)")
    axes.set(title="A   tip (black), approaches (grey), ways by error", xlabel="column (tiles)", ylabel="row (tiles)")


def _tiles(axes: Axes) -> None:
    for r, c in np.ndindex(SIZE, SIZE):
        axes.add_patch(Rectangle((c - 0.5, r - 0.5), 1, 1, fill=False, ec=PALE, lw=0.6))
    axes.set(xlim=(-0.6, SIZE - 0.4), ylim=(SIZE - 0.4, -0.6), aspect="equal", xticks=range(SIZE), yticks=range(SIZE))


def _error_course(axes: Axes, telemetry: pd.DataFrame, moved: pd.DataFrame) -> None:
    u = np.linspace(0.0, 1.15, 116)
    time = telemetry["time_s"].to_numpy(float)
    tip, reference = (telemetry[[f"{what}_{a}_m" for a in "xyz"]].to_numpy(float) for what in ("tool", "reference"))
    rows_of = telemetry.groupby("move").indices
    curves = []
    for index, onset, t_f in zip(moved["move"], moved["onset_s"], moved["t_f_s"], strict=True):
        rows = rows_of[index]
        off = 1e3 * np.linalg.norm(tip[rows] - reference[rows], axis=1)
        curves.append(np.interp(u, (time[rows] - onset) / t_f, off, right=np.nan))
    if curves:
        stack = np.array(curves)
        shown = np.isfinite(stack).sum(axis=0) >= max(1, len(stack) // 10)
        low, middle, high = np.nanpercentile(stack[:, shown], (5, 50, 95), axis=0)
        axes.fill_between(u[shown], low, high, color=BLUE, alpha=0.25, lw=0, label="5 to 95 % of the moves")
        axes.plot(u[shown], middle, color=BLUE, lw=1.2, label="median")
        axes.plot(u[shown], np.nanmax(stack[:, shown], axis=0), color=VERMILION, lw=0.8, label="greatest")
        axes.legend(loc="upper right")
    axes.set(title=f"B   distance from the reference, {len(curves)} moves",
             xlabel="time since the onset / $t_f$", ylabel="error (mm)",
             ylim=(0, 1.35 * axes.get_ylim()[1]))  # fmt: skip


def _errors(axes: Axes, moved: pd.DataFrame, limit: float) -> None:
    for name, mark, colour, allowed, label in (
        ("max_error_mm", "o", BLUE, limit, "greatest on the way"),
        ("end_error_mm", "s", VERMILION, LIMIT_END, "on arrival"),
    ):
        axes.scatter(moved["t_f_s"], moved[name], s=4, marker=mark, color=colour, lw=0, alpha=0.5, label=label)
        axes.axhline(allowed, color=colour, lw=0.8, ls=":", label=f"its limit: {allowed:g} mm")
    axes.set(title="C   error of each move; limits for 0.6 s", xlabel="$t_f$ (s)", ylabel="error (mm)")
    axes.set_ylim(0, 1.5 * max(limit, axes.get_ylim()[1] / 1.05))
    axes.legend(loc="upper right", ncols=2, columnspacing=1.0)


def _entry(axes: Axes, moved: pd.DataFrame, cell: Cell) -> None:
    t_f = moved["t_f_s"].to_numpy(float)
    axes.scatter(t_f, moved["t_2mm_s"], s=4, color=BLUE, lw=0, alpha=0.5, label="measured")
    u = np.linspace(0, 1, 2001)
    inside = u[np.searchsorted(minimum_jerk(u)[0], 1 - cell.radius / cell.tile)]
    ends = np.array([t_f.min(), t_f.max()]) if len(t_f) and np.ptp(t_f) > 0 else np.array(T_F_S)
    axes.plot(ends, inside * ends, color=GREY, lw=0.8, label=f"Eq 2: {inside:.3f} $t_f$")
    axes.plot(ends, ends, color=GREY, lw=0.8, ls=":", label="$t_f$")
    radius = 1e3 * cell.radius
    axes.set(title=f"D   entry into the {radius:g} mm radius", xlabel="$t_f$ (s)", ylabel="time since the onset (s)")
    axes.legend(loc="upper left")


def timing(telemetry: pd.DataFrame, moves: pd.DataFrame, distributions: pd.DataFrame, path: Path) -> None:
    """Draw the distributions of paper § 2.3.4 that there are: marker, motion, command, cycles, and the log.

    On a virtual clock all cycles are equally long and no time passes between command and marker: that is said and not
    drawn. Where nothing is left, there is no picture.

    Args:
        telemetry: Rows of telemetry.parquet.
        moves: Rows of moves.parquet.
        distributions: Rows of timing.parquet.
        path: Of the PNG; the PDF lies beside it.
    """
    panels, note = _timing_panels(telemetry, moves, distributions)
    if not panels:
        return
    columns = 3 if len(panels) % 3 == 0 else min(2, len(panels))
    rows = -(-len(panels) // columns)
    with rc_context(PLACED):
        figure = Figure(figsize=(0.4 + 2.5 * columns, 0.3 + 2.1 * rows))
        grid = figure.add_gridspec(rows, 2 * columns)
        for i, (title, draw) in enumerate(panels):
            # The last of an odd number is as wide as two: no place stays empty.
            first = 2 * (i % columns)
            stop = 2 * columns if i + 1 == len(panels) else first + 2
            one = figure.add_subplot(grid[i // columns, first:stop])
            draw(one)
            one.set_title(f"{'ABCDEF'[i]}   {title}")
        if note:
            figure.supxlabel(note, fontsize=6.5, color=GREY, x=0.01, ha="left")
        save(figure, path)


def _timing_panels(
    telemetry: pd.DataFrame, moves: pd.DataFrame, distributions: pd.DataFrame
) -> tuple[list[tuple[str, Callable[[Axes], None]]], str]:
    """Return title and painter of each panel that has something to show, and a sentence on what has not."""
    names = [str(name) for name in distributions.columns if name != "quantity"]
    spread = {
        str(row["quantity"]): {name.removesuffix("_ms"): float(row[name]) for name in names}
        for row in distributions.to_dict("records")
    }
    time = telemetry["time_s"].to_numpy(float)
    period = 1e3 * np.diff(time)
    latency, behind = (moves[f"{name}_ms"].to_numpy(float) for name in ("trigger_latency", "behind_log"))
    sent = moves[["marker_latency_ms", "stim_latency_ms"]].to_numpy(float)
    panels: list[tuple[str, Callable[[Axes], None]]] = []
    if "trigger_latency" in spread and np.isfinite(latency).any():
        panels.append(("onset marked to motion begun", lambda a: _histogram(a, latency, spread["trigger_latency"])))
        panels.append(("the same by the move's duration", lambda a: _by_duration(a, moves)))
    if np.nanmax(np.abs(sent), initial=0.0) > _EQUAL_MS:
        panels.append(("onset commanded to marker", lambda a: _after_onset(a, moves, spread)))
    virtual = len(period) > 0 and float(np.ptp(period)) < _EQUAL_MS
    if "cycle" in spread and len(period) and not virtual:
        panels.append(("control cycle", lambda a: _histogram(a, period, spread["cycle"], counts=True)))
        panels.append(("cycles in the session", lambda a: _cycles(a, time, period)))
    if "behind_log" in spread and np.isfinite(behind).any():
        panels.append(("onset interval less the log's", lambda a: _histogram(a, behind, spread["behind_log"])))
    note = f"a virtual clock: every control cycle lasts {period[0]:.3g} ms" if virtual else ""
    return panels, note


def _cycles(axes: Axes, time: np.ndarray, period: np.ndarray) -> None:
    axes.plot(time[1:] / 60.0, period, ".", color=BLUE, ms=1.5, rasterized=True)
    axes.set(xlabel="time (min)", ylabel="length (ms)")
    axes.set_ylim(min(7.0, axes.get_ylim()[0]), max(9.0, axes.get_ylim()[1]))


def _by_duration(axes: Axes, moves: pd.DataFrame) -> None:
    # A latency that grew with t_f would shift the potentials of slow moves against those of quick ones.
    known = moves[moves["trigger_latency_ms"].notna()]
    t_f, latency = known["t_f_s"].to_numpy(float), known["trigger_latency_ms"].to_numpy(float)
    axes.scatter(t_f, latency, s=4, color=BLUE, lw=0, alpha=0.5)
    if len(known) > 1 and np.ptp(t_f) > 0:
        slope, start = np.polyfit(t_f, latency, 1)
        ends = np.array([t_f.min(), t_f.max()])
        axes.plot(ends, start + slope * ends, color=VERMILION, lw=1.0, label=f"slope ${slope:+.2f}$ ms/s")
        axes.legend(loc="upper right")
    axes.set(xlabel="$t_f$ (s)", ylabel="latency (ms)")
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.25 * (high - low))


def _after_onset(axes: Axes, moves: pd.DataFrame, spread: Mapping[str, Mapping[str, float]]) -> None:
    shown = [
        ("marker", BLUE, "-", "marker sent"),
        ("stim", VERMILION, "--", "first sample with it"),
    ]
    for name, colour, line, label in shown:
        values = np.sort(moves[f"{name}_latency_ms"].dropna().to_numpy(float))
        if len(values):
            of = spread[f"{name}_latency"]
            text = f"{label}\n{_number(of['mean'])} ± {_number(of['sd'])} ms"
            share = np.arange(1, len(values) + 1) / len(values)
            axes.step(
                np.r_[values[0], values], np.r_[0.0, share], where="post", color=colour, ls=line, lw=1.2, label=text
            )
    axes.set(xlabel="latency (ms)", ylabel="share of the moves up to it")
    axes.set_ylim(0, 1.55)
    axes.set_yticks([0, 0.5, 1])
    low, high = axes.get_xlim()
    axes.set_xlim(min(low, -0.05), max(high, 1.0))
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper left")


def _histogram(axes: Axes, values: np.ndarray, spread: Mapping[str, float], *, counts: bool = False) -> None:
    known = values[np.isfinite(values)]
    axes.set(xlabel="time (ms)", ylabel="cycles" if counts else "share of the moves")
    # A distribution narrower than a tenth of a millisecond is shown as what it is, not as rounding noise.
    low, high = float(known.min()), float(known.max())
    room = max(0.1 * (high - low), 0.05)
    edges = np.linspace(low - room, high + room, 42)
    # Late cycles are few among very many: only a logarithmic axis shows them.
    weights = None if counts else np.full(len(known), 1 / len(known))
    axes.hist(known, edges.tolist(), weights=weights, color=BLUE, log=counts)
    # Up to where the numbers stand.
    axes.axvline(spread["median"], ymax=0.7, color=VERMILION, lw=0.8)
    top = axes.get_ylim()[1]
    axes.set_ylim(*((0.5, 30.0 * top) if counts else (0.0, 1.5 * top)))
    shown = {name: _number(value) for name, value in spread.items()}
    text = f"n = {len(known)}, median {shown['median']}\n{shown['mean']} ± {shown['sd']} ms\n1 to 99 %: {shown['p1']}"
    axes.text(
        0.98, 0.98, f"{text} to {shown['p99']}", transform=axes.transAxes, ha="right", va="top", fontsize=6.5,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
    )  # fmt: skip


def _number(value: float) -> str:
    # Adding zero turns a -0.00 into 0.00.
    return f"{round(value, 2) + 0.0:.2f}".replace("-", "\N{MINUS SIGN}")
