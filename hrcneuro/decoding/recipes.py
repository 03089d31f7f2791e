"""Decoders as recipes: which features, which estimator, with what parameters, after whom. Light to import."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from hrcneuro.contract import option
from hrcneuro.decoding.scheme import SHRINKAGE

FEATURES = ("windows", "windows_600", "steps", "windows_bands", "epochs")
ESTIMATORS = ("rlda", "shrinkage_lda", "toeplitz_lda", "xdawn_tangent")
N_STEPS = 12  # of the features steps

_ROWS = ("windows", "windows_600", "steps", "windows_bands")
_WINDOWED = ("windows", "windows_600", "windows_bands")
# A block-Toeplitz covariance needs equal windows side by side, xDAWN channels and time steps apart.
_FITTING = {"rlda": _ROWS, "shrinkage_lda": _ROWS, "toeplitz_lda": ("steps",), "xdawn_tangent": ("epochs",)}


@dataclass(frozen=True)
class Recipe:
    """One decoder: features of each trial, and an estimator with its parameters."""

    estimator: str = option(
        "rlda", f"the classifier: {', '.join(ESTIMATORS)}, or the import path of any of scikit-learn's kind"
    )
    features: str = option("windows", "what it sees of a trial", choices=FEATURES)
    params: dict[str, Any] = option({}, "the estimator's parameters, e.g. shrinkage")
    citation: str = option("", "where the method comes from")
    windows_s: tuple[tuple[float, ...], ...] = option(
        (),
        "start and end of each window of features = windows, windows_600 or windows_bands; none: the paper's",
        unit="s",
    )
    file: str = option("", "your own Python file that has the estimator", path=True, keyed=False)

    @property
    def foreign(self) -> bool:
        """Whether the estimator is named by its import path."""
        return "." in self.estimator

    @property
    def sees(self) -> tuple[str, tuple[tuple[float, ...], ...]]:
        """What the features are made of: two recipes that agree in it see the same of a trial."""
        return self.features, self.windows_s


def misfits(recipe: Recipe) -> list[str]:
    """Return what of a recipe does not fit together, a sentence each: ``what is there; what is allowed``."""
    sentences = _wrong_windows(recipe)
    if recipe.foreign or recipe.estimator not in ESTIMATORS:
        return sentences + _wrong_path(recipe)
    if recipe.file:
        sentences.append(f"file is for an estimator of your own; {recipe.estimator} is built in: leave file out")
    if recipe.features not in _FITTING[recipe.estimator]:
        allowed = ", ".join(_FITTING[recipe.estimator])
        sentences.append(f"features = {recipe.features!r}; allowed for {recipe.estimator}: {allowed}")
    given = dict(recipe.params)
    if not all(isinstance(value, int | float) and not isinstance(value, bool) for value in given.values()):
        return [*sentences, f"params = {recipe.params}; allowed for {recipe.estimator}: numbers"]
    if recipe.estimator == "rlda":
        good, allowed = 0 < given.pop("shrinkage", SHRINKAGE) <= 1, "0 < shrinkage <= 1"
    elif recipe.estimator == "toeplitz_lda":
        good, allowed = given.pop("n_times", 0) == N_STEPS, f"n_times = {N_STEPS}, and it must be given"
    elif recipe.estimator == "xdawn_tangent":
        n_filters = float(given.pop("n_filters", 3))
        good, allowed = n_filters >= 1 and n_filters.is_integer(), "a whole n_filters >= 1"
    else:
        good, allowed = True, "none"
    if given or not good:
        sentences.append(f"params = {recipe.params}; allowed for {recipe.estimator}: {allowed}")
    return sentences


def _wrong_windows(recipe: Recipe) -> list[str]:
    if recipe.windows_s and recipe.features not in _WINDOWED:
        return [f"windows_s is for features = {', '.join(_WINDOWED)}; features is {recipe.features!r}: leave it out"]
    return [
        f"windows_s[{i}] = {list(window)}; allowed: [start, end], start first"
        for i, window in enumerate(recipe.windows_s)
        if len(window) != 2 or window[0] >= window[1]
    ]


def _wrong_path(recipe: Recipe) -> list[str]:
    if recipe.foreign and all(part.isidentifier() for part in recipe.estimator.split(".")):
        return []
    return [
        f"estimator = {recipe.estimator!r}; allowed: {', '.join(ESTIMATORS)}, or an import path such as "
        "'sklearn.svm.SVC' (of your own file: 'FILE.NAME', with file = 'FILE.py')"
    ]


BUILTIN: dict[str, Recipe] = {
    "rlda": Recipe(
        "rlda",
        "windows",
        citation="Ehrlich et al. 2023, PLoS ONE 18:e0287958, section 2.5.4; Friedman 1989, JASA 84:165",
    ),
    "rlda_600": Recipe(
        "rlda", "windows_600", citation="as rlda, with the 0-600 ms mean removed: what a live decoder can know"
    ),
    "shrinkage_lda": Recipe(
        "shrinkage_lda", "windows", citation="Blankertz et al. 2011, NeuroImage 56:814; Ledoit & Wolf 2004, JMVA 88:365"
    ),
    "toeplitz_lda": Recipe(
        "toeplitz_lda", "steps", {"n_times": N_STEPS}, citation="Sosulski & Tangermann 2022, J. Neural Eng. 19:066001"
    ),
    "rlda_bands": Recipe(
        "rlda", "windows_bands", citation="Ehrlich et al. 2023, section 5 (outlook): theta, alpha and beta power added"
    ),
    "xdawn_tangent": Recipe(
        "xdawn_tangent",
        "epochs",
        {"n_filters": 3},
        citation="Rivet et al. 2009, IEEE TBME 56:2035; Barachant et al. 2012, IEEE TBME 59:920; pyRiemann",
    ),
}
