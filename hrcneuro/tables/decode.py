"""The tables of decode: a subject's folds, scores, ROC, patterns and others; Table 2 and the group's tests."""

from __future__ import annotations

from hrcneuro.io.tables import Column, Table
from hrcneuro.tables.rates import RATES

_KEY = {
    "scenario": Column("category", "", "value of the split column, all without one"),
    "problem": Column("category", "", "name of the decoding problem"),
    "decoder": Column("category", "", "name of the decoder's recipe"),
}
_FOLD = {
    "repeat": Column("int", "", "repeat of the cross-validation, from 0"),
    "fold": Column("int", "", "fold within the repeat, from 0"),
}

FOLDS = Table(
    1,
    "one row a repeat and fold",
    {
        **_KEY,
        **_FOLD,
        "n_train": Column("int", "", "training trials after balancing"),
        "n1_test": Column("int", "", "held-out trials of class 1"),
        "n2_test": Column("int", "", "held-out trials of class 2"),
        **RATES,
    },
)
PREDICTIONS = Table(
    1,
    "one row a held-out trial and repeat",
    {
        **_KEY,
        **_FOLD,
        "epoch": Column("int", "", "row of the trial in the epochs file"),
        "block": Column("int", "", "the trial's key: block"),
        "episode": Column("int", "", "the trial's key: episode"),
        "trial": Column("int", "", "the trial's key: trial in the episode"),
        "label": Column("int", "", "1 takeover (class 2), 0 not (class 1)"),
        "score": Column("float", "", "discriminant, positive where takeover is decided"),
    },
)
ROC = Table(
    1,
    "one row a scenario, problem, decoder and false positive rate: the mean of the folds' ROC curves",
    {
        **_KEY,
        "fpr": Column("float", "%", "held-out trials of class 1 taken for takeovers"),
        "tpr": Column("float", "%", "held-out takeovers found at that rate; the curve's area is auc of scores.parquet"),
    },
)
PATTERNS = Table(
    1,
    "one row a scenario, problem, linear decoder, channel and feature; decoders fitted to all trials of the problem",
    {
        **_KEY,
        "channel": Column("category", "", "EEG channel"),
        "measure": Column("category", "", "mean of the channel, or theta, alpha, beta: its power in the band"),
        "unit": Column("category", "", "unit of the feature and of the pattern: µV, or dB of power"),
        "start_s": Column("float", "s", "start of the feature's window, from the onset"),
        "end_s": Column("float", "s", "its end"),
        "weight": Column("float", "", "the decoder's weight; not to be read as a place in the brain"),
        "pattern": Column(
            "float",
            "",
            "covariance with the score over the score's SD: what goes with one SD towards takeover, in the unit of the "
            "row (doi:10.1016/j.neuroimage.2013.10.067)",
        ),
    },
)
STRATA = Table(
    1,
    "one row a cue and its value; decoders trained on all training trials, scored on held-out trials with this value",
    {
        **_KEY,
        "cue": Column("category", "", "prev_error or turn"),
        "value": Column("bool", "", "the cue's value"),
        "n1": Column("int", "", "trials of class 1"),
        "n2": Column("int", "", "trials of class 2"),
        "bacc": Column("float", "%", "balanced accuracy; NaN with fewer trials a class than decode.min_stratum"),
    },
)
EXTRA = {
    "lobo_bacc": "balanced accuracy with one block left out at a time",
    "matched_bacc": "balanced accuracy of decoders trained and tested on trials without a previous error",
    "prev_error_no_bacc": "balanced accuracy of held-out trials after no error, trained on all",
    "prev_error_yes_bacc": "balanced accuracy of held-out trials after an error, trained on all",
    "prev_error_mean_bacc": "mean of the two strata of prev_error",
    "turn_no_bacc": "balanced accuracy of held-out trials without a turn ahead, trained on all",
    "turn_yes_bacc": "balanced accuracy of held-out trials with a turn ahead, trained on all",
    "turn_mean_bacc": "mean of the two strata of turn",
    "prev_error_rule_bacc": "no EEG: after an error, takeover",
    "prev_error_fitted_bacc": "no EEG: a rule on prev_error fitted in the training folds",
    "turn_rule_bacc": "no EEG: before a turn, takeover",
    "turn_fitted_bacc": "no EEG: a rule on turn fitted in the training folds",
    "stays_rule_acc": "no EEG: accuracy of 'the actor stays', never a takeover; its balanced accuracy is 50",
    "stays": "held-out trials in which the decoder says that the actor stays (class 1)",
}
SHARES = ("chance", "stays_rule_acc", "stays")
"""Measures that guessing does not bring to 50 %."""
SCORES = Table(
    2,
    "one row a scenario, problem and decoder; NaN where note says why",
    {
        **_KEY,
        "class1": Column("category", "", "condition without takeover"),
        "class2": Column("category", "", "condition with takeover"),
        "n1": Column("int", "", "trials of class 1"),
        "n2": Column("int", "", "trials of class 2"),
        "n_folds": Column("int", "", "folds used; 0 where nothing was computed"),
        "n_repeats": Column("int", "", "repeats"),
        **RATES,
        "bacc_se": Column("float", "%", "standard error of bacc from tnr, tpr, n1 and n2: trials as binomial draws"),
        "chance": Column("float", "%", "accuracy that guessing exceeds in 5 % of studies with n1 + n2 trials"),
        "permutation_bacc": Column(
            "float", "%", "balanced accuracy of the one repeat that p tests, with folds of its own; bacc is a mean"
        ),
        "p": Column("float", "", "permutation p value of permutation_bacc, not of bacc; labels permuted within block"),
        **{name: Column("float", "%", text) for name, text in EXTRA.items()},
        "note": Column("string", "", "what was not computed, or otherwise than configured, and why"),
    },
)

TABLE2 = Table(
    1,
    "one row a scenario, problem, decoder and measure, over subjects",
    {
        **_KEY,
        "measure": Column("category", "", "a column of scores.parquet"),
        "mean": Column("float", "%", "mean over subjects"),
        "sd": Column("float", "%", "standard deviation over subjects (n - 1)"),
        "n": Column("int", "", "subjects with a value"),
        "half_width": Column(
            "float", "%", "half the width of the mean's 95 % interval (t distribution); NaN below two subjects"
        ),
        "detectable": Column(
            "float",
            "%",
            "mean that a one-sided t test against 50 finds with 80 % power at this sd, n; NaN below three subjects, "
            "where it would exceed 100, and of what guessing does not bring to 50",
        ),
        "published_mean": Column("float", "%", "Ehrlich et al. 2023, Table 2 (doi:10.1371/journal.pone.0287958)"),
        "published_sd": Column("float", "%", "the same table's SD"),
    },
)
ABOVE = ("tnr", "tpr", "acc")
"""The rates that the paper compares with the chance level (Table 2)."""
TESTS = Table(
    2,
    "one row a scenario, problem and decoder: is the group above chance?",
    {
        **_KEY,
        "n": Column("int", "", "subjects"),
        "bacc": Column("float", "%", "mean balanced accuracy"),
        "p": Column("float", "", "one-sided sign flips of the subjects, bacc - 50 (exact up to 16 subjects)"),
        "p_holm": Column("float", "", "Holm's correction over scenarios and problems"),
        "significant": Column("bool", "", "p_holm < 0.05"),
        "acc": Column("float", "%", "mean accuracy"),
        "chance": Column("float", "%", "mean chance level over subjects, scenarios and problems"),
        **{
            f"p_{rate}": Column("float", "", f"one-sided sign flips of the subjects, {rate} - own chance level")
            for rate in ABOVE
        },
        **{f"published_{rate}": Column("bool", "", f"{rate} printed as significantly above chance") for rate in ABOVE},
    },
)
COMPARED = Table(
    1,
    "one row a scenario, problem and further decoder, against the first one on the same folds",
    {
        **_KEY,
        "reference": Column("category", "", "the first decoder"),
        "n": Column("int", "", "subjects with both"),
        "difference": Column("float", "%", "mean difference of balanced accuracy, decoder minus reference"),
        "sd": Column("float", "%", "standard deviation of the differences (n - 1)"),
        "p": Column("float", "", "two-sided sign flips of the subjects"),
        "p_holm": Column("float", "", "Holm's correction over all rows"),
    },
)
SUBJECTS = Table(
    SCORES.version,
    "one row a subject, scenario, problem and decoder; the first row's decoder is the reference",
    {"subject": Column("category", "", "subject"), **SCORES.columns},
)
