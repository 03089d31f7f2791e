"""What a comparison with the paper is worth: agrees, differs, by construction, not testable, not run."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from hrcneuro import published
from hrcneuro.report.results import Results
from hrcneuro.sources.origin import Origin

AGREES, DIFFERS, PLANTED, OPEN, MISSING = "agrees", "differs", "by construction", "not testable", "not run"
CHOSEN = "agrees, by our choice of reading"
VERDICTS = {
    AGREES: "this run shows what the paper prints, and could have shown something else",
    CHOSEN: "it does, but the paper can be read in several ways, and the one was chosen that gives this figure",
    DIFFERS: "it does not",
    PLANTED: "it does, but the data were simulated so as to give it: agreement is no evidence",
    OPEN: "these data cannot tell, for the reason given; data of unknown origin never can",
    MISSING: "the stage has not run or has failed",
}
_SUBJECTS = published.ANALYSED.value
_EPISODES = published.BLOCKS.value * published.EPISODES_A_BLOCK.value
_REPETITIONS = published.REPETITIONS.value


@dataclass(frozen=True)
class Measured:
    """What this run has to say on one printed result.

    Attributes:
        text: This run's figure.
        agrees: Whether it fits; None where that cannot be told, ``why`` says for what reason.
        rests_on: What must be real for agreement to be evidence: ``eeg``, ``behaviour``, ``arm``, ``model`` or
            ``arithmetic``.
        why: The criterion or the reason, in a few words.
        planted: False where a simulated recording has no such effect in it, so that it cannot tell.
        reading: What of the paper was read so as to give the printed figure; empty where nothing was.
        value: One number of the figure, by which analyses are compared; None where it has none.
        unit: Of that number.
    """

    text: str
    agrees: bool | None
    rests_on: str = "eeg"
    why: str = ""
    planted: bool = True
    reading: str = ""
    value: float | None = None
    unit: str = ""


@dataclass(frozen=True)
class Grounds:
    """What the verdicts of a run rest on.

    Attributes:
        origin: Ground -> where its data come from; None where subjects differ in that.
        short: Ground -> why it is too small to be compared; absent where it is not.
    """

    origin: dict[str, Origin | None]
    short: dict[str, str]

    def verdict(self, measured: Measured | None, *, ran: bool = False) -> tuple[str, str]:
        """Return the verdict and the reason for it; ``ran`` says whether the stage that measures it has run.

        A small study and data of unknown origin can neither agree nor differ; simulated data can differ, but never
        agree.
        """
        if measured is None:
            return (
                (OPEN, "the stage has run, but its settings or data do not give this figure") if ran else (MISSING, "")
            )
        short, origin = self.short.get(measured.rests_on, ""), self.origin[measured.rests_on]
        real = origin is Origin.REAL
        if short or measured.agrees is None:
            return OPEN, short or measured.why
        if origin is None:
            return OPEN, "the subjects' data are of several origins"
        if origin is Origin.UNKNOWN:
            fits = "fits" if measured.agrees else "does not fit"
            return OPEN, f"the data are of unknown origin; the figure {fits}: {measured.why}"
        if not real and not measured.planted:
            return OPEN, "the simulation has no such effect in it"
        if not measured.agrees:
            return DIFFERS, measured.why
        if real and measured.reading:
            return CHOSEN, f"{measured.why}; chosen so as to give it: {measured.reading}"
        return (AGREES if real else PLANTED), measured.why


def grounds(results: Results) -> Grounds:
    """Return what the verdicts of a run rest on: what is real in it, and what is too small to be compared."""
    origins = results.origins(results.included("acquire"))
    origin = {name: _common(getattr(one, name) for one in origins) for name in ("eeg", "behaviour")}
    # The paper's own rates are no result of this run; rates decoded from a simulation are circular.
    origin["model"] = Origin.REAL if results.settings.sections["simulate"].rates == "paper" else origin["eeg"]
    origin["arm"] = Origin.SYNTHETIC if results.settings.sections["robot"].simulated else Origin.REAL
    origin["arithmetic"] = Origin.REAL
    return Grounds(origin, _short(results))


def _common(origins: Iterable[Origin]) -> Origin | None:
    """Return the origin that all have; None where they differ."""
    kinds = set(origins)
    return kinds.pop() if len(kinds) == 1 else None if kinds else Origin.UNKNOWN


def _short(results: Results) -> dict[str, str]:
    """Return the ground -> why this run is too small to be compared on it."""
    short = {}
    units = results.included("acquire")
    tables = results.tables("acquire", "trials.parquet").values()
    episodes = [len(t[~t["practice"].astype(bool)][["block", "episode"]].drop_duplicates()) for t in tables]
    if len(units) < _SUBJECTS:
        short["behaviour"] = f"{len(units)} subjects, the paper has {_SUBJECTS}"
    elif episodes and np.mean(episodes) < 0.95 * _EPISODES:
        short["behaviour"] = f"{np.mean(episodes):.0f} episodes a subject, the paper has {_EPISODES}"
    if "behaviour" in short:
        short["eeg"] = short["behaviour"]
    model = results.settings.sections["simulate"]
    if model.repetitions < _REPETITIONS:
        short["model"] = f"{model.repetitions} repetitions, the paper has {_REPETITIONS}"
    elif model.rates != "paper" and "eeg" in short:
        short["model"] = f"the decoder comes from a short study: {short['eeg']}"
    return short


def near(ours: np.ndarray, mean: float, sd: float, n: int = _SUBJECTS) -> tuple[bool, str]:
    """Return whether a mean lies within two standard errors of the difference from a published one, and the criterion.

    The published SD is taken for both, so that noisy data agree no more easily.

    Args:
        ours: ndarray, shape (n_subjects,), in the unit of ``mean`` and ``sd``.
        mean, sd: As published.
        n: Subjects behind them.
    """
    margin = 2 * sd * math.sqrt(1 / n + 1 / len(ours))
    return bool(abs(float(np.mean(ours)) - mean) <= margin), f"within ± {margin:.2g} of the printed mean"


def spread(values: np.ndarray | list[float], digits: int = 1) -> str:
    """Return mean ± SD (n - 1) of values, ndarray, shape (n,); the mean alone of one value."""
    values = np.asarray(values, float)
    sd = f" ± {values.std(ddof=1):.{digits}f}" if len(values) > 1 else ""
    return f"{values.mean():.{digits}f}{sd}"
