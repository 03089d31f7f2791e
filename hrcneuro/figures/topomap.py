"""Scalp maps, seen from above: spherical splines (Perrin et al. 1989) between the electrodes.

The view is azimuthal and equidistant, as in EEGLAB and MNE: the distance from the middle is the angle from the vertex.
The head's outline lies at 90°, or just beyond the lowest electrode. A map is one product with a matrix that depends on
the electrodes alone, and a row of maps is one picture, one set of contour lines and one of outlines: MNE's
``plot_topomap`` triangulates anew and makes an Axes for every map.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.path import Path
from numpy.typing import NDArray

from hrcneuro.eeg import interpolation

Floats = NDArray[np.float64]

# Fewer electrodes cannot be interpolated to a map.
FEWEST = 4
_PIXELS = 72  # across a map, before smoothing
_CENTRES = (np.arange(_PIXELS) + 0.5) / _PIXELS * 2 - 1
# A map shows what was measured: MNE's 1e-5, made for bad channels, would leave one electrode half of its own value.
_SMOOTHING = 1e-8
_LEVELS = (-0.6, -0.2, 0.2, 0.6)  # contour lines, as shares of the colours' limit
# Straight below the vertex an angle has no direction any more; no electrode lies there.
_LOWEST = 0.95 * np.pi


@dataclass(frozen=True)
class Topography:
    """The scalp at one time.

    Attributes:
        time: From the onset, s.
        values: ndarray, shape (n_channels,), µV.
        marked: Which electrodes to mark, ndarray, shape (n_channels,).
        title: Above it, in place of the time.
    """

    time: float
    values: Floats
    marked: NDArray[np.bool_] | None = None
    title: str = ""


def peak_title(time_s: float, channel: str) -> str:
    """Return the title of the map at the largest value of all: when, and at which channel."""
    return f"{_ms(time_s)}, {channel}"


def _ms(time_s: float) -> str:
    return f"{1000 * time_s:.0f} ms".replace("-", "\N{MINUS SIGN}")


@dataclass(frozen=True)
class Scalp:
    """Electrodes on a disc of radius 1, and how to interpolate between them.

    Attributes:
        rows: The electrodes' places among the channels, ndarray, shape (n_electrodes,).
        electrodes: Where they lie, ndarray, shape (n_electrodes, 2).
        matrix: Makes the disc's pixels (rows from the neck to the nose, flattened) of their values, ndarray, shape
            (n_pixels, n_electrodes).
    """

    rows: NDArray[np.intp]
    electrodes: Floats
    matrix: Floats

    @classmethod
    def of(cls, positions: Floats) -> Scalp | None:
        """Return the disc for channels at these positions, shape (n_channels, 3); None where too few are known.

        x points to the right ear, y to the nose, z to the vertex; a position that is not finite or zero is unknown.
        """
        known = np.flatnonzero(np.isfinite(positions).all(axis=1) & (positions != 0).any(axis=1))
        if len(known) < FEWEST:
            return None
        at = positions[known] - interpolation.sphere_centre(positions[known])
        electrodes = _from_above(at)
        radius = max(1.0, 1.03 * float(np.linalg.norm(electrodes, axis=1).max()))
        pixels = np.stack(np.meshgrid(_CENTRES, _CENTRES), axis=-1).reshape(-1, 2)
        matrix = interpolation.weights(at, _onto_sphere(pixels * radius), method="perrin", smoothing=_SMOOTHING)
        return cls(known, electrodes / radius, matrix)

    def image(self, values: Floats) -> Floats:
        """Return the map of the channels' values, shape (pixels, pixels), from the neck to the nose."""
        return (self.matrix @ values[self.rows]).reshape(_PIXELS, _PIXELS)

    def draw(self, axes: Axes, maps: Sequence[Topography], limit: float, *, slots: int, bar: bool) -> None:
        """Draw maps side by side into empty axes, in the middle of ``slots`` places, with a colour bar if wanted.

        Colours reach from ``-limit`` to ``limit``; a map's title is its time.
        """
        pixel = 2 / _PIXELS
        box = axes.get_position()
        shape = np.array([box.width, box.height]) * axes.get_figure(root=True).get_size_inches()  # type: ignore[union-attr]
        height = 2.6  # the nose and a title above
        width, bar_width = height * shape[0] / shape[1], 0.75
        gap = round(max(0.0, (width - bar_width - 2 * slots - 0.2) / max(1, slots - 1)) / pixel)
        pitch = (_PIXELS + gap) * pixel
        middles = 1.1 + pitch * (np.arange(len(maps)) + (slots - len(maps)) / 2)
        strip = np.zeros((_PIXELS, len(maps) * (_PIXELS + gap) - gap))
        for i, one in enumerate(maps):
            strip[:, i * (_PIXELS + gap) :][:, :_PIXELS] = self.image(one.values)
        self._colours(axes, strip, middles, limit)
        self._marks(axes, maps, middles)
        if bar:
            _bar(axes, width - 0.42, limit)
        axes.set(xlim=(0, width), ylim=(-1.02, height - 1.02))
        axes.set_axis_off()

    def _colours(self, axes: Axes, strip: Floats, middles: Floats, limit: float) -> None:
        disc = Path.unit_circle()
        discs = Path.make_compound_path(*(Path(np.asarray(disc.vertices) + [x, 0], disc.codes) for x in middles))
        left, right = middles[0] - 1, middles[-1] + 1
        image = axes.imshow(
            strip, cmap="RdBu_r", vmin=-limit, vmax=limit, origin="lower", aspect="auto", interpolation="bilinear",
            extent=(left, right, -1, 1),
        )  # fmt: skip
        columns = left + (np.arange(strip.shape[1]) + 0.5) * (right - left) / strip.shape[1]
        levels = [share * limit for share in _LEVELS]
        lines = axes.contour(columns, _CENTRES, strip, levels=levels, colors="k", linewidths=0.4)
        for drawn in (image, lines):
            drawn.set_clip_path(discs, axes.transData)

    def _marks(self, axes: Axes, maps: Sequence[Topography], middles: Floats) -> None:
        lines = [line + [x, 0] for x in middles for line in _head()]
        axes.add_collection(LineCollection(lines, colors="k", linewidths=0.8, capstyle="round"), autolim=False)
        at = [self.electrodes + [x, 0] for x in middles]
        plain: dict[str, Any] = dict(color="k", ls="none", marker="o", mew=0, zorder=3)
        axes.plot(*np.concatenate(at).T, ms=0.9, **plain)
        marked = [p[one.marked[self.rows]] for p, one in zip(at, maps, strict=True) if one.marked is not None]
        if marked:
            axes.plot(*np.concatenate(marked).T, **plain | dict(ms=2.6, mfc="w", mec="k", mew=0.4))
        for x, one in zip(middles, maps, strict=True):
            axes.text(x, 1.24, one.title or _ms(one.time), fontsize=7, ha="center")


def _bar(axes: Axes, left: float, limit: float) -> None:
    extent = (left, left + 0.13, -0.85, 0.85)
    axes.imshow(np.linspace(-1, 1, 128)[:, None], cmap="RdBu_r", origin="lower", aspect="auto", extent=extent)
    for share in (-1, 0, 1):
        text = f"{share * limit:.2g}".replace("-", "\N{MINUS SIGN}") if share else "0"
        axes.text(left + 0.2, share * 0.85, text, fontsize=6, va="center", clip_on=False)
    axes.text(left + 0.07, 0.97, "µV", fontsize=6, ha="center")


def _head() -> list[Floats]:
    """Return the lines of a head of radius 1: outline, nose, ears."""
    turn = np.linspace(0, 2 * np.pi, 73)
    outline = np.column_stack([np.cos(turn), np.sin(turn)])
    nose = np.array([[-0.17, 0.985], [0, 1.16], [0.17, 0.985]])
    bow = np.linspace(-1.25, 1.25, 17)
    ear = np.column_stack([0.975 + 0.11 * np.cos(bow), 0.24 * np.sin(bow)])
    return [outline, nose, ear, ear * [-1, 1]]


def _from_above(at: Floats) -> Floats:
    """Return points around the sphere's centre, shape (n, 3), as the view from above has them, shape (n, 2)."""
    angle = np.arctan2(np.hypot(at[:, 0], at[:, 1]), at[:, 2]) / (np.pi / 2)
    direction = np.arctan2(at[:, 1], at[:, 0])
    return np.column_stack([angle * np.cos(direction), angle * np.sin(direction)])


def _onto_sphere(flat: Floats) -> Floats:
    """Return the points of the unit sphere that the view from above shows at these places: its inverse."""
    distance = np.linalg.norm(flat, axis=1)
    angle = np.minimum(distance * np.pi / 2, _LOWEST)
    aside = np.divide(np.sin(angle), distance, out=np.zeros_like(distance), where=distance > 0)
    return np.column_stack([flat * aside[:, None], np.cos(angle)])
