"""What this run has measured of setup and parameters: counts, rates and sizes that no verdict rests on."""

from __future__ import annotations

from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.paradigm.grid import SIZE, STEPS
from hrcneuro.report.results import Results


def gather(results: Results) -> SimpleNamespace:
    """Return the facts as words, by the names that :mod:`parameters` asks for; a dash stands for what has not run."""
    settings = results.settings
    acquired = [results.summary("acquire", u) for u in results.units("acquire")]
    robots = [results.summary("robot", u) for u in results.included("robot")]
    cell, model = settings.sections["robot"].cell, settings.sections["simulate"]
    decode = settings.sections["decode"]
    eeg = _range(a.get("channels", {}).get("eeg") for a in acquired)
    logs = [t for t in results.tables("acquire", "trials.parquet").values() if t["scenario"].notna().any()]
    return SimpleNamespace(
        subjects=len(settings.study.subjects),
        excluded=f"{len(settings.study.exclude)} ({', '.join(settings.study.exclude)})"
        if settings.study.exclude
        else "0",
        included=len(settings.included),
        eeg=eeg,
        eog=_range(a.get("channels", {}).get("eog") for a in acquired),
        reference=_words(a.get("reference") for a in acquired),
        source_sfreq=_hz(results.summary("preprocess", u).get("source_sfreq") for u in results.units("preprocess")),
        sfreq=_hz(results.summary("preprocess", u).get("sfreq") for u in results.units("preprocess")),
        loop_hz=_hz(r.get("loop_hz") for r in robots),
        grid_edge=f"{SIZE * cell.tile:g} × {SIZE * cell.tile:g} m",
        far_edge=f"{cell.near_edge + SIZE * cell.tile:g} m",
        conditions=sum(name.count("_") == 1 for name in settings.shared.conditions),
        problems=len(settings.shared.problems),
        levels=", ".join(f"{v:g}" for v in model.levels) + " %",
        test_cases=", ".join(f"({n}, {m})" for n, m in model.test_cases) or "-",
        reassigned=f"{'every ' if model.reassign == 'every' else ''}{model.period} episodes",
        rates="this run's decoder"
        if model.rates != "paper"
        else ", ".join(f"{v:g}" for v in (model.tnr_hh, model.tpr_hr, model.tnr_rr, model.tpr_rh)) + " %",
        **_windows(eeg, decode.decoders[0] if decode.decoders else ""),
        **_session(logs),
    )


def _windows(eeg: str, decoder: str) -> dict[str, str]:
    """Return what decoders see of a trial, with so many EEG channels."""
    from hrcneuro.decoding.features import COARSE_S, FINE_S, WINDOWS_S

    facts = {}
    for name, windows in (("short_windows", FINE_S), ("long_windows", COARSE_S)):
        width = 1000 * (windows[0][1] - windows[0][0])
        span = f"{1000 * windows[0][0]:.0f} to {1000 * windows[-1][1]:.0f} ms"
        facts[name] = f"{len(windows)} of {width:.0f} ms in {span}"
    facts["last_window"] = f"{1000 * max(stop for _, stop in WINDOWS_S):.0f} ms"
    plain = decoder == "rlda" and eeg.isdigit()
    facts["features"] = f"{int(eeg) * len(WINDOWS_S)} = {eeg} × {len(WINDOWS_S)}" if plain else "-"
    return facts


def _session(tables: list[pd.DataFrame]) -> dict[str, Any]:
    """Return what the logs say of the protocol."""
    names = ("scenarios", "blocks", "episodes", "practice", "error_rate", "soa_range", "least_steps")
    facts: dict[str, Any] = dict.fromkeys(names, "-")
    if not tables:
        return facts
    moves = pd.concat([t.assign(unit=i) for i, t in enumerate(tables)], ignore_index=True)
    practice = moves["practice"].astype(bool)
    main, trained = moves[~practice], moves[practice]
    facts["scenarios"] = main["scenario"].nunique()
    facts["blocks"] = _range(main.groupby("unit")["block"].nunique())
    facts["episodes"] = _range(main.groupby(["unit", "block"])["episode"].nunique())
    if len(trained):
        per_block = trained.groupby(["unit", "scenario", "block"], observed=True)["episode"].nunique()
        facts["practice"] = f"1, {_range(per_block)}"
    free = main[~main["prev_error"].astype(bool)]
    facts["error_rate"] = f"{100 * free['error'].astype(bool).mean():.1f} % of moves after none"
    facts["least_steps"] = int(steps(main).min())
    soa = main["soa_s"].dropna()
    if len(soa):
        low, high = np.quantile(soa, [0.01, 0.99]) * 1000
        facts["soa_range"] = f"{low:.0f} to {high:.0f} ms (1 to 99 %)"
    return facts


def steps(moves: pd.DataFrame) -> np.ndarray:
    """Return the Manhattan distance from start to goal of every episode: ndarray, shape (n_episodes,), tiles.

    The log has no start: it is where the first move came from. An episode ends on its goal.

    Args:
        moves: Rows of ``trials.parquet``; a column ``unit`` tells several subjects apart.
    """
    keys = [k for k in ("unit", "block", "episode") if k in moves]
    ordered = moves.sort_values([*keys, "trial"])
    first, last = ordered.groupby(keys).first(), ordered.groupby(keys).last()
    executed = [STEPS.get(str(d), (0, 0)) for d in ordered.groupby(keys).nth(0)["executed"]]
    start = first[["row", "col"]].to_numpy(int) - np.array(executed)
    return np.abs(last[["row", "col"]].to_numpy(int) - start).sum(axis=1)


def _range(values: Iterable[Any]) -> str:
    ordered = sorted({v for v in values if v is not None})
    if not ordered:
        return "-"
    return f"{ordered[0]}" if len(ordered) == 1 else f"{ordered[0]} to {ordered[-1]}"


def _hz(values: Iterable[Any]) -> str:
    text = _range(round(v, 1) for v in values if v is not None)
    return text if text == "-" else f"{text.replace('.0', '')} Hz"


def _words(values: Iterable[Any]) -> str:
    return "; ".join(sorted({str(v) for v in values if v})) or "-"
