"""This run's figures on decoding (paper 2.6.2, Table 2)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hrcneuro import published
from hrcneuro.report.measured_brain import Planted, planted
from hrcneuro.report.results import Results
from hrcneuro.report.verdicts import Measured, near, spread

_LEVEL = published.LEVEL.value
_GUESSING = 50.0
_BALANCE = "how training sets are balanced"
_CHANCE_FORMULA = "the formula of the chance level"


def measure(results: Results) -> dict[str, Measured]:
    """Return the key of a claim -> what this run has on it."""
    subjects = [results.summary("decode", unit) for unit in results.included("decode")]
    there = planted(results)
    return {**_table_2(subjects, there), **_above(results.summary("decode"), there), **_chance(subjects, results)}


def guessing(results: Results) -> str:
    """Return with how many numbers of Table 2 a decoder that guesses would agree; empty where none was compared."""
    n = len(results.included("decode"))
    printed = [rate for rates in published.TABLE_2.values() for rate in rates.values()]
    if not n:
        return ""
    agree = sum(_guess_agrees(*rate.value, n) for rate in printed)
    return (
        f"A decoder at exactly {_GUESSING:g} % would agree with {agree} of the {len(printed)} numbers of Table 2: "
        "agreement with these is no evidence of decoding."
    )


def _table_2(subjects: list[Mapping[str, Any]], there: Planted) -> dict[str, Measured]:
    measured = {}
    for key, rates in published.TABLE_2.items():
        cells = [one for s in subjects for one in _cells(s, key) if one.get("acc") is not None]
        for name, printed in rates.items() if cells else ():
            ours = np.array([one[name] for one in cells])
            agrees, why = near(ours, *printed.value)
            if _guess_agrees(*printed.value, len(ours)):
                why += f"; so is {_GUESSING:g} %, guessing"
            # Without an effect this row tells the ways of balancing apart, and one was chosen that gives it.
            reading = _BALANCE if key == ("sC", "HHvsHR") else ""
            measured[f"{_cell(key)} {name}"] = Measured(
                f"{spread(ours)} %",
                agrees,
                "eeg",
                why,
                _decodable(key, there),
                reading,
                value=float(ours.mean()),
                unit="%",
            )
    return measured


def _above(group: Mapping[str, Any], there: Planted) -> dict[str, Measured]:
    """Return which rates are significantly above chance over the subjects, by the stage's own test."""
    measured = {}
    for key, printed in published.ABOVE_CHANCE.items():
        for cell in _cells(group, key):
            for rate, said in printed.items():
                p = cell["p_above_chance"][rate]
                if p is None:
                    continue
                mean, level = cell[rate], cell["chance"]
                text = f"{mean:.1f} %, chance {level:.1f} %, p = {p:.3g}"
                wanted = "p <" if said.value else "p at least"
                why = f"{wanted} {_LEVEL:g}, sign flips of each subject's rate less the same subject's chance level"
                measured[f"{_cell(key)} {rate} above"] = Measured(
                    text,
                    (p < _LEVEL) == said.value,
                    "eeg",
                    why,
                    _decodable(key, there) or not said.value,
                    value=mean - level,
                    unit="points above chance",
                )
    return measured


def _chance(subjects: list[Mapping[str, Any]], results: Results) -> dict[str, Measured]:
    chances = [one["chance"] for s in subjects for key in published.TABLE_2 for one in _cells(s, key) if one["chance"]]
    if not chances:
        return {}
    level = float(np.mean(chances))
    # The same trials must give the printed digits, which tells formulas apart; others' counts differ.
    margin = 0.05 if results.same_logs else 0.5
    why = f"within {margin:g} of the printed level; it follows from the trial counts alone"
    agrees = abs(level - published.CHANCE.value) <= margin
    text = f"{level:.2f} %"
    return {"chance": Measured(text, agrees, "behaviour", why, reading=_CHANCE_FORMULA, value=level, unit="%")}


def _guess_agrees(mean: float, sd: float, n: int) -> bool:
    return near(np.full(n, _GUESSING), mean, sd)[0]


def _decodable(key: tuple[str, str], there: Planted) -> bool:
    """Return whether a simulated recording has in it what this cell of Table 2 decodes."""
    scenario, problem = key
    return problem != "RRvsRH" or (there.intermittent if scenario == "iC" else there.sequential)


def _cell(key: tuple[str, str]) -> str:
    return " ".join(key)


def _cells(summary: Mapping[str, Any], key: tuple[str, str]) -> list[Mapping[str, Any]]:
    cell = summary.get(key[0], {}).get(key[1])
    return [cell] if cell else []
