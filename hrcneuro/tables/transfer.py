"""The tables of transfer: trials of a subject as decoders see them; the group's scores, learning curves and tests."""

from __future__ import annotations

from hrcneuro.io.tables import Column, Table
from hrcneuro.tables.rates import RATES

NONE, EVERY = "none", "all"
"""Calibration without a trial, and with all that there are outside the held-out block."""

_PLACE = {
    "signal": Column("category", "", "offline: the epochs of epoch; causal: the recording as a stream would bring it"),
    "scenario": Column("category", "", "value of the split column, all without one"),
    "problem": Column("category", "", "name of the decoding problem"),
}
_WAY = {
    **_PLACE,
    "way": Column("category", "", "own, pooled, recentred or joint: what the decoder was trained on"),
    "calibration": Column("category", "", f"calibration trials a class: {NONE}, a number or {EVERY}"),
}
_SPREAD = {
    "sd": Column("float", "%", "standard deviation over subjects (n - 1); NaN with one"),
    "half_width": Column("float", "%", "half the width of the mean's 95 % interval (t distribution)"),
}

TRIALS = Table(
    1,
    "one row a trial of a problem, as a signal shows it",
    {
        **_PLACE,
        "onset_s": Column("float", "s", "when the trial begins"),
        "block": Column("int", "", "its block; null where the study has none"),
        "label": Column("int", "", "1 takeover (class 2), 0 not (class 1)"),
        "features_uv": Column("float32[]", "uV", "the study's features: all windows of the first channel, and so on"),
    },
)
SCORES = Table(
    1,
    "one row a signal, scenario, problem, way, size of calibration and subject; all trials are held out once",
    {
        **_WAY,
        "subject": Column("category", "", "the subject that is decoded"),
        "n1": Column("int", "", "trials of class 1"),
        "n2": Column("int", "", "trials of class 2"),
        "folds": Column("int", "", "parts, such as blocks, that are held out in turn"),
        "pairs": Column("float", "", "calibration trials a class, mean over the parts"),
        "minutes": Column("float", "min", "cap time that the calibration takes, mean over the parts"),
        **RATES,
    },
)
CURVES = Table(
    1,
    "one row a signal, scenario, problem, way and size of calibration, over subjects: the learning curves",
    {
        **_WAY,
        "n": Column("int", "", "subjects with so many calibration trials"),
        "pairs": Column("float", "", "calibration trials a class, mean over subjects"),
        "minutes": Column("float", "min", "cap time that the calibration takes, mean over subjects"),
        "bacc": Column("float", "%", "mean balanced accuracy"),
        **_SPREAD,
        "minutes_per_point": Column(
            "float",
            "min",
            "more minutes than at the size before for a point of accuracy; NaN where none was gained, or where other "
            "subjects reach that size",
        ),
    },
)
TESTS = Table(
    1,
    "one row a signal, scenario, problem, way, and calibration with none or all: is the group above chance?",
    {
        **_WAY,
        "n": Column("int", "", "subjects"),
        "minutes": Column("float", "min", "cap time that the calibration takes, mean over subjects"),
        "bacc": Column("float", "%", "mean balanced accuracy"),
        **_SPREAD,
        "p": Column("float", "", "one-sided sign flips of the subjects, bacc - 50 (exact up to 16 subjects)"),
        "p_holm": Column("float", "", "Holm's correction over all rows"),
        "significant": Column("bool", "", "p_holm < 0.05"),
    },
)
COMPARED = Table(
    1,
    "one row a signal, scenario, problem and way, against the subject's own decoder with all calibration trials",
    {
        **_WAY,
        "n": Column("int", "", "subjects with both"),
        "difference": Column("float", "%", "mean difference of balanced accuracy, the way minus own"),
        **_SPREAD,
        "p": Column("float", "", "two-sided sign flips of the subjects"),
        "p_holm": Column("float", "", "Holm's correction over all rows"),
        "worth_minutes": Column(
            "float", "min", "cap time at which the mean curve of own reaches this way's mean; NaN where it does not"
        ),
    },
)
