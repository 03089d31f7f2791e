"""Two machines, as network namespaces of this one: what is told where the cable between them is pulled."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator

from live_lab import COMMAND, Lab, Row, lsl_api

_MARKERS = """
import itertools, time
from hrcneuro.live.lsl import LslOutlet
outlet = LslOutlet("hrcneuro-moves", "Markers", ["marker"], sfreq=0, source_id="robot")
for i in itertools.count():
    outlet.send(f"move/subject=s01/scenario=iC/block=1/episode=1/trial={i}", outlet.clock())
    time.sleep(1)
"""
Start = Callable[..., "subprocess.Popen[str]"]
_HERE, _THERE = "10.97.3.1", "10.97.3.2"


def pulled_cable(lab: Lab) -> Iterator[Row]:
    """Amplifier and markers come from another machine; its cable is pulled, and put back: both are told, at once."""
    if os.geteuid() or subprocess.run(["ip", "netns", "list"], capture_output=True, check=False).returncode:
        yield "SKIPPED: needs root and 'ip netns', to have another machine", True, ""
        return
    with _machines(lab) as (here, there):
        senders = [
            there("-m", "hrcneuro", "amp", "s01"),
            there("-c", _MARKERS),
        ]
        recorder = None
        try:
            recorder = here("-m", "hrcneuro", "record", "s01", "--json", "--set", "record.wait_s=20")
            _until(lambda: bool(lab.parts()) or recorder.poll() is not None)
            if recorder.poll() is not None:
                yield "two machines' streams are recorded", False, str(recorder.communicate())[-500:]
                return
            time.sleep(5)
            _ip("-n", _name(lab, "there"), "link", "set", "cable", "down")
            time.sleep(8)
            _ip("-n", _name(lab, "there"), "link", "set", "cable", "up")
            time.sleep(12)
            os.killpg(recorder.pid, signal.SIGTERM)
            out, said = recorder.communicate(timeout=60)
        finally:
            for one in [*senders, *([recorder] if recorder is not None else [])]:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(one.pid, signal.SIGKILL)
                one.communicate()
    about = json.loads((lab.recording / "session.json").read_text())["parts"][0]
    told = [(one["stream"], one["kind"]) for one in about["events"]]
    yield "the silent EEG is told", ("eeg", "stall") in told, str(told)
    yield "that the markers are gone is told, though none was due", ("markers", "lost") in told, str(told)
    yield "both are told to be back", {("eeg", "back"), ("markers", "back")} <= set(told), f"{told} {said[-900:]}"
    yield "the exit code says what the file is", recorder.returncode in (0, 1), out[-300:]


@contextlib.contextmanager
def _machines(lab: Lab) -> Iterator[tuple[Start, Start]]:
    names = [_name(lab, one) for one in ("here", "there")]
    try:
        for name in names:
            _ip("netns", "add", name)
            _ip("-n", name, "link", "set", "lo", "up")
        _ip("link", "add", "cable", "netns", names[0], "type", "veth", "peer", "name", "cable", "netns", names[1])
        for name, address in zip(names, (_HERE, _THERE), strict=True):
            _ip("-n", name, "addr", "add", f"{address}/24", "dev", "cable")
            _ip("-n", name, "link", "set", "cable", "up")
        yield tuple(_start(lab, name, peer) for name, peer in zip(names, (_THERE, _HERE), strict=True))
    finally:
        for name in names:
            subprocess.run(["ip", "netns", "del", name], check=False, capture_output=True)


def _start(lab: Lab, name: str, peer: str) -> Start:
    path = lab.folder / f"{name}.cfg"
    path.write_text(lsl_api(f"live-{lab.folder.name}", peer=peer))
    environment = {**lab.environment, "LSLAPICFG": str(path)}

    def start(*words: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            ["ip", "netns", "exec", name, COMMAND[0], *words], cwd=lab.folder, env=environment,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        )  # fmt: skip

    return start


def _name(lab: Lab, which: str) -> str:
    return f"hrc-{lab.folder.name[-6:]}-{which}"


def _ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True)


def _until(condition: Callable[[], bool], seconds: float = 60.0) -> None:
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "it did not come to pass"
        time.sleep(0.05)
