"""This run's figures on behaviour, timing, trial counts and channels."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from hrcneuro.published import SOA_MS
from hrcneuro.report.facts import steps
from hrcneuro.report.results import Results
from hrcneuro.report.verdicts import Measured, near, spread

COUNTS = {"HH": (611, 43), "HR": (148, 14), "RR": (530, 25), "RH": (212, 22)}
STEPS = (7.19, 0.39)
REPLACED = (3, 6)
# How far two mean durations may lie apart: a fiftieth of the durations' range.
_TRIAL_MARGIN_MS = 12.0
# And their SDs: subjects of one study differ by a twentieth.
_SD_SHARE = 0.1


def measure(results: Results) -> dict[str, Measured]:
    """Return result key -> what this run has."""
    trials = results.tables("acquire", "trials.parquet")
    trials = {u: t[~t["practice"].astype(bool)] for u, t in trials.items() if t["scenario"].notna().any()}
    return {
        **_moves(trials),
        **_counts(results.tables("epoch", "conditions.parquet"), exact=results.same_logs),
        **_channels(results),
    }


def _moves(trials: Mapping[str, pd.DataFrame]) -> dict[str, Measured]:
    if not trials:
        return {}
    walked = np.concatenate([steps(t) for t in trials.values()])
    margin = 2 * STEPS[1] / np.sqrt(len(walked))
    found = {
        "steps": Measured(
            spread(walked, 2),
            bool(abs(walked.mean() - STEPS[0]) <= margin + 0.01),
            "behaviour",
            f"within {margin + 0.01:.2f} of the printed mean",
        )
    }
    return found | _durations(pd.concat(list(trials.values())))


def _durations(moves: pd.DataFrame) -> dict[str, Measured]:
    found = {}
    for scenario, (mean, sd) in SOA_MS.items():
        soa = 1000 * moves.loc[moves["scenario"] == scenario, "soa_s"].dropna().to_numpy(float)
        if len(soa):
            alike = abs(soa.std(ddof=1) - sd) <= _SD_SHARE * sd if len(soa) > 1 else False
            agrees = abs(soa.mean() - mean) <= _TRIAL_MARGIN_MS and alike
            why = f"within {_TRIAL_MARGIN_MS:g} ms of the printed mean and {100 * _SD_SHARE:g} % of the printed SD"
            found[f"soa {scenario}"] = Measured(f"{spread(soa, 1)} ms", bool(agrees), "eeg", why)
    whole = moves["soa_s"].dropna().to_numpy(float)
    if len(whole):
        agrees = 1.5 <= whole.mean() < 2.5
        why = "a mean that rounds to 2 s; 2.3.1 prints less than one"
        found["soa 2 s"] = Measured(f"{spread(whole, 2)} s", bool(agrees), "eeg", why)
    return found


def _counts(tables: Mapping[str, pd.DataFrame], *, exact: bool) -> dict[str, Measured]:
    tables = {u: t for u, t in tables.items() if len(t) and set(t["scenario"]) & {"sC", "iC"}}
    if not tables:
        return {}
    found = {}
    for case, (mean, sd) in COUNTS.items():
        kept = {
            place: np.array(
                [t.loc[(t["case"] == case) & (t["position"] == place), "kept"].sum() for t in tables.values()], float
            )
            for place in ("before", "after")
        }
        if exact:
            agrees = all(abs(k.mean() - mean) < 1 for k in kept.values())
            why = "the paper's own logs: the printed mean to the trial"
        else:
            tests = [near(k, mean, sd) for k in kept.values()]
            agrees, why = all(ok for ok, _ in tests), tests[0][1]
        text = "; ".join(spread(k, 1) for k in kept.values())
        found[f"trials {case}"] = Measured(text, agrees, "behaviour", why)
    before = pd.concat([t[t["position"] == "before"] for t in tables.values()])
    share = 100 * before.loc[before["scenario"] == "sC", "kept"].sum() / before["kept"].sum()
    found["half"] = Measured(f"{share:.1f} %", bool(45 <= share <= 55), "behaviour", "between 45 and 55 %")
    return found


def _channels(results: Results) -> dict[str, Measured]:
    found = {}
    tables = results.tables("preprocess", "quality.parquet")
    replaced = [int(t["interpolated"].fillna(False).astype(bool).sum()) for t in tables.values()]
    if replaced:
        agrees = REPLACED[0] <= min(replaced) and max(replaced) <= REPLACED[1]
        found["replaced"] = Measured(f"{min(replaced)} to {max(replaced)}", agrees, "eeg", "within the printed range")
    units = results.units("epoch")
    summaries = {u: results.summary("epoch", u) for u in units}
    if not units:
        return found
    outliers = [u for u in units if summaries[u].get("outlier")]
    text = f"{len(outliers)} ({', '.join(outliers)})" if outliers else "0"
    found["outlier"] = Measured(text, outliers == ["s07"], "eeg", "s07 alone")
    # The paper excludes for the amplitude alone; an epoch cut by a boundary, say, is another matter.
    reasons = [summaries[u].get("reasons", {}) for u in units if u in results.settings.included]
    lost = sum(int(why.get("amplitude", 0)) for why in reasons)
    others = sum(sum(why.values()) for why in reasons) - lost
    text = f"{lost} ({others} for other reasons)" if others else str(lost)
    found["rejected"] = Measured(text, lost == 0, "eeg", "none for its amplitude")
    return found
