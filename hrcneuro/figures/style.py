"""How all figures look, and how they become files: one style, one palette, PNG and PDF whose bytes never wander."""

from __future__ import annotations

import contextlib
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from matplotlib import rc_context, rcParamsDefault
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.figure import Figure
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path as Outline

DPI = 200
_RULES = ("GSUB", "GPOS", "GDEF", "MATH", "BASE", "JSTF", "kern")  # tables of a font
_LETTER, _FOOT_LINE = 0.046, 0.115  # inches: of a note's letters, the mean width; from line to line
# What says where a window opens, or what a session does, is no style.
_NO_STYLE = ("backend", "interactive", "toolbar", "timezone", "webagg", "tk.", "docstring", "savefig.directory", "date")
# Matplotlib's defaults are named first: a reader's own matplotlibrc must not change a figure.
STYLE: dict[Any, Any] = {
    **{key: value for key, value in rcParamsDefault.items() if not key.startswith(_NO_STYLE)},
    "font.size": 8,
    "font.sans-serif": ["DejaVu Sans"],  # comes with Matplotlib: the same letters on every machine
    "axes.titlesize": 8.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "legend.frameon": False,
    "legend.fontsize": 7,
    "hatch.linewidth": 0.4,
    "pdf.fonttype": 42,  # letters that a journal's layouter can edit
}
# For figures whose parts Matplotlib may place itself; it draws them twice for that.
PLACED: dict[Any, Any] = {**STYLE, "axes.titlesize": 8, "figure.constrained_layout.use": True}

BLUE, VERMILION, ORANGE, SKY, GREEN, PURPLE = "#0072B2", "#D55E00", "#E69F00", "#56B4E9", "#009E73", "#CC79A7"
INK, GREY, PALE = "#222222", "#767676", "#DDDDDD"
# The paper's pair, blue for robot and magenta for human takeovers, then others that stay apart for the colour-blind.
COLOURS = ("#2166ac", "#c51b7d", "#1b7837", "#d95f02", "#5e3c99", "#8c510a")
CONTINUATION = "#6e6e6e"


def save(figure: Figure, path: Path) -> None:
    """Write a PNG and, beside it, a PDF whose bytes depend on the picture alone: no date, no version of a tool."""
    with rc_context(STYLE):
        # By the canvases themselves: ``savefig`` draws each file once more beforehand, for the parts to find their
        # places, which needs their sizes only; and where the PNG has put them the PDF leaves them.
        figure.dpi = DPI
        canvas = FigureCanvasAgg(figure)
        if (engine := figure.get_layout_engine()) is not None:
            engine.execute(figure)
        figure.set_layout_engine("none")
        # Packed less tightly: a twentieth larger, a fifth sooner.
        canvas.print_png(path, metadata={"Software": None}, pil_kwargs={"compress_level": 3})
        nothing = {"CreationDate": None, "Creator": None, "Producer": None}
        # The figure's resolution is that of what a PDF holds as pixels.
        with _bare_fonts():
            FigureCanvasPdf(figure).print_pdf(path.with_suffix(".pdf"), metadata=nothing)


@contextlib.contextmanager
def _bare_fonts() -> Iterator[None]:
    """Let fonts come into PDFs without their rules for joining and moving letters, which all stand where they belong.

    Reading those rules, of all scripts of the world, would take a sixth of a picture's time.
    """
    from fontTools.subset import Options

    known = getattr(Options, "_drop_tables_default", None)
    if known is None:
        yield
        return
    Options._drop_tables_default = [*known, *_RULES]
    try:
        yield
    finally:
        Options._drop_tables_default = known


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
    if gap_s < stop_s:
        spans = [(start + gap_s * 1000, start + stop_s * 1000) for start in starts_ms]
        whole = [Outline([(a, 0), (b, 0), (b, 1), (a, 1), (a, 0)], closed=True) for a, b in spans]
        # One patch, since a PDF's hatches heed the transparency of patches alone.
        ink: Any = dict(edgecolor="k", alpha=0.16, zorder=4) if above else dict(edgecolor="0.86", zorder=0.5)
        place: Any = dict(transform=axes.get_xaxis_transform(), facecolor="none", hatch="////", lw=0)
        axes.add_patch(PathPatch(Outline.make_compound_path(*whole), **place, **ink))


def foot_lines(note: str, width: float) -> list[str]:
    """Return the lines of a note at the foot of a figure that is so many inches wide."""
    return textwrap.wrap(note, max(30, int((width - 0.2) / _LETTER))) or [""]


def foot_height(lines: Sequence[str]) -> float:
    """Return how many inches more than for one line a foot of these lines takes."""
    return _FOOT_LINE * (len(lines) - 1)


def write_foot(figure: Figure, lines: Sequence[str]) -> None:
    """Write a note at the foot of a figure."""
    place = (0.1 / figure.get_figwidth(), 0.06 / figure.get_figheight())
    figure.text(*place, "\n".join(lines), fontsize=6.5, color=GREY, va="bottom", linespacing=1.2)


def legend_below(figure: Figure, patches: list[Patch], gap_s: float, stop_s: float, *, above: float = 0.0) -> None:
    """Explain the shadings in a line at the foot of the figure; the gap's where it ends before ``stop_s``.

    ``above`` are inches that the note below takes beyond its first line.
    """
    if gap_s < stop_s:
        text = f"the next onset may fall here (shortest gap {gap_s * 1000:.0f} ms)"
        patches = [*patches, Patch(facecolor="none", edgecolor="0.75", hatch="////", lw=0, label=text)]
    if patches:
        place = (0.1 / figure.get_figwidth(), (0.2 + above) / figure.get_figheight())
        figure.legend(
            handles=patches,
            loc="lower left",
            bbox_to_anchor=place,
            ncol=len(patches),
            fontsize=6.5,
            borderaxespad=0,
            borderpad=0,
        )
