"""Troubles that broke arm, cache or command line, run as a user would: ``python tests/product/robot_cases.py FOLDER``.

FOLDER holds scripts ``NN_name.py`` and ``NN_name.sh`` (``../shared/cases/robot`` at our desks; ``make cases``). Each
takes the product as ``HRC`` and a small study as ``W``, and prints what happened; what should happen is said in its
head, and here a line each. Run as root: some scripts mount, or make accounts. They run one after another, as arms move
in real time: half an hour. ``robot_cases.py FOLDER 13 14`` runs some of them.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from case_table import ROOT, Judge, Row, environment, sections, table

STUDY = """
[study]
name = "small"
subjects = ["s01"]
exclude = []
[acquire]
sfreq = 250.0
[acquire.session]
practice_episodes = 1
blocks = 2
episodes_per_block = 6
[preprocess]
sfreq = 128.0
"""
BUGS = re.compile(r"Traceback|Exception ignored|as a bug|UnicodeEncodeError|[Uu]nexpected")
LONGEST_S = 1500


class Case:
    """A script, the product as a command, and a study of its own."""

    def __init__(self, script: Path, place: Path) -> None:
        self.script, self.study, self.tools = script, place / "study", place / "tools"
        self.study.mkdir()
        self.tools.mkdir()
        (self.study / "hrcneuro.toml").write_text(STUDY)
        for name, words in {"hrcneuro": "-m hrcneuro ", "python": ""}.items():
            tool = self.tools / name
            tool.write_text(f'#!/bin/bash\nPYTHONPATH={ROOT} exec {sys.executable} {words}"$@"\n')
            tool.chmod(0o755)
        place.chmod(0o755)
        self.hrcneuro("acquire", "s01", "-j", "1")

    def hrcneuro(self, *words: str, tail: str = "") -> int:
        """Run the product in the study; ``tail`` is what a shell takes; return the exit code."""
        line = f'"$0" "$@" {tail}'
        command = ["bash", "-c", line, str(self.tools / "hrcneuro"), *words]
        return subprocess.run(command, cwd=self.study, env=environment(), capture_output=True, check=False).returncode

    def output(self, *arguments: str) -> str:
        """Run the script; return all that it printed, after LONGEST_S all that it had printed by then."""
        runner = sys.executable if self.script.suffix == ".py" else "bash"
        env = environment() | {
            "HRC": str(self.tools / "hrcneuro"),
            "W": str(self.study),
            "CONFIGS": str(ROOT / "configs"),
        }
        env.pop("OMP_NUM_THREADS")
        with tempfile.TemporaryFile() as file:
            command = [runner, str(self.script), *arguments]
            process = subprocess.Popen(
                command, cwd=ROOT, env=env, stdin=subprocess.DEVNULL, stdout=file, stderr=file, start_new_session=True
            )
            try:
                process.wait(LONGEST_S)
            except subprocess.TimeoutExpired:
                _end(process)
            file.seek(0)
            return file.read().decode(errors="backslashreplace")

    def recorded(self, text: str) -> bool:
        """Return whether a session's telemetry is kept: rescued (the script lists it), or under recordings/."""
        return "telemetry" in text or any(self.study.glob("recordings/**/telemetry*"))


def _end(process: subprocess.Popen) -> None:
    # The script's own simulated controllers end with it when it is interrupted.
    for number in (signal.SIGINT, signal.SIGKILL):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, number)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(20)
            return


def interrupts(case: Case) -> list[Row]:
    rows = []
    for gap, rest in sections(case.output("2.0", "hup"), "gap "):
        name, _, at_rest = gap.partition(": at rest after ")
        found = re.search(r"exit (-?\d+); first line after ([\d.]+) s.*?record: (\[.*?\])", rest)
        code, told, files = (int(found[1]), float(found[2]), found[3]) if found else (-1, 99.0, "")
        rows += [
            (f"{name}: at rest", "at once", at_rest != "None" and float(at_rest) <= 0.5, f"after {at_rest} s"),
            (f"{name}: told", "within 2 s, exit 130", code == 130 and told <= 2, f"exit {code} after {told} s"),
            (f"{name}: record", "whole, and named", case.recorded(files) and "record" in rest, files or rest),
        ]
    return rows


def frozen(case: Case) -> list[Row]:
    rows = []
    for driver in ("rtde", "script"):
        text = case.output(driver)
        found = re.search(r"exit (\d+); told after ([\d.]+) s", text)
        # Sooner than a packet can be too old, the session had ended before the controller froze: nothing was tried.
        right = bool(found) and found[1] == "4" and 0.2 <= float(found[2]) <= 2 and "emergency stop" in text
        rows.append((driver, "4, told within 2 s what to press", right, text))
    return rows


def two_sessions(case: Case) -> list[Row]:
    found = re.findall(
        r"^(A \w+, B \w+, \w+ TMPDIR)\n\s+A exit (-?\d+): (.*)\n\s+B exit (-?\d+): (.*)", case.output(), re.M
    )
    return [(who, "A 0, B 4", (a, b) == ("0", "4"), f"A {a}, B {b}: {why}") for who, a, _, b, why in found]


def no_locks(case: Case) -> list[Row]:
    return [
        (name, "runs, exit 0", re.findall(r"^exit (\d+)", text, re.M) == ["0"] and not BUGS.search(text), text)
        for name, text in sections(case.output(), "--- ")
    ]


def dead_lock(case: Case) -> list[Row]:
    text = case.output()
    own, _, foreign = text.partition("\nkey ")
    rows = []
    for name, part in {"of a killed run": own, "of another machine": foreign}.items():
        code = re.search(r"exit (\d+) \(124", part)
        goes_on = bool(code) and code[1] == "0"
        named = bool(code) and code[1] not in ("0", "124") and ".lock" in part.partition("\n")[2]
        rows.append((name, "goes on, or names the file", (goes_on or named) and not BUGS.search(part), part[-300:]))
    return rows


ACCOUNTS = (
    *("A:", "B, the same (a hit):", "B, the next stage:", "A, the next stage of what B made:"),
    *("B, another value:", "B, forced:", "B, verify and gc:"),
)


def two_accounts(case: Case) -> list[Row]:
    text = case.output()
    rows = []
    for who in ACCOUNTS:
        part = f"\n{text}".partition(f"\n{who}\n")[2]
        part = re.split(r"^[AB](?:, [^\n]*| again[^\n]*)?:\n", part, maxsplit=1, flags=re.M)[0]
        codes = re.findall(r"^exit (\d+)", part, re.M)
        said = all(code == "0" for code in codes) or ("2" in codes and "cure" in part)
        right = bool(codes) and set(codes) <= {"0", "2"} and said and not BUGS.search(part)
        rows.append((who, "0, or 2 with file and cure", right, f"{codes} {part[-200:]}"))
    after = text.partition("A again")[2].partition("\n")[2]
    rows.append(("A again", "A's results are there", "fresh" in after and not BUGS.search(after), after))
    return rows


def shared_gc(case: Case) -> list[Row]:
    text = case.output()
    after = text.partition("--- study two afterwards")[2]
    kept = re.search(r"exit (\d+)", after)
    return [("gc in study one", "study two is whole", bool(kept) and kept[1] == "0", after)]


def finished(case: Case) -> list[Row]:
    text = case.output()
    code = re.search(r"exit (-?\d+):", text)
    # Any other code is of a session that did not come to its last move.
    kept = bool(code) and (code[1] == "0" or (code[1] == "130" and case.recorded(text.partition("rescued")[2])))
    return [("Ctrl-C after the last move", "kept, or rescued and named", kept, text)]


def streams(case: Case) -> list[Row]:
    text = case.output()
    rows = []
    for name, code, said in re.findall(r"^(.+?) +exit +(\d+) +err ?(.*)$", text, re.M):
        wanted = 2 if "expects 2" in name else 1 if "/dev/full" in name else 0
        if "nosuch 2>&-" in name:
            # The script prints the code of what it runs next.
            code = str(case.hrcneuro("acquire", "nosuch", tail="2>&-"))
        rows.append((name, f"{wanted}", int(code) == wanted and not BUGS.search(said), f"{code} {said}"))
    last = re.findall(r"^exit in a terminal (\d+)", text, re.M)
    return [*rows, ("in a terminal", "0", last == ["0"], f"{last}")]


# What runs, and to what end; everything else is refused before it starts.
MEANT = (
    *("accuracy=0", "accuracy=100", "accuracy=60,55", "accuracy= 55 , 60", "accuracy=55,60,"),
    *("subtasks=2,4,6 --sweep chosen=3", "wide --dry-run", "wide --sweep accuracy=55 --dry-run"),
)


def sweeps(case: Case) -> list[Row]:
    text = case.output()
    rows = []
    for words, code, said in re.findall(r"^(--.+?) +exit (\d+) +[\d.]+s ?(.*)$", text, re.M):
        meant = words.removeprefix("--sweep ").strip() in MEANT or words.startswith("--set simulate.trial_s")
        bounded = code == "0" and words.endswith("50,50,50")
        told = len(words) > 55 and "the sweep has" in said
        right = code == "0" if meant else bounded or told or (code == "2" and "error" in said)
        rows.append((words, "0" if meant else "2, or told before", right and not BUGS.search(said), f"{code} {said}"))
    for jobs, code, said in re.findall(r"^-j (\S+): exit (\d+) (.*)$", text, re.M):
        wanted = "0" if jobs.isdigit() else "2"
        rows.append((f"-j {jobs}", wanted, code == wanted, f"{code} {said}"))
    return rows


def odd_places(case: Case) -> list[Row]:
    rows = []
    for name, part in sections(case.output(), "== "):
        codes = re.findall(r" exit (\d+)$", part, re.M)
        whole = any(word in name for word in ("workdir [", "not UTF-8", "to a folder", "copied", "future", "at once"))
        right = set(codes) <= ({"0"} if whole else {"0", "1", "2", "3"}) and not BUGS.search(part)
        if "at once" in name:
            # Of three one ran: a line of the task, a line of the whole. (What it counts as "hit" is now "fresh".)
            right &= part.split()[0] == "2"
        if "tilde" in name:
            # First it is the cache of before, in which a stage's folder is now a link that leads nowhere.
            right &= codes == ["2", "0", "0"] and "which is not there" in part
        if "kill -9" in name:
            # A worker that was still starting ends once it has started; its folder is gone with the next command.
            right &= "\n0\n" in part and "are sound" in part
        if "copied" in name or "future" in name:
            right &= part.count("fresh") >= 2 and " ran" not in part
        rows.append((name, "0" if whole else "as documented", right, f"{codes} {part}"))
    return rows


def threads(case: Case) -> list[Row]:
    text = case.output()
    hashes = re.findall(r"^([0-9a-f]{20})$", text, re.M)
    rows = [("threads, workers, seeds, zones", "one digest", len(hashes) == 4 and len(set(hashes)) == 1, f"{hashes}")]
    for name, size in re.findall(r"^(\w+): topographies .* at most (\S+)$", text, re.M):
        rows.append((f"kernels of {name}", "rounding only", float(size) < 1e-9, size))
    if len(rows) < 4 and "Illegal instruction" in text:
        # The script begins with what it can; its second processor has AVX-512, and without that it goes no further.
        return [*rows, ("kernels of SkylakeX", "rounding only", True, "not tried: this processor has no AVX-512")]
    return rows if len(rows) == 4 else [*rows, ("kernels", "three compared", False, text[-200:])]


def programs(case: Case) -> list[Row]:
    rows = []
    for name, part in sections(case.output(), "--- "):
        wanted = "exit 2" if name in ("a missing folder", "a file") else "serves ok.script"
        right = "ended with exit 2" in part if wanted == "exit 2" else "Loading program: ok.script" in part
        rows.append((name, wanted, right and not BUGS.search(part), part))
    return rows


def script_port(case: Case) -> list[Row]:
    rows: list[Row] = []
    for verdict, what, should, did in re.findall(r"^(ok|BAD) +(.+?) +should: (.+?) +did: (.*)$", case.output(), re.M):
        if what.startswith("str_sub"):
            # The script wants an error; UR's script manual limits the length: str_sub("abcde", 2, 50) is "cde".
            rows.append((what, "the rest, as the manual says", did.endswith("r=c"), did))
        else:
            rows.append((what, should[:34], verdict == "ok", did))
    return rows


def _judge(rows: Callable[[Case], list[Row]]) -> Judge:
    return lambda script, place: rows(Case(script, place))


CASES = {
    "03": interrupts, "04": frozen, "05": two_sessions, "07": no_locks, "08": dead_lock, "09": two_accounts,
    "10": shared_gc, "12": finished, "13": streams, "14": sweeps, "15": odd_places, "17": threads, "21": programs,
    "B2": script_port,
}  # fmt: skip


if __name__ == "__main__":
    # In a shell's background interrupts are ignored, and every child inherits that; a handler is not inherited.
    for _number in (signal.SIGINT, signal.SIGHUP):
        if signal.getsignal(_number) is signal.SIG_IGN:
            signal.signal(_number, signal.default_int_handler)
    judges = {number: _judge(rows) for number, rows in CASES.items()}
    sys.exit(table(sys.argv[1], "[0-9B][0-9]_*.[ps][yh]", judges, tuple(sys.argv[2:])))
