"""Decoders as recipes: which features, which estimator, with what parameters, after whom. Light to import."""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro.contract import option
from hrcneuro.decoding.scheme import SHRINKAGE

FEATURES = ("windows", "windows_600", "steps", "windows_bands", "epochs")
ESTIMATORS = ("rlda", "shrinkage_lda", "toeplitz_lda", "xdawn_tangent")
N_STEPS = 12  # of the features steps

_ROWS = ("windows", "windows_600", "steps", "windows_bands")
# A block-Toeplitz covariance needs equal windows side by side, xDAWN channels and time steps apart.
_FITTING = {"rlda": _ROWS, "shrinkage_lda": _ROWS, "toeplitz_lda": ("steps",), "xdawn_tangent": ("epochs",)}


@dataclass(frozen=True)
class Recipe:
    """One decoder: features of each trial, and an estimator with its parameters."""

    estimator: str = option("rlda", "the classifier", choices=ESTIMATORS)
    features: str = option("windows", "what it sees of a trial", choices=FEATURES)
    params: dict[str, float] = option({}, "the estimator's parameters, e.g. shrinkage")
    citation: str = option("", "where the method comes from")


def misfits(recipe: Recipe) -> list[str]:
    """Return what of a recipe does not fit together, a sentence each: ``what is there; what is allowed``."""
    sentences = []
    if recipe.features not in _FITTING[recipe.estimator]:
        allowed = ", ".join(_FITTING[recipe.estimator])
        sentences.append(f"features = {recipe.features!r}; allowed for {recipe.estimator}: {allowed}")
    given = dict(recipe.params)
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
