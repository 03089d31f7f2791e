"""The tables and the summary of calibrate: decoders on blocks that they have not seen, beside rules without EEG."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.analyses.calibrated import Seen, cues_of
from hrcneuro.decoding import baselines, chance, metrics
from hrcneuro.decoding.calibration import Calibrated, Training, log_loss, pairs
from hrcneuro.decoding.features import WINDOWS_S
from hrcneuro.decoding.frozen import FrozenDecoder, FrozenProblem
from hrcneuro.decoding.patterns import pattern
from hrcneuro.io.tables import Table
from hrcneuro.paradigm.design import CUES
from hrcneuro.tables.calibrate import BASELINES, BLOCKS, DROPPED, PATTERNS, SCORES, STRATA, TRIALS

_KEYS = ("block", "episode", "trial")


@dataclass
class Rows:
    """Everything that calibrate says about one subject.

    Attributes:
        min_stratum: Trials a class below which a stratum is not scored.
        matched: Cues within whose strata both classes trained with equally many trials.
        scores, blocks, strata, baselines: Rows of the tables of these names.
        trials, patterns: Frames of rows, one a problem.
        warnings: What the user must know, a sentence each.
    """

    min_stratum: int
    matched: tuple[str, ...] = ()
    scores: list[dict[str, Any]] = field(default_factory=list)
    blocks: list[dict[str, Any]] = field(default_factory=list)
    strata: list[dict[str, Any]] = field(default_factory=list)
    baselines: list[dict[str, Any]] = field(default_factory=list)
    trials: list[pd.DataFrame] = field(default_factory=list)
    patterns: list[pd.DataFrame] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def add(
        self, name: str, problem: FrozenProblem, training: Training, found: Calibrated, rows: pd.DataFrame, note: str
    ) -> None:
        """Add a problem.

        Args:
            name: Its name.
            problem: How it is decided.
            training: Its trials.
            found: What was found on them.
            rows: Their rows of the trial table.
            note: What was done otherwise than configured, and why.
        """
        key, cues = {"problem": name}, cues_of(rows)
        what = {"actor": problem.actor or None, "class1": problem.classes[0], "class2": problem.classes[1]}
        labels = training.labels
        self.scores.append(key | what | score_row(training, found) | {"note": note})
        self.blocks += [key | row for row in block_rows(training, found, rows)]
        self.strata += [key | row for row in strata_rows(labels, found, cues, at_least=self.min_stratum)]
        self.baselines += [key | row for row in baseline_rows(labels, cues)]
        self.trials.append(trial_rows(rows, training, found, problem).assign(**key))
        spread = pattern(training.features, problem.weights)
        self.patterns.append(pd.DataFrame({"weight": problem.weights, "pattern": spread}).assign(**key))
        self.warnings += [f"{name}: {note}"] if note else []

    def tables(self, decoder: FrozenDecoder, seen: Seen) -> dict[str, tuple[Table, pd.DataFrame]]:
        """Return file name -> (schema, rows)."""
        places = pd.DataFrame(
            [(channel, *span) for channel in decoder.kept for span in WINDOWS_S],
            columns=["channel", "start_s", "end_s"],
        )
        patterns = [pd.concat([places, one], axis=1) for one in self.patterns]
        return {
            "scores.parquet": (SCORES, _frame(self.scores, SCORES)),
            "blocks.parquet": (BLOCKS, _frame(self.blocks, BLOCKS)),
            "strata.parquet": (STRATA, _frame(self.strata, STRATA)),
            "baselines.parquet": (BASELINES, _frame(self.baselines, BASELINES)),
            "trials.parquet": (TRIALS, _joined(self.trials, TRIALS)),
            "patterns.parquet": (PATTERNS, _joined(patterns, PATTERNS)),
            "dropped.parquet": (DROPPED, dropped_rows(seen)),
        }

    def summary(self, decoder: FrozenDecoder, seen: Seen) -> dict[str, Any]:
        """Return problem -> rates in percent, trials and rules without EEG; what the decoder takes; the warnings."""
        problems: dict[str, Any] = {}
        for row in self.scores:
            rules = {
                one["rule"]: _numbers(one, "bacc", "acc") for one in self.baselines if one["problem"] == row["problem"]
            }
            strata = {
                f"{one['cue']} {'yes' if one['value'] else 'no'}": _json(one["bacc"])
                for one in self.strata
                if one["problem"] == row["problem"]
            }
            rates = ("tnr", "tpr", "acc", "bacc", "bacc_se", "auc", "chance", "log_loss", "stays", "slope", "offset")
            counts = {one: int(row[one]) for one in ("n1", "n2", "n_blocks")}
            what = {"classes": [row["class1"], row["class2"]], "actor": row["actor"] or ""}
            problems[row["problem"]] = _numbers(row, *rates) | counts | what | {"rules": rules, "strata": strata}
        return {
            "problems": problems,
            "channels": len(decoder.channels),
            "kept": len(decoder.kept),
            "sfreq": decoder.sfreq,
            "epoch_samples": decoder.n_times,
            "trials": len(seen.table),
            "matched": list(self.matched),
            "dropped": seen.reasons,
        } | ({"warnings": self.warnings} if self.warnings else {})


def score_row(training: Training, found: Calibrated) -> dict[str, Any]:
    """Return the numbers of a problem's row of scores.parquet, rates in percent."""
    labels = training.labels
    rates = _rates(labels, found.scores)
    n2 = int(np.count_nonzero(labels))
    n1 = len(labels) - n2
    return rates | {
        "n1": n1,
        "n2": n2,
        "n_blocks": len(np.unique(training.held_out)),
        "bacc_se": metrics.bacc_standard_error(rates["tnr"], rates["tpr"], n1, n2),
        "chance": 100 * chance.chance_level(len(labels)),
        "log_loss": log_loss(found.probabilities, labels, training.cells),
        "stays": 100 * float((found.scores <= 0).mean()),
        "slope": found.slope,
        "offset": found.offset,
    }


def block_rows(training: Training, found: Calibrated, rows: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Yield a row of blocks.parquet for each part that was held out; rates in percent, NaN where a class is absent."""
    labels = training.labels
    for part in np.unique(training.held_out):
        here = training.held_out == part
        both = pairs(labels[here], training.cells[here])
        scenarios = rows.loc[here, "scenario"].dropna().unique() if "scenario" in rows else []
        yield {
            "block": int(part),
            "scenario": str(scenarios[0]) if len(scenarios) == 1 else None,
            "n1": int((here & ~labels).sum()),
            "n2": int((here & labels).sum()),
            **_rates(labels[here], found.scores[here]),
            "log_loss": log_loss(found.probabilities[here], labels[here], training.cells[here]) if both else math.nan,
        }


def strata_rows(
    labels: np.ndarray, found: Calibrated, cues: Mapping[str, np.ndarray], *, at_least: int
) -> Iterator[dict[str, Any]]:
    """Yield a row of strata.parquet for each cue and value; rates in percent, NaN with fewer trials a class."""
    for cue, values in cues.items():
        for value in (False, True):
            here = values == value
            n1, n2 = int((here & ~labels).sum()), int((here & labels).sum())
            rates = _rates(labels[here], found.scores[here])
            enough = min(n1, n2) >= at_least
            scored = {name: rates[name] if enough else math.nan for name in ("tnr", "tpr", "bacc")}
            yield {"cue": cue, "value": value, "n1": n1, "n2": n2, **scored}


def baseline_rows(labels: np.ndarray, cues: Mapping[str, np.ndarray]) -> Iterator[dict[str, Any]]:
    """Yield a row of baselines.parquet for each rule that looks at no EEG; rates in percent."""
    rules = {"stays": np.zeros(len(labels), bool), **cues}
    for rule, takeover in rules.items():
        tnr, tpr, acc, _, _ = metrics.rates(labels, np.where(takeover, 1.0, -1.0))
        bacc = baselines.rule_bacc(takeover, labels)
        n2 = int(np.count_nonzero(labels))
        rates = {"tnr": tnr, "tpr": tpr, "acc": acc, "bacc": bacc}
        yield {"rule": rule, "n1": len(labels) - n2, "n2": n2, **{name: 100 * v for name, v in rates.items()}}


def trial_rows(rows: pd.DataFrame, training: Training, found: Calibrated, problem: FrozenProblem) -> pd.DataFrame:
    """Return a problem's rows of trials.parquet without its name.

    Args:
        rows: Its trials, as :class:`Seen` has them.
        training: The same trials as they were learned from.
        found: What was found.
        problem: The finished decoder, which scores each of them, too.
    """
    names = ("scenario", *_KEYS, *CUES)
    columns = {name: rows[name].to_numpy() if name in rows else None for name in names}
    numbers = {name: rows[name].to_numpy() for name in ("zero", "first_sample", "peak_uv")}
    return pd.DataFrame(
        columns
        | numbers
        | {
            "label": training.labels.astype(int),
            "held_out": training.held_out,
            "score": found.scores,
            "probability": found.probabilities,
            "frozen_score": [problem.score(one) for one in training.features],
        },
        index=range(len(rows)),
    )


def dropped_rows(seen: Seen) -> pd.DataFrame:
    """Return the rows of dropped.parquet."""
    columns = {name: seen.dropped[name].to_numpy() if name in seen.dropped else None for name in _KEYS}
    return pd.DataFrame(columns | {"reason": seen.dropped["reason"].to_numpy()}, index=range(len(seen.dropped)))


def _rates(labels: np.ndarray, scores: np.ndarray) -> dict[str, float]:
    found = metrics.rates(labels, scores)
    return {name: 100 * float(value) for name, value in zip(metrics.RATES, found, strict=True)}


def _numbers(row: Mapping[str, Any], *names: str) -> dict[str, float | None]:
    return {name: _json(row[name]) for name in names}


def _json(value: float) -> float | None:
    """Return a number to four decimals, None where there is none (JSON knows no NaN)."""
    return round(float(value), 4) if math.isfinite(value) else None


def _frame(rows: list[dict[str, Any]], table: Table) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=list(table.columns))


def _joined(frames: list[pd.DataFrame], table: Table) -> pd.DataFrame:
    if not frames:
        return pd.DataFrame(columns=list(table.columns))
    return pd.concat(frames, ignore_index=True)[list(table.columns)]
