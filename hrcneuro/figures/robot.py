"""The figures of the stage robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from hrcneuro.figures.style import BLUE, GREY, PALE, PLACED, VERMILION, save
from hrcneuro.robot import kinematics
from hrcneuro.robot.cell import GRID
from hrcneuro.robot.limits import MAX_SPEED
from hrcneuro.robot.measure import Tip
from hrcneuro.robot.record import APPROACH, Telemetry
from hrcneuro.robot.session import Done
from hrcneuro.robot.trajectory import minimum_jerk
from hrcneuro.robot.workspace import Workspace


def robot(
    done: Sequence[Done], record: Telemetry, tip: Tip, table: pd.DataFrame, workspace: Workspace, path: Path
) -> None:
    """Draw the tip's path, its error in the course of a move, the moves' errors, and the entry into the radius."""
    with rc_context(PLACED):
        figure = Figure(figsize=(7.2, 6.2))
        axes = figure.subplots(2, 2)
        _path(axes[0, 0], record, tip, table, workspace, figure)
        _error_course(axes[0, 1], done, record, tip)
        moved = table[table["max_error_mm"].notna()]
        _errors(axes[1, 0], moved)
        _entry(axes[1, 1], moved, workspace)
        save(figure, path)


def _path(axes: Axes, record: Telemetry, tip: Tip, table: pd.DataFrame, workspace: Workspace, figure: Figure) -> None:
    _tiles(axes)
    cell = workspace.cell
    column = (GRID - 1) / 2 - (tip.position[:, 1] + cell.sideways) / cell.tile
    row = (-tip.position[:, 0] - cell.near_edge) / cell.tile - 0.5
    between = record.phase == APPROACH
    axes.plot(np.where(between, column, np.nan), np.where(between, row, np.nan), color=PALE, lw=0.5, zorder=1)
    ways = table[table["max_error_mm"].notna()].groupby(["start_row", "start_col", "row", "col"])["max_error_mm"].max()
    # The two directions of an edge are drawn side by side.
    lines, values = [], []
    for (r0, c0, r1, c1), worst in zip(ways.index.to_list(), ways.to_numpy(), strict=True):
        side = 0.09 * np.array([r0 - r1, c1 - c0])
        lines.append([np.array([c0, r0]) + side, np.array([c1, r1]) + side])
        values.append(worst)
    axes.plot(np.where(between, np.nan, column), np.where(between, np.nan, row), color="black", lw=0.5, zorder=3)
    drawn = LineCollection(lines, array=np.array(values), cmap="viridis_r", lw=2.2, capstyle="round", zorder=2)
    axes.add_collection(drawn)
    if values:
        figure.colorbar(drawn, ax=axes, shrink=0.7, label="greatest error of the way (mm)")
    axes.set(title="tip (black), approaches (grey), ways by error", xlabel="column", ylabel="row")


def _tiles(axes: Axes) -> None:
    for r, c in np.ndindex(GRID, GRID):
        axes.add_patch(Rectangle((c - 0.5, r - 0.5), 1, 1, fill=False, ec=PALE, lw=0.6))
    axes.set(xlim=(-0.6, GRID - 0.4), ylim=(GRID - 0.4, -0.6), aspect="equal", xticks=range(GRID), yticks=range(GRID))


def _error_course(axes: Axes, done: Sequence[Done], record: Telemetry, tip: Tip) -> None:
    u = np.linspace(0.0, 1.15, 116)
    curves = []
    for one in done:
        if one.move.dwells or not np.isfinite(one.track.onset):
            continue
        rows = slice(one.track.first, one.track.last)
        off = 1e3 * np.linalg.norm(tip.position[rows] - record.reference[rows], axis=1)
        share = (record.time[rows] - one.track.onset) / one.move.t_f
        curves.append(np.interp(u, share, off, right=np.nan))
    if curves:
        stack = np.array(curves)
        shown = np.isfinite(stack).sum(axis=0) >= max(1, len(stack) // 10)
        low, middle, high = np.nanpercentile(stack[:, shown], (5, 50, 95), axis=0)
        axes.fill_between(u[shown], low, high, color=BLUE, alpha=0.25, lw=0, label="5 to 95 % of the moves")
        axes.plot(u[shown], middle, color=BLUE, lw=1.2, label="median")
        axes.plot(u[shown], np.nanmax(stack[:, shown], axis=0), color=VERMILION, lw=0.8, label="greatest")
        axes.legend(loc="upper right")
    axes.set(
        title=f"distance from the reference, {len(curves)} moves",
        xlabel="time / $t_f$",
        ylabel="distance (mm)",
        ylim=(0, 1.35 * axes.get_ylim()[1]),
    )


def _errors(axes: Axes, moved: pd.DataFrame) -> None:
    axes.scatter(moved["t_f_s"], moved["max_error_mm"], s=4, color=BLUE, lw=0, alpha=0.5, label="greatest on the way")
    axes.scatter(moved["t_f_s"], moved["end_error_mm"], s=4, color=VERMILION, lw=0, alpha=0.5, label="on arrival")
    axes.axhline(0.8, color=BLUE, lw=0.7, ls=":")
    axes.axhline(0.1, color=VERMILION, lw=0.7, ls=":")
    axes.set(
        title=f"error of each of {len(moved)} moves; dotted: the limits",
        xlabel="duration $t_f$ (s)",
        ylabel="error (mm)",
        ylim=(0, max(1.2, axes.get_ylim()[1])),
    )
    axes.legend(loc="upper right")


def _entry(axes: Axes, moved: pd.DataFrame, workspace: Workspace) -> None:
    t_f = moved["t_f_s"].to_numpy(float)
    axes.scatter(t_f, moved["t_2mm_s"], s=4, color=BLUE, lw=0, alpha=0.5, label="measured")
    u = np.linspace(0, 1, 2001)
    inside = u[np.searchsorted(minimum_jerk(u)[0], 1 - workspace.cell.radius / workspace.cell.tile)]
    ends = np.array([t_f.min(), t_f.max()]) if len(t_f) else np.array([0.6, 1.2])
    axes.plot(ends, inside * ends, color=GREY, lw=0.8, label=f"Eq 2: {inside:.3f} $t_f$")
    axes.plot(ends, ends, color=GREY, lw=0.8, ls=":", label="$t_f$")
    radius = 1e3 * workspace.cell.radius
    axes.set(
        title=f"entry into the {radius:g} mm radius, {len(moved)} moves",
        xlabel="duration $t_f$ (s)",
        ylabel="time from onset (s)",
    )
    axes.legend(loc="upper left")


def timing(record: Telemetry, table: pd.DataFrame, spread: Mapping[str, Mapping[str, float]], path: Path) -> None:
    """Draw the distributions of trigger latency, control cycle and lateness behind the log."""
    with rc_context(PLACED):
        figure = Figure(figsize=(7.2, 2.6))
        axes = figure.subplots(1, 3)
        latency = table["trigger_latency_ms"].to_numpy(float)
        _histogram(axes[0], latency, spread.get("trigger_latency"), "motion onset after marker")
        _histogram(axes[1], 1e3 * np.diff(record.time), spread.get("cycle"), "control cycle")
        behind = table["behind_log_ms"].to_numpy(float)
        _histogram(axes[2], behind, spread.get("behind_log"), "onset interval less the log's")
        axes[0].set_ylabel("share")
        save(figure, path)


def _histogram(axes: Axes, values: np.ndarray, spread: Mapping[str, float] | None, title: str) -> None:
    known = values[np.isfinite(values)]
    axes.set_xlabel("time (ms)")
    if spread is None or not len(known):
        axes.set(title=title)
        axes.text(0.5, 0.5, "none", transform=axes.transAxes, ha="center", color=GREY)
        return
    # A distribution narrower than a tenth of a millisecond is shown as what it is, not as rounding noise.
    low, high = float(known.min()), float(known.max())
    room = max(0.1 * (high - low), 0.05)
    edges = np.linspace(low - room, high + room, 41)
    axes.hist(known, edges.tolist(), weights=np.full(len(known), 1 / len(known)), color=BLUE)
    axes.axvline(spread["median"], color=VERMILION, lw=0.8)
    # Adding zero turns what rounds to minus zero into zero.
    mean, sd, first, last = (round(float(spread[name]), 2) + 0.0 for name in ("mean", "sd", "p1", "p99"))
    about = f"n = {len(known)}, {mean:.2f} ± {sd:.2f} ms\n1 to 99 %: {first:.2f} to {last:.2f} ms"
    axes.set_title(f"{title}\n{about}")


def reach(workspace: Workspace, path: Path) -> None:
    """Draw the cell from the side, the smallest singular value over the tiles, and the joints' speed at t_f = 0.6 s."""
    with rc_context(PLACED):
        figure = Figure(figsize=(7.2, 2.7))
        axes = figure.subplots(1, 3, width_ratios=(1.15, 1, 1))
        _side(axes[0], workspace)
        _heat(axes[1], workspace.reach.singular_value, "smallest singular value\nof the Jacobian", "{:.2f}")
        _heat(axes[2], 100 * _speed_share(workspace, 0.6), "fastest joint at $t_f$ = 0.6 s\n(% of its limit)", "{:.0f}")
        save(figure, path)


def _side(axes: Axes, workspace: Workspace) -> None:
    cell, middle = workspace.cell, GRID // 2
    far = cell.near_edge + GRID * cell.tile
    axes.add_patch(Rectangle((-0.1, 0), 0.2, cell.base_height, color=PALE, lw=0))
    axes.add_patch(Rectangle((cell.near_edge, cell.screen_height - 0.04), far - cell.near_edge, 0.04, color=GREY, lw=0))
    low, high = workspace.box
    axes.add_patch(
        Rectangle((-high[0], low[2] + cell.base_height), high[0] - low[0], high[2] - low[2], fill=False, ec=VERMILION,
                  lw=0.7, ls="--")
    )  # fmt: skip
    for row, shade in ((0, 0.35), (middle, 1.0), (GRID - 1, 0.35)):
        q = workspace.reach.q[row, middle]
        points = kinematics.frames(q)[:, :3, 3]
        points = np.vstack([points, kinematics.forward(q, tool=cell.tool)[:3, 3]])
        axes.plot(-points[:, 0], points[:, 2] + cell.base_height, "o-", color=BLUE, alpha=shade, lw=1.6, ms=2.5)
    axes.axhline(0, color=GREY, lw=0.7)
    edge: dict[str, Any] = {"fontsize": 6.5, "ha": "center"}
    axes.text(0, cell.base_height / 2, "base", va="center", rotation=90, **edge)
    axes.text((cell.near_edge + far) / 2, cell.screen_height - 0.07, "screen", va="top", **edge)
    axes.text(-low[0], high[2] + cell.base_height + 0.02, "allowed space", color=VERMILION, **{**edge, "ha": "right"})
    axes.set(
        title="from the side, tool over the nearest,\nmiddle and farthest row",
        xlabel="distance from the base (m)",
        ylabel="height (m)",
        aspect="equal",
        xlim=(-0.2, 1.5),
        ylim=(-0.02, 1.5),
    )


def _heat(axes: Axes, values: np.ndarray, title: str, form: str) -> None:
    image = axes.imshow(values, cmap="viridis")
    middle = (values.min() + values.max()) / 2
    for (r, c), value in np.ndenumerate(values):
        colour = "white" if value < middle else "black"
        axes.text(c, r, form.format(value), ha="center", va="center", fontsize=6, color=colour)
    axes.set(title=title, xlabel="column", ylabel="row", xticks=range(GRID), yticks=range(GRID))
    image.set_clim(values.min(), max(values.max(), values.min() + 1e-9))


def _speed_share(workspace: Workspace, t_f: float) -> np.ndarray:
    ways = [
        ((r, c), (r + dr, c + dc))
        for r, c in np.ndindex(GRID, GRID)
        for dr, dc in ((0, 1), (1, 0), (0, -1), (-1, 0))
        if 0 <= r + dr < GRID and 0 <= c + dc < GRID
    ]
    speed, _ = workspace.move_peaks(np.array([w[0] for w in ways]), np.array([w[1] for w in ways]))
    share = (speed / t_f / np.array(MAX_SPEED)).max(axis=1)
    out = np.zeros((GRID, GRID))
    for (start, _), value in zip(ways, share, strict=True):
        out[start] = max(out[start], value)
    return out
