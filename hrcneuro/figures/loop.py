"""The figure of a closed loop: how well it learned, beside what coin flips would give, who did what, and when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hrcneuro.figures.style import BLUE, GREEN, GREY, INK, ORANGE, PALE, PLACED, SKY, VERMILION, save
from hrcneuro.learning import loop_scores as scores
from hrcneuro.learning.loop import CASES, STEPS, LoopSessions
from hrcneuro.learning.simulations import Curve

_HUMAN, _ROBOT = VERMILION, BLUE
_KINDS = {
    "human": ("person, own", _HUMAN),
    "taken": ("robot, the person's", ORANGE),
    "robot": ("robot, own", _ROBOT),
    "left": ("robot, own, left lying first", SKY),
    "diagonal": ("diagonal", PALE),
}
_SIM1 = (("-.", GREEN), ((0, (1, 1)), GREEN), (":", GREY))
_MOST_BINS = 26


@dataclass(frozen=True)
class LoopPicture:
    """What is drawn.

    Attributes:
        played: The sessions.
        null: The null model's, in the same mode, at the rates of the sessions; None: not drawn.
        independent: The same of decisions that do not depend on the truth; None: not drawn.
        sim1: What the rates of a curve of SIM1 are -> the curve.
        stages: Stage in words -> times since the onset, ms.
        deadline_ms: A decision that is sent later teaches nothing.
        note: What stands above all, as that it is synthetic.
    """

    played: LoopSessions
    null: LoopSessions | None = None
    independent: LoopSessions | None = None
    sim1: Mapping[str, Curve] = field(default_factory=dict)
    stages: Mapping[str, np.ndarray] = field(default_factory=dict)
    deadline_ms: float = float("nan")
    note: str = ""


def loop(picture: LoopPicture, path: Path) -> None:
    """Draw it: accuracy over episodes, over updates, by whose directions; steps; decisions by case; times.

    Args:
        picture: What is drawn.
        path: Of the PNG; the PDF lies beside it.
    """
    with rc_context(PLACED):
        figure = Figure(figsize=(7.4, 5.9))
        (top, lower) = figure.subplots(2, 3)
        _over_episodes(top[0], picture)
        _over_updates(top[1], picture)
        _by_rows(top[2], picture)
        _steps(lower[0], picture.played)
        _decisions(lower[1], picture)
        _times(lower[2], picture)
        if picture.note:
            figure.suptitle(picture.note, fontsize=8, color=VERMILION)
        save(figure, path)


def _over_episodes(axes: Axes, picture: LoopPicture) -> None:
    number = _episodes(picture.played)
    _curves(axes, number, [scores.accuracy(one) if one is not None else None for one in _three(picture)])
    for (name, curve), (dash, colour) in zip(picture.sim1.items(), _SIM1, strict=False):
        shown = curve.mean[: len(number)]
        axes.plot(number[: len(shown)], shown, ls=dash, lw=1.1, color=colour, label=f"SIM1, {name}")
    _accuracy_axes(axes, "A  all four directions", "closed episode", number[-1])
    axes.set_ylabel("choice accuracy")
    _legend_below(axes, ncols=2, handlelength=1.8)


def _over_updates(axes: Axes, picture: LoopPicture) -> None:
    last = max(min(_all_have(one) for one in _three(picture)[:2] if one is not None), 1)
    points = np.linspace(0, last, 60)
    drawn = [scores.against_updates(one, "all", points) if one is not None else None for one in _three(picture)]
    _curves(axes, points, drawn)
    for curve, (dash, colour) in zip(picture.sim1.values(), _SIM1, strict=False):
        taken = np.append(0, scores.sim1_updates(len(curve.mean)))
        here = taken <= last
        axes.plot(taken[here], np.append(0.5, curve.mean)[here], ls=dash, lw=1.1, color=colour)
    _accuracy_axes(axes, "B  against updates", "updates", last)
    if not any(np.isfinite(one).any() for one in drawn if one is not None):
        axes.text(0.5, 0.2, "owners were drawn anew", transform=axes.transAxes, ha="center", color=GREY)


def _by_rows(axes: Axes, picture: LoopPicture) -> None:
    number = _episodes(picture.played)
    for rows, colour, text in (("human", _HUMAN, "the person's two"), ("robot", _ROBOT, "the robot's two")):
        if picture.null is not None:
            null = scores.mean_over_sessions(scores.accuracy(picture.null, rows)).mean[: len(number)]
            axes.plot(number[: len(null)], null, "--", lw=0.9, color=colour)
        found = scores.mean_over_sessions(scores.accuracy(picture.played, rows))
        axes.plot(number, found.mean, lw=1.3, color=colour, label=text)
        axes.fill_between(number, found.low, found.high, color=colour, alpha=0.18, lw=0)
    if picture.null is not None:
        axes.plot([], [], "--", lw=0.9, color=GREY, label="null model")
    _accuracy_axes(axes, "C  by whose directions", "closed episode", number[-1])
    _legend_below(axes, ncols=2, handlelength=1.8)


def _curves(axes: Axes, x: np.ndarray, values: Sequence[np.ndarray | None]) -> None:
    played, null, independent = values
    assert played is not None
    if null is not None:
        band = scores.expected_mean(null, len(played))
        shown = min(len(x), len(band.mean))
        low, high = np.clip(band.low, 0, 1), np.clip(band.high, 0, 1)
        axes.fill_between(x[:shown], low[:shown], high[:shown], color=PALE, lw=0, label="null model, 95 %")
    if independent is not None:
        mean = scores.mean_over_sessions(independent).mean[: len(x)]
        axes.plot(x[: len(mean)], mean, "--", lw=0.9, color=GREY, label="independent of the truth")
    found = scores.mean_over_sessions(played)
    axes.fill_between(x, found.low, found.high, color=INK, alpha=0.18, lw=0)
    axes.plot(x, found.mean, lw=1.4, color=INK, label="played")


def _steps(axes: Axes, played: LoopSessions) -> None:
    per_episode = played.steps.sum(axis=0)
    bins = np.array_split(np.arange(len(per_episode)), min(_MOST_BINS, len(per_episode)))
    centre = np.array([one.mean() + 1 for one in bins])
    counts = np.array([per_episode[one].sum(axis=0) for one in bins], float)
    share = 100 * counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    below = np.zeros(len(bins))
    for kind, (text, colour) in _KINDS.items():
        part = share[:, STEPS.index(kind)]
        axes.bar(centre, part, [len(one) for one in bins], bottom=below, color=colour, label=text, lw=0)
        below = below + part
    axes.set(title="D  who made whose steps", xlabel="closed episode", ylabel="steps (%)", ylim=(0, 100))
    axes.set_xlim(0.5, len(per_episode) + 0.5)
    _legend_below(axes, ncols=2, handlelength=1.0)


def _decisions(axes: Axes, picture: LoopPicture) -> None:
    right = scores.rates_by_case(picture.played)
    said, true = scores.continuing(picture.played), scores.staying(picture.played)
    names = [f"{'TNR' if case[0] == case[1] else 'TPR'}\n{case}" for case in CASES] + ["stays\nR", "stays\nH"]
    place = np.arange(len(names))
    mean, half = np.append(right.mean, said.mean), np.append(right.half_width, said.half_width)
    colour = [_HUMAN if one in (2, 3, 5) else _ROBOT for one in place]
    for x, y, half_width, ink in zip(place, mean, np.nan_to_num(half), colour, strict=True):
        axes.errorbar(x, 100 * y, 100 * half_width, fmt="o", ms=3.5, lw=1.1, color=ink)
    axes.plot(place[4:], 100 * true.mean, "_", ms=12, color=GREY, label="as often as the person expects it")
    axes.axhline(50, color=GREY, lw=0.7, ls=":")
    axes.axvline(3.5, color=PALE, lw=0.8)
    axes.set_xticks(place, names, fontsize=6)
    axes.set(title="E  decisions that taught", ylabel="right, or said (%)", ylim=(-2, 104))
    _legend_below(axes, ncols=1, handlelength=1.0)


def _times(axes: Axes, picture: LoopPicture) -> None:
    there = {name: values for name, values in picture.stages.items() if len(values)}
    last = 0.0
    for row, values in enumerate(there.values()):
        middle, late, most = np.percentile(values, [50, 99, 100])
        axes.plot([values.min(), most], [row, row], lw=0.8, color=GREY)
        axes.plot([middle, late], [row, row], lw=3.5, color=BLUE, solid_capstyle="butt")
        axes.plot(middle, row, "|", ms=9, color=INK)
        axes.annotate(
            f"{middle:.0f} · {late:.0f} · {most:.0f}", (middle, row), xytext=(0, 6), textcoords="offset points",
            fontsize=6, ha="left",
        )  # fmt: skip
        last = max(last, most)
    if np.isfinite(picture.deadline_ms):
        axes.axvline(picture.deadline_ms, color=VERMILION, lw=0.9, label="deadline")
        _legend_below(axes, ncols=1, handlelength=1.0)
        last = max(last, picture.deadline_ms)
    axes.set_yticks(range(len(there)), [name.replace(" ", "\n", 1) for name in there], fontsize=6.5)
    axes.set(title="F  median · 99 % · most", xlabel="since the onset of tr−1 (ms)", ylim=(len(there) - 0.3, -0.7))
    if there:
        axes.set_xlim(right=last + 0.12 * (last - axes.get_xlim()[0]))
    else:
        axes.text(0.5, 0.5, "nothing was decided", transform=axes.transAxes, ha="center", color=GREY)


def _all_have(sessions: LoopSessions) -> int:
    """Return how many updates every session has made that was played to the end: fewer, where few go on, mislead."""
    whole = np.isfinite(sessions.policies[:, -1, 0])
    return int(sessions.updates[whole, -1].min())


def _three(picture: LoopPicture) -> tuple[LoopSessions | None, ...]:
    return picture.played, picture.null, picture.independent


def _episodes(sessions: LoopSessions) -> np.ndarray:
    return np.arange(1, sessions.policies.shape[1] + 1)


def _legend_below(axes: Axes, *, ncols: int, handlelength: float) -> None:
    # Curves may lie anywhere within the axes.
    axes.legend(
        loc="upper center", bbox_to_anchor=(0.5, -0.24), ncols=ncols, fontsize=6, handlelength=handlelength,
        columnspacing=0.8, labelspacing=0.3,
    )  # fmt: skip


def _accuracy_axes(axes: Axes, title: str, label: str, last: float) -> None:
    axes.axhline(0.5, color=GREY, lw=0.7, ls=":")
    limits: dict[str, Any] = {"ylim": (0.0, 1.02), "xlim": (0, last)}
    axes.set(title=title, xlabel=label, **limits)
