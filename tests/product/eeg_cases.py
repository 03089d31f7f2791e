"""Small recordings that once broke the product, run as a user would: ``python tests/product/eeg_cases.py FOLDER``.

FOLDER holds scripts named ``NN_name.py``, each of which writes its inputs and studies into the folder that it is given
(``../shared/cases/eeg`` at our desks; ``make cases``). What should happen is said here a line each; a table says what
did, and the exit code is 1 where a line fails. The kinds behind them have tests of their own under ``tests/``.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import mne
import numpy as np

ROOT = Path(__file__).parents[2]
LOGS = Path("data", "HRC_neurobased_taskplanning")  # beside the folder of cases
Row = tuple[str, str, bool, str]  # variant, what should happen, whether it did, what did


@dataclass(frozen=True)
class Case:
    """One script's inputs in a folder of their own."""

    script: Path
    place: Path

    def make(self, *arguments: object) -> None:
        """Run the script."""
        self.python(str(self.script), str(self.place), *map(str, arguments), cwd=self.script.parent)

    def python(self, *words: str, cwd: Path | None = None) -> str:
        """Run a script of the case; return what it prints."""
        done = subprocess.run(
            [sys.executable, *words], cwd=cwd or self.place, capture_output=True, text=True, check=True, env=_env()
        )
        return done.stdout

    def hrcneuro(self, *words: str) -> tuple[int, str]:
        """Run the product in the case's folder; return its exit code and all that it printed."""
        command = [sys.executable, "-m", "hrcneuro", *words]
        done = subprocess.run(command, cwd=self.place, capture_output=True, text=True, check=False, env=_env())
        return done.returncode, " ".join((done.stdout + done.stderr).split())

    def acquire(self, study: str, unit: str = "demo", *words: str) -> tuple[int, str, dict]:
        """Acquire a subject; return exit code, what was printed, and the summary (empty where it failed)."""
        workdir = f"work_{Path(study).stem}"
        code, text = self.hrcneuro("acquire", unit, "--config", study, "--workdir", workdir, "--json", *words)
        try:
            item = next(i for i in _items(text) if i["unit"] == unit)
        except (ValueError, StopIteration):
            return code, text, {}
        return code, text, item.get("summary") or {}

    def raw(self, study: str, unit: str = "demo") -> mne.io.BaseRaw:
        """Return what acquire wrote."""
        found = self.place.glob(f"work_{Path(study).stem}/cache/acquire/{unit}/*/{unit}_raw.fif")
        path = max(found, key=lambda p: p.stat().st_mtime)
        return mne.io.read_raw_fif(path, preload=True, verbose="error")


def _env() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200", "OMP_NUM_THREADS": "1"}


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
    rows.append(("part 2 missing", "3, names it", code == 3 and part.name in text, f"{code} {_about(text, 'split')}"))
    return rows


def absent_condition(case: Case) -> list[Row]:
    case.make()
    code, text = case.hrcneuro("erp", "--config", "study.toml", "--workdir", "work_study")
    _, _, summary = case.acquire("study.toml", "s2")
    note = _note(summary, "S 22")
    return [("s2 has no S 22", "0, a note", code == 0 and bool(note), f"{code} {note or _end(text)}")]


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
    rows.append(("markers edited", "acquire runs anew", code == 0 and "hit" not in text, _end(text)))
    said = "before_renaming.vmrk" in shown
    rows.append(("stale name", "the fallback is said", said, _about(shown, "before_renaming")))
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
        said = bool(_note(summary, "STI 014"))
        rows.append(
            (study, "16 × 20, 17 × 20", code == 0 and (events == wanted or said), f"{code} {events or _end(text)}")
        )
    return rows


def units(case: Case) -> list[Row]:
    case.make()
    rows = []
    for study in ("ansi", "greek", "bom", "umlaut", "name"):
        code, text, summary = case.acquire(f"study_{study}.toml")
        if code:
            rows.append((study, "SD 10 µV, a × 5", False, f"{code} {_end(text)}"))
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
                f"{code} {epoch} {got or _end(text + said)}",
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
            rows.append((study, "0", False, f"{code} {_end(text)}"))
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


def channel_names(case: Case) -> list[Row]:
    case.make()
    rows = []
    for study in ("caps", "twins", "twoT", "dup", "mastoid"):
        code, text = case.hrcneuro("preprocess", "demo", "--config", f"study_{study}.toml", "--workdir", f"w_{study}")
        rows.append(
            (study, "0, or said", code == 0 or (code in (2, 3) and "unexpectedly" not in text), f"{code} {_end(text)}")
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
                f"{code} {_about(text, 'tsv')}",
            )
        )
    return rows


def paths_and_files(case: Case) -> list[Row]:
    case.make()
    rows = []
    for study in ("my study", "nfd", "link", "bom"):
        code, text = case.hrcneuro("erp", "P1", "--config", f"{study}.toml", "--workdir", f"w_{study}")
        rows.append((study, "0", code == 0, f"{code} {_end(text)}"))
    code, text = case.hrcneuro("erp", "P1", "--config", "latin1.toml")
    rows.append(
        (
            "latin1",
            "2, says UTF-8 and the line",
            code == 2 and "UTF-8" in text and "line" in text,
            f"{code} {_end(text)}",
        )
    )
    for study in ("broken", "broken_edf"):
        code, text = case.hrcneuro("acquire", "P1", "--config", f"{study}.toml")
        rows.append((study, "3, git annex get", code == 3 and "git annex get" in text, f"{code} {_end(text)}"))
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
                f"{code} {summary.get('events') or _end(text)}",
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
            rows.append((name, "0, or said", code == 2 and "unexpectedly" not in text, f"{code} {_end(text)}"))
            continue
        cells = [
            i["summary"]["all"]["sVSt"]
            for i in _items(text)
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
            f"{code} {_end(text)}",
        )
    ]
    code, text = case.hrcneuro("erp", "--config", "study.toml", "--set", "preprocess.subjects.s3.eog=none")
    rows.append(("without regression", "0", code == 0, f"{code} {_end(text)}"))
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
                f"{code} {'same' if same else _end(text)}",
            )
        )
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
                code == 3 or bool(_note(summary, "80")),
                f"{code} {_note(summary, '80') or _end(text)}",
            )
        )
    return rows


CASES: dict[str, Callable[[Case], list[Row]]] = {
    "03": split_fif, "04": absent_condition, "05": segments, "07": trigger_channel, "08": units, "10": eeglab_events,
    "12": clinic, "13": channel_names, "14": bids_dataset, "15": paths_and_files, "16": collision, "17": group,
    "18": absent_channel, "19": excel_log, "20": truncated,
}  # fmt: skip


def main(folder: str, *only: str) -> int:
    """Print the table; return the exit code."""
    scripts = [s for s in sorted(Path(folder).resolve().glob("[0-9][0-9]_*.py")) if not only or s.name[:2] in only]
    if not scripts:
        print(f"no cases in {folder}: nothing to do")
        return 0
    with tempfile.TemporaryDirectory(prefix="hrcneuro-cases-") as base, ThreadPoolExecutor(2) as pool:
        tables = pool.map(lambda script: _rows(script, Path(base) / script.stem), scripts)
        rows = [(script.name[:2], *row) for script, table in zip(scripts, tables, strict=True) for row in table]
    for number, variant, wanted, right, got in rows:
        print(f"{number}  {variant:<22} {'ok  ' if right else 'FAIL'}  {wanted:<34} {got[:150]}")
    failed = sum(not row[3] for row in rows)
    print(f"{len(rows)} lines of {len(scripts)} cases, {failed} failed")
    return 1 if failed else 0


def _rows(script: Path, place: Path) -> list[Row]:
    run = CASES.get(script.name[:2])
    if run is None:
        return [("-", "nothing said of it here", False, "add what should happen to CASES")]
    try:
        return run(Case(script, place))
    except Exception as error:  # a broken case is a line of the table, not the end of the others
        return [("-", "runs", False, f"{type(error).__name__}: {error}")]


def _items(text: str) -> list[dict]:
    """Return the items of what ``--json`` printed, whatever stands after it."""
    return json.JSONDecoder().raw_decode(text[text.index("{") :])[0]["items"]


def _note(summary: dict, word: str) -> str:
    return next((note for note in summary.get("notes", []) + summary.get("warnings", []) if word in note), "")


def _about(text: str, word: str) -> str:
    at = text.find(word)
    return text[max(0, at - 60) : at + 80] if at >= 0 else _end(text)


def _end(text: str) -> str:
    return text[-150:]


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
