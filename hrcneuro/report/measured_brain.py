"""This run's figures on potentials and rhythms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hrcneuro.contract import GROUP
from hrcneuro.eeg.significance import SignificanceMap
from hrcneuro.paradigm.design import FIG_2
from hrcneuro.report.effects import Effect, Shown, shown
from hrcneuro.report.regions import ALPHA, BETA, FRONTAL, LEFT_TEMPORAL, MOTOR, THETA
from hrcneuro.report.results import Results
from hrcneuro.report.verdicts import Measured
from hrcneuro.tables.maps import read_contrast_waves

PANELS = {letter: f"{takeover}-{continuation}_{position}" for letter, _, takeover, continuation, position in FIG_2}
BEFORE = PANELS["C"]
Maps = Mapping[tuple[str, str], SignificanceMap]  # by (scenario, contrast)

# Signs are those of a takeover less its continuation. Alpha sinks around the human's own actions (4.1): after a key
# was pressed, which is in HH and not in HR, and before one is pressed, which is in RH and not in RR.
POSITIVITY = Effect("frontal channels", FRONTAL, 1, s=(0.4, 0.6))
THETA_BEFORE = Effect("frontal channels", FRONTAL, 1, THETA, s=(0.3, 0.7), peaks=True)
ALPHA_BEFORE = Effect("motor channels", MOTOR, -1, ALPHA)
_RHYTHMS = {
    "ersp B": (PANELS["B"], Effect("motor channels", MOTOR, 1, ALPHA)),
    # "Around 700 ms": two SDs of the wavelet at 10 Hz to either side.
    "ersp C alpha": (BEFORE, replace(ALPHA_BEFORE, s=(0.6, 1.2), starts_s=(0.55, 0.85))),
    "ersp C theta": (BEFORE, THETA_BEFORE),
    "ersp D": (PANELS["D"], Effect("left temporal channels", LEFT_TEMPORAL, 1, BETA, s=(0.4, 0.8), peaks=True)),
}
# Two maps or waves share half of their variance from here on.
_ALIKE = np.sqrt(0.5)
# Of a mean difference, where and when the effect must be.
_UV = "µV"


def measure(results: Results) -> dict[str, Measured]:
    """Return the key of a claim -> what this run has on it."""
    erp, ersp = results.maps("erp"), results.maps("ersp")
    there = planted(results)
    measured = {**_potentials(erp, there), **_rhythms(ersp, there)}
    path = results.path("erp", GROUP, "erp_stats.parquet")
    if path and ("sC", BEFORE) in erp and ("iC", BEFORE) in erp:
        measured["erp alike"] = _alike(erp["sC", BEFORE], erp["iC", BEFORE], path, there)
    if ("all", BEFORE) in erp and ("all", BEFORE) in ersp:
        measured["locked"] = _locked(erp["all", BEFORE], ersp["all", BEFORE], there)
    return measured


@dataclass(frozen=True)
class Planted:
    """Which effects a simulated recording has in it.

    Attributes:
        intermittent, sequential: The extra positivity before takeovers in iC, and in sC.
        more: More of it in iC than in sC.
    """

    intermittent: bool
    sequential: bool
    more: bool


def planted(results: Results) -> Planted:
    """Return what is planted in the configured recording; that matters to simulated recordings alone."""
    eeg = results.settings.sections["acquire"].eeg
    # Each effect but "none" is calibrated on RH against RR before, whatever it stands for.
    there = eeg.effect != "none" and eeg.effect_uv != 0
    return Planted(there, there and eeg.sequential_share > 0, there and eeg.sequential_share < 1)


def _potentials(erp: Maps, planted: Planted) -> dict[str, Measured]:
    measured = {}
    for panel, contrast in PANELS.items():
        if ("all", contrast) in erp and panel != "C":
            measured[f"erp {panel}"] = _nothing(erp["all", contrast])
    if ("sC", BEFORE) in erp:
        measured["erp sC"] = _nothing(erp["sC", BEFORE])
    for key, scenario in (("erp C", "all"), ("erp iC", "iC")):
        if (scenario, BEFORE) in erp:
            measured[key] = _effect(erp[scenario, BEFORE], POSITIVITY, planted.intermittent)
    return measured


def _alike(sequential: SignificanceMap, intermittent: SignificanceMap, path: Path, planted: Planted) -> Measured:
    """Return how alike the two scenarios' responses at Cz and the maps of their differences are."""
    waves = read_contrast_waves(path, "Cz")
    similar: dict[str, float] = {}
    if ("sC", BEFORE) in waves and ("iC", BEFORE) in waves:
        one, other = waves["sC", BEFORE], waves["iC", BEFORE]
        similar |= {"RH at Cz": _correlation(one.plus, other.plus), "RR at Cz": _correlation(one.minus, other.minus)}
    common = [name for name in sequential.channels if name in intermittent.channels]
    maps = [m.of_channels(common).within(s=POSITIVITY.s).difference.mean(axis=1) for m in (sequential, intermittent)]
    similar["difference map, 400 to 600 ms"] = _correlation(*maps)
    return Measured(
        ", ".join(f"{name}: r = {r:.2f}" for name, r in similar.items()),
        all(r >= _ALIKE for r in similar.values()),
        "eeg",
        f"each r at least {_ALIKE:.2f}, half of the variance shared",
        planted.sequential and planted.intermittent,
        value=min(similar.values()),
        unit="least r",
    )


def _locked(potential: SignificanceMap, magnitude: SignificanceMap, planted: Planted) -> Measured:
    """Return whether one effect is both in the average and in single trials' magnitude, as the paper argues (4.1)."""
    both = {"ERP": shown(potential, POSITIVITY), "theta": shown(magnitude, THETA_BEFORE)}
    why = "the paper's own argument: the ERP (as in Fig 2C) and the theta (as in Fig 2C) are both there"
    text = "; ".join(f"{name}: {'there' if one.agrees else 'not there as printed'}" for name, one in both.items())
    there = all(one.agrees for one in both.values())
    return Measured(text, there, "eeg", why, planted.intermittent, value=both["theta"].mean, unit=_UV)


def _rhythms(ersp: Maps, planted: Planted) -> dict[str, Measured]:
    measured = {}
    if ("all", PANELS["A"]) in ersp:
        measured["ersp A"] = _nothing(ersp["all", PANELS["A"]])
    # No simulated recording has a rebound of beta after a takeover.
    there = {"ersp C theta": planted.intermittent, "ersp D": False}
    for key, (contrast, effect) in _RHYTHMS.items():
        if ("all", contrast) in ersp:
            measured[key] = _effect(ersp["all", contrast], effect, there.get(key, True))
    if ("sC", BEFORE) in ersp and ("iC", BEFORE) in ersp:
        measured |= _scenarios(ersp["sC", BEFORE], ersp["iC", BEFORE], planted)
    return measured


def _scenarios(sequential: SignificanceMap, intermittent: SignificanceMap, planted: Planted) -> dict[str, Measured]:
    alpha = [shown(one, ALPHA_BEFORE) for one in (sequential, intermittent)]
    theta = [shown(one, THETA_BEFORE) for one in (sequential, intermittent)]
    # The simulated central rhythm sinks alike in both scenarios.
    stronger = alpha[0].strongest > alpha[1].strongest
    earlier = alpha[0].starts_s < alpha[1].starts_s or (alpha[0].agrees and np.isnan(alpha[1].starts_s))
    more = theta[1].points > theta[0].points and theta[1].strongest > theta[0].strongest
    return {
        "ersp 3 alpha": _in_both(alpha, ALPHA_BEFORE, there=True),
        "ersp 3 theta": _in_both(theta, THETA_BEFORE, there=planted.sequential),
        "ersp 3 early": Measured(
            _beside(alpha, "falls"),
            bool(stronger and earlier),
            "eeg",
            "significant alpha falls deeper and begins earlier in sC",
            planted=False,
            value=alpha[0].mean - alpha[1].mean,
            unit=_UV,
        ),
        "ersp 3 more": Measured(
            f"{_beside(theta, 'rises')}; {theta[0].points} and {theta[1].points} points",
            bool(more),
            "eeg",
            f"more significant points with a larger rise in iC, {_hz(THETA)}, 300 to 700 ms",
            planted.more,
            value=theta[1].mean - theta[0].mean,
            unit=_UV,
        ),
    }


def _in_both(pair: Sequence[Shown], effect: Effect, *, there: bool) -> Measured:
    text = f"sC: {pair[0].text}; iC: {pair[1].text}"
    # The weaker of the two.
    mean = effect.sign * min(effect.sign * one.mean for one in pair)
    agrees = all(one.agrees for one in pair)
    return Measured(text, agrees, "eeg", f"in both {effect.criterion}", there, value=mean, unit=_UV)


def _beside(pair: Sequence[Shown], how: str) -> str:
    """Return how strong and how early an effect is in sC and in iC."""
    parts = []
    for scenario, one in zip(("sC", "iC"), pair, strict=True):
        begun = f"from {1000 * one.starts_s:.0f} ms" if np.isfinite(one.starts_s) else "never for a period"
        there = f"{how} by up to {one.strongest:.2f} µV, {begun}"
        parts.append(f"{scenario}: {there if one.strongest else f'nowhere {how} significantly'}")
    return "; ".join(parts)


def _effect(tested: SignificanceMap, effect: Effect, there: bool) -> Measured:
    seen = shown(tested, effect)
    text = seen.text if seen.points or not tested.any else f"{seen.text}; elsewhere: {tested.describe()}"
    return Measured(text, seen.agrees, "eeg", effect.criterion, there, value=seen.mean, unit=_UV)


def _nothing(tested: SignificanceMap) -> Measured:
    share = 100 * float(tested.significant.mean()) if tested.significant.size else 0.0
    text = tested.describe()
    return Measured(text, not tested.any, "eeg", "nothing significant", value=share, unit="% of the points")


def _correlation(one: np.ndarray, other: np.ndarray) -> float:
    """Return Pearson's r of two arrays of one shape; NaN where one of them is flat."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return float(np.corrcoef(one, other)[0, 1])


def _hz(band: tuple[float, float]) -> str:
    return f"{band[0]:g} to {band[1]:g} Hz"
