"""A recorded session at virtual pace: an amplifier that replays, a robot that marks, a recorder, and a log."""

from dataclasses import replace

import numpy as np
from virtual_streams import Sender, VirtualNetwork

from hrcneuro.live import faults, journal, part, preparation, session
from hrcneuro.live.amplifier import TRIGGER, Amplifier, Replay
from hrcneuro.live.parameters import Declared, RecordOptions
from hrcneuro.paradigm import markers

SFREQ = 250.0
LABELS = ["Fz", "Cz", "Pz", "O1"]
OPTIONS = RecordOptions(
    streams={"eeg": Declared(type="EEG"), "markers": Declared(name="hrcneuro-moves")}, look_s=0.5, wait_s=1.0
)


class Lab:
    """A recording of a session's moves: an amplifier that replays, a robot that marks, a recorder, a log."""

    def __init__(
        self, folder, trials, *, what=(), offset=0.0, drift_ppm=0.0, start=1000.0, marks=True, robot_offset=0.0
    ):
        self.folder, self.trials, self.marks = folder, trials, marks
        self.robot_offset = robot_offset  # of the robot's machine, whose clock began at another time
        folder.mkdir(parents=True, exist_ok=True)
        self.offset, self.drift_ppm = offset, drift_ppm
        self.eeg = Sender("actiCHamp", "EEG", labels=(*LABELS, TRIGGER), sfreq=SFREQ, source_id="amp")
        self.eeg.description = _typed(self.eeg.description)
        self.robot = Sender("hrcneuro-moves", "Markers", source_id="robot")
        self.robot.offset = robot_offset
        self.network = VirtualNetwork(self.eeg, self.robot, now=start)
        self.data = _data(int((trials["onset_s"].max() + 6) * SFREQ))
        self.amplifier = Amplifier(
            Replay(LABELS, SFREQ, self.data), lambda: self, self.network.clock,
            faults=[faults.parse(text) for text in what], rng=np.random.default_rng(1),
        )  # fmt: skip
        self.next = 0
        self.network.on_wait.append(self.happen)
        self.begin(1)

    def push(self, stamps, values):
        """Send what the amplifier took, stamped by its own clock."""
        self.eeg.push(self.own(stamps), values)

    def own(self, now):
        """Return the time of the amplifier's own clock."""
        return now - self.offset + 1e-6 * self.drift_ppm * (now - 1000.0)

    def close(self):
        """The amplifier goes."""

    def happen(self, now):
        self.eeg.offset = now - self.own(now)
        while self.next < len(self.trials):
            row = self.trials.iloc[self.next]
            when = self.amplifier.start + row["onset_s"]
            if when > now:
                break
            self.amplifier.trigger(when)
            if self.marks:
                self.robot.push([when - self.robot_offset], [[marker_of(row)]])
            self.next += 1
        self.amplifier.step()

    def begin(self, number):
        opened = preparation.prepare(self.network, self.network.clock, self.network.wait, OPTIONS)
        preparation.refuse(opened.problems)
        self.notes = journal.Journal(self.folder, {})
        path = part.path_of(self.folder, number)
        self.notes.begin({"file": path.name})
        self.session = session.Session(
            self.network, self.network.clock, opened, OPTIONS, part.Part(path, started=f"2026-01-01T00:0{number}:00"),
            self.notes, tell=lambda stream, event: None, helper=None,
        )  # fmt: skip

    def go_on(self, seconds=None):
        end = self.network.now + seconds if seconds else np.inf
        while self.network.now < end and not self.amplifier.over:
            self.network.wait(0.05)
            self.session.step()
        return self

    def end(self):
        self.session.close()
        return self


def _typed(description):
    xml = description.xml.replace(
        f"<label>{TRIGGER}</label><unit>microvolts</unit><type>EEG</type>",
        f"<label>{TRIGGER}</label><unit>none</unit><type>stim</type>",
    )
    return replace(description, xml=xml, bare_xml=xml, units=("microvolts",) * 4 + ("none",))


def _data(n):
    rng = np.random.default_rng(7)
    return np.concatenate([np.arange(n)[None] % 1000, 20 * rng.standard_normal((3, n))]).astype(np.float32)


def marker_of(row):
    numbers = {name: int(row[name]) for name in ("block", "episode", "trial")}
    return markers.of_move("s01", scenario=row["scenario"], practice=bool(row["practice"]), **numbers)
