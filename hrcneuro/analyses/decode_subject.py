"""A subject's tables of decode: what every decoder scored in every scenario and problem, row by row."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.decoding import chance, problem
from hrcneuro.decoding.metrics import FALSE_POSITIVES, RATES, bacc_standard_error
from hrcneuro.decoding.patterns import DecoderPatterns
from hrcneuro.io.tables import Table
from hrcneuro.tables.decode import FOLDS, PATTERNS, PREDICTIONS, ROC, SCORES, STRATA


@dataclass
class ProblemRows:
    """One scenario and problem: adds the rows of its decoders to the subject's.

    Attributes:
        subject: Where the rows go.
        shared: The columns of scores.parquet that do not depend on the decoder.
        trials, plan: The problem and its folds.
        keys: The trials' keys, a row a trial: epoch, block, episode, trial.
        label_free: What can be decoded without EEG, by column, as fractions.
    """

    subject: SubjectRows
    shared: dict[str, Any]
    trials: problem.LabelledTrials
    plan: problem.Plan
    keys: pd.DataFrame
    label_free: dict[str, float]

    def add(self, decoder: str, decoded: problem.Decoded, *, permuted: bool) -> None:
        """Add a decoder's results.

        Args:
            decoder: Its recipe's name.
            decoded: What it scored.
            permuted: Whether it is quick enough for permutations.
        """
        key = {"scenario": self.shared["scenario"], "problem": self.shared["problem"], "decoder": decoder}
        rates = decoded.fold_rates.mean() | {"lobo_bacc": decoded.lobo_bacc}
        rates |= {"matched_bacc": decoded.matched_bacc} | _strata_means(decoded.strata) | self.label_free
        row = {name: 100 * value for name, value in rates.items()}
        n1, n2 = self.shared["n1"], self.shared["n2"]
        row["bacc_se"] = bacc_standard_error(row["tnr"], row["tpr"], n1, n2)
        row["stays"] = (row["tnr"] * n1 + (100 - row["tpr"]) * n2) / (n1 + n2)
        row["stays_rule_acc"] = 100 * n1 / (n1 + n2)
        if decoded.permutation is not None:
            row |= {"permutation_bacc": 100 * decoded.permutation.statistic, "p": decoded.permutation.p}
        note = "; ".join(self._notes(decoded, permuted=permuted))
        self.subject.score(self.shared | key | row | {"note": note})
        self.subject.folds.append(self._folds(decoded).assign(**key))
        self.subject.predictions.append(self._predictions(decoded).assign(**key))
        roc = pd.DataFrame({"fpr": 100 * FALSE_POSITIVES, "tpr": 100 * decoded.roc})
        self.subject.roc.append(roc.assign(**key))
        for s in decoded.strata:
            counted = {"cue": s.cue, "value": s.value, "n1": s.n1, "n2": s.n2, "bacc": 100 * s.bacc}
            self.subject.strata.append(key | counted)

    def add_patterns(self, found: DecoderPatterns, channels: Sequence[str]) -> None:
        """Add a decoder's patterns, or a warning that it has none.

        Args:
            found: Its patterns and weights.
            channels: Names of the channels that its features are of.
        """
        if found.patterns is None or found.weights is None:
            sentence = f"{found.decoder} has no patterns: its score is no weighted sum of features"
            self.subject.warnings += [sentence] if sentence not in self.subject.warnings else []
            return
        key = {"scenario": self.shared["scenario"], "problem": self.shared["problem"], "decoder": found.decoder}
        rows = [
            (channel, one.measure, one.unit, *one.span_s)
            for block in found.layout
            for channel in channels
            for one in block
        ]
        frame = pd.DataFrame(rows, columns=["channel", "measure", "unit", "start_s", "end_s"])
        self.subject.patterns.append(frame.assign(**key, weight=found.weights, pattern=found.patterns))

    def _notes(self, decoded: problem.Decoded, *, permuted: bool) -> list[str]:
        few = [
            f"{s.cue} {'yes' if s.value else 'no'} ({s.n1}/{s.n2})" for s in decoded.strata if not np.isfinite(s.bacc)
        ]
        return [
            *self.plan.fallbacks,
            *self.plan.notes,
            *([] if permuted else ["p not computed: this decoder is too slow to permute"]),
            *(["p not computed: decode.permutations = 0"] if permuted and decoded.permutation is None else []),
            *([f"strata with too few trials: {', '.join(few)}"] if few else []),
        ]

    def _folds(self, decoded: problem.Decoded) -> pd.DataFrame:
        second = [int(np.count_nonzero(self.trials.labels[s.test])) for s in self.plan.shuffled]
        columns: dict[str, Any] = {
            "repeat": [s.repeat for s in self.plan.shuffled],
            "fold": [s.fold for s in self.plan.shuffled],
            "n_train": [len(s.train) for s in self.plan.shuffled],
            "n1_test": [len(s.test) - n for s, n in zip(self.plan.shuffled, second, strict=True)],
            "n2_test": second,
        }
        return pd.DataFrame(columns | dict(zip(RATES, 100 * decoded.fold_rates.values.T, strict=True)))

    def _predictions(self, decoded: problem.Decoded) -> pd.DataFrame:
        tested = np.concatenate([s.test for s in self.plan.shuffled])
        lengths = [len(s.test) for s in self.plan.shuffled]
        repeat = np.repeat([s.repeat for s in self.plan.shuffled], lengths)
        frame = self.keys.iloc[tested].reset_index(drop=True)
        frame["repeat"], frame["fold"] = repeat, np.repeat([s.fold for s in self.plan.shuffled], lengths)
        frame["label"] = self.trials.labels[tested].astype(int)
        frame["score"] = decoded.scores[repeat, tested]
        return frame


@dataclass
class SubjectRows:
    """Everything that decode says about one subject.

    Attributes:
        first_decoder: The decoder that enters the summary, and that a problem without results is recorded under.
        scores, strata: Rows of the tables of these names.
        folds, predictions, roc, patterns: Frames of rows, one a problem and decoder.
        warnings: What the user must know, a sentence each.
    """

    first_decoder: str
    scores: list[dict[str, Any]] = field(default_factory=list)
    folds: list[pd.DataFrame] = field(default_factory=list)
    predictions: list[pd.DataFrame] = field(default_factory=list)
    roc: list[pd.DataFrame] = field(default_factory=list)
    patterns: list[pd.DataFrame] = field(default_factory=list)
    strata: list[dict[str, Any]] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def begin(
        self,
        scenario: str,
        name: str,
        classes: tuple[str, str],
        trials: problem.LabelledTrials,
        plan: problem.Plan,
        metadata: pd.DataFrame,
    ) -> ProblemRows:
        """Begin a problem; one that cannot be decoded is recorded at once.

        Args:
            scenario, name: Of the problem.
            classes: The conditions of class 1 and of class 2.
            trials, plan: The problem and its folds.
            metadata: The trial table's rows of the problem; the index is the epoch's.
        """
        n1, n2 = trials.counts
        shared: dict[str, Any] = {
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
        self.warnings += [f"{scenario} {name}: {fallback}" for fallback in plan.fallbacks]
        if not plan.shuffled:
            self.score(shared | {"decoder": self.first_decoder, "note": "; ".join(plan.fallbacks)})
        keys = pd.DataFrame({"epoch": metadata.index})
        for column in ("block", "episode", "trial"):
            keys[column] = metadata[column].to_numpy() if column in metadata else None
        return ProblemRows(self, shared, trials, plan, keys, problem.label_free(trials, plan) if plan.shuffled else {})

    def score(self, row: dict[str, Any]) -> None:
        """Add a row of scores; columns without a value are NaN."""
        self.scores.append({name: row.get(name, math.nan) for name in SCORES.columns})

    def tables(self) -> dict[str, tuple[Table, pd.DataFrame]]:
        """Return file name -> (schema, rows)."""
        return {
            "scores.parquet": (SCORES, pd.DataFrame(self.scores, columns=list(SCORES.columns))),
            "strata.parquet": (STRATA, pd.DataFrame(self.strata, columns=list(STRATA.columns))),
            "folds.parquet": (FOLDS, _joined(self.folds, FOLDS)),
            "predictions.parquet": (PREDICTIONS, _joined(self.predictions, PREDICTIONS)),
            "roc.parquet": (ROC, _joined(self.roc, ROC)),
            "patterns.parquet": (PATTERNS, _joined(self.patterns, PATTERNS)),
        }

    def summary(self) -> dict[str, Any]:
        """Return scenario -> problem -> rates in percent, trials, p and classes, and the warnings.

        They are the first decoder's, whose name stands beside them; the others' rates stand in ``others``, by name.
        """
        rates: dict[str, Any] = {}
        for row in self.scores:
            numbers = {name: as_json(row[name]) for name in ("tnr", "tpr", "acc", "bacc", "p")}
            problems = rates.setdefault(row["scenario"], {})
            if row["decoder"] == self.first_decoder:
                trials = {name: int(row[name]) for name in ("n1", "n2")}
                what = {"decoder": row["decoder"], "classes": [row["class1"], row["class2"]]}
                problems[row["problem"]] = numbers | {"chance": as_json(row["chance"])} | trials | what
            else:
                problems[row["problem"]].setdefault("others", {})[row["decoder"]] = numbers
        return rates | ({"warnings": self.warnings} if self.warnings else {})


def as_json(value: float) -> float | None:
    """Return a number to four decimals, None where there is none (JSON knows no NaN)."""
    return round(float(value), 4) if math.isfinite(value) else None


def _strata_means(strata: tuple[problem.Stratum, ...]) -> dict[str, float]:
    by_value = {f"{s.cue}_{'yes' if s.value else 'no'}_bacc": s.bacc for s in strata}
    cues = {s.cue for s in strata}
    return by_value | {f"{c}_mean_bacc": (by_value[f"{c}_no_bacc"] + by_value[f"{c}_yes_bacc"]) / 2 for c in cues}


def _joined(frames: list[pd.DataFrame], table: Table) -> pd.DataFrame:
    if not frames:
        return pd.DataFrame(columns=list(table.columns))
    return pd.concat(frames, ignore_index=True)[list(table.columns)]
