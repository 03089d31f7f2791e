"""The closed loop at virtual pace: an amplifier with a trigger line, a robot that marks, the loop, and a recorder."""

from dataclasses import replace

import numpy as np
from recorded_lab import OPTIONS as RECORD
from virtual_streams import Sender, VirtualNetwork

from hrcneuro.decoding.features import WINDOWS_S
from hrcneuro.decoding.frozen import FrozenDecoder, FrozenProblem, windows
from hrcneuro.eeg.causal import design
from hrcneuro.learning.learners import kinds
from hrcneuro.learning.online import OnlineLearner
from hrcneuro.live import decisions, journal, online_streams, part, preparation, session
from hrcneuro.live.amplifier import TRIGGER
from hrcneuro.live.online import Online
from hrcneuro.live.parameters import OnlineOptions
from hrcneuro.paradigm import markers

SFREQ = 250.0
LABELS = ("Fz", "Cz", "Pz", "O1", "EOG1")


def decoder(sfreq=SFREQ, channels=LABELS, reject_uv=2000.0):
    rng = np.random.default_rng(4)
    matrix = rng.normal(0, 0.3, (4, len(channels)))
    n = 4 * len(WINDOWS_S)
    problems = {
        name: FrozenProblem((f"{name}1", f"{name}2"), actor, rng.normal(0, 0.1, n), 0.25, 0.8, -0.1)
        for name, actor in (("HHvsHR", "human"), ("RRvsRH", "robot"))
    }
    filter_ = design(sfreq, 0.1, 40.0)
    return FrozenDecoder(
        channels, sfreq, (0.1, 40.0), filter_, matrix, channels[:4], windows(sfreq), reject_uv, problems
    )


def learner(name="paper", tau=0.1, floor=0.0, rates=None):
    return OnlineLearner(kinds(alpha=0.05, ddof=0, horizon=40)[name], tau=tau, floor=floor, rates=rates)


def moves(episodes=3, steps=8, block=1, seed=1, every_s=0.9, start_s=4.0, practice=False, scenario="iC"):
    """Return (onset, marker) of each event: a block, then moves with actors and next directions."""
    rng = np.random.default_rng(seed)
    events, at = [(start_s - 1.0, markers.of_block("s01", scenario=scenario, block=block, practice=practice))], start_s
    for episode in range(1, episodes + 1):
        for trial in range(steps):
            after = "" if trial == steps - 1 else str(rng.choice(["N", "E", "S", "W"]))
            text = markers.of_move(
                "s01", scenario=scenario, block=block, episode=episode, trial=trial, practice=practice,
                actor=str(rng.choice(["human", "robot"])), next=after,
            )  # fmt: skip
            # Between samples: the edge and the marker must differ.
            events.append((at + float(rng.uniform(0, 0.01)), text))
            at += every_s
        at += 2.0
    return events


class Lab:
    """The streams; ``spoil(numbers, rows)`` returns the rows that are sent, NaN stamps left out."""

    def __init__(self, events, *, trigger=True, options=None, spoil=None, offset=0.0, chunk=10, folder=None, **loop):
        self.events, self.trigger, self.spoil, self.offset, self.chunk = sorted(events), trigger, spoil, offset, chunk
        self.late = 2  # samples: the trigger behind its marker
        labels = (*LABELS, TRIGGER)
        self.eeg = Sender("amp", "EEG", labels=labels, sfreq=SFREQ, source_id="amp")
        self.typed()
        self.robot = Sender("hrcneuro-moves", "Markers", source_id="robot")
        self.network = VirtualNetwork(self.eeg, self.robot)
        self.eeg.offset = offset
        self.begun, self.sent, self.marked, self.silent = self.network.now, 0, 0, []
        self.rng, self.pulses = np.random.default_rng(9), []
        self.network.on_wait.append(self.happen)
        self.session = self.record(folder) if folder is not None else None
        self.published, self.lines, self.told = [], [], []
        self.options = options or OnlineOptions(mode="closed")
        self.decoder = loop.pop("decoder", decoder())
        self.learner = loop.pop("learner", learner())
        eeg = online_streams.find_eeg(self.network, self.network.clock, self.network.wait, self.decoder, self.options)
        self.loop = Online(
            self.network, self.network.clock, eeg, self.decoder, self.learner, self.options, subject="s01",
            publish=lambda text, stamp: self.published.append(text), log=self.lines.append, tell=self.told.append,
            **loop,
        )  # fmt: skip

    def typed(self):
        xml = self.eeg.description.xml.replace(
            f"<label>{TRIGGER}</label><unit>microvolts</unit><type>EEG</type>",
            f"<label>{TRIGGER}</label><unit>none</unit><type>stim</type>",
        )
        units = ("microvolts",) * len(LABELS) + ("none",)
        self.eeg.description = replace(self.eeg.description, xml=xml, bare_xml=xml, units=units)

    def record(self, folder):
        folder.mkdir(parents=True)
        opened = preparation.prepare(self.network, self.network.clock, self.network.wait, RECORD)
        preparation.refuse(opened.problems)
        notes = journal.Journal(folder, {})
        path = part.path_of(folder, 1)
        notes.begin({"file": path.name})
        self.begun = self.network.now  # events count from the recording's beginning
        self.sent = 0
        return session.Session(
            self.network, self.network.clock, opened, RECORD, part.Part(path, started="2026-01-01T00:00:00"), notes,
            tell=lambda stream, event: None, helper=None,
        )  # fmt: skip

    def happen(self, now):
        for at, text in self.events[self.marked :]:
            if self.begun + at > now:
                break
            self.marked += 1
            if text.startswith("move"):
                self.pulses.append(int(np.ceil(at * SFREQ)) + self.late)
            self.robot.push([self.begun + at], [[text]])
        due = int((now - self.begun - 0.03) * SFREQ) - self.sent
        for _ in range(due // self.chunk):
            numbers = self.sent + np.arange(self.chunk)
            self.sent += self.chunk
            rows = np.zeros((self.chunk, len(LABELS) + 1), np.float32)
            rows[:, :-1] = 100.0 + 15 * self.rng.standard_normal((self.chunk, len(LABELS)))
            if self.trigger:
                rows[:, -1] = np.isin(numbers, [k + i for k in self.pulses[-20:] for i in range(3)])
            stamps = self.begun + numbers / SFREQ - self.offset
            if self.spoil is not None:
                stamps, rows = self.spoil(numbers, stamps, rows)
            if len(stamps):
                self.eeg.push(stamps, rows)

    def run(self, seconds=None, step=0.01):
        end = self.begun + (seconds or self.events[-1][0] + 3.0)
        while self.network.now < end:
            self.network.wait(step)
            self.loop.step()
            if self.session is not None:
                self.session.step()
        if self.session is not None:
            self.session.close()
        return self

    @property
    def trials(self):
        return [line for line in self.lines if line["kind"] == decisions.MOVE]

    @property
    def causes(self):
        return {cause: n for cause, n in self.loop.deciding.causes.items() if cause}
