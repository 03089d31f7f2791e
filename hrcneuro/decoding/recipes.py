"""Decoders as recipes: which features, which estimator, with what parameters, after whom. Light to import."""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro.contract import option

FEATURES = ("windows", "windows_600", "steps", "windows_bands", "epochs")
ESTIMATORS = ("rlda", "shrinkage_lda", "toeplitz_lda", "xdawn_tangent")


@dataclass(frozen=True)
class Recipe:
    """One decoder: features of each trial, and an estimator with its parameters."""

    estimator: str = option("rlda", "the classifier", choices=ESTIMATORS)
    features: str = option("windows", "what it sees of a trial", choices=FEATURES)
    params: dict[str, float] = option({}, "the estimator's parameters, e.g. shrinkage")
    citation: str = option("", "where the method comes from")


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
        "toeplitz_lda", "steps", {"n_times": 12}, citation="Sosulski & Tangermann 2022, J. Neural Eng. 19:066001"
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
