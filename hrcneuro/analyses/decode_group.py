"""The group's tables of decode: Table 2 beside the published one, tests over subjects, decoders compared."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro import published
from hrcneuro.analyses.decode_subject import as_json
from hrcneuro.decoding import group
from hrcneuro.decoding.generators import named
from hrcneuro.io.tables import Table
from hrcneuro.tables.decode import ABOVE, COMPARED, EXTRA, SCORES, SHARES, SUBJECTS, TABLE2, TESTS

_KEY = {name: SCORES.columns[name] for name in ("scenario", "problem", "decoder")}
MEASURES = ("tnr", "tpr", "acc", "bacc", "auc", "chance", *EXTRA)


def tables(scores: pd.DataFrame, decoders: Sequence[str], seed: int) -> dict[str, tuple[Table, pd.DataFrame]]:
    """Return file name -> (schema, rows).

    Args:
        scores: All subjects' scores.parquet with a column ``subject``.
        decoders: Names of the decoders; others are compared with the first.
        seed: For sign flips of more than 16 subjects; each row draws its own, whatever other decoders there are.
    """
    return {
        "table2.parquet": (TABLE2, table2(scores)),
        "group_tests.parquet": (TESTS, test_table(scores, seed)),
        "compared.parquet": (COMPARED, compare_table(scores, decoders, seed)),
        "subjects.parquet": (SUBJECTS, scores[list(SUBJECTS.columns)]),
    }


def table2(scores: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of ``TABLE2``."""
    rows = []
    for (scenario, problem, decoder), part in _groups(scores):
        printed = published.TABLE_2.get((scenario, problem), {})
        for measure in MEASURES:
            ours = group.spread(part[measure].to_numpy(dtype=float))
            mean, sd = printed[measure].value if measure in printed else (math.nan, math.nan)
            detectable = math.nan if measure in SHARES else ours.detectable
            if measure == "chance" and printed:
                mean = published.CHANCE.value
            key = (scenario, problem, decoder, measure)
            rows.append((*key, ours.mean, ours.sd, ours.n, ours.half_width, detectable, mean, sd))
    return pd.DataFrame(rows, columns=list(TABLE2.columns))


def test_table(scores: pd.DataFrame, seed: int) -> pd.DataFrame:
    """Return the rows of ``TESTS``; Holm's correction runs over the problems of one decoder."""
    rows = []
    for key, part in _groups(scores):
        scenario, problem, decoder = key
        done = part[np.isfinite(part["bacc"])]
        everyone = scores[(scores["decoder"] == decoder) & np.isfinite(scores["bacc"])]
        printed = published.ABOVE_CHANCE.get((scenario, problem), {})
        rows.append(
            {
                **dict(zip(_KEY, key, strict=True)),
                "n": len(done),
                "bacc": _mean(done["bacc"]),
                "p": group.sign_flip_p(
                    done["bacc"].to_numpy(dtype=float) - 50, named(seed, scenario, problem, decoder)
                ),
                "acc": _mean(done["acc"]),
                "chance": _mean(everyone["chance"]),
                **{f"p_{rate}": _above_chance_p(done, rate, named(seed, *key, rate)) for rate in ABOVE},
                **{f"published_{rate}": printed[rate].value if rate in printed else None for rate in ABOVE},
            }
        )
    table = pd.DataFrame(rows, columns=[name for name in TESTS.columns if name not in ("p_holm", "significant")])
    table["p_holm"] = table.groupby("decoder")["p"].transform(lambda p: group.holm(p.to_numpy(dtype=float)))
    table["significant"] = table["p_holm"].to_numpy(dtype=float) < 0.05
    return table


def _above_chance_p(subjects: pd.DataFrame, rate: str, rng: np.random.Generator) -> float:
    """Return how likely such rates are by chance alone: each subject's rate less that subject's chance level."""
    return group.sign_flip_p((subjects[rate] - subjects["chance"]).to_numpy(dtype=float), rng)


def compare_table(scores: pd.DataFrame, decoders: Sequence[str], seed: int) -> pd.DataFrame:
    """Return the rows of ``COMPARED``: each further decoder against the first, paired by subject."""
    rows = []
    for (scenario, problem), part in scores.groupby(["scenario", "problem"], sort=True):
        table = part.pivot(index="subject", columns="decoder", values="bacc")
        for decoder in decoders[1:]:
            if decoder not in table:
                continue
            difference = (table[decoder] - table[decoders[0]]).to_numpy(dtype=float)
            over = group.spread(difference)
            rng = named(seed, str(scenario), str(problem), decoder, decoders[0])
            p = group.sign_flip_p(difference, rng, two_sided=True)
            rows.append((scenario, problem, decoder, decoders[0], over.n, over.mean, over.sd, p))
    table = pd.DataFrame(rows, columns=[name for name in COMPARED.columns if name != "p_holm"])
    table["p_holm"] = group.holm(table["p"].to_numpy(dtype=float))
    return table


def summary(scores: pd.DataFrame, tests: pd.DataFrame, decoder: str) -> dict[str, Any]:
    """Return scenario -> problem -> mean rates, interval, n, p values and classes, and who was left out.

    They are the first decoder's, whose name stands beside them; the others' stand in ``others``, by name.

    Args:
        scores: As :func:`tables` takes them.
        tests: The rows of ``TESTS``.
        decoder: The first one's name.
    """
    cells: dict[str, Any] = {}
    first = scores[scores["decoder"] == decoder]
    ours = tests["decoder"] == decoder
    for row in [*tests[ours].to_dict("records"), *tests[~ours].to_dict("records")]:
        part = scores[(scores[list(_KEY)] == [row[name] for name in _KEY]).all(axis=1)]
        numbers = _numbers(part, row)
        chance = {"chance": as_json(_mean(part["chance"]))}
        problems = cells.setdefault(row["scenario"], {})
        if row["decoder"] == decoder:
            classes = [str(part[name].iloc[0]) for name in ("class1", "class2")]
            problems[row["problem"]] = numbers | chance | {"decoder": decoder, "classes": classes}
        else:
            problems[row["problem"]].setdefault("others", {})[row["decoder"]] = numbers
    lost = [f"{r['subject']} {r['scenario']} {r['problem']}" for r in first.to_dict("records") if not r["n_folds"]]
    if lost:
        cells["warnings"] = [f"not computed, so left out of the group: {', '.join(lost)}"]
    return cells


def _numbers(scores: pd.DataFrame, test: Mapping[Any, Any]) -> dict[str, Any]:
    """Return mean rates, interval, n and p values of one problem and decoder."""
    rates = {name: as_json(_mean(scores[name])) for name in ("tnr", "tpr", "acc", "bacc")}
    return rates | {
        "n": test["n"],
        "acc_half_width": as_json(group.spread(scores["acc"].to_numpy(dtype=float)).half_width),
        "p": as_json(test["p"]),
        "p_holm": as_json(test["p_holm"]),
        "p_above_chance": {rate: as_json(test[f"p_{rate}"]) for rate in ABOVE},
    }


def _groups(scores: pd.DataFrame) -> Any:
    return scores.groupby(["scenario", "problem", "decoder"], sort=True)


def _mean(values: pd.Series) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if len(finite) else math.nan
