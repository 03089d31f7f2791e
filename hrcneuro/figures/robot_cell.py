"""The figure of the cell: where arm, screen and subject stand, and how well the arm reaches the tiles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from hrcneuro.figures.style import BLUE, GREY, INK, PALE, PLACED, VERMILION, save
from hrcneuro.paradigm.design import T_F_S
from hrcneuro.paradigm.grid import CENTRE, SIZE
from hrcneuro.robot import kinematics
from hrcneuro.robot.cell import Cell


def reach(tiles: pd.DataFrame, cell: Cell, path: Path) -> None:
    """Draw the cell from the side and from above, and, over its tiles, nearness to singularities and joint speeds.

    Args:
        tiles: Rows of reach.parquet.
        cell: Where table, screen and arm stand.
        path: Of the PNG; the PDF lies beside it.
    """
    grid = tiles.sort_values(["row", "col"])
    q = grid[[f"q_{i}_rad" for i in range(1, 7)]].to_numpy(float).reshape(SIZE, SIZE, 6)
    with rc_context(PLACED):
        figure = Figure(figsize=(7.2, 6.0))
        axes = figure.subplots(2, 2, height_ratios=(1.12, 1))
        _side(axes[0, 0], cell, q)
        _above(axes[0, 1], cell, q)
        least = grid["singular_value"].to_numpy(float).reshape(SIZE, SIZE)
        _heat(axes[1, 0], least, "{:.2f}", "C   distance from singularities", figure,
              f"smallest singular value (allowed: ≥ {cell.min_singular_value:g})")  # fmt: skip
        share = 100 * grid["speed_share"].to_numpy(float).reshape(SIZE, SIZE)
        _heat(axes[1, 1], share, "{:.0f}", f"D   quickest joint of the moves from a tile in {T_F_S[0]:g} s", figure,
              "% of the joint's greatest speed")  # fmt: skip
        save(figure, path)


def _side(axes: Axes, cell: Cell, q: np.ndarray) -> None:
    middle = SIZE // 2
    far = cell.near_edge + SIZE * cell.tile
    axes.add_patch(Rectangle((-0.1, 0), 0.2, cell.base_height, color=PALE, lw=0))
    axes.add_patch(Rectangle((cell.near_edge, cell.screen_height - 0.04), far - cell.near_edge, 0.04, color=GREY, lw=0))
    low, high = cell.box
    axes.add_patch(Rectangle((-high[0], low[2] + cell.base_height), high[0] - low[0], high[2] - low[2], fill=False,
                             ec=VERMILION, lw=0.9, ls="--"))  # fmt: skip
    for row, shade in ((0, 0.35), (SIZE - 1, 0.35), (middle, 1.0)):
        points = kinematics.frames(q[row, middle])[:, :3, 3]
        points = np.vstack([points, kinematics.forward(q[row, middle], tool=cell.tool)[:3, 3]])
        axes.plot(-points[:, 0], points[:, 2] + cell.base_height, "o-", color=BLUE, alpha=shade, lw=1.6, ms=2.5)
    axes.axhline(0, color=INK, lw=0.7)
    text: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 6.5, "color": INK}
    axes.text(0, cell.base_height / 2, "stand", **text)
    axes.text((cell.near_edge + far) / 2, cell.screen_height - 0.09, "screen", **text)
    axes.text(
        -low[0], high[2] + cell.base_height + 0.04, "keep-inside box", **(text | {"ha": "right", "color": VERMILION})
    )
    axes.set(title="A   from the side: nearest, middle and farthest row", xlabel="distance from the arm's axis (m)",
             ylabel="height above the floor (m)", aspect="equal", xlim=(-0.2, 1.5), ylim=(-0.02, 1.5))  # fmt: skip


def _above(axes: Axes, cell: Cell, q: np.ndarray) -> None:
    # Up the page is the arm's left, −y of its base; so this is the view from above, not from below.
    edge = SIZE * cell.tile / 2
    low, high = cell.box
    beyond, below = 0.035 - low[0], -high[1] - 0.035
    text: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 6.5, "color": INK}
    for r, c in np.ndindex(SIZE, SIZE):
        x, y, _ = cell.position(r, c)
        corner = (-x - cell.tile / 2, -y - cell.tile / 2)
        axes.add_patch(Rectangle(corner, cell.tile, cell.tile, fill=False, ec=GREY, lw=0.5))
        if c == 0:
            axes.text(-x, below, str(r), **(text | {"fontsize": 5.5}))
        if r == 0:
            axes.text(beyond, -y, str(c), **(text | {"fontsize": 5.5}))
    box = Rectangle((-high[0], -high[1]), high[0] - low[0], high[1] - low[1], fill=False, ec=VERMILION, lw=0.9, ls="--")
    axes.add_patch(box)
    for tile, shade in (((0, 0), 0.35), ((SIZE - 1, SIZE - 1), 0.35), (CENTRE, 1.0)):
        points = np.vstack([kinematics.frames(q[tile])[:, :3, 3], cell.position(*tile)])
        axes.plot(-points[:, 0], -points[:, 1], "o-", color=BLUE, alpha=shade, lw=1.6, ms=2.5)
    axes.add_patch(Circle((0, 0), 0.1, color=PALE, lw=0, zorder=0))
    axes.text(0, -0.14, "arm", **text)
    axes.text(beyond + 0.055, cell.sideways, "column", rotation=90, **text)
    axes.text(beyond + 0.15, cell.sideways, "subject", rotation=90, **text)
    axes.text(cell.near_edge + edge, below - 0.055, "row", **text)
    axes.set(title="B   from above: two corners and the middle", xlabel="distance from the arm's axis (m)",
             ylabel="to the arm's left (m)", aspect="equal", xlim=(-0.2, 1.55),
             ylim=(below - 0.15, 0.15 - below))  # fmt: skip


def _heat(axes: Axes, values: np.ndarray, form: str, title: str, figure: Figure, unit: str) -> None:
    image = axes.imshow(values, cmap="cividis")
    image.set_clim(values.min(), max(values.max(), values.min() + 1e-9))
    for (r, c), value in np.ndenumerate(values):
        colour = "white" if value < (values.min() + values.max()) / 2 else "black"
        axes.text(c, r, form.format(value), ha="center", va="center", fontsize=6, color=colour)
    axes.set(title=title, xlabel="column (tiles)", ylabel="row (tiles)", xticks=range(SIZE), yticks=range(SIZE))
    figure.colorbar(image, ax=axes, shrink=0.85, label=unit)
