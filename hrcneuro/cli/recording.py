"""What the command record does: streams, files, a look at them while they grow, and the answer in the end."""

from __future__ import annotations

import contextlib
import ctypes
import gc
import json
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from hrcneuro import interrupts
from hrcneuro.cli.console import Console
from hrcneuro.cli.recording_view import View
from hrcneuro.errors import ConfigError, DataError, HardwareError
from hrcneuro.io.places import check_room, lock, new_folder, unwritable
from hrcneuro.live import journal, preparation, session
from hrcneuro.live.lsl import LslNetwork
from hrcneuro.live.parameters import RecordOptions
from hrcneuro.live.part import LOCK, Part, newest, number_of, path_of
from hrcneuro.live.preflight import Look

_ROOM = 200_000_000  # bytes: ten minutes of 64 channels at 1 kHz
_QUICK_S = 0.001
_GIVE_BACK_S = 60.0


@dataclass
class Answer:
    """How a recording ended: exit code, what a program and what a person is told."""

    code: int
    about: dict[str, Any] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)


def check(options: RecordOptions) -> dict[str, Any]:
    """Return what comes of the streams at this moment.

    Raises:
        HardwareError: They are not as they should be.
    """
    with LslNetwork() as network:
        opened = preparation.prepare(network, network.clock, time.sleep, options)
        try:
            preparation.refuse(opened.problems)
            return {key: _looked(look) for key, look in opened.looks.items()}
        finally:
            opened.close()


def in_words(looked: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """Yield a line a stream, of what :func:`check` returns."""
    for key, one in looked.items():
        rate = f"{one['measured_hz']:.2f} Hz" if one["measured_hz"] else f"{one['samples']} texts"
        yield f"{key}: {one['name']} ({one['type']}), {one['channels']} channels, {rate}"
    yield "all declared streams are there; nothing was recorded"


def _looked(look: Look) -> dict[str, Any]:
    about, stamps = look.description, look.stamps
    moving = bool(about.sfreq) and len(stamps) > 1
    return {
        "name": about.name,
        "type": about.type,
        "channels": about.n_channels,
        "samples": len(stamps),
        "measured_hz": float((len(stamps) - 1) / (stamps[-1] - stamps[0])) if moving else 0.0,
    }


def run(
    workdir: Path,
    subject: str,
    options: RecordOptions,
    talk: Console,
    *,
    seconds: float = 0,
    resume: bool = False,
    quick: bool = False,
) -> Answer:
    """Record until Ctrl-C, or for so many seconds; return how it ended.

    ``quick`` takes samples as soon as they come, to time them, and does not read the file back.

    Raises:
        HardwareError: The streams are not as they should be; nothing was recorded.
        ConfigError, DataError, StageError: There is nothing to go on with, or no place to write.
    """
    _refuse_without_reader()
    parent = workdir.absolute() / options.folder / subject
    earlier = _last(parent) if resume else None
    cure = "free space, or choose another place: record.folder"
    check_room(parent, _ROOM, what="ten minutes of recording", cure=cure, then="nothing is recorded")
    with interrupts.whole():
        with LslNetwork() as network, ThreadPoolExecutor(1) as helper:
            talk.say(f"looking at the streams, {options.look_s:g} s …")
            opened = preparation.prepare(network, network.clock, time.sleep, options)
            try:
                preparation.refuse(opened.problems)
                folder, part, notes = _begin(parent, earlier, subject, options, network.clock)
            except BaseException:
                opened.close()
                raise
            for name, why in opened.left_out.items():
                talk.say(f"the stream {name!r} is left out: {why}", style="yellow")
            gc.collect()
            _give_back()
            view = View(talk, folder, options)
            # From here on a signal waits until the step is done: it must cut nothing in two.
            interrupts.once(view.tell_patience)
            interrupts.hold()
            going = session.Session(network, network.clock, opened, options, part, notes, tell=view.tell, helper=helper)
            fault = _go_on(going, part, notes, view, seconds, _QUICK_S if quick else preparation.STEP_S)
            answer = Answer(1 if fault else 0, {"folder": str(folder)}) if quick else _ended(folder, notes, fault, talk)
        # Whoever asked again was answered: the recording is whole, and so is what is said of it.
        interrupts.forget()
    return answer


def _go_on(
    going: session.Session, part: Part, notes: journal.Journal, view: View, seconds: float, step_s: float
) -> str:
    """Step until somebody ends it; return why it could not go on, or an empty string."""
    begun = given_back = time.monotonic()
    fault = ""
    try:
        with view:
            while not interrupts.asked() and (not seconds or time.monotonic() - begun < seconds):
                going.step()
                view.show(going.recorder.streams, part.size, time.monotonic() - begun)
                if time.monotonic() - given_back > _GIVE_BACK_S:
                    given_back = time.monotonic()
                    _give_back()
                time.sleep(step_s)
        going.close()
    except OSError as error:
        fault = f"{part.path} takes no more: {error.strerror or error}"
        notes.part["state"] = journal.FULL
    except Exception as error:
        # Whatever it was: what came until then is a recording, and is ended as one.
        fault = f"{type(error).__name__}: {error}"
        notes.part["state"] = journal.FAILED
    if fault:
        view.fail(fault)
        with contextlib.suppress(OSError):
            going.recorder.close()
        with contextlib.suppress(OSError):
            notes.write()
    elif going.unwritten:
        view.fail(going.unwritten)
    return fault


def _begin(
    parent: Path, earlier: Path | None, subject: str, options: RecordOptions, clock: Any
) -> tuple[Path, Part, journal.Journal]:
    try:
        folder = earlier or new_folder(parent)
        _lock(folder)
        notes = journal.Journal(folder, {"subject": subject})
        number = 1 + max((number_of(path) for path in folder.glob("part*.xdf")), default=0)
        path = path_of(folder, number)
        beginning = journal.beginning(path, clock_s=clock())
        part = Part(path, started=beginning["began"])
        notes.begin(beginning)
    except OSError as error:
        raise unwritable("the recording", parent, error) from error
    return folder, part, notes


def _give_back() -> None:
    """Give the system back what loading and buffers have left free: a recorder lives beside an experiment."""
    # Where the C library has no such function, nothing is given back.
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)


def _lock(folder: Path) -> None:
    """Refuse to write into a recording that another process writes; the lock ends with this process.

    Raises:
        HardwareError: It does.
    """
    try:
        lock(folder / LOCK)
    except BlockingIOError as error:
        raise HardwareError(
            f"another process is recording into {folder}",
            cure="end it with Ctrl-C, then resume; or begin a new recording",
        ) from error


def _last(parent: Path) -> Path:
    """Return the newest recording of a subject, to go on with."""
    there = newest(parent, "part*.xdf")
    if there is None:
        raise DataError(
            f"there is no recording to go on with in {parent}", cure="begin one: the same command without --resume"
        )
    return there


def _refuse_without_reader() -> None:
    if find_spec("pyxdf") is None:
        raise ConfigError(
            "a recording is read back by pyxdf, which is not installed", cure="pip install 'hrcneuro[lsl,xdf]'"
        )


def _ended(folder: Path, notes: journal.Journal, fault: str, talk: Console) -> Answer:
    """Read the recording back, and say what it is worth."""
    talk.say("reading the recording back …")
    checked, trouble = read_back(folder)
    notes.part["check"] = checked
    with contextlib.suppress(OSError):
        notes.write()
    lines = [*verdict(folder, checked)]
    if trouble:
        lines.append(trouble)
    if fault:
        lines.append(f"the recording ended early: {fault}; all that had been written is kept")
    whole = bool(checked) and all(one["whole"] for one in checked) and not fault and not trouble
    about = {"folder": str(folder), "whole": whole, "fault": fault or trouble, "check": checked}
    return Answer(0 if whole else 1, about, lines)


def read_back(folder: Path) -> tuple[list[dict[str, Any]], str]:
    """Read a recording in a process of its own; return what each stream is worth, and why it cannot be read."""
    words = [sys.executable, "-m", "hrcneuro.live.selfcheck", str(folder)]
    done = subprocess.run(words, capture_output=True, text=True, check=False, start_new_session=True)
    if done.returncode == 0:
        return json.loads(done.stdout), ""
    why = (done.stderr.strip().splitlines() or ["it ended without a word"])[-1]
    return [], f"{folder} cannot be read back: {why}"


def verdict(folder: Path, checked: list[dict[str, Any]]) -> Iterator[str]:
    """Yield what was read back, a line a stream and part, and what it comes to."""
    for one in checked:
        part = f"part {one['part']}, " if checked[-1]["part"] > 1 else ""
        rate = f" at {one['rate']:.3f} Hz" if one["rate"] else ""
        gaps = f", {one['missing']} missing in {one['gaps']} gaps" if one["gaps"] else ", no gap" if rate else ""
        drift = f", clock {round(one['drift_ppm'], 1) + 0.0:+.1f} ppm" if one["drift_ppm"] is not None else ""
        lost = (one["counted"] or one["samples"]) - one["samples"]
        short = f", {lost} fewer than came" if lost else ""
        flaws = "".join(f"; {flaw}" for flaw in one["flaws"])
        yield f"{part}{one['stream']}: {one['samples']:,} samples{rate}{gaps}{drift}{short}{flaws}"
    sound = all(one["whole"] for one in checked) and checked
    yield f"{'whole' if sound else 'NOT WHOLE'}: {folder}"
