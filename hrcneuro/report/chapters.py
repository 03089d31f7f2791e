"""What a chapter says beside its figures: counts, Table 2, subjects, milestones, the arm."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from hrcneuro.contract import GROUP
from hrcneuro.report import regression, transfer
from hrcneuro.report import subjects as of_subjects
from hrcneuro.report.markup import Cell, NotedCell, PageTable, render
from hrcneuro.report.measured_decoding import guessing
from hrcneuro.report.results import Results
from hrcneuro.report.verdicts import spread
from hrcneuro.sources.origin import Origins
from hrcneuro.tables.decode import ABOVE

Values = Mapping[str, Any]

_MEASURES = {"tnr": "TNR", "tpr": "TPR", "acc": "ACC", "bacc": "balanced", "auc": "AUC"}
_PLAIN = {"bacc": "all trials", "lobo_bacc": "one block left out"}
# No balanced accuracies: what a decoder gains in open blocks that merely prefers one answer.
_STAYS = {
    "stays_rule_acc": "no EEG: the actor stays, plain accuracy",
    "stays": "how often the decoder says that the actor stays",
}
_STRATA = {
    **_PLAIN,
    "prev_error_no_bacc": "after no error",
    "prev_error_yes_bacc": "after an error",
    "turn_no_bacc": "no turn ahead",
    "turn_yes_bacc": "turn ahead",
    "matched_bacc": "retrained after no error",
    "prev_error_fitted_bacc": "no EEG: previous error",
    "turn_fitted_bacc": "no EEG: turn ahead",
    **_STAYS,
}


def tables(results: Results, stage: str) -> str:
    """Return a stage's tables as HTML; empty where it has none to show."""
    values = _VALUES[stage](results) if stage in _VALUES else {}
    return render(f"chapters/{stage}.html", **values) if values else ""


def _recordings(results: Results) -> Values:
    rows: list[list[Cell]] = []
    for unit in results.units("acquire"):
        s = results.summary("acquire", unit)
        kind = _kind(Origins.of(s.get("origin", {})))
        channels = ", ".join(f"{n} {name}" for name, n in sorted(s.get("channels", {}).items()))
        events = ", ".join(f"{n} {name}" for name, n in sorted(s.get("events", {}).items()))
        out = "" if unit in results.settings.included else "excluded"
        minutes = s.get("duration_s", math.nan) / 60
        rows.append([unit, kind, channels, f"{s.get('sfreq', 0):g} Hz", f"{minutes:.1f} min", events, out])
    head = ["subject", "data", "channels", "rate", "length", "events", "note"]
    return {"recordings": PageTable(head, rows)}


def _kind(origins: Origins) -> str:
    """Return where a subject's data come from, in a few words."""
    whose = f" (the study's {origins.log})" if origins.log else ""
    if origins.eeg is origins.behaviour:
        return f"{origins.eeg}{whose}"
    return f"EEG {origins.eeg}, behaviour {origins.behaviour}{whose}"


def _quality(results: Results) -> Values:
    rows: list[list[Cell]] = []
    for unit in results.units("preprocess"):
        s = results.summary("preprocess", unit)
        rate = f"{s.get('source_sfreq', 0):g} to {s.get('sfreq', 0):g} Hz"
        replaced = s.get("interpolated", ())
        kept = sorted(f"{name} ({why})" for name, why in s.get("noisy", {}).items() if name not in replaced)
        method = s.get("interpolation", "")
        rows.append([unit, ", ".join(replaced) or "none", ", ".join(kept) or "none", rate, method])
    head = ["subject", "replaced", "noisy all the time, and kept (PREP)", "rate", "interpolation"]
    return {"replaced": PageTable(head, rows)}


def _counts(results: Results) -> Values:
    summaries = {u: results.summary("epoch", u) for u in results.units("epoch")}
    cells = [(s, c) for one in summaries.values() for s, cases in one.get("counts", {}).items() for c in cases]
    # A summary that comes from the cache has lost its order.
    cells = sorted(set(cells))
    rows: list[list[Cell]] = []
    for unit, s in summaries.items():
        counts = [s.get("counts", {}).get(scenario, {}).get(case, 0) for scenario, case in cells]
        rows.append([unit, *counts, s.get("epochs", ""), s.get("rejected", 0), "outlier" if s.get("outlier") else ""])
    included = [s for u, s in summaries.items() if u in results.settings.included]
    if len(included) > 1:
        means = [spread([s.get("counts", {}).get(a, {}).get(b, 0) for s in included], 0) for a, b in cells]
        rows.append([f"mean ± SD, n = {len(included)}", *means, "", "", ""])
    head = ["subject", *(f"{a} {b}" for a, b in cells), "epochs", "rejected", "note"]
    return {"counts": PageTable(head, rows)}


def _potentials(results: Results) -> Values:
    return {} if ("erp", GROUP) in results.done else {"peaks": of_subjects.potentials(results)}


def _rhythms(results: Results) -> Values:
    return {} if ("ersp", GROUP) in results.done else {"peaks": of_subjects.rhythms(results)}


def _decoding(results: Results) -> Values:
    if ("decode", GROUP) in results.done:
        return _of_group(results)
    scores = of_subjects.scores(results)
    if scores is None:
        return {}
    return {"decoders": [], "subjects": _subjects(scores), "repeats": results.settings.sections["decode"].repeats}


def _of_group(results: Results) -> Values:
    table2, subjects = (results.table("decode", GROUP, f"{n}.parquet") for n in ("table2", "subjects"))
    tests = results.table("decode", GROUP, "group_tests.parquet")
    if table2 is None or subjects is None or tests is None or table2.empty:
        return {}
    compared = results.table("decode", GROUP, "compared.parquet")
    names = list(dict.fromkeys(subjects["decoder"]))
    decoders = []
    for name in names:
        rows = table2[table2["decoder"] == name]
        decoders.append({"name": name, "table_2": _table_2(rows), "strata": _strata(rows)})
    printed = bool(np.isfinite(table2["published_mean"].astype(float)).any())
    return {
        "title": "Table 2" if printed else "All subjects",
        "decoders": decoders,
        "guessing": guessing(results) if printed else "",
        "tests": _tests(tests),
        "compared": _compared(compared, names[0]) if compared is not None and len(compared) else None,
        "subjects": _subjects(subjects),
        "repeats": results.settings.sections["decode"].repeats,
    }


def _compared(compared: Any, first: str) -> PageTable:
    rows: list[list[Cell]] = [
        [r["scenario"], r["problem"], r["decoder"], f"{r['difference']:+.1f}{_give_or_take(r['sd'])}", _p(r["p_holm"])]
        for r in compared.to_dict("records")
    ]
    return PageTable(["scenario", "problem", "decoder", f"balanced accuracy less that of {first}", "p (Holm)"], rows)


def _table_2(rows: Any) -> PageTable:
    measures = _MEASURES | {"lobo_bacc": "LOBO", "chance": "chance"}
    lines: list[list[Cell]] = []
    for (scenario, problem), part in rows.groupby(["scenario", "problem"], sort=True):
        at = {r["measure"]: r for r in part.to_dict("records")}
        ours = [_mean(at.get(name)) for name in measures]
        lines.append([scenario, problem, "this run", *ours])
        printed = [_mean(at.get(name), "published_") for name in measures]
        if any(cell != "-" for cell in printed):
            lines.append(["", "", "published", *printed])
    return PageTable(["scenario", "problem", "", *(f"{name} (%)" for name in measures.values())], lines)


def _strata(rows: Any) -> PageTable | None:
    """Return a table with a row a measure and a column a problem; None where no trial has a cue."""
    places = list(rows.groupby(["scenario", "problem"], sort=True))
    at = [{r["measure"]: r for r in part.to_dict("records")} for _, part in places]
    lines: list[list[Cell]] = []
    for name, label in _STRATA.items():
        cells = [_powered(one.get(name), one["bacc"]["n"]) for one in at]
        if any(cell != "-" for cell in cells):
            lines.append([label, *cells])
    # Without any cue only the plain accuracies are left, which stand above.
    if not any(line[0] not in (_PLAIN | _STAYS).values() for line in lines):
        return None
    head = ["balanced accuracy (%)", *(f"{scenario}: {problem}" for (scenario, problem), _ in places)]
    return PageTable(head, lines)


def _powered(row: Mapping[str, Any] | None, subjects: int) -> Cell:
    """Return mean ± SD, and below it what could have been detected, and of how many subjects if not of all."""
    mean = _mean(row)
    if row is None or mean == "-":
        return mean
    known = math.isfinite(row["detectable"]) and not row["measure"].endswith("_fitted_bacc")
    notes = [f"detectable {row['detectable']:.1f}"] if known else []
    notes += [f"n = {row['n']}"] if row["n"] < subjects else []
    return NotedCell(mean, ", ".join(notes)) if notes else mean


def _mean(row: Mapping[str, Any] | None, prefix: str = "") -> str:
    if row is None or not math.isfinite(row[f"{prefix}mean"]):
        return "-"
    return f"{row[f'{prefix}mean']:.1f}{_give_or_take(row[f'{prefix}sd'])}"


def _give_or_take(sd: float) -> str:
    """Return what follows a mean; nothing after the value of one subject."""
    return f" ± {sd:.1f}" if math.isfinite(sd) else ""


def _tests(tests: Any) -> PageTable:
    rows: list[list[Cell]] = [
        [
            r["scenario"],
            r["problem"],
            r["decoder"],
            r["n"],
            f"{r['bacc']:.1f}",
            _p(r["p"]),
            _p(r["p_holm"]),
            *(_above(r, rate) for rate in ABOVE),
        ]
        for r in tests.to_dict("records")
    ]
    head = ["scenario", "problem", "decoder", "n", "balanced (%)", "p, sign flips", "p (Holm)"]
    return PageTable([*head, *(f"p, {_MEASURES[rate]} above chance" for rate in ABOVE)], rows)


def _above(row: Mapping[str, Any], rate: str) -> Cell:
    """Return a rate's p value against the chance level, and below it what the paper prints."""
    printed = {True: "published: significant", False: "published: not significant"}.get(row[f"published_{rate}"], "")
    return NotedCell(_p(row[f"p_{rate}"]), printed) if printed else _p(row[f"p_{rate}"])


def _subjects(subjects: Any) -> PageTable:
    rows: list[list[Cell]] = []
    for r in subjects.sort_values(["scenario", "problem", "decoder", "subject"]).to_dict("records"):
        shown = (*_MEASURES, "lobo_bacc", "chance", "permutation_bacc")
        rates = [f"{r[name]:.1f}" if math.isfinite(r[name]) else "-" for name in shown]
        trials = f"{r['n1']} : {r['n2']}"
        rows.append([r["scenario"], r["problem"], r["decoder"], r["subject"], trials, *rates, _p(r["p"]), r["note"]])
    rates_head = [*_MEASURES.values(), "LOBO", "chance", "balanced, one repeat", "its p, permutation", ""]
    return PageTable(["scenario", "problem", "decoder", "subject", "trials", *rates_head], rows)


def _p(value: float | None) -> str:
    return "-" if value is None or not math.isfinite(value) else f"{value:.3g}"


def _milestones(results: Results) -> Values:
    reached = results.table("simulate", GROUP, "milestones.parquet")
    if reached is None:
        return {}
    rows: list[list[Cell]] = []
    for r in reached[reached["variant"].astype(str).str.contains("emp")].to_dict("records"):
        episode, earliest, latest = (f"{v:.0f}" if math.isfinite(v) else "never" for v in _three(r))
        minutes = f"{r['minutes']:.0f}" if math.isfinite(r["minutes"]) else "-"
        level = f"{100 * r['level']:.0f} %"
        rows.append(
            [r["simulation"], r["variant"], level, episode, f"{earliest} to {latest}", f"{r['trial_s']:g} s", minutes]
        )
    head = ["simulation", "decoder", "accuracy", "episode", "95 % band", "a trial lasts", "minutes"]
    return {"milestones": PageTable(head, rows)}


def _three(row: Mapping[str, Any]) -> tuple[float, float, float]:
    return tuple(math.nan if row[n] is None else float(row[n]) for n in ("episode", "earliest", "latest"))  # type: ignore[return-value]


def _arms(results: Results) -> Values:
    rows: list[list[Cell]] = []
    for unit in results.units("robot"):
        s = results.summary("robot", unit)
        rows.append(
            [
                unit,
                s.get("moves", "-"),
                _number(s.get("max_error_mm"), 3),
                _number(s.get("end_error_mm"), 3),
                _number(s.get("t_2mm_s"), 3),
                _number(s.get("loop_hz"), 2),
                _number(s.get("jitter_p99_ms"), 3),
                s.get("stops", "-"),
            ]
        )
    head = ["subject", "moves", "greatest error (mm)", "error on arrival (mm)", "2 mm after (s)", "loop (Hz)"]
    return {"arms": PageTable([*head, "jitter, 99 % (ms)", "stops"], rows)}


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def _calibrations(results: Results) -> Values:
    return {"calibrations": of_subjects.calibrations(results)}


# Stage -> what its template is given; empty where it has nothing to show.
_VALUES: dict[str, Callable[[Results], Values]] = {
    "acquire": _recordings,
    "preprocess": _quality,
    "epoch": _counts,
    "erp": _potentials,
    "ersp": _rhythms,
    "rerp": regression.values,
    "decode": _decoding,
    "transfer": transfer.values,
    "simulate": _milestones,
    "robot": _arms,
    "calibrate": _calibrations,
}
