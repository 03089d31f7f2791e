"""What must fit between the sections of a configuration, and what a user should at least know."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from hrcneuro import stages
from hrcneuro.contract import OF_ALL, is_piece
from hrcneuro.decoding.scheme import FEATURES_END_S
from hrcneuro.errors import did_you_mean


def errors(settings: Any) -> list[str]:
    """Return the contradictions between sections, each with what is allowed."""
    return [*_subjects(settings), *_tables(settings.shared), *_rates(settings.sections), *_windows(settings.sections)]


def warnings(settings: Any) -> list[str]:
    """Return what is allowed but worth knowing."""
    sections = settings.sections
    notes = [note for name in stages.NAMES for note in stages.load(name).notes(sections[name])]
    notes += [note for of_stage in settings.remarks.values() for note in of_stage]
    if settings.left_out:
        notes.append(without_moves(settings))
    gap = sections["acquire"].timing.soa_min_s
    if settings.study.split == "scenario" and settings.shared.problems:
        end = sections["decode"].mean_window_s[1]
        if end > gap:
            notes.append(
                f"decode.mean_window_s ends at {end:g} s, past the shortest gap of {gap:g} s between onsets: "
                "what follows a trial leaks into it, as in the paper; [0.0, 0.6] avoids that"
            )
    known = set(settings.study.subjects)
    notes += [
        f"study.exclude names {s!r}{did_you_mean(s, known)}, who is not in study.subjects"
        for s in settings.study.exclude
        if s not in known
    ]
    return notes


def without_moves(settings: Any) -> str:
    """Return which stages a study leaves out, and why."""
    return (
        f"left out: {' and '.join(settings.left_out)}, which are about moves on the grid; acquire.source = "
        f"{settings.sections['acquire'].source!r} has none (study.stages names what the study consists of)"
    )


def _subjects(settings: Any) -> Iterator[str]:
    subjects = settings.study.subjects
    if not subjects:
        yield "study.subjects is empty: name at least one subject"
    for subject in sorted({s for s in subjects if subjects.count(s) > 1}):
        yield f"study.subjects names {subject!r} twice"
    for subject in subjects:
        if subject in OF_ALL or is_piece(subject) or not subject.replace("-", "").replace("_", "").isalnum():
            yield (
                f"study.subjects names {subject!r}; allowed: letters, digits, - and _, but not "
                f"{', '.join(OF_ALL)} and sweep-…"
            )


def _tables(shared: Any) -> Iterator[str]:
    """Yield what is wrong with the tables that several stages read: once, and a line for all that has one cause."""
    pairs = {"contrasts": ("[plus, minus]", shared.contrasts), "problems": ("[class 1, class 2]", shared.problems)}
    for table, (form, entries) in pairs.items():
        for name, pair in entries.items():
            if len(pair) != 2 or pair[0] == pair[1]:
                yield f"[{table}] {name} = {list(pair)}: it needs two different conditions, {form}"
    known = shared.conditions
    if not known:
        using = [f"[{table}]" for table, (_, entries) in pairs.items() if entries]
        also = f", and {' and '.join(using)} need{'s' if len(using) == 1 else ''} some" if using else ""
        yield f"[conditions] is empty{also}: name at least one condition, as a query on the trial table"
        return
    for table, (_, entries) in pairs.items():
        lacking = {name: [one for one in pair if one not in known] for name, pair in entries.items()}
        lacking = {name: ones for name, ones in lacking.items() if ones}
        if lacking:
            unknown = dict.fromkeys(one for ones in lacking.values() for one in ones)
            words = _few([f"{one!r}{did_you_mean(one, known)}" for one in unknown])
            yield (
                f"[{table}] {_few(list(lacking))}: no such condition as {words}; [conditions] has {', '.join(known)}"
                f"{_of_paper(shared, table)}"
            )


def _few(names: list[str]) -> str:
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")


def _of_paper(shared: Any, table: str) -> str:
    """Return a hint where nobody has given a table, so that the paper's is in force."""
    if getattr(shared, table) != getattr(type(shared)(), table):
        return ""
    return f" (these {table} are the paper's, as none are given: write [{table}] of your own, or {table} = {{}})"


def _rates(sections: Mapping[str, Any]) -> Iterator[str]:
    acquire, clean, ersp = sections["acquire"], sections["preprocess"], sections["ersp"]
    rates = {"preprocess.sfreq": clean.sfreq}
    if acquire.source in ("synthetic", "semisynthetic"):
        rates["acquire.sfreq"] = acquire.sfreq
    edges = {"preprocess.h_freq": clean.h_freq, "ersp.high_hz": ersp.high_hz}
    for edge, frequency in edges.items():
        for name, rate in rates.items():
            if frequency >= rate / 2:
                yield (
                    f"{edge} = {frequency:g} Hz is not below the Nyquist frequency of {name} = {rate:g} Hz; "
                    f"allowed: below {rate / 2:g} Hz"
                )


def _windows(sections: Mapping[str, Any]) -> Iterator[str]:
    start, end = sections["epoch"].tmin, sections["epoch"].tmax
    windows = {"erp.baseline_s": sections["erp"].baseline_s}
    if sections["decode"].problems:
        windows["decode.mean_window_s"] = sections["decode"].mean_window_s
        known = sections["decode"].known
        named = {name: known[name].windows_s for name in sections["decode"].decoders if name in known}
        if end < FEATURES_END_S and not all(named.values()):
            yield f"epoch.tmax = {end:g} s ends before the decoder's last window, {FEATURES_END_S:g} s after the onset"
        for name, spans in named.items():
            windows |= {f"decode.recipes.{name}.windows_s[{i}]": span for i, span in enumerate(spans)}
    for name, window in windows.items():
        if window and (window[0] < start or window[-1] > end):
            yield (
                f"{name} = {list(window)} lies outside the epoch; allowed: within {start:g} to {end:g} s "
                "(epoch.tmin, epoch.tmax)"
            )
