"""XDF files: clocks, gaps, rates, streams that share a name, files that were not finished."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hrcneuro.eeg.stamps import samples_at, segments, steady
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.sources import joining
from hrcneuro.sources.channels import shape
from hrcneuro.sources.formats import read_recording
from hrcneuro.sources.units import voltage_unit

SHARED = Path(__file__).parents[2] / "../shared/data/recordings/xdf"


@pytest.fixture
def eeg(noise_uv):
    def stream(samples: int = 1000, *, srate: float = 100.0, true_hz: float = 0.0, start: float = 50.0, **more) -> dict:
        return {
            "name": "amp", "type": "EEG", "srate": srate, "format": "float32", "labels": ["Fz", "Cz"],
            "stamps": start + np.arange(samples) / (true_hz or srate), "samples": noise_uv(2, samples).T, **more,
        }  # fmt: skip

    return stream


def markers(stamps: list[float], texts: list, **more) -> dict:
    return {
        "name": "tags", "type": "Markers", "srate": 0, "format": "string", "stamps": stamps, "samples": texts, **more,
    }  # fmt: skip


def onsets(recording) -> dict[str, float]:
    table = recording.markers
    return dict(zip(table["event"], table["onset_s"].round(6), strict=True))


@pytest.mark.parametrize("gap_s", [0.1, 0.9, 4.0])
def test_a_gap_of_any_length_is_a_break(tmp_path, write_xdf, eeg, gap_s):
    stream = eeg()
    stream["stamps"][400:] += gap_s
    marks = markers([52.0, 54.0 + gap_s / 2, 56.0 + gap_s], ["before", "within", "after"])
    recording = read_recording(write_xdf(tmp_path / "r.xdf", [stream, marks]))
    assert recording.breaks_s == [4.0]
    assert onsets(recording) == {"before": 2.0, "after": 6.0}
    assert "1 markers lie where samples are missing and are left out" in recording.notes
    length = f"{gap_s + 0.01:.1f}"
    assert f"gaps without samples: 1, {length} s in all, {length} s at most" in recording.notes


def test_samples_that_come_late_and_in_bursts_are_no_gap():
    """A radio that sends 20 samples at once, and stalls for half a second now and then, loses nothing."""
    rng = np.random.default_rng(4)
    sent = np.arange(6000) / 200.0
    arrived = sent + 0.02 + rng.exponential(0.004, 6000)
    for stall in range(500, 6000, 700):
        arrived[stall : stall + 100] = np.maximum(arrived[stall : stall + 100], arrived[stall] + 0.5)
    assert segments(np.maximum.accumulate(arrived), 200.0) == [(0, 6000)]
    lost = np.delete(arrived, np.arange(3000, 3020))
    assert segments(lost, 200.0) == [(0, 3000), (3000, 5980)]


@pytest.mark.parametrize("lost", [1, 3])
@pytest.mark.parametrize("wavers_s", [0.0, 0.0001])
def test_a_gap_of_a_sample_or_some_is_a_break_where_the_clock_is_steady(tmp_path, write_xdf, eeg, lost, wavers_s):
    stream = eeg(1000, srate=500.0)
    stream["stamps"][400:] += lost / 500
    stream["stamps"] += wavers_s * np.random.default_rng(1).standard_normal(1000)
    marks = markers([51.0, 52.0], ["one", "two"])
    recording = read_recording(write_xdf(tmp_path / "r.xdf", [stream, marks]))
    assert recording.breaks_s == [0.8]
    length = f"{2 * (lost + 1)} ms"
    assert f"gaps without samples: 1, {length} in all, {length} at most" in recording.notes


def test_chunks_that_came_behind_younger_ones_are_put_in_their_places(tmp_path, write_xdf, eeg):
    stream = eeg()
    whole = stream["stamps"].copy(), stream["samples"].copy()
    order = np.concatenate([np.arange(300), np.arange(320, 360), np.arange(300, 320), np.arange(360, 1000)])
    stream["stamps"], stream["samples"] = whole[0][order], whole[1][order]
    recording = read_recording(write_xdf(tmp_path / "r.xdf", [stream, markers([55.0], ["a"])]))
    np.testing.assert_allclose(recording.data.T * 1e6, whole[1], rtol=1e-5)
    assert recording.breaks_s == []
    assert onsets(recording) == {"a": 5.0}
    assert any("put in their places" in note for note in recording.notes)


def test_a_clock_that_was_set_back_is_not_put_in_order(tmp_path, write_xdf, eeg):
    stream = eeg()
    stream["stamps"][600:] -= 2.0
    recording = read_recording(write_xdf(tmp_path / "r.xdf", [stream, markers([51.0], ["a"])]))
    np.testing.assert_allclose(recording.data.T * 1e6, stream["samples"], rtol=1e-5)
    assert recording.breaks_s == [6.0]


@pytest.mark.parametrize("off_ms", [-60, -7, 3, 40])
def test_a_gap_that_the_recorder_marked_is_found_where_measured_clocks_waver(tmp_path, write_xdf, eeg, off_ms):
    """The mark is as far off as the clocks' last difference; the stamps waver too much to tell a gap alone."""
    stream = eeg(3000, srate=500.0)
    rng = np.random.default_rng(3)
    stream["stamps"][1000:] += 4 / 500
    # Chunks of ten that are stamped early and late.
    stream["stamps"] += np.repeat(np.abs(0.0025 * rng.standard_normal(300)), 10)
    stream["stamps"][990:1010] -= stream["stamps"][[999, 1000]].repeat(10) - 50 - np.repeat([999, 1004], 10) / 500
    mark = {
        "name": "hrcneuro-recorder", "type": "Markers", "srate": 0, "format": "string",
        "source_id": "hrcneuro-recorder", "stamps": [stream["stamps"][999] + off_ms / 1000],
        "samples": ["gap/stream=eeg/samples=4/seconds=0.008"],
    }  # fmt: skip
    path = write_xdf(tmp_path / "r.xdf", [stream, markers([51.0], ["a"]), mark])
    assert read_recording(path).breaks_s == [2.0]
    assert read_recording(write_xdf(tmp_path / "n.xdf", [stream, markers([51.0], ["a"])])).breaks_s == []
    other = {**mark, "samples": ["gap/stream=gaze/samples=55/seconds=0.1"]}
    assert read_recording(write_xdf(tmp_path / "o.xdf", [stream, markers([51.0], ["a"]), other])).breaks_s == []


def test_what_is_told_of_a_part_is_told_of_the_whole(tmp_path, write_xdf, eeg):
    parts = [write_xdf(tmp_path / f"{n}.xdf", [eeg(clocks=n == 1), markers([55.0], ["a"])]) for n in (1, 2)]
    (told,) = joining.read_joined(parts).warnings
    assert told.startswith("2.xdf: the clock of stream 'amp' was never compared")


def test_a_clock_that_was_never_compared_is_told(tmp_path, write_xdf, eeg):
    marks = markers([55.0], ["a"])
    assert read_recording(write_xdf(tmp_path / "r.xdf", [eeg(), marks])).warnings == []
    alone = [one | {"clocks": False} for one in (eeg(), marks)]
    told = read_recording(write_xdf(tmp_path / "r.xdf", alone)).warnings
    assert [text.split("'")[1] for text in told if "never compared" in text] == ["amp", "tags"]


def test_the_rate_is_measured_within_segments():
    stamps = np.concatenate([np.arange(500) / 99.0, 100 + np.arange(500) / 99.0])
    parts = segments(stamps, 100.0)
    assert parts == [(0, 500), (500, 1000)]
    times, rate = steady(stamps, parts)
    assert rate == pytest.approx(99.0)
    np.testing.assert_allclose(times, stamps, atol=1e-9)
    places = samples_at(times, parts, np.array([1.0, 50.0, 101.0]), 0.01)
    np.testing.assert_allclose(places, [99.0, np.nan, 599.0], atol=1e-6)


@pytest.mark.parametrize("which", ["nominal", "measured"])
def test_a_clock_that_runs_backwards_is_refused(tmp_path, write_xdf, eeg, which):
    stream = eeg()
    stream["stamps"] = stream["stamps"][::-1]
    path = write_xdf(tmp_path / "r.xdf", [stream, markers([55.0], ["a"])])
    with pytest.raises(DataError, match="the time stamps of stream 'amp' do not go forward"):
        read_recording(path, stream_rate=which)


@pytest.mark.parametrize("true_hz", [93.0, 107.0])
def test_a_rate_that_is_not_as_stated_is_refused_or_measured(tmp_path, write_xdf, eeg, true_hz):
    path = write_xdf(tmp_path / "r.xdf", [eeg(true_hz=true_hz), markers([55.0], ["a"])])
    with pytest.raises(DataError, match=rf"states 100 Hz and came at {true_hz:.3f} Hz, 7\.0 % off") as caught:
        read_recording(path)
    assert "acquire.stream_rate = 'measured'" in caught.value.cure
    recording = read_recording(path, stream_rate="measured")
    assert recording.sfreq == pytest.approx(true_hz)
    assert onsets(recording) == {"a": 5.0}
    assert read_recording(path, rate_tolerance=0.08).sfreq == 100


def test_a_rate_that_is_nearly_as_stated_is_noted(tmp_path, write_xdf, eeg):
    recording = read_recording(write_xdf(tmp_path / "r.xdf", [eeg(true_hz=100.2), markers([55.0], ["a"])]))
    assert recording.sfreq == 100
    assert "stream 'amp': 1000 samples at 100 Hz (nominal 100, measured 100.200 Hz)" in recording.notes


def test_a_stream_that_states_no_rate(tmp_path, write_xdf, eeg):
    stream = eeg() | {"srate": 0.0}
    path = write_xdf(tmp_path / "r.xdf", [stream, markers([55.0], ["a"])])
    with pytest.raises(DataError, match=r"states no sampling rate; measured 100\.000 Hz"):
        read_recording(path)
    assert read_recording(path, stream_rate="measured").sfreq == pytest.approx(100)


def test_streams_of_one_name_are_told_apart(tmp_path, write_xdf, eeg):
    streams = [eeg(source_id="amp-17"), eeg(source_id="amp-18", samples=800), markers([51.0], ["a"])]
    path = write_xdf(tmp_path / "r.xdf", streams)
    with pytest.raises(
        ConfigError, match=r"amp#1 \(.*amp-17.*1000 samples\), amp#2 \(.*amp-18.*800 samples\)"
    ) as caught:
        read_recording(path)
    assert "acquire.stream = 'amp#1'" in caught.value.cure
    with pytest.raises(ConfigError, match=r"2 streams that acquire\.stream = 'amp' fits"):
        read_recording(path, stream="amp")
    for stream in ("amp#2", "amp-18"):
        recording = read_recording(path, stream=stream)
        assert recording.data.shape == (2, 800)
        assert [text.split("'")[1] for text in recording.warnings if "left aside" in text] == ["amp#1"]
        assert "1000 samples" in recording.warnings[0]


def test_a_file_that_lost_samples_is_refused_and_one_without_an_end_noted(tmp_path, write_xdf, eeg):
    path = write_xdf(tmp_path / "r.xdf", [eeg(counted=1200), markers([51.0], ["a"])])
    with pytest.raises(DataError, match="stream 'amp' holds 1000 of 1200 samples"):
        read_recording(path)
    path = write_xdf(tmp_path / "r.xdf", [eeg(counted=None), markers([51.0], ["a"])])
    assert any("no end mark" in note and "truncated" in note for note in read_recording(path).notes)


def test_an_eeg_stream_without_samples_is_not_replaced_by_another(tmp_path, write_xdf, eeg):
    empty = eeg(0) | {"counted": 0}
    path = write_xdf(tmp_path / "r.xdf", [empty, eeg(name="gyro", type="Motion"), markers([51.0], ["a"])])
    with pytest.raises(DataError, match=r"the EEG stream has no samples: amp \(EEG, 2 channels, 100 Hz, 0 samples\)"):
        read_recording(path)


def test_a_lone_stream_of_another_type_is_taken_and_said(tmp_path, write_xdf, eeg):
    recording = read_recording(write_xdf(tmp_path / "r.xdf", [eeg(type="signal"), markers([51.0], ["a"])]))
    assert "stream 'amp' of type 'signal' taken for the EEG" in recording.notes


@pytest.mark.parametrize("kind", ["Markers", "Triggers", "Event"])
def test_markers_that_are_numbers(tmp_path, write_xdf, eeg, kind):
    marks = markers([51.0, 52.0], [7, 9], type=kind, format="int32")
    other = markers([51.5], [1.5], type="Gaze", format="float32", name="eye")
    recording = read_recording(write_xdf(tmp_path / "r.xdf", [eeg(), marks, other]))
    assert onsets(recording) == {"7": 1.0, "9": 2.0}
    assert "streams of other kinds, not read: eye" in recording.notes


def test_a_marker_without_a_text_is_none(tmp_path, write_xdf, eeg):
    recording = read_recording(write_xdf(tmp_path / "r.xdf", [eeg(), markers([51.0, 52.0], ["", "go"])]))
    assert onsets(recording) == {"go": 2.0}
    assert "1 markers without a text are left out" in recording.notes


def test_types_and_units_of_channels(tmp_path, write_xdf, eeg):
    stream = eeg(labels=["Fz", "Belt"], types=["EEG", "Respiration"], units=["counts", "a.u."])
    recording = read_recording(write_xdf(tmp_path / "r.xdf", [stream, markers([51.0], ["a"])]))
    assert recording.ch_types == ["eeg", "misc"]
    assert any("Fz: unit 'counts' is no voltage, taken for microvolts" in note for note in recording.notes)
    np.testing.assert_allclose(recording.data[0] * 1e6, stream["samples"][:, 0], rtol=1e-6)
    stream = eeg(units=["microvolts", "celsius"], types=["EEG", ""])
    recording = read_recording(write_xdf(tmp_path / "r.xdf", [stream, markers([51.0], ["a"])]))
    shape(recording, rename={}, types={}, drop=(), bads=(), montage="none", unit="")
    assert recording.ch_types == ["eeg", "misc"]
    assert "taken for MISC, not EEG, by the unit celsius: Cz" in recording.notes
    stream = eeg(units=["millivolts", "-6"])
    recording = read_recording(write_xdf(tmp_path / "r.xdf", [stream, markers([51.0], ["a"])]))
    np.testing.assert_allclose(recording.data.T, stream["samples"] * [1e-3, 1e-6], rtol=1e-6)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("µV", "uV"), ("μV", "uV"), ("ÂµV", "uV"), ("Î¼V", "uV"), ("\ufffdV", "uV"), ("uv", "uV"), (" µV ", "uV"),
        ("uVolt", "uV"), ("microvol", "uV"), ("æV", "uV"), ("mVolt", "mV"),
        ("Microvolts", "uV"), ("mV", "mV"), ("nV", "nV"), ("Volt", "V"), ("-6", "uV"),
        ("C", None), ("°C", None), ("µS", None), ("%", None), ("", None), ("a.u.", None),
    ],
)  # fmt: skip
def test_units_of_voltage(text, unit):
    assert voltage_unit(text) == unit


@pytest.mark.parametrize("rounding", [-1e-15, 0.0, 1e-15])
def test_a_moment_just_one_sample_away_belongs_to_the_segment_whatever_the_rounding(rounding):
    times = 5 + np.arange(9) / 10
    when = np.array([times[0] - 0.1, times[-1] + 0.1]) + [-rounding, rounding]
    assert np.isfinite(samples_at(times, [(0, 9)], when, 0.1)).all()
    assert np.isnan(samples_at(times, [(0, 9)], times[[0, -1]] + [-0.11, 0.11], 0.1)).all()


def test_the_format_s_own_examples():
    """What the examples of the format's maintainers must give, as their descriptions have it."""
    if not SHARED.is_dir():
        pytest.skip("the format's examples are not here (shared/data)")
    minimal = read_recording(SHARED / "minimal.xdf")
    assert (minimal.data.shape, minimal.sfreq, len(minimal.markers)) == ((3, 9), 10, 9)
    with pytest.raises(DataError, match=r"states 100 Hz and came at 92\.934 Hz"):
        read_recording(SHARED / "clock_resets.xdf")
    resets = read_recording(SHARED / "clock_resets.xdf", stream_rate="measured")
    assert len(resets.breaks_s) == 1
    assert len(resets.markers) == 175
