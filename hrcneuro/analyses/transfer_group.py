"""The group's tables of transfer: learning curves, above chance or not, each way against the subjects' own decoders."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.analyses.decode_subject import as_json
from hrcneuro.decoding import group
from hrcneuro.decoding.generators import named
from hrcneuro.decoding.transfer_scheme import NEEDS_LABELS, WAYS
from hrcneuro.io.tables import Table
from hrcneuro.tables.transfer import COMPARED, CURVES, EVERY, NONE, SCORES, TESTS

_PLACE = ["signal", "scenario", "problem"]
_KEY = [*_PLACE, "way", "calibration"]
_LEVEL = 0.05
_ENDS = {NONE: 0.0, EVERY: math.inf}


def tables(scores: pd.DataFrame, seed: int) -> dict[str, tuple[Table, pd.DataFrame]]:
    """Return file name -> (schema, rows).

    Args:
        scores: Rows of ``SCORES``.
        seed: For sign flips of more than 16 subjects.
    """
    curves = curve_table(scores)
    return {
        "scores.parquet": (SCORES, scores),
        "curves.parquet": (CURVES, curves),
        "tests.parquet": (TESTS, test_table(scores, seed)),
        "compared.parquet": (COMPARED, compare_table(scores, curves, seed)),
    }


def curve_table(scores: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of ``CURVES``, each way's in the order of its calibration."""
    rows: list[dict[str, Any]] = []
    for key, part in _grouped(scores):
        over = group.spread(part["bacc"].to_numpy(float))
        row = dict(zip(_KEY, key, strict=True)) | {"pairs": part["pairs"].mean(), "minutes": part["minutes"].mean()}
        row |= {"n": over.n, "bacc": over.mean, "sd": over.sd, "half_width": over.half_width}
        before = rows[-1] if rows and [rows[-1][k] for k in _KEY[:4]] == list(key[:4]) else None
        rows.append(row | {"minutes_per_point": _price(before, row)})
    return pd.DataFrame(rows, columns=list(CURVES.columns))


def _price(before: Mapping[str, Any] | None, row: Mapping[str, Any]) -> float:
    if before is None or before["n"] != row["n"] or not row["bacc"] > before["bacc"]:
        return math.nan
    return float((row["minutes"] - before["minutes"]) / (row["bacc"] - before["bacc"]))


def test_table(scores: pd.DataFrame, seed: int) -> pd.DataFrame:
    """Return the rows of ``TESTS``: of each way with no calibration and with all; Holm's correction is over all."""
    rows = []
    for key, part in _grouped(scores):
        if key[-1] not in (NONE, EVERY):
            continue
        over = group.spread(part["bacc"].to_numpy(float))
        p = group.sign_flip_p(part["bacc"].to_numpy(float) - 50, named(seed, *key))
        row = dict(zip(_KEY, key, strict=True)) | {"n": over.n, "minutes": part["minutes"].mean(), "bacc": over.mean}
        rows.append(row | {"sd": over.sd, "half_width": over.half_width, "p": p})
    table = pd.DataFrame(rows, columns=[name for name in TESTS.columns if name not in ("p_holm", "significant")])
    table["p_holm"] = group.holm(table["p"].to_numpy(float))
    table["significant"] = table["p_holm"].to_numpy(float) < _LEVEL
    return table


def compare_table(scores: pd.DataFrame, curves: pd.DataFrame, seed: int) -> pd.DataFrame:
    """Return the rows of ``COMPARED``; none where nobody's own decoder is among the ways."""
    rows = []
    parts: Any = scores.groupby(_PLACE, sort=True)
    for place, part in parts:
        baccs = part.pivot(index="subject", columns=["way", "calibration"], values="bacc")
        learned = curves[(curves[_PLACE] == list(place)).all(axis=1) & (curves["way"] == "own")]
        for way, calibration in _ordered(baccs.columns):
            if ("own", EVERY) not in baccs or calibration not in (NONE, EVERY) or way == "own":
                continue
            difference = (baccs[way, calibration] - baccs["own", EVERY]).to_numpy(float)
            over = group.spread(difference)
            p = group.sign_flip_p(difference, named(seed, *place, way, calibration), two_sided=True)
            worth = _worth(learned, float(baccs[way, calibration].mean()))
            row = dict(zip(_KEY, (*place, way, calibration), strict=True)) | {"n": over.n, "difference": over.mean}
            rows.append(row | {"sd": over.sd, "half_width": over.half_width, "p": p, "worth_minutes": worth})
    table = pd.DataFrame(rows, columns=[name for name in COMPARED.columns if name != "p_holm"])
    table["p_holm"] = group.holm(table["p"].to_numpy(float))
    return table


def _worth(learned: pd.DataFrame, level: float) -> float:
    """Return at which minutes a mean learning curve first reaches a level, straight between its points."""
    minutes, bacc = learned["minutes"].to_numpy(float), learned["bacc"].to_numpy(float)
    reached = np.flatnonzero(bacc >= level)
    if not len(reached):
        return math.nan
    at = int(reached[0])
    if at == 0:
        return float(minutes[0])
    share = (level - bacc[at - 1]) / (bacc[at] - bacc[at - 1])
    return float(minutes[at - 1] + share * (minutes[at] - minutes[at - 1]))


def summary(scores: pd.DataFrame, tables: Mapping[str, tuple[Table, pd.DataFrame]]) -> dict[str, Any]:
    """Return scenario -> problem and signal -> way -> what came out, as JSON."""
    found: dict[str, Any] = {}
    compared = {tuple(row[k] for k in _KEY): row for row in tables["compared.parquet"][1].to_dict("records")}
    for row in tables["tests.parquet"][1].to_dict("records"):
        cells = found.setdefault(row["scenario"], {}).setdefault(f"{row['problem']}, {row['signal']}", {})
        name = row["way"] if row["way"] in (*NEEDS_LABELS, "pooled") else f"{row['way']}, {row['calibration']}"
        numbers = {k: as_json(row[k]) for k in ("bacc", "half_width", "p_holm", "minutes")}
        beside = compared.get(tuple(row[k] for k in _KEY))
        if beside is not None:
            numbers |= {f"{k}_to_own": as_json(beside[k]) for k in ("difference", "p_holm")}
            numbers["worth_minutes"] = as_json(beside["worth_minutes"])
        cells[name] = numbers | {"n": int(row["n"])}
    return {"subjects": sorted(scores["subject"].unique()), "decoded": found}


def _grouped(scores: pd.DataFrame) -> list[tuple[Any, pd.DataFrame]]:
    """Return the groups of equal place, way and calibration, calibrations in rising order."""
    parts = list(scores.groupby(_KEY, sort=True, observed=True))
    return sorted(parts, key=lambda part: (part[0][:3], _rank(part[0][3:])))


def _ordered(columns: Any) -> list[tuple[str, str]]:
    return sorted(columns, key=_rank)


def _rank(key: tuple[str, str]) -> tuple[int, float]:
    way, calibration = key
    return WAYS.index(way), _ENDS[calibration] if calibration in _ENDS else float(calibration)
