"""What one session gave, beside what a session of the study gives: counts and durations with limits for one subject.

:func:`hrcneuro.paradigm.rules.check_rules` judges twelve subjects together; here chance in a single session, of any
length, is allowed for: three standard errors, or three standard deviations between the logged subjects.
"""

from __future__ import annotations

from math import sqrt

import pandas as pd

from hrcneuro import published
from hrcneuro.paradigm.conditions import count_pairs
from hrcneuro.paradigm.rules import PAIR_COUNTS

_ERROR_RATE = 0.2956  # of moves after no error, in the logs' main blocks
_MOVES = (13.8, 5.2)  # of an episode, in the logs: mean and standard deviation
_BLOCKS_A_SCENARIO, _SPREAD = 6, 3.0
_SLACK_MS = 30.0  # how far an arm's own pace may be from the study's


def session_counts(trials: pd.DataFrame) -> pd.DataFrame:
    """Return one row a quantity: quantity, measured, low, high, ok.

    Args:
        trials: A session's trial table, as :func:`hrcneuro.paradigm.conditions.annotate` returns it. Without main
            blocks, the table is empty.
    """
    main = trials[~trials["practice"].astype(bool)]
    rows: list[dict[str, object]] = []
    if main.empty:
        return pd.DataFrame(columns=["quantity", "measured", "low", "high", "ok"])
    lengths = main.groupby(["block", "episode"], sort=False).size()
    _add(rows, "moves of an episode, mean", lengths.mean(), _MOVES[0], _SPREAD * _MOVES[1] / sqrt(len(lengths)))
    free = main[~main["prev_error"].astype(bool)]
    chance = sqrt(_ERROR_RATE * (1 - _ERROR_RATE) / len(free))
    _add(rows, "share of errors after no error", free["error"].mean(), _ERROR_RATE, _SPREAD * chance)
    pairs = count_pairs(main)
    for scenario, cases in PAIR_COUNTS.items():
        of_scenario = main[main["scenario"] == scenario]
        if of_scenario.empty:
            continue
        episodes = of_scenario.groupby(["block", "episode"]).ngroups
        part = episodes / (_BLOCKS_A_SCENARIO * published.EPISODES_A_BLOCK.value)
        for case, (mean, sd) in cases.items():
            spread = _SPREAD * max(sd * sqrt(part), sqrt(mean * part))
            _add(rows, f"{scenario}: pairs {case}", int(pairs[case][scenario]), mean * part, spread)
        gaps = of_scenario["soa_s"].dropna()
        if len(gaps) > 1:
            printed = published.SOA_MS[scenario].value
            spread = _SPREAD * printed.sd / sqrt(len(gaps)) + _SLACK_MS
            _add(rows, f"{scenario}: onset to onset, mean, ms", 1e3 * gaps.mean(), printed.mean, spread)
    return pd.DataFrame(rows)


def _add(rows: list[dict[str, object]], quantity: str, measured: float, middle: float, spread: float) -> None:
    low, high = max(middle - spread, 0.0), middle + spread
    rows.append({"quantity": quantity, "measured": measured, "low": low, "high": high, "ok": low <= measured <= high})
