"""What the command amp does: a signal, its streams, and the loop that keeps pace."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import FrameType
from typing import TYPE_CHECKING, Any

import numpy as np

from hrcneuro.cli.console import Console
from hrcneuro.cli.options import Options
from hrcneuro.config.settings import Settings
from hrcneuro.eeg.breaks import borders
from hrcneuro.errors import HardwareError
from hrcneuro.live.amplifier import TRIGGER, Amplifier, Replay, Signal
from hrcneuro.live.faults import Fault
from hrcneuro.live.listening import Listening
from hrcneuro.live.lsl import LslNetwork, LslOutlet
from hrcneuro.live.person import Person
from hrcneuro.live.transport import MOVES
from hrcneuro.sources import origin

if TYPE_CHECKING:
    from hrcneuro.eeg.synthetic.endless import Endless

_STEP_S = 0.005
_VOLTAGES = ("eeg", "eog", "ecg", "emg")


@dataclass
class Recorded:
    """A recording that is sent again.

    Attributes:
        signal: Its samples.
        kinds: Its channels' types, as acquire knows them.
        onsets: Its moves' onsets, as samples of the signal, pauses included.
        markers: Their markers.
        remark: That it was simulated, where it was.
    """

    signal: Replay
    kinds: Sequence[str]
    onsets: np.ndarray
    markers: Sequence[str]
    remark: str


def recorded(options: Options, study: Settings, subject: str) -> Recorded:
    """Bring acquire of a subject up to date and return its recording.

    Raises:
        HrcError: It cannot be had.
    """
    from hrcneuro.cli import bring
    from hrcneuro.io.fif import read_raw
    from hrcneuro.io.tables import read_table
    from hrcneuro.pipeline import graph
    from hrcneuro.pipeline.workdir import Workdir

    wanted = graph.targets(study, ["acquire"], [subject])
    with bring.logged("amp", options, study) as log:
        items = bring.bring(options, study, wanted, log)
        code = bring.console(options).failures(items)
        log.end(items, code)
    if code:
        raise HardwareError("there is no recording to send", cure="mend what acquire says, then begin again")
    workdir = Workdir(options.workdir)
    raw = read_raw(workdir.artifact("acquire", subject, f"{subject}_raw.fif"))
    kinds = raw.get_channel_types()
    # Its triggers are made anew from its onsets.
    picks = [i for i, kind in enumerate(kinds) if kind != "stim"]
    scale = np.array([1e6 if kinds[i] in _VOLTAGES else 1.0 for i in picks])
    data = (raw.get_data(picks=picks) * scale[:, None]).astype(np.float32)
    breaks = [at for at in borders(raw.annotations.onset, raw.annotations.description, raw.info["sfreq"]) if at > 0]
    table = read_table(workdir.artifact("acquire", subject, "trials.parquet"))
    table = table[table["onset_sample"].notna()]
    signal = Replay([raw.ch_names[i] for i in picks], float(raw.info["sfreq"]), data, breaks)
    onsets = np.array([signal.place(at) for at in table["onset_sample"].to_numpy(int)])
    return Recorded(
        signal,
        [kinds[i] for i in picks],
        onsets,
        texts_of(table.to_dict("records"), subject),
        origin.mark_of(origin.Origins.of(items[0].summary["origin"])),
    )


def texts_of(rows: Sequence[Mapping[Any, Any]], subject: str) -> list[str]:
    """Return the markers of the rows of trials.parquet, as a session sends them."""
    texts = []
    for row, after in zip(rows, [*rows[1:], None], strict=True):
        follows = after is not None and all(after[name] == row[name] for name in ("practice", "block", "episode"))
        texts.append(marker_of(row, subject, str(after["target"]) if after is not None and follows else ""))
    return texts


def marker_of(row: Mapping[Any, Any], subject: str, after: str = "") -> str:
    """Return the marker of a row of trials.parquet; ``after``: the direction of the path's next tile."""
    from hrcneuro.paradigm import design, markers

    if row["event"] != design.MOVE:
        return str(row["event"])
    block, episode, trial = (int(row[name]) for name in ("block", "episode", "trial"))
    return markers.of_move(
        subject, scenario=row["scenario"], block=block, episode=episode, trial=trial, practice=bool(row["practice"]),
        actor=str(row["actor"]), next=after,
    )  # fmt: skip


def run(
    study: Settings,
    subject: str,
    stream: str,
    source: Recorded | None,
    faults: Sequence[Fault],
    talk: Console,
    *,
    seconds: float = 0,
    as_json: bool = False,
    sitting: int = 0,
) -> int:
    """Send until Ctrl-C, the recording's end or so many seconds; return 0.

    Raises:
        HardwareError: mne-lsl is absent.
    """
    brain = None if source is not None else brain_of(study, subject, sitting=sitting)
    signal_, types = (source.signal, source.kinds) if source is not None else (brain, kinds())
    assert signal_ is not None
    with LslNetwork() as network:
        remark = source.remark if source is not None else origin.mark_of(origin.SYNTHETIC)
        opened = _outlets(stream, subject, signal_, types, faults, remark)
        rng = np.random.default_rng(study.sections["acquire"].seed)
        network.visible()  # the first look takes a second, in which no sample would leave
        amplifier = Amplifier(signal_, opened, network.clock, faults=faults, rng=rng)
        twin = opened(_run_of(subject, "twin")) if any(one.kind == "twin" for one in faults) else None
        person = Person(amplifier, brain)
        listening = Listening(network, network.clock, person) if source is None else None
        sender = _Sender(source, amplifier, subject) if source is not None else None
        if as_json:
            print(json.dumps({"command": "amp", "ok": True, "stream": stream}), flush=True)
        talk.say(f"{stream}: {len(types)} channels and {TRIGGER} at {signal_.sfreq:g} Hz; Ctrl-C ends it")
        _keep_pace(amplifier, listening, sender, seconds)
        amplifier.close()
        if twin is not None:
            twin.close()
        talk.say(f"{stream}: {amplifier.sent:,} samples sent" + _of_moves(person))
    return 0


def _keep_pace(amplifier: Amplifier, listening: Listening | None, sender: _Sender | None, seconds: float) -> None:
    ended = threading.Event()

    def end(number: int, frame: FrameType | None) -> None:
        ended.set()

    before = {number: signal.signal(number, end) for number in (signal.SIGINT, signal.SIGTERM)}
    # Late samples would look like a fault of what is tested with them.
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, -10)
    begun = time.monotonic()
    try:
        while not (ended.is_set() or amplifier.over or 0 < seconds <= time.monotonic() - begun):
            for one in (listening, sender):
                if one is not None:
                    one.step()
            amplifier.step()
            ended.wait(_STEP_S)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _of_moves(person: Person) -> str:
    late = f"; {person.late} triggers late" if person.late else ""
    return late + (f"; {person.unknown} moves without truth" if person.unknown else "")


def brain_of(study: Settings, subject: str, *, sitting: int = 0) -> Endless:
    """Return the EEG of a simulated person, without an end; each ``sitting`` is another recording of the same head."""
    from hrcneuro.eeg.synthetic.endless import Endless
    from hrcneuro.sources.simulated import generator

    acquire = study.sections["acquire"]
    # Channels go bad on demand, not by chance: what is tried with them should be the same each time.
    sound = replace(acquire.eeg, bad_channels=0, noisy_channels=0)
    return Endless(params=sound, sfreq=acquire.sfreq, rng=generator(acquire.seed, subject, "amp"), sitting=sitting)


def kinds() -> Sequence[str]:
    """Return what each of its channels is, ``eeg`` or ``eog``."""
    from hrcneuro.eeg.synthetic.head import CH_TYPES

    return CH_TYPES


def _outlets(
    stream: str, subject: str, source: Signal, kinds: Sequence[str], faults: Sequence[Fault], remark: str
) -> Callable[..., LslOutlet]:
    constant = {one.kind: one.value for one in faults}
    names = [str(i + 1) for i in range(len(kinds))] if "labels" in constant else list(source.ch_names)
    unit = "volts" if "volts" in constant else "microvolts"
    usual = _run_of(subject, "amp")
    return lambda source_id=usual: LslOutlet(
        stream,
        "EEG",
        [*names, TRIGGER],
        sfreq=constant.get("rate", source.sfreq),
        source_id=source_id,
        types=[*kinds, "stim"],
        units=[*(unit if kind in _VOLTAGES else "none" for kind in kinds), "none"],
        remark=remark,
    )


class _Sender:
    """The markers of a recording that is sent again."""

    def __init__(self, source: Recorded, amplifier: Amplifier, subject: str) -> None:
        self._amplifier, self._next = amplifier, 0
        self._source = source
        self._outlet = LslOutlet(MOVES, "Markers", ["marker"], sfreq=0, source_id=_run_of(subject, "moves"))

    def step(self) -> None:
        """Send what has begun by now, and let the trigger channel show it."""
        now = self._amplifier.sample_at(self._outlet.clock())
        onsets, markers = self._source.onsets, self._source.markers
        while self._next < len(onsets) and onsets[self._next] <= now:
            when = self._amplifier.time_of(int(onsets[self._next]))
            self._amplifier.trigger(when)
            self._outlet.send(markers[self._next], when)
            self._next += 1


def _run_of(subject: str, what: str) -> str:
    """Return a source id that no other run has: LSL reconnects to whatever has the same, in whichever session."""
    return f"hrcneuro-{what}-{subject}-{os.getpid()}"
