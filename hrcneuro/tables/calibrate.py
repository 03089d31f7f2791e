"""The tables of calibrate: how the decoder does on held-out blocks, and what needs no EEG."""

from __future__ import annotations

from hrcneuro.io.tables import Column, Table
from hrcneuro.tables.rates import RATES

_PROBLEM = {"problem": Column("category", "", "name of the decoding problem")}
_COUNTS = {
    "n1": Column("int", "", "trials of class 1"),
    "n2": Column("int", "", "trials of class 2"),
}
_RATES = {
    **RATES,
    "log_loss": Column(
        "float", "bits", "mean of -log2 P(true class), classes weighing alike in each matched stratum; 1: knows nothing"
    ),
}

SCORES = Table(
    1,
    "one row a problem: how decoders do on blocks that they have not seen; NaN where note says why",
    {
        **_PROBLEM,
        "actor": Column("category", "", "who makes the moves at whose onset it is decided; null where both do"),
        "class1": Column("category", "", "condition without takeover"),
        "class2": Column("category", "", "condition with takeover"),
        **_COUNTS,
        "n_blocks": Column("int", "", "blocks held out in turn"),
        **_RATES,
        "bacc_se": Column("float", "%", "standard error of bacc from tnr, tpr, n1 and n2: trials as binomial draws"),
        "chance": Column("float", "%", "accuracy that guessing exceeds in 5 % of studies with n1 + n2 trials"),
        "stays": Column("float", "%", "held-out trials in which the decoder says that the actor stays (class 1)"),
        "slope": Column("float", "", "log-odds of class 2 a unit of the score"),
        "offset": Column("float", "", "log-odds of class 2 at a score of 0"),
        "note": Column("string", "", "what was done otherwise than configured, and why"),
    },
)
BLOCKS = Table(
    1,
    "one row a problem and held-out block: the scores of decoders that were trained on the other blocks",
    {
        **_PROBLEM,
        "block": Column("int", "", "the block; a fifth of the trials, from 0, where there are no two blocks"),
        "scenario": Column("category", "", "the block's scenario; null without one"),
        **_COUNTS,
        **_RATES,
    },
)
STRATA = Table(
    1,
    "one row a problem, cue and value: held-out trials with this value, of decoders that were trained on all others",
    {
        **_PROBLEM,
        "cue": Column("category", "", "prev_error or turn"),
        "value": Column("bool", "", "the cue's value"),
        **_COUNTS,
        "tnr": _RATES["tnr"],
        "tpr": _RATES["tpr"],
        "bacc": Column("float", "%", "balanced accuracy; NaN with fewer trials a class than calibrate.min_stratum"),
    },
)
BASELINES = Table(
    1,
    "one row a problem and rule that looks at no EEG",
    {
        **_PROBLEM,
        "rule": Column(
            "category",
            "",
            "stays: the actor stays; prev_error: after an error, takeover; turn: before a turn, takeover",
        ),
        **_COUNTS,
        **{name: Column("float", "%", text) for name, text in (
            ("tnr", "trials of class 1 that it gets right"),
            ("tpr", "trials of class 2 that it gets right"),
            ("acc", "trials that it gets right"),
            ("bacc", "balanced accuracy"),
        )},
    },
)  # fmt: skip
TRIALS = Table(
    1,
    "one row a problem and trial of the calibration, in the order of the recording",
    {
        **_PROBLEM,
        "scenario": Column("category", "", "sC or iC; null without one"),
        "block": Column("int", "", "the trial's key: block"),
        "episode": Column("int", "", "the trial's key: episode"),
        "trial": Column("int", "", "the trial's key: trial in the episode"),
        "zero": Column("float", "samples", "the epoch's zero, from the recording's first sample"),
        "first_sample": Column("int", "samples", "the epoch's first sample, the one nearest to its zero"),
        "prev_error": Column("bool", "", "the move before was an error; null where that is not known"),
        "turn": Column("bool", "", "the next target direction differs; null where that is not known"),
        "label": Column("int", "", "1 takeover (class 2), 0 not (class 1)"),
        "held_out": Column("int", "", "trials of equal value were held out together"),
        "score": Column("float", "", "of decoders that have not seen the trial's block; positive: takeover"),
        "probability": Column("float", "", "of takeover, from that score; slope and offset of other blocks, too"),
        "frozen_score": Column(
            "float", "", "of the decoder that is handed on: it has learned from this trial, so this is no performance"
        ),
        "peak_uv": Column("float", "µV", "largest deviation from a channel's mean in the cleaned epoch"),
    },
)
PATTERNS = Table(
    1,
    "one row a problem, channel and window: the decoder that is handed on",
    {
        **_PROBLEM,
        "channel": Column("category", "", "EEG channel"),
        "start_s": Column("float", "s", "start of the window whose mean is the feature, from the epoch's zero"),
        "end_s": Column("float", "s", "its end"),
        "weight": Column("float", "1/µV", "the decoder's weight; not to be read as a place in the brain"),
        "pattern": Column(
            "float",
            "µV",
            "covariance with the score over the score's SD: what goes with one SD towards takeover "
            "(doi:10.1016/j.neuroimage.2013.10.067)",
        ),
    },
)
DROPPED = Table(
    1,
    "one row a trial that the decoder does not learn from, in the order of the recording",
    {
        "block": Column("int", "", "the trial's key: block"),
        "episode": Column("int", "", "the trial's key: episode"),
        "trial": Column("int", "", "the trial's key: trial in the episode"),
        "reason": Column(
            "category",
            "",
            "no onset; outside the recording; boundary: samples are missing in it; marked bad; amplitude: an artefact; "
            "twin: it begins less than 0.1 s after another trial",
        ),
    },
)
