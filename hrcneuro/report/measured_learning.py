"""This run's figures on the robot that learns (paper 3.3)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro import published
from hrcneuro.contract import GROUP
from hrcneuro.report.results import Results
from hrcneuro.report.verdicts import Measured

# Where SIM4's curves are compared. More subtasks are slower while all curves still rise: at episode 40 decoders of 60 %
# and more have caught up; of 60 seeds the order shows beyond its error in 56 at episode 5, in 41 at 10. How subtasks
# are shared shows late, with the empirical decoder, which learns slowly: at episode 100 in all 60.
_EARLY, _LATE = 5, 100
# What is notable of a loss, and of a difference between performances that are called comparable.
_NOTABLE = 0.05
# Half of the last printed digit of SIM1's figures.
_ROUNDED = 0.005
_FIRST_EVENT = (
    "no event before an episode's first one, a new sequence every episode, Eq 6 over all entries of q, accuracy as the "
    "mean of π"
)


def measure(results: Results) -> dict[str, Measured]:
    """Return the key of a claim -> what this run has on it."""
    curves = results.table("simulate", GROUP, "curves.parquet")
    if curves is None or curves.empty:
        return {}
    measured = {**_first(curves), **_second(curves), **_third(results), **_fourth(curves), **_minutes()}
    return _lacking(results.settings.sections["simulate"].episodes) | measured


def _lacking(episodes: int) -> dict[str, Measured]:
    """Return the figures for which so many episodes are too few."""
    needed = {"sim 35": 35, "sim 100": 100, "sim4": _EARLY, "sim4 2": _LATE, "sim4 8": _LATE, "sim4 balance": _LATE}
    return {
        key: Measured("-", None, "model", f"simulate.episodes = {episodes}, the figure is that of episode {last}")
        for key, last in needed.items()
        if episodes < last
    }


def _first(curves: pd.DataFrame) -> dict[str, Measured]:
    """Return SIM1's accuracy, judged only where this run's Monte-Carlo error tells the readings of the paper apart.

    The printed figures rest on 100 repetitions, whose error is several points, and the readings of 3.2 lie about one
    point apart: 20,000 repetitions give 70.1 and 80.2 %, with ``carry_over`` 71.1 and 81.1.
    """
    measured = {}
    for episode, printed in published.SIM1_ACCURACY.items():
        here = curves[(curves["simulation"] == "SIM1") & (curves["variant"] == "emp") & (curves["episode"] == episode)]
        if here.empty:
            continue
        mean, sd, n = (float(here[c].iloc[0]) for c in ("mean", "sd", "n"))
        error = 2 * sd / np.sqrt(n)
        agrees = _within(mean - printed.value, error, _ROUNDED)
        text = f"{100 * mean:.1f} ± {100 * error:.1f} %"
        why = f"within {100 * _ROUNDED:g} of the printed figure, Monte-Carlo error included"
        if agrees is None:
            needed = int(np.ceil((4 * sd / _ROUNDED) ** 2 / 1000) * 1000)
            why = (
                f"with {n:g} repetitions the figure is known to ± {100 * error:.1f} points, and readings of the paper "
                f"lie one apart; simulate.repetitions = {needed} would tell"
            )
        measured[f"sim {episode}"] = Measured(
            text, agrees, "model", why, reading=_FIRST_EVENT, value=100 * mean, unit="%"
        )
    return measured


def _within(difference: float, error: float, margin: float) -> bool | None:
    """Return whether a difference lies within a margin; None where its error, on both sides, leaves that open."""
    if abs(difference) + error <= margin:
        return True
    return False if abs(difference) - error > margin else None


def _minutes() -> dict[str, Measured]:
    """Return the paper's own arithmetic, whatever this run simulates: episodes of ten events at 1 and 2 s a trial."""
    measured = {}
    rounded = {n: (about.value - 0.5, about.value + 0.5) for n, about in published.SIM1_MINUTES.items()}
    for episodes, (low, high) in (rounded | {n: p.value for n, p in published.SIM3_MINUTES.items()}).items():
        minutes = {s: episodes * published.EVENTS.value * s / 60 for s in (1, 2)}
        text = f"{minutes[2]:.1f} min at 2 s, {minutes[1]:.1f} at 1 s a trial"
        agrees = low <= minutes[2] <= high
        fits = (
            "the printed minutes, which 1 s a trial would give" if low <= minutes[1] <= high else "the printed minutes"
        )
        measured[f"minutes {episodes}"] = Measured(text, agrees, "arithmetic", fits, value=minutes[2], unit="min")
    return measured


def _second(curves: pd.DataFrame) -> dict[str, Measured]:
    sim = curves[curves["simulation"] == "SIM2"]
    means = {str(v): float(part["mean"].mean()) for v, part in sim.groupby("variant", observed=True)}
    measured = {}
    if {"50", "emp", "60", "70", "80"} <= set(means):
        order = sorted(means, key=lambda v: means[v])
        text = (
            " < ".join(f"{v.replace('emp', 'emp.')}: {100 * means[v]:.0f}" for v in order) + " % (mean over episodes)"
        )
        measured["sim2"] = Measured(text, order == ["50", "emp", "60", "70", "80"], "model", "the same order")
    last = sim[sim["variant"] == "50"].tail(1)
    if len(last):
        mean, error = float(last["mean"].iloc[0]), float(last["sd"].iloc[0] / np.sqrt(last["n"].iloc[0]))
        text = f"{100 * mean:.1f} ± {200 * error:.1f} % at the end"
        agrees, why = abs(mean - 0.5) <= 3 * error, "within three standard errors of 50 %"
        measured["sim2 50"] = Measured(text, agrees, "model", why, value=100 * mean, unit="%")
    return measured


def _third(results: Results) -> dict[str, Measured]:
    table = results.table("simulate", GROUP, "relearning.parquet")
    if table is None:
        return {}
    table = table[(table["variant"] == "emp") & (table["assignment"] > 1)]
    if table.empty:
        return {}
    last = table.iloc[-1]
    text = (
        f"{100 * last['loss']:.0f} ± {100 * last['loss_half_width']:.0f} points lost from the first to the last "
        f"assignment (empirical decoder)"
    )
    # A gain is no loss, however large.
    agrees = _within(max(float(last["loss"]), 0.0), float(last["loss_half_width"]), _NOTABLE)
    why = f"less than {100 * _NOTABLE:g} points lost, the 95 % band included"
    if agrees is None:
        why = f"the loss's 95 % band holds less and more than {100 * _NOTABLE:g} points: too few repetitions to tell"
    return {"sim3": Measured(text, agrees, "model", why, value=100 * float(last["loss"]), unit="points lost")}


def _fourth(curves: pd.DataFrame) -> dict[str, Measured]:
    early, late = _Point(curves, _EARLY), _Point(curves, _LATE)
    measured = {}
    cases = {4: "SIM2 {}", 6: "SIM4 6/3 {}", 10: "SIM4 10/5 {}"}
    means = {n: early.mean([case.format(v) for v in ("emp", "60", "70", "80")]) for n, case in cases.items()}
    steps = [_compared(means[a], means[b]) for a, b in ((4, 6), (6, 10))]
    if all(steps):
        text = ", ".join(f"{n}: {100 * m[0]:.0f} %" for n, m in means.items() if m)
        measured["sim4"] = _verdict(
            f"{text} at episode {_EARLY}", [s for s in steps if s], "falls with n, mean of decoders"
        )
    even = late.mean(["SIM4 10/5 emp"])
    for key, case, sign in (("sim4 2", "10/2", 1), ("sim4 8", "10/8", -1)):
        other = late.mean([f"SIM4 {case} emp"])
        step = _compared(other, even) if sign > 0 else _compared(even, other)
        if step and other and even:
            text = f"{100 * other[0]:.0f} % against {100 * even[0]:.0f} % at episode {_LATE}"
            measured[key] = _verdict(text, [step], "empirical decoder")
    return measured | _balance(late)


def _balance(late: _Point) -> dict[str, Measured]:
    """Return whether a share of two or eight subtasks of ten is learned as well as one of five."""
    means = {m: late.mean([f"SIM4 10/{m} emp"]) for m in (2, 5, 8)}
    steps = [d for d in (_compared(means[m], means[5]) for m in (2, 8)) if d]
    if not steps:
        return {}
    text = ", ".join(f"{m} of 10: {100 * mean[0]:.0f} %" for m, mean in means.items() if mean)
    shown = " and ".join(f"{100 * d:+.1f} ± {100 * margin:.1f}" for d, margin in steps)
    verdicts = [_within(d, margin, _NOTABLE) for d, margin in steps]
    agrees = False if False in verdicts else None if None in verdicts else True
    how = "no more than" if agrees is not None else "too few repetitions to tell whether it is more than"
    why = f"{how} {100 * _NOTABLE:g} points from 5 of 10, Monte-Carlo error included: {shown}, empirical decoder"
    farthest = 100 * max((d for d, _ in steps), key=abs)
    said = f"{text} at episode {_LATE}"
    return {"sim4 balance": Measured(said, agrees, "model", why, value=farthest, unit="points")}


class _Point:
    """The learning curves at one episode: mean accuracy and its squared standard error, by simulation and variant."""

    def __init__(self, curves: pd.DataFrame, episode: int) -> None:
        here = curves[curves["episode"] == episode]
        names = here["simulation"].astype(str) + " " + here["variant"].astype(str)
        squares = here["sd"].astype(float) ** 2 / here["n"]
        self._at = dict(zip(names, zip(here["mean"].astype(float), squares, strict=True), strict=True))

    def mean(self, names: Sequence[str]) -> tuple[float, float] | None:
        """Return the mean over curves and its squared standard error, or None where a curve is absent."""
        if not all(name in self._at for name in names):
            return None
        curves = np.array([self._at[name] for name in names])
        return float(curves[:, 0].mean()), float(curves[:, 1].sum() / len(names) ** 2)


def _compared(one: tuple[float, float] | None, other: tuple[float, float] | None) -> tuple[float, float] | None:
    """Return by how much one mean exceeds another, and twice the Monte-Carlo error of that."""
    if one is None or other is None:
        return None
    return one[0] - other[0], 2 * float(np.sqrt(one[1] + other[1]))


def _verdict(text: str, steps: Sequence[tuple[float, float]], why: str) -> Measured:
    """Return agreement where every difference exceeds its error; none can be told where one stays within it."""
    shown = ", ".join(f"{100 * d:.1f} ± {100 * margin:.1f}" for d, margin in steps)
    least: dict[str, Any] = {"value": 100 * min(d for d, _ in steps), "unit": "points"}
    if any(d < -margin for d, margin in steps):
        agrees: bool | None = False
    else:
        agrees = True if all(d > margin for d, margin in steps) else None
    if agrees is None:
        open_ = f"the difference, {shown} points, is within twice its Monte-Carlo error"
        return Measured(text, None, "model", open_, **least)
    told = f"{why}, by more than twice the Monte-Carlo error: {shown} points"
    return Measured(text, agrees, "model", told, **least)
