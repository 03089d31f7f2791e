"""This run's figures on behaviour, trial counts and channels."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from hrcneuro import published
from hrcneuro.report.facts import steps
from hrcneuro.report.results import Results
from hrcneuro.report.verdicts import Measured, near, spread

# How far two mean durations may lie apart: a fiftieth of the durations' range.
_TRIAL_MARGIN_MS = 12.0
# And their SDs: subjects of one study differ by a twentieth.
_SD_SHARE = 0.1
# "About half", in per cent: what rounds to a half in tenths, and one more.
_HALF = (40.0, 60.0)
# What follows an error -> the cases of the pair that it makes with the next move.
_AFTER_MISTAKES = {"followed by a takeover": ("HR", "RH"), "corrected by the human": ("HH", "RH")}
_PAIRS = "which pairs of moves are counted as trials"


def measure(results: Results) -> dict[str, Measured]:
    """Return the key of a claim -> what this run has on it."""
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
    mean, sd = published.STEPS.value
    # A hundredth for the printed mean's rounding.
    margin = 2 * sd / np.sqrt(len(walked)) + 0.01
    distance = Measured(
        spread(walked, 2),
        bool(abs(walked.mean() - mean) <= margin),
        "behaviour",
        f"within {margin:.2f} of the printed mean",
        value=float(walked.mean()),
        unit="steps",
    )
    moves = pd.concat(list(trials.values()))
    return {"steps": distance, **_durations(moves), **_mistakes(moves)}


def _mistakes(moves: pd.DataFrame) -> dict[str, Measured]:
    """Return who moves after an error: its own partner, or the other one, who takes over."""
    after = moves.loc[moves["prev_error"].astype(bool), "case"].dropna().astype(str)
    if after.empty:
        return {}
    share = {name: 100 * float(after.isin(cases).mean()) for name, cases in _AFTER_MISTAKES.items()}
    text = ", ".join(f"{name} {value:.0f} %" for name, value in share.items())
    agrees = all(0 < value < 100 for value in share.values())
    why = "each happens, none always"
    value, unit = next(iter(share.values())), "% followed by a takeover"
    said = f"of {len(after)} mistakes: {text}"
    return {"mistakes": Measured(said, agrees, "behaviour", why, value=value, unit=unit)}


def _durations(moves: pd.DataFrame) -> dict[str, Measured]:
    measured = {}
    for scenario, printed in published.SOA_MS.items():
        mean, sd = printed.value
        soa = 1000 * moves.loc[moves["scenario"] == scenario, "soa_s"].dropna().to_numpy(float)
        if len(soa):
            alike = abs(soa.std(ddof=1) - sd) <= _SD_SHARE * sd if len(soa) > 1 else False
            agrees = abs(soa.mean() - mean) <= _TRIAL_MARGIN_MS and alike
            why = f"within {_TRIAL_MARGIN_MS:g} ms of the printed mean and {100 * _SD_SHARE:g} % of the printed SD"
            text, value = f"{spread(soa, 1)} ms", float(soa.mean())
            measured[f"soa {scenario}"] = Measured(text, bool(agrees), "eeg", why, value=value, unit="ms")
    whole = moves["soa_s"].dropna().to_numpy(float)
    if len(whole):
        agrees = 1.5 <= whole.mean() < 2.5
        why = "a mean that rounds to 2 s; 2.3.1 prints less than one"
        text, value = f"{spread(whole, 2)} s", float(whole.mean())
        measured["soa 2 s"] = Measured(text, bool(agrees), "eeg", why, value=value, unit="s")
    return measured


def _counts(tables: Mapping[str, pd.DataFrame], *, exact: bool) -> dict[str, Measured]:
    tables = {u: t for u, t in tables.items() if len(t) and set(t["scenario"]) & {"sC", "iC"}}
    if not tables:
        return {}
    measured = {}
    for case, printed in published.TRIALS.items():
        mean, sd = printed.value
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
        value = float(np.mean([k.mean() for k in kept.values()]))
        measured[f"trials {case}"] = Measured(
            text, agrees, "behaviour", why, reading=_PAIRS, value=value, unit="trials a subject"
        )
    return {**measured, **_halves(pd.concat(list(tables.values())))}


def _halves(counts: pd.DataFrame) -> dict[str, Measured]:
    """Return how many trials of each condition are of sC: the paper halves the conditions, not their sum."""
    before = counts[counts["position"] == "before"]
    kept = before.groupby(["case", "scenario"], observed=True)["kept"].sum().unstack(fill_value=0)
    whole = kept.sum(axis=1)
    share = (100 * kept.get("sC", 0 * whole) / whole)[whole > 0]
    if share.empty:
        return {}
    cases = [case for case in published.TRIALS if case in share]
    together = 100 * float(kept.get("sC", 0 * whole).sum() / whole.sum())
    text = ", ".join(f"{case} {share[case]:.0f} %" for case in cases) + f"; all together {together:.0f} %"
    low, high = _HALF
    agrees = bool(share[cases].between(low, high).all())
    why = f"each condition between {low:g} and {high:g} %"
    return {"half": Measured(text, agrees, "behaviour", why, value=together, unit="% in sC")}


def _channels(results: Results) -> dict[str, Measured]:
    measured = {}
    tables = results.tables("preprocess", "quality.parquet")
    replaced = [int(t["interpolated"].fillna(False).astype(bool).sum()) for t in tables.values()]
    if replaced:
        fewest, most = published.REPLACED_CHANNELS.value
        agrees = fewest <= min(replaced) and max(replaced) <= most
        text, mean = f"{min(replaced)} to {max(replaced)}", float(np.mean(replaced))
        measured["replaced"] = Measured(
            text, agrees, "eeg", "within the printed range", value=mean, unit="channels a subject"
        )
    units = results.units("epoch")
    summaries = {u: results.summary("epoch", u) for u in units}
    if not units:
        return measured
    outliers = [u for u in units if summaries[u].get("outlier")]
    text = f"{len(outliers)} ({', '.join(outliers)})" if outliers else "0"
    alone, value = outliers == [*published.OUTLIERS.value], float(len(outliers))
    measured["outlier"] = Measured(text, alone, "eeg", "s07 alone", value=value, unit="subjects")
    # The paper excludes for the amplitude alone; an epoch cut by a boundary, say, is another matter.
    reasons = [summaries[u].get("reasons", {}) for u in units if u in results.settings.included]
    lost = sum(int(why.get("amplitude", 0)) for why in reasons)
    others = sum(sum(why.values()) for why in reasons) - lost
    text = f"{lost} ({others} for other reasons)" if others else str(lost)
    agrees = lost == published.REJECTED_EPOCHS.value
    why = "none for its amplitude"
    measured["rejected"] = Measured(text, agrees, "eeg", why, value=float(lost), unit="epochs")
    return measured
