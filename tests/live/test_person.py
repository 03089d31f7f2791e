"""The simulated person: what it is told, what its brain then does, and that nobody else listens to the truth."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from virtual_streams import Sender, VirtualNetwork

import hrcneuro
from hrcneuro.eeg.synthetic import SyntheticParams
from hrcneuro.eeg.synthetic.endless import Endless
from hrcneuro.live.amplifier import Amplifier
from hrcneuro.live.listening import Listening
from hrcneuro.live.person import Person
from hrcneuro.paradigm import markers

MARKER = markers.of_move("s01", scenario="iC", block=1, episode=2, trial=3, practice=False)
SFREQ = 250.0
QUIET = SyntheticParams(
    variability=0, background_uv=0, alpha_uv=0, mu_uv=0, blinks_per_min=0, saccade_uv=0, line_uv=0, drift_uv=0,
    sensor_uv=0, bad_channels=0, noisy_channels=0, amplitude_sigma=0, latency_sd_ms=0,
)  # fmt: skip


class Nowhere:
    def push(self, stamps, values):
        """Let samples go."""

    def close(self):
        """Nothing to close."""


class Bench:
    def __init__(self, params=QUIET):
        self.now = 10.0
        self.brain = Endless(params=params, sfreq=SFREQ, rng=np.random.default_rng(1))
        self.amplifier = Amplifier(self.brain, Nowhere, lambda: self.now, rng=np.random.default_rng(2))
        self.person = Person(self.amplifier, self.brain)

    def after(self, seconds, channel="Cz"):
        """Return the EEG of the next seconds at a channel, from 0 µV on."""
        data = self.brain.take(round(seconds * SFREQ))[:, self.brain.ch_names.index(channel)]
        return data - data[0]


def told(**move):
    return json.dumps({"marker": MARKER, **move})


def test_a_marker_names_its_move():
    assert markers.move_in(MARKER) == {
        "subject": "s01", "scenario": "iC", "block": 1, "episode": 2, "trial": 3, "practice": False, "closed": False
    }  # fmt: skip
    assert markers.move_in("key/left") is None
    assert markers.move_in("move/subject=s01/block=x/episode=1/trial=2") is None


def test_a_takeover_that_it_anticipates_adds_the_positivity():
    expected, other = Bench(), Bench()
    expected.person.knows(told(actor="robot", condition_before="RH", scenario="iC"))
    other.person.knows(told(actor="robot", condition_before="RR", scenario="iC"))
    for bench in (expected, other):
        bench.person.hears(MARKER, 10.0)
    extra = expected.after(1.5) - other.after(1.5)
    assert np.argmax(extra) / SFREQ == pytest.approx(0.5, abs=0.02)
    assert extra.max() > 3


def test_the_hand_moves_before_the_motion_where_it_was_announced():
    bench = Bench()
    bench.person.knows(told(actor="human", key_s=10.4))
    before = bench.after(0.39, "C3")
    assert np.abs(before[round(0.3 * SFREQ) :]).max() > 1


def test_without_truth_a_move_evokes_what_any_move_does():
    bench = Bench()
    bench.person.hears(MARKER, 10.0)
    assert bench.person.unknown == 1
    assert np.abs(bench.after(1.0)).max() > 1


def test_texts_that_are_no_moves_and_truth_that_is_none_change_nothing():
    bench = Bench()
    bench.person.hears("key/left", 10.0)
    for text in ("", "[]", "{}", "5", "\x00", '{"marker": 3}'):
        bench.person.knows(text)
    assert np.abs(bench.after(1.0)).max() < 1e-3


def test_a_late_marker_is_counted():
    bench = Bench()
    bench.now = 11.0
    bench.amplifier.step()
    bench.person.hears(MARKER, 10.1)
    assert bench.person.late == 1


def test_rest_has_no_seam_where_it_repeats():
    params = SyntheticParams(bad_channels=0, noisy_channels=0, blinks_per_min=0, saccade_uv=0)
    brain = Endless(params=params, sfreq=SFREQ, rng=np.random.default_rng(4))
    data = brain.take(round(121 * SFREQ))
    steps = np.abs(np.diff(data, axis=0))
    seam = steps[round(119.9 * SFREQ) : round(120.1 * SFREQ)].max(axis=0)
    assert (seam <= 1.5 * np.quantile(steps, 0.999, axis=0)).all()


class Ears:
    """A person who writes down what comes."""

    def __init__(self):
        self.heard, self.known = [], []

    def hears(self, text, stamp):
        self.heard.append((text, stamp))

    def knows(self, text, offset=0.0):
        self.known.append(text)


@pytest.mark.parametrize("source_id", ["experiment", "another run"])
@pytest.mark.parametrize("recovers", [True, False])
def test_a_session_that_is_begun_anew_is_heard_and_each_marker_once(source_id, recovers):
    """Whether LSL connects by itself to the next run, which has the same source id, or not."""
    senders = [Sender(name, "Markers", source_id="experiment") for name in ("hrcneuro-moves", "hrcneuro-truth")]
    network, ears = VirtualNetwork(*senders), Ears()
    network.recovers = recovers
    listening = Listening(network, network.clock, ears)

    def go_on(seconds):
        for _ in range(round(seconds / 0.05)):
            network.wait(0.05)
            listening.step()

    for run in range(3):
        go_on(1)
        for n in range(5):
            senders[0].push([network.now], [[f"move/{run}/{n}"]])
            senders[1].push([network.now], [[f"truth/{run}/{n}"]])
            go_on(0.2)
        for one in senders:
            one.end()
        go_on(0.7)
        senders = [Sender(name, "Markers", source_id=source_id) for name in ("hrcneuro-moves", "hrcneuro-truth")]
        network.outlets[:] = senders
    assert [text for text, _ in ears.heard] == [f"move/{run}/{n}" for run in range(3) for n in range(5)]
    assert ears.known == [f"truth/{run}/{n}" for run in range(3) for n in range(5)]


def test_nothing_but_the_amplifier_reads_the_truth():
    """A robot that could would need no decoder."""
    root = Path(hrcneuro.__file__).parent
    files = [path for path in root.rglob("*.py") if re.search("TRUTH|[a-z]-truth", path.read_text())]
    # The preflight names it to leave it out; who simulates a person writes it, and listening takes it to the amplifier.
    assert {path.relative_to(root).as_posix() for path in files} == {
        "live/transport.py",
        "live/person.py",
        "live/preflight.py",
        "live/onsets.py",
        "live/listening.py",
        "experiment/rehearsal.py",
    }
