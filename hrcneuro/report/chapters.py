"""What a chapter says beside its figures: counts, Table 2, subjects, milestones, the arm."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from hrcneuro.report.markup import Cell, Raw, esc, fold, table
from hrcneuro.report.results import Results
from hrcneuro.report.verdicts import spread

_MEASURES = {"tnr": "TNR", "tpr": "TPR", "acc": "ACC", "bacc": "balanced", "auc": "AUC"}
_MEANINGS = (
    "<p class='small'>Balanced: mean of TNR and TPR. AUC: area under the receiver operating characteristic. LOBO: "
    "balanced accuracy with one block left out at a time.</p>"
)
_PLAIN = {"bacc": "all trials", "lobo_bacc": "one block left out"}
_STRATA = {
    **_PLAIN,
    "prev_error_no_bacc": "after no error",
    "prev_error_yes_bacc": "after an error",
    "turn_no_bacc": "no turn ahead",
    "turn_yes_bacc": "turn ahead",
    "matched_bacc": "retrained after no error",
    "prev_error_fitted_bacc": "no EEG: previous error",
    "turn_fitted_bacc": "no EEG: turn ahead",
}
_POWER = (
    "<p class='small'>Detectable: the smallest mean that a one-sided t test against 50 % finds with 80 % power, with "
    "as many subjects and this SD. Retrained decoders learn from fewer trials, which costs accuracy whatever is "
    "decoded.</p>"
)


def tables(results: Results, stage: str) -> str:
    """Return a stage's tables; empty where it has none to show."""
    makers = {
        "acquire": _recordings,
        "preprocess": _quality,
        "epoch": _counts,
        "decode": _decoding,
        "simulate": _milestones,
        "robot": _robots,
    }
    return makers[stage](results) if stage in makers else ""


def _recordings(results: Results) -> str:
    rows: list[list[Cell]] = []
    for unit in results.units("acquire"):
        s = results.summary("acquire", unit)
        real = s.get("real", {})
        kind = "real" if real.get("eeg") else "synthetic EEG, real behaviour" if real.get("behaviour") else "synthetic"
        channels = ", ".join(f"{n} {name}" for name, n in sorted(s.get("channels", {}).items()))
        events = ", ".join(f"{n} {name}" for name, n in sorted(s.get("events", {}).items()))
        out = "" if unit in results.settings.included else "excluded"
        minutes = s.get("duration_s", math.nan) / 60
        rows.append([unit, kind, channels, f"{s.get('sfreq', 0):g} Hz", f"{minutes:.1f} min", events, out])
    return table(["subject", "data", "channels", "rate", "length", "events", "note"], rows)


def _quality(results: Results) -> str:
    rows: list[list[Cell]] = []
    for unit in results.units("preprocess"):
        s = results.summary("preprocess", unit)
        rate = f"{s.get('source_sfreq', 0):g} to {s.get('sfreq', 0):g} Hz"
        rows.append([unit, ", ".join(s.get("interpolated", ())) or "none", rate, s.get("interpolation", "")])
    return fold("Replaced channels", table(["subject", "replaced", "rate", "interpolation"], rows))


def _counts(results: Results) -> str:
    found = {u: results.summary("epoch", u) for u in results.units("epoch")}
    cells = [(s, c) for one in found.values() for s, cases in one.get("counts", {}).items() for c in cases]
    # A summary that comes from the cache has lost its order.
    cells = sorted(set(cells))
    rows: list[list[Cell]] = []
    for unit, s in found.items():
        counts = [s.get("counts", {}).get(scenario, {}).get(case, 0) for scenario, case in cells]
        rows.append([unit, *counts, s.get("epochs", ""), s.get("rejected", 0), "outlier" if s.get("outlier") else ""])
    included = [s for u, s in found.items() if u in results.settings.included]
    if len(included) > 1:
        means = [spread([s.get("counts", {}).get(a, {}).get(b, 0) for s in included], 0) for a, b in cells]
        rows.append([f"mean ± SD, n = {len(included)}", *means, "", "", ""])
    head = ["subject", *(f"{a} {b}" for a, b in cells), "epochs", "rejected", "note"]
    return table(head, rows)


def _decoding(results: Results) -> str:
    table2, subjects = (results.table("decode", "group", f"{n}.parquet") for n in ("table2", "subjects"))
    tests = results.table("decode", "group", "group_tests.parquet")
    if table2 is None or subjects is None or tests is None or table2.empty:
        return ""
    decoders = list(dict.fromkeys(subjects["decoder"]))
    title = "Table 2" if np.isfinite(table2["published_mean"].astype(float)).any() else "All subjects"
    at = {name: table2[table2["decoder"] == name] for name in decoders}
    text = f"<h3>{title}</h3>{_table_2(at[decoders[0]])}{_MEANINGS}"
    text += f"<h3>Above chance?</h3>{_tests(tests)}{_strata(at[decoders[0]])}"
    compared = results.table("decode", "group", "compared.parquet")
    if compared is not None and len(compared):
        rows = [
            [r["scenario"], r["problem"], r["decoder"], f"{r['difference']:+.1f} ± {r['sd']:.1f}", _p(r["p_holm"])]
            for r in compared.to_dict("records")
        ]
        head = ["scenario", "problem", "decoder", f"balanced accuracy less that of {decoders[0]}", "p (Holm)"]
        text += f"<h3>Decoders compared</h3>{table(head, rows)}"
    for name in decoders[1:]:
        text += fold(f"{title} and strata of {name}", _table_2(at[name]) + _strata(at[name]))
    scheme = results.settings.sections["decode"]
    caveat = (
        "<p class='small'>p, permutation, tests the balanced accuracy of one repeat, whose folds are drawn for it and "
        f"which stands before it; the other rates are means over the repeats, {scheme.repeats} as configured.</p>"
    )
    return text + fold("Every subject", caveat + _subjects(subjects))


def _table_2(rows: Any) -> str:
    measures = _MEASURES | {"lobo_bacc": "LOBO", "chance": "chance"}
    lines: list[list[Cell]] = []
    for (scenario, problem), part in rows.groupby(["scenario", "problem"], sort=True):
        at = {r["measure"]: r for r in part.to_dict("records")}
        ours = [_mean(at.get(name)) for name in measures]
        lines.append([scenario, problem, "this run", *ours])
        printed = [_mean(at.get(name), "published_") for name in measures]
        if any(cell != "-" for cell in printed):
            lines.append(["", "", "published", *printed])
    return table(["scenario", "problem", "", *(f"{name} (%)" for name in measures.values())], lines)


def _strata(rows: Any) -> str:
    """Return a table with a row a measure and a column a problem; empty where no trial has a cue."""
    places = list(rows.groupby(["scenario", "problem"], sort=True))
    at = [{r["measure"]: r for r in part.to_dict("records")} for _, part in places]
    lines: list[list[Cell]] = []
    for name, label in _STRATA.items():
        cells = [_powered(one.get(name), one["bacc"]["n"]) for one in at]
        if any(cell != "-" for cell in cells):
            lines.append([label, *cells])
    # Without any cue only the plain accuracies are left, which stand above.
    if not any(line[0] not in _PLAIN.values() for line in lines):
        return ""
    head = ["balanced accuracy (%)", *(f"{scenario}: {problem}" for (scenario, problem), _ in places)]
    return f"<h3>Within strata, and without EEG</h3>{_POWER}{table(head, lines)}"


def _powered(row: Mapping[str, Any] | None, subjects: int) -> Cell:
    """Return mean ± SD, and below it what could have been detected, and of how many subjects if not of all."""
    mean = _mean(row)
    if row is None or mean == "-":
        return mean
    known = math.isfinite(row["detectable"]) and not row["measure"].endswith("_fitted_bacc")
    notes = [f"detectable {row['detectable']:.1f}"] if known else []
    notes += [f"n = {row['n']}"] if row["n"] < subjects else []
    return Raw(f"{esc(mean)}<small>{', '.join(notes)}</small>") if notes else mean


def _mean(row: Mapping[str, Any] | None, prefix: str = "") -> str:
    if row is None or not math.isfinite(row[f"{prefix}mean"]):
        return "-"
    sd = row[f"{prefix}sd"]
    return f"{row[f'{prefix}mean']:.1f}" + (f" ± {sd:.1f}" if math.isfinite(sd) else "")


def _tests(tests: Any) -> str:
    rows: list[list[Cell]] = [
        [
            r["scenario"],
            r["problem"],
            r["decoder"],
            r["n"],
            f"{r['bacc']:.1f}",
            _p(r["p"]),
            _p(r["p_holm"]),
            *({True: "yes", False: "no"}.get(r[name], "-") for name in ("above_chance", "published_above")),
        ]
        for r in tests.to_dict("records")
    ]
    head = ["scenario", "problem", "decoder", "n", "balanced (%)", "p, sign flips", "p (Holm)", "ACC above chance"]
    return table([*head, "published"], rows)


def _subjects(subjects: Any) -> str:
    rows: list[list[Cell]] = []
    for r in subjects.sort_values(["scenario", "problem", "decoder", "subject"]).to_dict("records"):
        shown = (*_MEASURES, "lobo_bacc", "chance", "permutation_bacc")
        rates = [f"{r[name]:.1f}" if math.isfinite(r[name]) else "-" for name in shown]
        trials = f"{r['n1']} : {r['n2']}"
        rows.append([r["scenario"], r["problem"], r["decoder"], r["subject"], trials, *rates, _p(r["p"]), r["note"]])
    rates_head = [*_MEASURES.values(), "LOBO", "chance", "balanced, one repeat", "its p, permutation", ""]
    return table(["scenario", "problem", "decoder", "subject", "trials", *rates_head], rows)


def _p(value: float | None) -> str:
    return "-" if value is None or not math.isfinite(value) else f"{value:.3g}"


def _milestones(results: Results) -> str:
    found = results.table("simulate", "group", "milestones.parquet")
    if found is None:
        return ""
    rows: list[list[Cell]] = []
    for r in found[found["variant"].astype(str).str.contains("emp")].to_dict("records"):
        episode, earliest, latest = (f"{v:.0f}" if math.isfinite(v) else "never" for v in _three(r))
        minutes = f"{r['minutes']:.0f}" if math.isfinite(r["minutes"]) else "-"
        level = f"{100 * r['level']:.0f} %"
        rows.append(
            [r["simulation"], r["variant"], level, episode, f"{earliest} to {latest}", f"{r['trial_s']:g} s", minutes]
        )
    head = ["simulation", "decoder", "accuracy", "episode", "95 % band", "a trial lasts", "minutes"]
    return fold("When the robot has learned", table(head, rows))


def _three(row: Mapping[str, Any]) -> tuple[float, float, float]:
    return tuple(math.nan if row[n] is None else float(row[n]) for n in ("episode", "earliest", "latest"))  # type: ignore[return-value]


def _robots(results: Results) -> str:
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
    return fold("Every subject's arm", table([*head, "jitter, 99 % (ms)", "stops"], rows))


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
