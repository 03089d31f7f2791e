"""A whole session at virtual pace: amplifier, simulated person, recorder, experiment and arm in one process.

The parts are those of a session in real time; they exchange stamped chunks over a virtual network, whose clock is the
arm's.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hrcneuro.experiment import messages as m
from hrcneuro.experiment.ahead import Ahead
from hrcneuro.experiment.learning import Learning, Loop
from hrcneuro.experiment.ports import Seen
from hrcneuro.experiment.session import Setup
from hrcneuro.experiment.virtual import Virtual
from hrcneuro.live import journal, preparation
from hrcneuro.live.amplifier import TRIGGER, Amplifier
from hrcneuro.live.listening import Listening
from hrcneuro.live.parameters import RecordOptions
from hrcneuro.live.part import Part, path_of
from hrcneuro.live.person import Person
from hrcneuro.live.session import Session
from hrcneuro.live.transport import MOVES, TRUTH
from hrcneuro.live.virtual import VirtualNetwork, VirtualOutlet

_STEP_S, _CHUNK = 0.25, 50  # well within the time from a move's marker to its decision
_QUICK_CHUNK = 10
_AFTER_S = 3.0  # what the last move evokes is recorded, too


@dataclass(frozen=True)
class Lab:
    """What stands in the laboratory.

    Attributes:
        signal: What the amplifier's electrodes see.
        kinds: ``eeg`` or ``eog``, one a channel.
        options: How it is recorded.
        remark: A sentence that goes with the recording.
        folder: Where the recording is written; it is there. None: nothing is recorded.
    """

    signal: Any
    kinds: Sequence[str]
    options: RecordOptions
    remark: str
    folder: Path | None


class Rehearsal:
    """One session with its recording.

    Attributes:
        seen: What was seen of the session, once it has run.
        late: Triggers that came too late for their sample.
        learning: The closed loop, where there is one.
    """

    def __init__(self, setup: Setup, lab: Lab, loop: Loop | None = None, *, ahead: Ahead | None = None) -> None:
        """Prepare it: the streams are there, and are recorded from now on.

        Args:
            setup: What the session is run with: at virtual pace, with a simulated person.
            lab: What stands around it.
            loop: What decides and learns, for closed blocks.
            ahead: As :class:`~hrcneuro.experiment.virtual.Virtual` takes it.

        Raises:
            ConfigError, HardwareError: The arm cannot work in the cell; the streams are not as declared, or none that
                the decoder serves.
        """
        self.seen: Seen
        signal = lab.signal
        self._network = VirtualNetwork()
        amp = VirtualOutlet(
            "actiCHamp", "EEG", [*signal.ch_names, TRIGGER], sfreq=signal.sfreq, source_id=f"amp {setup.subject}",
            types=[*lab.kinds, "stim"], units=[*["microvolts"] * len(lab.kinds), "none"], remark=lab.remark,
        )  # fmt: skip
        source = f"experiment {setup.subject}"
        self._markers = VirtualOutlet(MOVES, "Markers", ["marker"], sfreq=0, source_id=source)
        self._truth = VirtualOutlet(TRUTH, "Markers", ["truth"], sfreq=0, source_id=f"{source} truth")
        self._network.outlets += [amp, self._markers, self._truth]
        self._amplifier = Amplifier(
            signal,
            lambda: amp,
            self._network.clock,
            chunk=_CHUNK if loop is None else _QUICK_CHUNK,
            apart=False,
            rng=np.random.default_rng(setup.seed),
        )
        self._person = Person(self._amplifier, signal)
        listening = Listening(self._network, self._network.clock, self._person)
        self._network.on_wait += [lambda now: listening.step(), lambda now: self._amplifier.step()]
        self._recording = self._recorded(lab, setup.subject)
        self._go: dict[int, m.Go] = {}
        options = replace(setup.options, truth=True)
        self.learning = None if loop is None else Learning(self._network, setup.subject, loop)
        self._session = Virtual(
            replace(setup, options=options), around=self._around, hear=self._hear, ahead=ahead,
            policies=None if self.learning is None else self.learning.policies,
        )  # fmt: skip
        self._began = self._network.now

    def run(self) -> Seen:
        """Run the session to its end, and close the recording; return what was seen of it.

        Raises:
            HardwareError: The arm was stopped.
        """
        self.seen = self._session.run()
        for _ in range(round(_AFTER_S / _STEP_S)):
            self._step(_STEP_S)
        if self._recording is not None:
            self._recording.close()
        return self.seen

    @property
    def late(self) -> int:
        """Triggers that came too late for their sample."""
        return self._person.late

    def _recorded(self, lab: Lab, subject: str) -> Session | None:
        options, folder = lab.options, lab.folder
        # Whether or not it is recorded, the same time passes: what is recorded is what happens without.
        opened = preparation.prepare(self._network, self._network.clock, self._network.wait, options)
        preparation.refuse(opened.problems)
        if folder is None:
            opened.close()
            return None
        notes = journal.Journal(folder, {"subject": subject})
        path = path_of(folder, 1)
        beginning = journal.beginning(path, clock_s=self._network.clock())
        part = Part(path, started=beginning["began"])
        notes.begin(beginning)
        return Session(
            self._network, self._network.clock, opened, options, part, notes,
            tell=lambda stream, event: None, helper=ThreadPoolExecutor(1),
        )  # fmt: skip

    def _around(self, now: float) -> None:
        passed = self._began + now - self._network.now
        soon = self.learning is not None and self.learning.soon(passed)
        # A decision waits for samples: nothing happens to it before the next of them leave.
        if passed >= (self._amplifier.due_s() if soon else _STEP_S):
            self._step(passed)

    def _step(self, seconds: float) -> None:
        self._network.wait(seconds)
        if self._recording is not None:
            self._recording.step()
        if self.learning is not None:
            self.learning.step()

    def _hear(self, message: m.Request | m.Report) -> None:
        if isinstance(message, m.Go):
            self._go[message.index] = message
        elif isinstance(message, m.Onset):
            go = self._go.pop(message.index)
            # Where the grid's edge stops a move, nothing moves, and no marker goes out.
            if go.start != go.end:
                self._markers.send(go.marker, self._began + message.when)
        elif isinstance(message, m.Mark):
            self._markers.send(message.text, self._began + message.when)
        elif isinstance(message, m.Truth):
            move = dict(message.move)
            if "key_s" in move:
                move["key_s"] += self._began
            self._truth.send(json.dumps(move), self._network.now)
