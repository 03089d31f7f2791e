"""The tables that decode writes for a subject: folds, held-out predictions, scores and strata."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.decoding import chance, problem
from hrcneuro.decoding.metrics import RATES
from hrcneuro.io.tables import Column, Table, write_table

_KEY = {
    "scenario": Column("category", "", "value of the split column, all without one"),
    "problem": Column("category", "", "name of the decoding problem"),
    "decoder": Column("category", "", "name of the decoder's recipe"),
}
_RATES = {
    "tnr": Column("float", "%", "held-out trials of class 1 (no takeover) decoded right"),
    "tpr": Column("float", "%", "held-out trials of class 2 (takeover) decoded right"),
    "acc": Column("float", "%", "held-out trials decoded right"),
    "bacc": Column("float", "%", "balanced accuracy, the mean of tnr and tpr"),
    "auc": Column("float", "%", "area under the receiver operating characteristic"),
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
        **_RATES,
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
}
SCORES = Table(
    1,
    "one row a scenario, problem and decoder; NaN where note says why",
    {
        **_KEY,
        "class1": Column("category", "", "condition without takeover"),
        "class2": Column("category", "", "condition with takeover"),
        "n1": Column("int", "", "trials of class 1"),
        "n2": Column("int", "", "trials of class 2"),
        "n_folds": Column("int", "", "folds used; 0 where nothing was computed"),
        "n_repeats": Column("int", "", "repeats"),
        **_RATES,
        "chance": Column("float", "%", "accuracy that guessing exceeds in 5 % of studies with n1 + n2 trials"),
        "permutation_bacc": Column(
            "float", "%", "balanced accuracy of the one repeat that p tests, with folds of its own; bacc is a mean"
        ),
        "p": Column("float", "", "permutation p value of permutation_bacc, not of bacc; labels permuted within block"),
        **{name: Column("float", "%", text) for name, text in EXTRA.items()},
        "note": Column("string", "", "what was not computed, or otherwise than configured, and why"),
    },
)


@dataclass
class Place:
    """One scenario and problem: collects the rows of its decoders."""

    tables: SubjectTables
    base: dict[str, Any]
    trials: problem.Trials
    plan: problem.Plan
    keys: pd.DataFrame
    free: dict[str, float]

    def add(self, decoder: str, found: problem.Decoded, *, permuted: bool) -> None:
        """Add a decoder's results."""
        key = {"scenario": self.base["scenario"], "problem": self.base["problem"], "decoder": decoder}
        rates = found.fold_rates.mean() | {"lobo_bacc": found.lobo_bacc}
        rates |= {"matched_bacc": found.matched_bacc} | _strata_means(found.strata) | self.free
        notes = [
            *self.plan.fallbacks,
            *self.plan.notes,
            *([] if permuted else ["p not computed: this decoder is too slow to permute"]),
            *(["p not computed: decode.permutations = 0"] if permuted and found.permutation is None else []),
        ]
        few = [f"{s.cue} {'yes' if s.value else 'no'} ({s.n1}/{s.n2})" for s in found.strata if not np.isfinite(s.bacc)]
        notes += [f"strata with too few trials: {', '.join(few)}"] if few else []
        row = {name: 100 * value for name, value in rates.items()}
        if found.permutation is not None:
            row |= {"permutation_bacc": 100 * found.permutation.statistic, "p": found.permutation.p}
        self.tables.score(self.base | key | row | {"note": "; ".join(notes)})
        self.tables.folds.append(self._folds(found).assign(**key))
        self.tables.predictions.append(self._predictions(found).assign(**key))
        for s in found.strata:
            counted = {"cue": s.cue, "value": s.value, "n1": s.n1, "n2": s.n2, "bacc": 100 * s.bacc}
            self.tables.strata.append(key | counted)

    def _folds(self, found: problem.Decoded) -> pd.DataFrame:
        second = [int(np.count_nonzero(self.trials.labels[s.test])) for s in self.plan.shuffled]
        columns: dict[str, Any] = {
            "repeat": [s.repeat for s in self.plan.shuffled],
            "fold": [s.fold for s in self.plan.shuffled],
            "n_train": [len(s.train) for s in self.plan.shuffled],
            "n1_test": [len(s.test) - n for s, n in zip(self.plan.shuffled, second, strict=True)],
            "n2_test": second,
        }
        return pd.DataFrame(columns | dict(zip(RATES, 100 * found.fold_rates.values.T, strict=True)))

    def _predictions(self, found: problem.Decoded) -> pd.DataFrame:
        tested = np.concatenate([s.test for s in self.plan.shuffled])
        lengths = [len(s.test) for s in self.plan.shuffled]
        repeat = np.repeat([s.repeat for s in self.plan.shuffled], lengths)
        frame = self.keys.iloc[tested].reset_index(drop=True)
        frame["repeat"], frame["fold"] = repeat, np.repeat([s.fold for s in self.plan.shuffled], lengths)
        frame["label"] = self.trials.labels[tested].astype(int)
        frame["score"] = found.scores[repeat, tested]
        return frame


@dataclass
class SubjectTables:
    """Everything that decode says about one subject."""

    first_decoder: str
    rows: list[dict[str, Any]] = field(default_factory=list)
    folds: list[pd.DataFrame] = field(default_factory=list)
    predictions: list[pd.DataFrame] = field(default_factory=list)
    strata: list[dict[str, Any]] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def warn(self, sentence: str) -> None:
        """Note what the user must know; it reaches the summary."""
        self.warnings.append(sentence)

    def open(
        self,
        scenario: str,
        name: str,
        classes: tuple[str, str],
        trials: problem.Trials,
        plan: problem.Plan,
        metadata: pd.DataFrame,
    ) -> Place:
        """Begin a problem; one that cannot be decoded is recorded at once."""
        n1, n2 = trials.counts
        base: dict[str, Any] = {
            "scenario": scenario,
            "problem": name,
            "class1": classes[0],
            "class2": classes[1],
            "n1": n1,
            "n2": n2,
            "n_folds": plan.shuffled[-1].fold + 1 if plan.shuffled else 0,
            "n_repeats": plan.shuffled[-1].repeat + 1 if plan.shuffled else 0,
            "chance": 100 * chance.chance_level(n1 + n2) if n1 + n2 else math.nan,
        }
        for fallback in plan.fallbacks:
            self.warn(f"{scenario} {name}: {fallback}")
        if not plan.shuffled:
            self.score(base | {"decoder": self.first_decoder, "note": "; ".join(plan.fallbacks)})
        keys = pd.DataFrame({"epoch": metadata.index})
        for column in ("block", "episode", "trial"):
            keys[column] = metadata[column].to_numpy() if column in metadata else None
        return Place(self, base, trials, plan, keys, problem.label_free(trials, plan) if plan.shuffled else {})

    def score(self, row: dict[str, Any]) -> None:
        """Add a row of scores; columns without a value are NaN."""
        self.rows.append({name: row.get(name, math.nan) for name in SCORES.columns})

    def write(self, out: Path) -> None:
        """Write the four tables."""
        write_table(pd.DataFrame(self.rows, columns=list(SCORES.columns)), out / "scores.parquet", SCORES)
        write_table(pd.DataFrame(self.strata, columns=list(STRATA.columns)), out / "strata.parquet", STRATA)
        write_table(_joined(self.folds, FOLDS), out / "folds.parquet", FOLDS)
        write_table(_joined(self.predictions, PREDICTIONS), out / "predictions.parquet", PREDICTIONS)

    def summary(self) -> dict[str, Any]:
        """Return scenario -> problem -> rates in percent of the first decoder, and the warnings where there are any."""
        found: dict[str, Any] = {}
        for row in self.rows:
            if row["decoder"] == self.first_decoder:
                found.setdefault(row["scenario"], {})[row["problem"]] = {
                    name: as_json(row[name]) for name in ("tnr", "tpr", "acc", "bacc", "chance")
                }
        return found | ({"warnings": self.warnings} if self.warnings else {})


def as_json(value: float) -> float | None:
    """Return a number to four decimals, None where there is none (JSON knows no NaN)."""
    return round(float(value), 4) if math.isfinite(value) else None


def _strata_means(strata: tuple[problem.Stratum, ...]) -> dict[str, float]:
    found: dict[str, float] = {}
    for s in strata:
        found[f"{s.cue}_{'yes' if s.value else 'no'}_bacc"] = s.bacc
    for cue in {s.cue for s in strata}:
        found[f"{cue}_mean_bacc"] = (found[f"{cue}_no_bacc"] + found[f"{cue}_yes_bacc"]) / 2
    return found


def _joined(frames: list[pd.DataFrame], table: Table) -> pd.DataFrame:
    if not frames:
        return pd.DataFrame(columns=list(table.columns))
    return pd.concat(frames, ignore_index=True)[list(table.columns)]
