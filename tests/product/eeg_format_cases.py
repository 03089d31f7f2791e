"""EEG cases of the makers' formats: breaks, trigger channels, units, events, clinics' files, downloads."""

from __future__ import annotations

import numpy as np
from case_table import Row
from eeg_case import Case, about, end, note


def segments(case: Case) -> list[Row]:
    case.make()
    code, text = case.hrcneuro("erp", "demo", "--config", "study.toml")
    seen = case.python("check.py") if code == 0 else text
    largest = float(seen.split("join:")[1].split()[0]) if code == 0 else np.inf
    rows = [
        ("break", "one break, no ringing", code == 0 and "breaks 1" in seen and largest < 60, " ".join(seen.split()))
    ]
    markers = case.place / "demo.vmrk"
    markers.write_text(markers.read_text().replace("S  2", "S  1", 3))
    code, text = case.hrcneuro("acquire", "demo", "--config", "study.toml")
    _, shown = case.hrcneuro("acquire", "demo", "--inspect", "--config", "study.toml")
    rows.append(("markers edited", "acquire runs anew", code == 0 and "fresh" not in text, end(text)))
    said = "before_renaming.vmrk" in shown
    rows.append(("stale name", "the fallback is said", said, about(shown, "before_renaming")))
    return rows


def trigger_channel(case: Case) -> list[Row]:
    case.make()
    rows = []
    for study, wanted in (
        ("steps", {"16": 20, "17": 20}),
        ("note", {"16": 20, "17": 20}),
        ("bad", {"16": 20, "17": 20}),
    ):
        code, text, summary = case.acquire(f"study_{study}.toml")
        events = {k: v for k, v in summary.get("events", {}).items() if k in wanted}
        said = bool(note(summary, "STI 014"))
        rows.append(
            (study, "16 × 20, 17 × 20", code == 0 and (events == wanted or said), f"{code} {events or end(text)}")
        )
    return rows


def units(case: Case) -> list[Row]:
    case.make()
    rows = []
    for study in ("ansi", "greek", "bom", "umlaut", "name"):
        code, text, summary = case.acquire(f"study_{study}.toml")
        if code:
            rows.append((study, "SD 10 µV, a × 5", False, f"{code} {end(text)}"))
            continue
        raw = case.raw(f"study_{study}.toml")
        spread = raw.get_data(picks="eeg").std(axis=1) * 1e6
        kinds = dict(zip(raw.ch_names, raw.get_channel_types(), strict=True))
        right = bool(np.allclose(spread, 10, atol=0.5)) and summary["events"] == {"a": 5} and kinds.get("Temp") != "eeg"
        rows.append(
            (study, "SD 10 µV, a × 5", right, f"SD {spread.min():.2f} to {spread.max():.2f}, {summary['events']}")
        )
    return rows


def eeglab_events(case: Case) -> list[Row]:
    case.make()
    ab, bad, edge = {"a": 10, "b": 10}, {"bad_choice": 10, "good_choice": 10}, {"edge_left": 10, "edge_right": 10}
    numbers = {"1": 10, "2": 10}
    wanted = dict(
        dur=ab, badspan=ab, badname=bad, edge=edge, mixed=numbers, minus99=numbers, nochaninfo=ab, onlyone={"a": 1}
    )
    rows = []
    for study, events in wanted.items():
        given = f"study_{study}.toml"
        code, text, summary = case.acquire(given)
        epoch, said = case.hrcneuro("epoch", "demo", "--config", given, "--workdir", f"work_study_{study}")
        got = {k: v for k, v in summary.get("events", {}).items() if k in events}
        rows.append(
            (
                study,
                f"{events}",
                (code, epoch) == (0, 0) and got == events,
                f"{code} {epoch} {got or end(text + said)}",
            )
        )
    return rows


def clinic(case: Case) -> list[Row]:
    case.make()
    rows = []
    for study in ("rates", "names", "nounit", "upper"):
        given = f"study_{study}.toml"
        unit = ("--set", "acquire.unit=uV") if study == "nounit" else ()
        code, text = case.hrcneuro("preprocess", "demo", "--config", given, "--workdir", f"work_study_{study}", *unit)
        if code:
            rows.append((study, "0", False, f"{code} {end(text)}"))
            continue
        raw = case.raw(given)
        kinds = dict(zip(raw.ch_names, raw.get_channel_types(), strict=True))
        others = {n: k for n, k in kinds.items() if "ECG" in n or "EKG" in n or "SaO2" in n}
        base = np.load(case.place / "base.npy")
        step = round(raw.info["sfreq"] / 200)
        error = float(np.abs(raw.get_data(picks="eeg")[:10, ::step] * 1e6 - base).max())
        right = "eeg" not in others.values() and error < 0.02
        rows.append((study, "right values, no ECG as EEG", right, f"off by {error:.3f} µV; {others}"))
    return rows


def truncated(case: Case) -> list[Row]:
    case.make()
    rows = []
    for study in ("edf", "bdf", "vhdr", "set", "fif"):
        code, text, summary = case.acquire(f"study_{study}.toml")
        rows.append(
            (
                study,
                "refused, or said",
                code == 3 or bool(note(summary, "80")),
                f"{code} {note(summary, '80') or end(text)}",
            )
        )
    return rows
