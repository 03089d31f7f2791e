"""The results of single subjects, for a chapter whose group has not run: peaks of potentials and rhythms, decoding."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hrcneuro.answers.brain import when
from hrcneuro.report.markup import Cell, PageTable
from hrcneuro.report.results import Results

_PEAK_HEAD = ("subject", "contrast", "trials", "largest", "channel")


def potentials(results: Results) -> PageTable:
    """Return a row a subject and contrast: where and when its difference is largest, as the stage says it."""
    return _peaks(results, "erp")


def rhythms(results: Results) -> PageTable:
    """Return a row a subject and contrast: at which channel, frequency and time its difference is largest."""
    return _peaks(results, "ersp")


def _peaks(results: Results, stage: str) -> PageTable:
    """Return the largest differences of the subjects' summaries, over all their trials."""
    from hrcneuro.eeg.selection import ALL

    rows: list[list[Cell]] = []
    for unit in results.units(stage):
        summary = results.summary(stage, unit)
        counts = summary.get("trials", {}).get(ALL, {})
        for name, one in summary.get("contrasts", {}).get(ALL, {}).items():
            plus, minus = results.settings.shared.contrasts[name]
            peak, hertz = one["peak"], ""
            if "frequency_hz" in peak:
                hertz = f"{peak['frequency_hz']:g} Hz, "
            trials = f"{counts.get(plus, '-')} : {counts.get(minus, '-')}"
            late = when(peak["time_s"], summary.get("shortest_gap_s"))
            at = f"{hertz}{1000 * peak['time_s']:.0f} ms{late}"
            rows.append([unit, name, trials, f"{peak['difference_uv']:+.2f} µV", peak["channel"], at])
    return PageTable([*_PEAK_HEAD, "at"], rows)


def scores(results: Results) -> Any:
    """Return the subjects' scores as the group's table of subjects has them, or None where there are none."""
    import pandas as pd

    from hrcneuro.io.tables import read_table

    parts = [
        read_table(path).astype({"scenario": str, "problem": str, "decoder": str, "note": str}).assign(subject=unit)
        for unit, path in _of_subjects(results, "decode", "scores.parquet")
    ]
    return pd.concat(parts, ignore_index=True) if parts else None


def _of_subjects(results: Results, stage: str, name: str) -> Iterator[tuple[str, Path]]:
    """Yield every subject that has this file of a stage, and where it lies."""
    for unit in results.units(stage):
        path = results.path(stage, unit, name)
        if path is not None:
            yield unit, path


def calibrations(results: Results) -> PageTable:
    """Return how each subject's frozen decoder does on held-out blocks, beside rules that look at no EEG."""
    rows: list[list[Cell]] = []
    for unit in results.units("calibrate"):
        for name, one in sorted(results.summary("calibrate", unit).get("problems", {}).items()):
            rules = [one["rules"].get(rule, {}).get("bacc") for rule in ("stays", "prev_error", "turn")]
            rates = [
                "-" if v is None else f"{v:.1f}" for v in (one["bacc"], 1.96 * one["bacc_se"], one["stays"], *rules)
            ]
            trials = f"{one['n1']} : {one['n2']}"
            rows.append([unit, name, trials, one["n_blocks"], *rates, f"{one['log_loss']:.3f}"])
    head = ["subject", "problem", "trials", "blocks", "balanced (%)", "± 95 %", "says that the actor stays (%)"]
    without = ["no EEG: the actor stays (%)", "no EEG: previous error (%)", "no EEG: turn ahead (%)"]
    return PageTable([*head, *without, "log loss (bits)"], rows)
