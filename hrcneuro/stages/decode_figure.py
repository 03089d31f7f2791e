"""The group's figure of decode: a forest plot, one row a subject, one panel a scenario and problem."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hrcneuro.decoding.group import PUBLISHED

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_INK, _SOFT, _MEAN, _PAPER = "#222222", "#8a8f98", "#b0246a", "#1f6fb4"


def draw(scores: pd.DataFrame, path: Path) -> None:
    """Save the forest plot of balanced accuracies.

    Args:
        scores: One decoder's rows of scores.parquet with a column ``subject``; only computed ones.
        path: The PNG file.
    """
    from matplotlib.figure import Figure

    panels = list(scores.groupby(["scenario", "problem"], sort=True))
    subjects = sorted(scores["subject"].unique())
    columns = min(len(panels), 4)
    lines = -(-len(panels) // columns)
    figure = Figure(figsize=(1.2 + 3.0 * columns, lines * (1.8 + 0.26 * len(subjects))), layout="constrained")
    axes = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True)
    for axis, ((scenario, problem), part) in zip(axes.flat, panels, strict=False):
        _panel(axis, part, subjects, (str(scenario), str(problem)))
    for axis in axes.flat[len(panels) :]:
        axis.set_axis_off()
    for axis in axes[-1]:
        axis.set_xlabel("balanced accuracy (%)")
    handles, texts = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, texts, loc="outside lower center", ncols=len(texts), frameon=False, fontsize=8)
    figure.savefig(path, dpi=120, metadata={"Software": None})


def _panel(axis: Axes, part: pd.DataFrame, subjects: list[str], key: tuple[str, str]) -> None:
    rows = np.array([len(subjects) - subjects.index(s) for s in part["subject"]])
    bacc = part["bacc"].to_numpy(dtype=float)
    half = 1.96 * _standard_error(part)
    axis.axvline(50, color=_SOFT, lw=1)
    axis.hlines(rows, bacc - half, bacc + half, color=_INK, lw=1)
    axis.plot(bacc, rows, "o", color=_INK, ms=4, label="subject, 95 % interval over trials")
    axis.plot(part["chance"], rows, "|", color=_SOFT, ms=9, mew=1.5, label="chance level (95 %)")
    spread = 1.96 * bacc.std(ddof=1) / np.sqrt(len(bacc)) if len(bacc) > 1 else 0.0
    axis.plot([bacc.mean() - spread, bacc.mean() + spread], [0, 0], color=_MEAN, lw=2)
    axis.plot(bacc.mean(), 0, "D", color=_MEAN, ms=6, label="mean, 95 % interval over subjects")
    published = PUBLISHED.get(key)
    # The paper prints no balanced accuracy; it is the mean of its TNR and TPR.
    mean = (published["tnr"][0] + published["tpr"][0]) / 2 if published else np.nan
    axis.plot(mean, 0, "D", mfc="none", mec=_PAPER, ms=9, label="published mean")
    axis.set_yticks([*range(len(subjects), 0, -1), 0], [*subjects, "mean"])
    axis.set_ylim(-0.8, len(subjects) + 0.8)
    classes = part.iloc[0]
    axis.set_title(f"{key[0]}: {classes['class1']} vs {classes['class2']}", fontsize=9)
    axis.spines[["top", "right"]].set_visible(False)
    axis.tick_params(axis="y", length=0)


def _standard_error(part: pd.DataFrame) -> np.ndarray:
    """Return the standard error of balanced accuracy from the two classes' sizes, in percent."""
    terms = [part[rate] * (100 - part[rate]) / part[size] for rate, size in (("tnr", "n1"), ("tpr", "n2"))]
    return np.sqrt(terms[0] + terms[1]).to_numpy(dtype=float) / 2
