"""The simulated amplifier at virtual pace: true to its clock, its triggers on their sample, each fault as it says."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrcneuro.errors import ConfigError
from hrcneuro.live import faults
from hrcneuro.live.amplifier import LATENCY_S, Amplifier, Replay


class Bench:
    """An amplifier of two channels that count, and all that it sent."""

    def __init__(self, *what, sfreq=1000.0, n=20000):
        self.now, self.streams = 50.0, []
        data = np.stack([np.arange(n), -np.arange(n)]).astype(np.float32)
        self.amplifier = Amplifier(
            Replay(["a", "b"], sfreq, data),
            self.open,
            lambda: self.now,
            faults=[faults.parse(text) for text in what],
            rng=np.random.default_rng(3),
        )

    def open(self):
        bench = self

        class Stream:
            def __init__(self):
                self.stamps, self.values, self.closed = [], [], False

            def push(self, stamps, values):
                self.stamps.append(stamps)
                self.values.append(values)

            def close(self):
                self.closed = True

        bench.streams.append(Stream())
        return bench.streams[-1]

    def run(self, seconds, step=0.005):
        end = self.now + seconds
        while self.now < end - 1e-9:
            self.now += step
            self.amplifier.step()
        return self

    @property
    def sent(self):
        stamps = [s for stream in self.streams for s in stream.stamps]
        values = [v for stream in self.streams for v in stream.values]
        return np.concatenate(stamps or [np.zeros(0)]), np.concatenate(values or [np.zeros((0, 3))])


@given(st.lists(st.floats(0.001, 0.7), min_size=1, max_size=30))
def test_however_late_it_gets_to_send_no_sample_is_lost_or_gained(steps):
    bench = Bench(n=10**5)
    for step in steps:
        bench.now += step
        bench.amplifier.step()
    stamps, values = bench.sent
    np.testing.assert_array_equal(values[:, 0], np.arange(len(values)))
    np.testing.assert_allclose(stamps, 50 + np.arange(len(stamps)) / 1000, atol=1e-9)
    due = (bench.now - 50 - LATENCY_S) * 1000
    assert due - 11 <= len(stamps) <= max(due + 1, 0)


def test_a_trigger_is_seen_from_its_sample_on():
    bench = Bench().run(1.0)
    assert bench.amplifier.trigger(bench.now - 0.004) == 996
    _, values = bench.run(0.2).sent
    np.testing.assert_array_equal(np.flatnonzero(values[:, 2]), np.arange(996, 1006))


def test_a_trigger_that_comes_too_late_is_seen_with_the_next_sample():
    bench = Bench().run(1.0)
    gone = bench.amplifier.sent
    assert bench.amplifier.trigger(bench.now - 0.5) == gone


@pytest.mark.parametrize("breaks", [(), (700,), (3, 1000, 1001, 2990)])
def test_a_replay_pauses_where_its_recording_had_a_break_and_loses_nothing(breaks):
    bench = Bench(n=3000)
    bench.amplifier._signal.breaks = breaks
    stamps, values = bench.run(3.5 + len(breaks)).sent
    np.testing.assert_array_equal(values[:, 0], np.arange(3000))
    places = np.rint((stamps - 50) * 1000).astype(int)
    np.testing.assert_array_equal(places, [bench.amplifier._signal.place(at) for at in range(3000)])
    assert [int(at) + 1 for at in np.flatnonzero(np.diff(places) != 1)] == list(breaks)
    assert set(np.diff(places)) <= {1, 1001}
    assert bench.amplifier.over


def test_a_replay_ends_with_its_last_sample():
    bench = Bench(n=1234).run(3.0)
    assert bench.amplifier.over
    assert len(bench.sent[0]) == 1234


@pytest.mark.parametrize(("ppm", "n"), [(1000.0, 10010), (-1000.0, 9990), (50.0, 10000)])
def test_a_clock_that_drifts_takes_more_or_fewer_samples(ppm, n):
    stamps, _ = Bench(f"drift={ppm}").run(10 + LATENCY_S + 0.01).sent
    assert len(stamps) == pytest.approx(n, abs=11)
    assert (len(stamps) - 1) / np.ptp(stamps) == pytest.approx(1000 * (1 + ppm * 1e-6), abs=1e-4)


def test_a_delay_is_in_every_stamp():
    stamps, _ = Bench("delay=0.037").run(1.0).sent
    np.testing.assert_allclose(stamps, 50.037 + np.arange(len(stamps)) / 1000)


@pytest.mark.parametrize(("what", "sd"), [(("jitter=0.005", "delay=0.037"), 0.005), (("jitter=0.005",), 0.003)])
def test_jitter_moves_the_stamps_of_whole_chunks_and_never_before_they_were_taken(what, sd):
    stamps, _ = Bench(*what).run(5.0).sent
    late = stamps - (50 + np.arange(len(stamps)) / 1000)
    assert late.min() >= -1e-9
    assert late.std() == pytest.approx(sd, rel=0.25)
    assert np.ptp(late.reshape(-1, 10), axis=1).max() < 1e-9


def test_dropped_samples_are_missing_and_nothing_else():
    stamps, values = Bench("drop=0.5@1").run(3.0).sent
    (gap,) = np.flatnonzero(np.diff(values[:, 0]) != 1)
    assert values[gap + 1, 0] - values[gap, 0] - 1 == pytest.approx(500, abs=20)
    np.testing.assert_allclose(stamps, 50 + values[:, 0] / 1000)


def test_a_stall_sends_everything_later():
    bench = Bench("stall=1@1").run(1.5)
    held = len(bench.sent[0])
    _, values = bench.run(1.5).sent
    assert held == pytest.approx(1000 - 1000 * LATENCY_S, abs=20)
    np.testing.assert_array_equal(values[:, 0], np.arange(len(values)))


def test_after_a_reconnect_there_is_a_new_stream_without_what_was_meanwhile():
    bench = Bench("reconnect=1@1").run(3.0)
    first, second = bench.streams
    assert first.closed
    assert not second.closed
    gap = second.values[0][0, 0] - first.values[-1][-1, 0]
    assert gap == pytest.approx(1000, abs=25)


def test_an_end_is_for_good():
    bench = Bench("end@1").run(3.0)
    assert bench.amplifier.over
    assert bench.streams[0].closed


def test_what_is_wrong_from_the_start():
    assert np.ptp(Bench("flat=1").run(1.0).sent[1][:, 0]) == 0
    assert Bench("volts").run(1.0).sent[1][500, 0] == pytest.approx(500e-6)
    assert len(Bench("stuck").run(1.0).sent[0]) == 0


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("dorp=1", "did you mean 'drop'"),
        ("drop=-1@2", "lies in 0"),
        ("drop=much@2", "numbers"),
        ("drop@-1", "not negative"),
        ("drop@inf", "not negative"),
        ("drift=50@3", "takes no time"),
        ("delay=nan", "lies in"),
    ],
)
def test_a_fault_that_is_none(text, match):
    with pytest.raises(ConfigError, match=match):
        faults.parse(text)


def test_each_fault_stands_in_the_documentation():
    from pathlib import Path

    page = (Path(__file__).parents[2] / "docs" / "recording.md").read_text()
    assert [kind for kind in faults.KINDS if f"`{kind}" not in page] == []
