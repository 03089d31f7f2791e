"""Small recordings that once broke the product, run as a user would: ``python tests/product/eeg_cases.py FOLDER``.

FOLDER holds scripts named ``NN_name.py``, each of which writes its inputs and studies into the folder that it is given
(``../shared/cases/eeg`` at our desks; ``make cases``). What should happen is said here a line each; a table says what
did, and the exit code is 1 where a line fails. The kinds behind them have tests of their own under ``tests/``.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path

import eeg_format_cases as formats
import numpy as np
from case_table import Judge, Row, table
from eeg_case import Case, about, end, items, note

LOGS = Path("data", "HRC_neurobased_taskplanning")  # beside the folder of cases


def split_fif(case: Case) -> list[Row]:
    case.make()
    case.acquire("study.toml")
    before = case.raw("study.toml").get_data()[:, -25000:].std() * 1e6
    case.python("change.py")
    case.acquire("study.toml")
    after = case.raw("study.toml").get_data()[:, -25000:].std() * 1e6
    rows = [
        ("part 2 changed", "acquire runs anew", 1.9 < after / before < 2.1, f"SD {before:.1f}, then {after:.1f} µV")
    ]
    part = case.place / "sub-demo_task-x_split-02_eeg.fif"
    part.unlink()
    code, text, _ = case.acquire("study.toml")
    rows.append(("part 2 missing", "3, names it", code == 3 and part.name in text, f"{code} {about(text, 'split')}"))
    return rows


def absent_condition(case: Case) -> list[Row]:
    case.make()
    code, text = case.hrcneuro("erp", "--config", "study.toml", "--workdir", "work_study")
    _, _, summary = case.acquire("study.toml", "s2")
    said = note(summary, "S 22")
    return [("s2 has no S 22", "0, a note", code == 0 and bool(said), f"{code} {said or end(text)}")]


def channel_names(case: Case) -> list[Row]:
    case.make()
    rows = []
    for study in ("caps", "twins", "twoT", "dup", "mastoid"):
        code, text = case.hrcneuro("preprocess", "demo", "--config", f"study_{study}.toml", "--workdir", f"w_{study}")
        rows.append(
            (study, "0, or said", code == 0 or (code in (2, 3) and "unexpectedly" not in text), f"{code} {end(text)}")
        )
    return rows


def bids_dataset(case: Case) -> list[Row]:
    case.make()
    rows = []
    for study in ("folder", "subfolder", "edf", "vhdr"):
        code, text = case.hrcneuro("acquire", "01", "--inspect", "--config", f"study_{study}.toml")
        told = code == 2 if "folder" in study else "events.tsv" in text or ("target" in text and "channels.tsv" in text)
        rows.append(
            (
                study,
                "2 with the cure" if "folder" in study else "the sidecars are named",
                told,
                f"{code} {about(text, 'tsv')}",
            )
        )
    return rows


def paths_and_files(case: Case) -> list[Row]:
    case.make()
    rows = []
    for study in ("my study", "nfd", "link", "bom"):
        code, text = case.hrcneuro("erp", "P1", "--config", f"{study}.toml", "--workdir", f"w_{study}")
        rows.append((study, "0", code == 0, f"{code} {end(text)}"))
    code, text = case.hrcneuro("erp", "P1", "--config", "latin1.toml")
    rows.append(
        (
            "latin1",
            "2, says UTF-8 and the line",
            code == 2 and "UTF-8" in text and "line" in text,
            f"{code} {end(text)}",
        )
    )
    for study in ("broken", "broken_edf"):
        code, text = case.hrcneuro("acquire", "P1", "--config", f"{study}.toml")
        rows.append((study, "3, git annex get", code == 3 and "git annex get" in text, f"{code} {end(text)}"))
    return rows


def collision(case: Case) -> list[Row]:
    rows = []
    for responses in (18, 30):
        case.make(responses)
        code, text, summary = case.acquire("study.toml")
        # 30 responses go on after the data's end, which is refused, too.
        right = code in (2, 3) or summary.get("events", {}).get("a") == 20
        rows.append(
            (
                f"{responses} responses",
                "refused, or the stimulus",
                right,
                f"{code} {summary.get('events') or end(text)}",
            )
        )
    return rows


def group(case: Case) -> list[Row]:
    rows = []
    variants = {
        "twins, no effect": ("--n", 2, "--dup", 0.004, "--uv", 0),
        "one subject": ("--n", 1),
        "two rates": ("--n", 2, "--fs2", 256),
        "lacks C3": ("--n", 2, "--lack", "C3"),
    }
    for name, words in variants.items():
        place = Case(case.script, case.place / name.replace(" ", "_").replace(",", ""))
        place.make(*words)
        code, text = place.hrcneuro("decode", "--config", "study.toml", "--json")
        if code:
            rows.append((name, "0, or said", code == 2 and "unexpectedly" not in text, f"{code} {end(text)}"))
            continue
        cells = [
            i["summary"]["all"]["sVSt"]
            for i in items(text)
            if i["stage"] == "decode" and "sVSt" in (i["summary"] or {}).get("all", {})
        ]
        accuracy = [round(cell["acc"], 1) for cell in cells if cell.get("acc") is not None]
        right = bool(accuracy) and (np.mean(accuracy) < 62 if "no effect" in name else np.mean(accuracy) > 62)
        rows.append((name, "chance" if "no effect" in name else "decodes", right, f"{accuracy} %"))
    return rows


def absent_channel(case: Case) -> list[Row]:
    case.make()
    code, text = case.hrcneuro("erp", "--config", "study.toml")
    rows = [
        (
            "s3 lacks ECG and LEYE",
            "3, the way out is named",
            code == 3 and "subjects.SUBJECT" in text,
            f"{code} {end(text)}",
        )
    ]
    code, text = case.hrcneuro("erp", "--config", "study.toml", "--set", "preprocess.subjects.s3.eog=none")
    rows.append(("without regression", "0", code == 0, f"{code} {end(text)}"))
    return rows


def excel_log(case: Case) -> list[Row]:
    logs = case.script.parents[2] / LOGS
    if not logs.is_dir():
        return [("all", "needs the authors' logs", True, "skipped: the logs are not here")]
    case.make(logs)
    rows, plain = [], None
    for way in ("plain", "crlf", "bom", "quoted", "blank", "trailing", "semi", "tab", "utf16"):
        given = ("--set", "acquire.source=semisynthetic", "--set", f"acquire.path={way}")
        code, text = case.hrcneuro("acquire", "s01", "--inspect", *given)
        plain = plain or text
        same = code == 0 and re.sub(rf"\b{way}\b", "plain", text) == plain
        told = code in (2, 3) and any(word in text for word in ("separated by", "UTF-16", "utf-16"))
        rows.append(
            (
                way,
                "as the original, or said why not",
                same or (told and way in ("semi", "tab", "utf16")),
                f"{code} {'same' if same else end(text)}",
            )
        )
    return rows


CASES: dict[str, Callable[[Case], list[Row]]] = {
    "03": split_fif, "04": absent_condition, "05": formats.segments, "07": formats.trigger_channel, "08": formats.units,
    "10": formats.eeglab_events, "12": formats.clinic, "13": channel_names, "14": bids_dataset, "15": paths_and_files,
    "16": collision, "17": group, "18": absent_channel, "19": excel_log, "20": formats.truncated,
}  # fmt: skip


def _judge(rows: Callable[[Case], list[Row]]) -> Judge:
    return lambda script, place: rows(Case(script, place))


if __name__ == "__main__":
    judges = {number: _judge(rows) for number, rows in CASES.items()}
    sys.exit(table(sys.argv[1], "[0-9][0-9]_*.py", judges, tuple(sys.argv[2:]), workers=2))
