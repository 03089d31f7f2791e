"""The tables of the evidence: session logs of a closed loop scored, replayed, and held against what was foretold."""

from __future__ import annotations

from hrcneuro.io.tables import Column, Table

_SUBJECT = Column("category", "", "subject, as the log's name has it")
_RUN = Column("int", "", "closed session of the subject, 1 to 4")
_RATES = {
    "tnr": Column("float", "", "share of right guesses after which the decoder said noError"),
    "tpr": Column("float", "", "share of wrong guesses after which it said ERROR"),
    "balanced": Column("float", "", "their mean, the balanced accuracy"),
    "right": Column("float", "", "share of the guesses that were right"),
}
_BAND = {
    "low": Column("float", "", "lower edge of its 95 % interval, bootstrap over subjects; missing below 5"),
    "high": Column("float", "", "upper edge"),
}
_BIN = Column("category", "", "bin of sessions by their online balanced accuracy")
_PREDICTOR = Column("category", "", "eq3-6: the design tool; fixed, adapting: the game with such a partner")
SESSIONS = Table(
    1,
    "one row a closed session in which guesses were logged",
    {
        "subject": _SUBJECT,
        "run": _RUN,
        "trials": Column("int", "", "trials"),
        **_RATES,
        "first_right": Column("float", "", "share of right guesses in the first 10 trials"),
        "last_right": Column("float", "", "share of right guesses in the last 10 trials"),
        "early_balanced": Column(
            "float", "", "balanced accuracy of the first 25 trials, half a trial added to each outcome"
        ),
        "bin": _BIN,
        "eq3-6": Column("float", "", "last_right as foretold by the design tool from the balanced accuracy"),
        "fixed": Column("float", "", "last_right as foretold by the game with a fixed partner, fitted to others"),
        "adapting": Column("float", "", "the same with a partner who adapts"),
        "eq3-6_early": Column("float", "", "as eq3-6, from early_balanced"),
    },
)
SUBJECTS = Table(
    1,
    "one row a subject, the trials of its sessions pooled",
    {
        "subject": _SUBJECT,
        "sessions": Column("int", "", "closed sessions in which guesses were logged"),
        "trials": Column("int", "", "their trials"),
        **_RATES,
    },
)
TRIALS = Table(
    1,
    "one row a trial of every closed session",
    {
        "subject": _SUBJECT,
        "run": _RUN,
        "trial": Column("int", "", "counted from 1"),
        "error": Column("bool", "", "the decoder said ERROR"),
        "transitions": Column("float", "", "gaze transitions as logged; missing in run 3"),
        "counted": Column(
            "int",
            "",
            "transitions inferred from the policies, a truncated count with its least; -1 where none explain them",
        ),
        "rows_one": Column("int", "", "rows of the policy with exactly one solution, none of its counts truncated"),
        "rows_several": Column("int", "", "rows with several solutions"),
        "truncated": Column("int", "", "counts of which only the least is known, as their probability was truncated"),
        "agrees": Column("bool", "", "the solutions allow the logged number; null where none is logged"),
        "ways": Column("float", "", "counts that the solutions and the logged number allow; missing without a number"),
        "paths": Column("float", "", "those of them that are one path of the gaze"),
        "difference": Column("float", "", "largest difference of the replayed policy from the logged one"),
    },
)
GUESSES = Table(
    1,
    "one row a bin of sessions and ten trials",
    {
        "bin": _BIN,
        "sessions": Column("int", "", "sessions of the bin"),
        "trial": Column("int", "", "the last of the ten"),
        "right": Column("float", "", "share of right guesses, mean over sessions"),
        **_BAND,
    },
)
PREDICTED = Table(
    1,
    "one row a predictor and bin of sessions",
    {
        "predictor": _PREDICTOR,
        "bin": _BIN,
        "sessions": Column("int", "", "sessions of the bin"),
        "predicted": Column("float", "", "share of right guesses in the last 10 trials as foretold, mean"),
        "observed": Column("float", "", "the same as logged, mean"),
        **_BAND,
    },
)
DESIGN = Table(
    1,
    "one row a predictor and decoder accuracy",
    {
        "predictor": _PREDICTOR,
        "accuracy": Column("float", "%", "correct decisions, after right and wrong guesses alike"),
        "predicted": Column("float", "", "share of right guesses in the last 10 of 50 trials"),
        "half_width": Column("float", "", "half the width of its 95 % Monte-Carlo band"),
    },
)
PARTNERS = Table(
    1,
    "one row a model of the person who guesses",
    {
        "partner": Column("category", "", "fixed or adapting"),
        "people": Column("category", "", "alike: one weight for all; differ: each has her own, normally distributed"),
        "weight": Column("float", "", "how strongly guesses follow the share of looks; mean over people"),
        "spread": Column("float", "", "its SD over people"),
        "rate": Column("float", "", "change of the weight, per trial and unit of surprise"),
        "log_likelihood": Column("float", "", "of all guesses whose looks are known, nats"),
        "held_out": Column("float", "", "the same of people to whom the model was not fitted; missing for alike"),
    },
)
