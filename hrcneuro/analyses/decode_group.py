"""The group's tables of decode: Table 2 beside the published one, tests over subjects, decoders compared; a figure."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.decoding import group
from hrcneuro.io.tables import Column, Table, write_table
from hrcneuro.tables.decode import EXTRA, SCORES, as_json

_KEY = {name: SCORES.columns[name] for name in ("scenario", "problem", "decoder")}
MEASURES = ("tnr", "tpr", "acc", "bacc", "auc", "chance", *EXTRA)

TABLE2 = Table(
    1,
    "one row a scenario, problem, decoder and measure, over subjects",
    {
        **_KEY,
        "measure": Column("category", "", "a column of scores.parquet"),
        "mean": Column("float", "%", "mean over subjects"),
        "sd": Column("float", "%", "standard deviation over subjects (n - 1)"),
        "n": Column("int", "", "subjects with a value"),
        "detectable": Column(
            "float",
            "%",
            "mean that a one-sided t test against 50 finds with 80 % power at this sd, n; NaN below three subjects and "
            "where it would exceed 100",
        ),
        "published_mean": Column("float", "%", "Ehrlich et al. 2023, Table 2 (doi:10.1371/journal.pone.0287958)"),
        "published_sd": Column("float", "%", "the same table's SD"),
    },
)
TESTS = Table(
    1,
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
        "above_chance": Column(
            "bool", "", "the paper's own rule: mean accuracy above the mean chance level; null where n = 0"
        ),
        "published_above": Column("bool", "", "the paper's verdict; null where it has none"),
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
    "one row a subject, scenario, problem and decoder",
    {"subject": Column("category", "", "subject"), **SCORES.columns},
)


def write(scores: pd.DataFrame, config: Any, seed: int, out: Path) -> dict[str, Any]:
    """Write the group's artifacts into ``out`` and return the JSON summary.

    Args:
        scores: All subjects' scores.parquet with a column ``subject``.
        config: The stage's section.
        seed: For sign flips of more than 16 subjects; each row draws its own, whatever other decoders there are.
        out: The folder.
    """
    from hrcneuro.figures.decode import draw

    tests, compared = test_table(scores, seed), compare_table(scores, config.decoders, seed)
    write_table(table2(scores), out / "table2.parquet", TABLE2)
    write_table(tests, out / "group_tests.parquet", TESTS)
    write_table(compared, out / "compared.parquet", COMPARED)
    write_table(scores[list(SUBJECTS.columns)], out / "subjects.parquet", SUBJECTS)
    first = scores[(scores["decoder"] == config.decoders[0]) & np.isfinite(scores["bacc"])]
    if len(first):
        draw(first, out / "decoding.png")
    return _summary(scores, tests, config.decoders[0])


def table2(scores: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of ``TABLE2``."""
    rows = []
    for (scenario, problem, decoder), part in _groups(scores):
        published = group.PUBLISHED.get((scenario, problem), {})
        for measure in MEASURES:
            found = group.spread(part[measure].to_numpy(dtype=float))
            mean, sd = published.get(measure, (math.nan, math.nan))
            detectable = math.nan if measure == "chance" else found.detectable
            if measure == "chance" and published:
                mean = group.PUBLISHED_CHANCE
            rows.append((scenario, problem, decoder, measure, found.mean, found.sd, found.n, detectable, mean, sd))
    return pd.DataFrame(rows, columns=list(TABLE2.columns))


def test_table(scores: pd.DataFrame, seed: int) -> pd.DataFrame:
    """Return the rows of ``TESTS``; Holm's correction runs over the problems of one decoder."""
    rows = []
    for (scenario, problem, decoder), part in _groups(scores):
        done = part[np.isfinite(part["bacc"])]
        everyone = scores[(scores["decoder"] == decoder) & np.isfinite(scores["bacc"])]
        published = group.PUBLISHED.get((scenario, problem))
        acc, chance = _mean(done["acc"]), _mean(everyone["chance"])
        rows.append(
            {
                **dict(zip(_KEY, (scenario, problem, decoder), strict=True)),
                "n": len(done),
                "bacc": _mean(done["bacc"]),
                "p": group.sign_flip_p(done["bacc"].to_numpy(dtype=float) - 50, _rng(seed, scenario, problem, decoder)),
                "acc": acc,
                "chance": chance,
                "above_chance": bool(acc > chance) if len(done) else None,
                "published_above": None if published is None else published["acc"][0] > group.PUBLISHED_CHANCE,
            }
        )
    table = pd.DataFrame(rows, columns=[name for name in TESTS.columns if name not in ("p_holm", "significant")])
    table["p_holm"] = table.groupby("decoder")["p"].transform(lambda p: group.holm(p.to_numpy(dtype=float)))
    table["significant"] = table["p_holm"].to_numpy(dtype=float) < 0.05
    return table


def compare_table(scores: pd.DataFrame, decoders: tuple[str, ...], seed: int) -> pd.DataFrame:
    """Return the rows of ``COMPARED``: each further decoder against the first, paired by subject."""
    rows = []
    for (scenario, problem), part in scores.groupby(["scenario", "problem"], sort=True):
        table = part.pivot(index="subject", columns="decoder", values="bacc")
        for decoder in decoders[1:]:
            if decoder not in table:
                continue
            found = group.spread((table[decoder] - table[decoders[0]]).to_numpy(dtype=float))
            rng = _rng(seed, str(scenario), str(problem), decoder, decoders[0])
            p = group.sign_flip_p((table[decoder] - table[decoders[0]]).to_numpy(dtype=float), rng, two_sided=True)
            rows.append((scenario, problem, decoder, decoders[0], found.n, found.mean, found.sd, p))
    table = pd.DataFrame(rows, columns=[name for name in COMPARED.columns if name != "p_holm"])
    table["p_holm"] = group.holm(table["p"].to_numpy(dtype=float))
    return table


def _summary(scores: pd.DataFrame, tests: pd.DataFrame, decoder: str) -> dict[str, Any]:
    found: dict[str, Any] = {}
    first = scores[scores["decoder"] == decoder]
    for row in tests[tests["decoder"] == decoder].to_dict("records"):
        part = first[(first["scenario"] == row["scenario"]) & (first["problem"] == row["problem"])]
        rates = {name: as_json(_mean(part[name])) for name in ("tnr", "tpr", "acc", "bacc", "chance")}
        found.setdefault(row["scenario"], {})[row["problem"]] = rates | {
            "n": row["n"],
            "p": as_json(row["p"]),
            "p_holm": as_json(row["p_holm"]),
        }
    lost = [f"{r['subject']} {r['scenario']} {r['problem']}" for r in first.to_dict("records") if not r["n_folds"]]
    if lost:
        found["warnings"] = [f"not computed, so left out of the group: {', '.join(lost)}"]
    return found


def _rng(seed: int, *names: str) -> np.random.Generator:
    return np.random.default_rng([seed, *"\0".join(names).encode()])


def _groups(scores: pd.DataFrame) -> Any:
    return scores.groupby(["scenario", "problem", "decoder"], sort=True)


def _mean(values: pd.Series) -> float:
    found = values[np.isfinite(values)]
    return float(found.mean()) if len(found) else math.nan
