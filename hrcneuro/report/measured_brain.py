"""This run's figures on potentials, rhythms and decoding."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hrcneuro import published
from hrcneuro.eeg.significance import SignificanceMap
from hrcneuro.paradigm.design import FIG_2
from hrcneuro.report.regions import ALPHA, BETA, FRONTAL, LEFT_TEMPORAL, MOTOR, THETA
from hrcneuro.report.results import Results
from hrcneuro.report.verdicts import Measured, near, spread

PANELS = {letter: f"{takeover}-{continuation}_{position}" for letter, _, takeover, continuation, position in FIG_2}
BEFORE = PANELS["C"]
Maps = Mapping[tuple[str, str], SignificanceMap]  # by (scenario, contrast)


def measure(results: Results) -> dict[str, Measured]:
    """Return the key of a claim -> what this run has on it."""
    erp, ersp = results.maps("erp"), results.maps("ersp")
    planted = _planted(results)
    return {**_potentials(erp, planted), **_rhythms(ersp, planted), **_decoding(results, planted)}


@dataclass(frozen=True)
class _Planted:
    """Which effects a simulated recording has in it.

    Attributes:
        intermittent, sequential: The extra positivity before takeovers in iC, and in sC.
        more: More of it in iC than in sC.
    """

    intermittent: bool
    sequential: bool
    more: bool


def _planted(results: Results) -> _Planted:
    """Return what is planted in the configured recording; that matters to simulated recordings alone."""
    eeg = results.settings.sections["acquire"].eeg
    # Each effect but "none" is calibrated on RH against RR before, whatever it stands for.
    there = eeg.effect != "none" and eeg.effect_uv != 0
    return _Planted(there, there and eeg.sequential_share > 0, there and eeg.sequential_share < 1)


def _potentials(erp: Maps, planted: _Planted) -> dict[str, Measured]:
    measured = {}
    for panel, contrast in PANELS.items():
        if ("all", contrast) in erp and panel != "C":
            measured[f"erp {panel}"] = _nothing(erp["all", contrast])
    if ("all", BEFORE) in erp:
        whole = erp["all", BEFORE]
        part = whole.within(FRONTAL, s=(0.4, 0.6))
        larger = part.any and bool((part.difference[part.significant] > 0).all())
        why = "significant and positive over frontal channels between 400 and 600 ms"
        measured["erp C"] = Measured(
            part.describe() if part.any else whole.describe(), larger, "eeg", why, planted.intermittent
        )
    if ("sC", BEFORE) in erp:
        measured["erp sC"] = _nothing(erp["sC", BEFORE])
    if ("iC", BEFORE) in erp:
        one = erp["iC", BEFORE]
        measured["erp iC"] = Measured(one.describe(), one.any, "eeg", "anything significant", planted.intermittent)
    return measured


def _rhythms(ersp: Maps, planted: _Planted) -> dict[str, Measured]:
    measured = {}
    if ("all", PANELS["A"]) in ersp:
        measured["ersp A"] = _nothing(ersp["all", PANELS["A"]])
    parts = {
        "ersp B": (PANELS["B"], MOTOR, ALPHA, None, True),
        "ersp C alpha": (BEFORE, MOTOR, ALPHA, (0.6, 1.2), True),
        "ersp C theta": (BEFORE, FRONTAL, THETA, (0.3, 0.7), planted.intermittent),
        # No simulated recording has a rebound of beta after a takeover.
        "ersp D": (PANELS["D"], LEFT_TEMPORAL, BETA, (0.4, 0.8), False),
    }
    for key, (contrast, channels, hz, s, there) in parts.items():
        if ("all", contrast) in ersp:
            part = ersp["all", contrast].within(channels, hz=hz, s=s)
            why = f"significant over {channels[0]} to {channels[-1]}, {hz[0]:g} to {hz[1]:g} Hz" + (
                f", {1000 * s[0]:.0f} to {1000 * s[1]:.0f} ms" if s else ""
            )
            measured[key] = Measured(part.describe(), part.any, "eeg", why, there)
    if ("sC", BEFORE) in ersp and ("iC", BEFORE) in ersp:
        measured |= _scenarios(ersp["sC", BEFORE], ersp["iC", BEFORE], planted)
    return measured


def _scenarios(sequential: SignificanceMap, intermittent: SignificanceMap, planted: _Planted) -> dict[str, Measured]:
    measured = {}
    motor = [one.within(MOTOR, hz=ALPHA) for one in (sequential, intermittent)]
    theta = [one.within(FRONTAL, hz=THETA) for one in (sequential, intermittent)]
    for key, pair, there in (("ersp 3 alpha", motor, True), ("ersp 3 theta", theta, planted.sequential)):
        text = f"sC: {pair[0].describe()}; iC: {pair[1].describe()}"
        measured[key] = Measured(text, all(one.any for one in pair), "eeg", "significant in both", there)
    strength = [float(np.abs(one.difference).max()) for one in motor]
    early = motor[0].any and (not motor[1].any or motor[0].first_s < motor[1].first_s)
    measured["ersp 3 early"] = Measured(
        f"largest difference {strength[0]:.2f} µV in sC, {strength[1]:.2f} in iC; {_ms(motor[0])} in sC, "
        f"{_ms(motor[1])} in iC",
        bool(strength[0] > strength[1] and early),
        "eeg",
        "larger and earlier significant in sC",
        # The simulated central rhythm sinks alike in both scenarios.
        planted=False,
    )
    bins = [int(one.significant.sum()) for one in theta]
    text = f"{bins[1]} significant bins in iC, {bins[0]} in sC"
    measured["ersp 3 more"] = Measured(text, bins[1] > bins[0], "eeg", "more significant bins in iC", planted.more)
    return measured


def _nothing(tested: SignificanceMap) -> Measured:
    return Measured(tested.describe(), not tested.any, "eeg", "nothing significant")


def _ms(tested: SignificanceMap) -> str:
    return f"significant from {1000 * tested.first_s:.0f} ms" if tested.any else "never significant"


def _decoding(results: Results, planted: _Planted) -> dict[str, Measured]:
    subjects = [results.summary("decode", u) for u in results.included("decode")]
    measured = {}
    every = [one for s in subjects for key in published.TABLE_2 for one in _cells(s, key)]
    chances = [one["chance"] for one in every if one.get("chance")]
    level = float(np.mean(chances)) if chances else np.nan
    for key, rates in published.TABLE_2.items():
        cells = [one for s in subjects for one in _cells(s, key) if one.get("acc") is not None]
        if not cells:
            continue
        there = key[1] != "RRvsRH" or (planted.intermittent if key[0] == "iC" else planted.sequential)
        for name, printed in rates.items():
            ours = np.array([one[name] for one in cells])
            agrees, why = near(ours, *printed.value)
            measured[f"{key[0]} {key[1]} {name}"] = Measured(f"{spread(ours)} %", agrees, "eeg", why, there)
        acc = float(np.mean([one["acc"] for one in cells]))
        above, said = acc > level, published.ABOVE_CHANCE[key].value
        text = f"{'above' if above else 'not above'} chance ({acc:.1f} %, chance {level:.1f} %)"
        measured[f"{key[0]} {key[1]} above"] = Measured(
            text, above == said, "eeg", "mean accuracy and mean chance level", there or not said
        )
    if chances:
        # The same trials must give the printed digits, which tells formulas apart; others' counts differ.
        margin = 0.05 if results.same_logs else 0.5
        why = f"within {margin:g} of the printed level; it follows from the trial counts alone"
        measured["chance"] = Measured(f"{level:.2f} %", abs(level - published.CHANCE.value) <= margin, "behaviour", why)
    return measured


def _cells(summary: Mapping, key: tuple[str, str]) -> list[Mapping]:
    cell = summary.get(key[0], {}).get(key[1])
    return [cell] if cell else []
