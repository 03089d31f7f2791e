"""How the figures of erp and ersp look: colours, the shaded time of the next onset, deterministic files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path as Outline

STYLE: dict[Any, Any] = {
    "font.size": 8,
    "axes.titlesize": 8.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "legend.frameon": False,
    "legend.fontsize": 7,
    "hatch.linewidth": 0.4,
}
GREY = "#767676"
# The paper's pair, blue for robot and magenta for human takeovers, then others that stay apart for the colour-blind.
COLOURS = ("#2166ac", "#c51b7d", "#1b7837", "#d95f02", "#5e3c99", "#8c510a")
CONTINUATION = "#6e6e6e"


def save(figure: Figure, path: Path) -> None:
    """Write a PNG whose bytes depend on the picture alone."""
    figure.savefig(path, dpi=170, metadata={"Software": None})


def colours(names: Sequence[str]) -> dict[str, str]:
    """Return a colour a condition; those that differ only after the first underscore share one."""
    families = list(dict.fromkeys(name.split("_")[0] for name in names))
    return {name: COLOURS[families.index(name.split("_")[0]) % len(COLOURS)] for name in names}


def shade_gap(
    axes: Axes, gap_s: float, stop_s: float, *, above: bool = False, starts_ms: Sequence[float] = (0.0,)
) -> None:
    """Hatch the time (ms) after the shortest gap between onsets, below or above all else: responses may overlap.

    ``starts_ms`` are the onsets' places where several maps share the axes.
    """
    if math.isfinite(gap_s) and gap_s < stop_s:
        spans = [(start + gap_s * 1000, start + stop_s * 1000) for start in starts_ms]
        whole = [Outline([(a, 0), (b, 0), (b, 1), (a, 1), (a, 0)], closed=True) for a, b in spans]
        # One patch, since a PDF's hatches heed the transparency of patches alone.
        ink: Any = dict(edgecolor="k", alpha=0.16, zorder=4) if above else dict(edgecolor="0.86", zorder=0.5)
        place: Any = dict(transform=axes.get_xaxis_transform(), facecolor="none", hatch="////", lw=0)
        axes.add_patch(PathPatch(Outline.make_compound_path(*whole), **place, **ink))


def legend_below(figure: Figure, patches: list[Patch], gap_s: float) -> None:
    """Explain the shadings in a line at the foot of the figure."""
    if math.isfinite(gap_s):
        text = f"the next onset may fall here (shortest gap {gap_s * 1000:.0f} ms)"
        patches = [*patches, Patch(facecolor="none", edgecolor="0.75", hatch="////", lw=0, label=text)]
    if patches:
        place = (0.1 / figure.get_figwidth(), 0.2 / figure.get_figheight())
        figure.legend(
            handles=patches,
            loc="lower left",
            bbox_to_anchor=place,
            ncol=len(patches),
            fontsize=6.5,
            borderaxespad=0,
            borderpad=0,
        )
