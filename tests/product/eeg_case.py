"""One EEG case: its script's inputs in a folder of their own, the product run on them, and what it said."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import mne
from case_table import environment


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
            [sys.executable, *words],
            cwd=cwd or self.place,
            capture_output=True,
            text=True,
            check=True,
            env=environment(),
        )
        return done.stdout

    def hrcneuro(self, *words: str) -> tuple[int, str]:
        """Run the product in the case's folder; return its exit code and all that it printed."""
        command = [sys.executable, "-m", "hrcneuro", *words]
        done = subprocess.run(command, cwd=self.place, capture_output=True, text=True, check=False, env=environment())
        return done.returncode, " ".join((done.stdout + done.stderr).split())

    def acquire(self, study: str, unit: str = "demo", *words: str) -> tuple[int, str, dict]:
        """Acquire a subject; return exit code, what was printed, and the summary (empty where it failed)."""
        workdir = f"work_{Path(study).stem}"
        code, text = self.hrcneuro("acquire", unit, "--config", study, "--workdir", workdir, "--json", *words)
        try:
            item = next(i for i in items(text) if i["unit"] == unit)
        except (ValueError, StopIteration):
            return code, text, {}
        return code, text, item.get("summary") or {}

    def raw(self, study: str, unit: str = "demo") -> mne.io.BaseRaw:
        """Return what acquire wrote."""
        found = self.place.glob(f"work_{Path(study).stem}/cache/acquire/{unit}/*/{unit}_raw.fif")
        path = max(found, key=lambda p: p.stat().st_mtime)
        return mne.io.read_raw_fif(path, preload=True, verbose="error")


def items(text: str) -> list[dict]:
    """Return the items of what ``--json`` printed, whatever stands after it."""
    return json.JSONDecoder().raw_decode(text[text.index("{") :])[0]["items"]


def note(summary: dict, word: str) -> str:
    """Return the first note or warning of a summary with a word in it."""
    return next((note for note in summary.get("notes", []) + summary.get("warnings", []) if word in note), "")


def about(text: str, word: str) -> str:
    """Return what stands around a word."""
    at = text.find(word)
    return text[max(0, at - 60) : at + 80] if at >= 0 else end(text)


def end(text: str) -> str:
    """Return the end of a text."""
    return text[-150:]
