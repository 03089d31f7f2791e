"""A study in a folder of its own, with the product's live commands as processes, and LSL that hears nobody else."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hrcneuro.live.liblsl import apart

ROOT = Path(__file__).parents[2]
COMMAND = [sys.executable, "-m", "hrcneuro"]
Row = tuple[str, bool, str]
"""A claim, whether it holds, and what is known where it does not."""
STUDY = """
[study]
name = "live"
subjects = ["s01"]
exclude = []
[acquire]
sfreq = 1000.0
[acquire.session]
practice_episodes = 1
blocks = 2
episodes_per_block = 6
[record]
look_s = 1.0
"""


def lsl_api(session: str, *, peer: str = "127.0.0.1") -> str:
    """Return liblsl's configuration: it hears one peer, this machine itself, and no stream of another session."""
    return apart(session).replace("127.0.0.1", peer)


class Lab:
    """A study in a folder of its own, with LSL that hears nobody else."""

    def __init__(self, folder: Path, *, brief: bool = True) -> None:
        self.folder, self.brief = folder, brief
        (folder / "hrcneuro.toml").write_text(STUDY)
        (folder / "lsl_api.cfg").write_text(lsl_api(f"live-{os.getpid()}-{folder.name}"))
        path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
        self.environment = {**os.environ, "LSLAPICFG": str(folder / "lsl_api.cfg"), "PYTHONPATH": path}

    def start(self, *words: str) -> subprocess.Popen[str]:
        """Start a command of the product."""
        return subprocess.Popen(
            [*COMMAND, *words], cwd=self.folder, env=self.environment, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, text=True, start_new_session=True,
        )  # fmt: skip

    @contextlib.contextmanager
    def amplifier(self, *words: str) -> Iterator[subprocess.Popen[str]]:
        """Run an amplifier that is there when this begins."""
        amp = self.start("amp", "s01", "--json", *words)
        assert amp.stdout is not None
        while '"stream"' not in (line := amp.stdout.readline()):
            assert line, amp.communicate()
        try:
            yield amp
        finally:
            amp.kill()
            amp.communicate()

    def record(self, *words: str, timeout: float = 4000) -> tuple[int, dict[str, Any], str]:
        """Record, and return exit code, the JSON answer and what was said."""
        done = self.start("record", "s01", "--json", *words)
        out, err = done.communicate(timeout=timeout)
        return done.returncode, json.loads(out or "{}"), err

    @property
    def recording(self) -> Path:
        """The newest recording."""
        return max(path.parent for path in self.parts())

    def streams(self, part: int = 1) -> dict[str, Any]:
        """Return the streams of a part, as pyxdf reads them, by name."""
        import pyxdf

        path = self.recording / f"part{part}.xdf"
        streams, _ = pyxdf.load_xdf(path, synchronize_clocks=False, dejitter_timestamps=False, verbose=False)
        return {one["info"]["name"][0]: one for one in streams}

    def parts(self) -> list[Path]:
        """Return the files of all recordings."""
        return sorted(self.folder.glob("recordings/s01/*/part*.xdf"))

    def samples_on_disk(self) -> int:
        """Return the bytes of the newest file."""
        return max((path.stat().st_size for path in self.parts()[-1:]), default=0)


def foreign(lab: Lab) -> Iterator[Row]:
    """pylsl's outlet is recorded, and its inlet reads our amplifier."""
    sender = subprocess.Popen([sys.executable, "-c", _PYLSL_OUTLET], env=lab.environment)
    try:
        code, answer, said = lab.record("--seconds", "4", "--set", 'record.streams={eeg={name="foreign"}}')
    finally:
        sender.kill()
        sender.wait()
    yield "pylsl's outlet recorded whole", code == 0, said[-200:]
    values = lab.streams()["foreign"]["time_series"][:, 0]
    yield "and in order", bool(np.array_equal(np.diff(values), np.ones(len(values) - 1))), str(answer)[:80]
    with lab.amplifier():
        done = subprocess.run(
            [sys.executable, "-c", _PYLSL_INLET], env=lab.environment, capture_output=True, text=True, check=False
        )
    yield f"pylsl's inlet read {done.stdout.strip()}", done.returncode == 0, done.stderr[-200:]


_PYLSL_OUTLET = """
import time, pylsl
info = pylsl.StreamInfo("foreign", "EEG", 2, 100, "float32", "pylsl-1")
outlet, begun, k = pylsl.StreamOutlet(info), pylsl.local_clock(), 0
while True:
    while k < (pylsl.local_clock() - begun) * 100:
        outlet.push_sample([float(k), 5.0 * (k % 7)], begun + k / 100); k += 1
    time.sleep(0.01)
"""
_PYLSL_INLET = """
import pylsl
found = [one for one in pylsl.resolve_streams(2.0) if one.name() == "actiCHamp"]
inlet = pylsl.StreamInlet(found[0])
samples, stamps = [], []
while len(stamps) < 2000:
    chunk, when = inlet.pull_chunk(timeout=1.0)
    samples += chunk; stamps += when
steps = [round((b - a) * 1e3, 3) for a, b in zip(stamps, stamps[1:])]
assert set(steps) == {1.0}, set(steps)
print(f"{len(stamps)} samples of {inlet.info().channel_count()} channels")
"""
