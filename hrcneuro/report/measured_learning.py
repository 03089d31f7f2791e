"""This run's figures on the robot that learns (paper 3.3)."""

from __future__ import annotations

import numpy as np
import pandas as pd

from hrcneuro.report.results import Results
from hrcneuro.report.verdicts import REPETITIONS, Measured

SIM1 = {35: (0.70, 6.0), 100: (0.80, 17.0)}
# The episodes over which SIM4's curves are compared: where they still rise.
_EARLY = 40


def measure(results: Results) -> dict[str, Measured]:
    """Return result key -> what this run has."""
    curves = results.table("simulate", "group", "curves.parquet")
    if curves is None or curves.empty:
        return {}
    events = results.settings.sections["simulate"].events
    found = {**_first(curves), **_second(curves), **_third(results), **_fourth(curves), **_minutes(events)}
    return found


def _first(curves: pd.DataFrame) -> dict[str, Measured]:
    found = {}
    for episode, (level, _) in SIM1.items():
        here = curves[(curves["simulation"] == "SIM1") & (curves["variant"] == "emp") & (curves["episode"] == episode)]
        if here.empty:
            continue
        mean, sd, n = (float(here[c].iloc[0]) for c in ("mean", "sd", "n"))
        margin = 2 * sd * np.sqrt(1 / REPETITIONS + 1 / n)
        text = f"{100 * mean:.1f} ± {200 * sd / np.sqrt(n):.1f} %"
        why = f"within {100 * margin:.1f} of the printed figure, twice the Monte-Carlo error of the difference"
        found[f"sim {episode}"] = Measured(text, bool(abs(mean - level) <= margin), "model", why)
    return found


def _minutes(events: int) -> dict[str, Measured]:
    """Return the paper's own arithmetic: so many episodes, at 1 and at 2 s a trial."""
    printed = {35: (5.5, 6.5), 100: (16.5, 17.5), 40: (6.0, 7.0)}
    found = {}
    for episodes, (low, high) in printed.items():
        minutes = {s: episodes * events * s / 60 for s in (1, 2)}
        text = f"{minutes[2]:.1f} min at 2 s, {minutes[1]:.1f} at 1 s a trial"
        agrees = low <= minutes[2] <= high
        fits = (
            "the printed minutes, which 1 s a trial would give" if low <= minutes[1] <= high else "the printed minutes"
        )
        found[f"minutes {episodes}"] = Measured(text, agrees, "arithmetic", fits)
    return found


def _second(curves: pd.DataFrame) -> dict[str, Measured]:
    sim = curves[curves["simulation"] == "SIM2"]
    means = {str(v): float(part["mean"].mean()) for v, part in sim.groupby("variant", observed=True)}
    found = {}
    if {"50", "emp", "60", "70", "80"} <= set(means):
        order = sorted(means, key=lambda v: means[v])
        text = (
            " < ".join(f"{v.replace('emp', 'emp.')}: {100 * means[v]:.0f}" for v in order) + " % (mean over episodes)"
        )
        found["sim2"] = Measured(text, order == ["50", "emp", "60", "70", "80"], "model", "the same order")
    last = sim[sim["variant"] == "50"].tail(1)
    if len(last):
        mean, error = float(last["mean"].iloc[0]), float(last["sd"].iloc[0] / np.sqrt(last["n"].iloc[0]))
        text = f"{100 * mean:.1f} ± {200 * error:.1f} % at the end"
        found["sim2 50"] = Measured(text, abs(mean - 0.5) <= 3 * error, "model", "within three standard errors of 50 %")
    return found


def _third(results: Results) -> dict[str, Measured]:
    table = results.table("simulate", "group", "relearning.parquet")
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
    return {
        "sim3": Measured(text, bool(last["loss"] <= last["loss_half_width"]), "model", "no loss beyond its 95 % band")
    }


def _fourth(curves: pd.DataFrame) -> dict[str, Measured]:
    early = curves[curves["episode"] == _EARLY]
    at = {
        (str(s), str(v)): float(m) for s, v, m in zip(early["simulation"], early["variant"], early["mean"], strict=True)
    }
    found = {}
    sizes = (4, 6, 10)
    levels = ("emp", "60", "70", "80")
    keys = [[("SIM2", v), ("SIM4", f"6/3 {v}"), ("SIM4", f"10/5 {v}")] for v in levels]
    if all(k in at for row in keys for k in row):
        means = [float(np.mean([at[row[i]] for row in keys])) for i in range(len(sizes))]
        text = ", ".join(f"{n}: {100 * m:.0f} %" for n, m in zip(sizes, means, strict=True))
        found["sim4"] = Measured(
            f"{text} at episode {_EARLY}", means[0] > means[1] > means[2], "model", "falls with n, mean over decoders"
        )
    for key, case, sign in (("sim4 2", "10/2", 1), ("sim4 8", "10/8", -1)):
        pair = [("SIM4", f"{case} emp"), ("SIM4", "10/5 emp")]
        if all(k in at for k in pair):
            text = f"{100 * at[pair[0]]:.0f} % against {100 * at[pair[1]]:.0f} % at episode {_EARLY}"
            found[key] = Measured(text, sign * (at[pair[0]] - at[pair[1]]) > 0, "model", "empirical decoder")
    return found
