"""The numbers that the paper prints, beside those of this run.

Published: Ehrlich et al. 2023, PLoS ONE 18(7) e0287958, doi:10.1371/journal.pone.0287958.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrcneuro.report.results import Results

COUNTS = {"HH": (611, 43), "HR": (148, 14), "RR": (530, 25), "RH": (212, 22)}  # 2.5.1
TRIAL_MS = {"sC": (875.88, 133.91), "iC": (872.34, 131.35)}  # 2.3.1
REPLACED = (3, 6)  # 2.3.3
CHANCE = 54.3  # 2.6.2
TABLE_2 = {
    ("sC", "HHvsHR"): {"tnr": (52.0, 3.7), "tpr": (51.4, 5.1), "acc": (51.9, 3.7)},
    ("sC", "RRvsRH"): {"tnr": (52.9, 2.6), "tpr": (53.3, 5.3), "acc": (53.0, 3.0)},
    ("iC", "HHvsHR"): {"tnr": (51.5, 3.4), "tpr": (51.4, 3.5), "acc": (51.4, 3.3)},
    ("iC", "RRvsRH"): {"tnr": (57.9, 4.3), "tpr": (56.1, 3.2), "acc": (57.1, 3.7)},
}
SIM1 = {"35": 0.70, "100": 0.80}  # 3.3


@dataclass(frozen=True)
class Row:
    """One line of the table: where the paper prints it, what, the two figures, and what to make of them."""

    place: str
    what: str
    published: str
    ours: str
    verdict: str


def rows(results: Results) -> list[Row]:
    """Return the comparison, line by line; what has not run is left out."""
    parts: tuple[Callable[[Results], Iterator[Row]], ...] = (_counts, _timing, _channels, _decoding, _learning)
    return [row for part in parts for row in part(results)]


def _counts(results: Results) -> Iterator[Row]:
    totals = [results.summary("epoch", u).get("total", {}) for u in results.included("epoch")]
    planted = results.reality[0] == "synthetic"
    for case, (mean, sd) in COUNTS.items():
        ours = [t[case] for t in totals if case in t]
        if ours:
            near = abs(np.mean(ours) - mean) <= sd
            verdict = "by construction" if planted else "agrees" if near else "differs"
            yield Row("2.5.1", f"trials {case} a subject", f"{mean} ± {sd}", _spread(ours, 1), verdict)


def _timing(results: Results) -> Iterator[Row]:
    pooled: dict[str, list[np.ndarray]] = {}
    for unit in results.included("acquire"):
        trials = results.table("acquire", unit, "trials.parquet")
        if trials is None or not trials["scenario"].notna().any():
            continue
        main = trials[~trials["practice"].astype(bool) & trials["soa_s"].notna()]
        for scenario, rows_of in main.groupby("scenario", observed=True):
            pooled.setdefault(str(scenario), []).append(rows_of["soa_s"].to_numpy(float) * 1000)
    planted = results.reality[0] in ("synthetic", "semi-synthetic")
    for scenario, (mean, sd) in TRIAL_MS.items():
        if scenario in pooled:
            soa = np.concatenate(pooled[scenario])
            verdict = "by construction" if planted else "agrees" if abs(soa.mean() - mean) <= 20 else "differs"
            yield Row("2.3.1", f"trial duration, {scenario}", f"{mean} ± {sd} ms", f"{_spread(soa, 1)} ms", verdict)


def _channels(results: Results) -> Iterator[Row]:
    tables = [results.table("preprocess", u, "quality.parquet") for u in results.included("preprocess")]
    replaced = [int(t["interpolated"].fillna(False).astype(bool).sum()) for t in tables if t is not None]
    if replaced:
        low, high = REPLACED
        verdict = "agrees" if low <= min(replaced) and max(replaced) <= high else "differs"
        ours = f"{min(replaced)} to {max(replaced)}"
        yield Row("2.3.3", "channels replaced a subject", f"{low} to {high}", ours, verdict)


def _decoding(results: Results) -> Iterator[Row]:
    subjects = [results.summary("decode", u) for u in results.included("decode")]
    planted = results.reality[0] != "real"
    chances = []
    for (scenario, problem), measures in TABLE_2.items():
        found = [s[scenario][problem] for s in subjects if problem in s.get(scenario, {})]
        found = [f for f in found if f.get("acc") is not None]
        chances += [f["chance"] for f in found]
        for measure, (mean, sd) in measures.items():
            ours = [f[measure] for f in found]
            if ours:
                # The planted effect lies in one problem; the others must stay at chance.
                near = abs(np.mean(ours) - mean) <= max(sd, 2.5)
                verdict = ("by construction" if planted else "agrees") if near else "differs"
                what = f"{measure.upper()}, {problem}, {scenario}"
                yield Row("Table 2", what, f"{mean} ± {sd} %", f"{_spread(ours, 1)} %", verdict)
    if chances:
        verdict = "agrees" if abs(np.mean(chances) - CHANCE) <= 0.5 else "differs"
        yield Row("2.6.2", "chance level", f"{CHANCE} %", f"{np.mean(chances):.2f} %", verdict)


def _learning(results: Results) -> Iterator[Row]:
    curve = results.summary("simulate").get("SIM1", {}).get("emp", {})
    for episode, published in SIM1.items():
        if episode in curve:
            ours = curve[episode]
            verdict = "agrees" if abs(ours - published) <= 0.03 else "differs"
            what = f"SIM1, choice accuracy at episode {episode}"
            yield Row("3.3", what, f"about {100 * published:.0f} %", f"{100 * ours:.1f} %", verdict)


def _spread(values: Any, digits: int) -> str:
    values = np.asarray(values, float)
    sd = f" ± {values.std(ddof=1):.{digits}f}" if len(values) > 1 else ""
    return f"{values.mean():.{digits}f}{sd}"
