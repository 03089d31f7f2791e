"""Formats of several makers, written byte by byte: samples, units, events and breaks come back, damage is refused."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from maker_files import save_bci2000, save_curry, save_egi, save_gdf, save_nedf, save_neuroscan

from hrcneuro.errors import ConfigError, DataError
from hrcneuro.sources.formats import read_recording
from hrcneuro.sources.layout import recording_files
from hrcneuro.stages import acquire

NAMES = ["Fz", "Cz", "Pz"]
UV = np.random.default_rng(0).normal(0, 10, (3, 400)).round(1)


def gdf(path, **options):
    events = [(50, 769, 10), (200, 0x7FFE, 0), (300, 770, 10)]
    return save_gdf(path, [(name, "uV", row) for name, row in zip(NAMES, UV, strict=True)], events, **options)


def writers(folder):
    """Return name -> (file, how exact its steps are in µV, markers, breaks)."""
    codes = [(50, 7, 0), (200, 0, 14), (300, 8, 0)]
    ones = {"names": NAMES, "gains": ["0.1"] * 3, "offsets": [5] * 3}
    states = {"StimulusCode": np.repeat([0, 3, 0, 4], 100)}
    return {
        "gdf 1": (gdf(folder / "old.gdf", version=1.25), 1e-9, [("769", 0.5), ("770", 3.0)], [2.0]),
        "gdf 2": (gdf(folder / "new.gdf"), 1e-9, [("769", 0.5), ("770", 3.0)], [2.0]),
        "neuroscan": (save_neuroscan(folder / "n.cnt", UV, NAMES, codes), 1e-5, [("7", 0.49), ("8", 2.99)], [2.0]),
        "egi": (save_egi(folder / "e.raw", UV, [("DIN1", [50, 51, 52, 100])]), 1e-5, [("DIN1", 0.5), ("DIN1", 1)], []),
        "nedf": (save_nedf(folder / "e.nedf", UV, NAMES, [(50, 3)]), 0.03, [], []),
        "bci2000": (save_bci2000(folder / "b.dat", UV * 10 + 5, states, **ones), 1e-9, [], []),
        "curry": (save_curry(folder / "c.cdt", UV, NAMES, [(50, 1), (300, 2)]), 1e-5,
                  [("event 1", 0.5), ("event 2", 3.0)], []),
    }  # fmt: skip


KINDS = ("gdf 1", "gdf 2", "neuroscan", "egi", "nedf", "bci2000", "curry")


@pytest.mark.parametrize("kind", KINDS)
def test_what_was_written_is_read(tmp_path, kind):
    path, exact, marked, breaks = writers(tmp_path)[kind]
    recording = read_recording(path)
    eeg = recording.picks("eeg")
    np.testing.assert_allclose(recording.data[eeg] * 1e6, UV, atol=exact)
    assert recording.sfreq == (500 if kind == "nedf" else 100)
    assert [recording.ch_names[i] for i in eeg] == (["E1", "E2", "E3"] if kind == "egi" else NAMES)
    found = list(zip(recording.markers["event"], recording.markers["onset_s"].round(6), strict=True))
    assert found == marked
    assert recording.breaks_s == breaks


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_that_is_cut_is_refused_and_nothing_is_padded(tmp_path, kind):
    path = writers(tmp_path)[kind][0]
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) - len(whole) // 3])
    if kind == "bci2000":
        # The format does not state how long a recording is: a sample that is cut is all that can be known.
        assert any("ends within a sample" in note for note in read_recording(path).notes) or len(whole) % 3
        return
    with pytest.raises(DataError, match=r"truncated|fewer|samples of .* cannot be read|cannot be read as"):
        read_recording(path)


@pytest.mark.parametrize("size", [0, 5, 200])
@pytest.mark.parametrize("ending", [".gdf", ".cnt", ".raw", ".nedf", ".dat", ".cdt"])
def test_another_file_of_that_ending_is_refused_with_a_cure(tmp_path, ending, size):
    path = tmp_path / f"x{ending}"
    path.write_bytes(b"Now is the winter of our discontent. " * 10)
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(DataError) as caught:
        read_recording(path)
    assert caught.value.cure
    assert str(tmp_path) not in caught.value.problem


@pytest.mark.parametrize(("version", "unit", "scale"), [
    (1.25, "uV", 1e-6), (1.25, "mV", 1e-3), (1.25, "nV", 1e-9), (1.25, "V", 1.0),
    (2.1, "uV", 1e-6), (2.1, "mV", 1e-3), (2.1, "nV", 1e-9), (2.1, "V", 1.0),
])  # fmt: skip
def test_gdf_units_are_those_of_the_header(tmp_path, version, unit, scale):
    recording = read_recording(save_gdf(tmp_path / "u.gdf", [("Cz", unit, UV[0])], version=version))
    np.testing.assert_allclose(recording.data[0], UV[0] * scale, rtol=1e-9)
    assert recording.units == [unit]


def test_gdf_events_by_a_clock_of_their_own_and_channels_of_another_rate(tmp_path):
    signals = [("Cz", "uV", UV[0]), ("slow", "uV", UV[1][:40])]
    recording = read_recording(save_gdf(tmp_path / "r.gdf", signals, [(500, 33, 0)], event_rate=1000))
    assert recording.markers.to_numpy().tolist() == [[0.5, "33"]]
    assert any("channels at 10 Hz, 100 Hz" in note for note in recording.notes)


def test_a_gdf_that_was_never_closed_or_lost_its_table(tmp_path):
    with pytest.raises(DataError, match="does not say how long it is"):
        read_recording(gdf(tmp_path / "open.gdf", records=-1))
    with pytest.raises(DataError, match="announces 9 records of 1 s, it holds 4"):
        read_recording(gdf(tmp_path / "short.gdf", records=9))
    path = gdf(tmp_path / "table.gdf")
    path.write_bytes(path.read_bytes()[:-5])
    with pytest.raises(DataError, match="table of events announces 3 and holds fewer"):
        read_recording(path)


@pytest.mark.parametrize("wide", [False, True])
@pytest.mark.parametrize("counted", [False, True])
def test_neuroscan_s_width_of_samples_is_found_with_and_without_a_count(tmp_path, wide, counted):
    path = save_neuroscan(tmp_path / "n.cnt", UV, NAMES, [(50, 7, 0)], wide=wide, counted=counted, bads=["Cz"])
    recording = read_recording(path)
    np.testing.assert_allclose(recording.data * 1e6, UV, atol=1e-5)
    assert recording.bads == ["Cz"]
    # Sites of the 10-05 system get that system's places; the header's flat drawing serves names of no system.
    assert recording.montage is None
    assert read_recording(save_neuroscan(tmp_path / "p.cnt", UV, ["1", "2", "3"])).montage is not None


def test_egi_by_the_amplifier_s_range_and_in_segments(tmp_path):
    recording = read_recording(save_egi(tmp_path / "r.raw", UV * 4096 / 1000, bits=12, span=1000))
    np.testing.assert_allclose(recording.data * 1e6, UV, atol=1e-4)
    with pytest.raises(DataError, match="holds segments"):
        read_recording(save_egi(tmp_path / "s.raw", UV, version=5))


def test_bci2000_states_become_trigger_channels(tmp_path):
    states = {"Running": np.ones(400), "StimulusCode": np.repeat([0, 3], 200), "Target": np.repeat([0, 1, 0, 2], 100)}
    path = save_bci2000(tmp_path / "b.dat", UV * 10, states, gains=["0.1muV"] * 3, offsets=[0] * 3, form="float32")
    recording = read_recording(path)
    assert recording.ch_names == ["EEG1", "EEG2", "EEG3", "StimulusCode", "Target"]
    assert recording.ch_types == ["eeg"] * 3 + ["stim"] * 2
    np.testing.assert_array_equal(recording.data[4], states["Target"])
    np.testing.assert_allclose(recording.data[:3] * 1e6, UV, atol=1e-4)
    with pytest.raises(DataError, match="3 channels, 2 gains and 3 offsets"):
        read_recording(save_bci2000(tmp_path / "g.dat", UV, states, gains=["1"] * 2, offsets=[0] * 3))


def test_several_trigger_channels_are_one_problem_with_its_own_cure(tmp_path):
    states = {"StimulusCode": np.repeat([0, 3], 200), "Target": np.repeat([0, 1, 0, 2], 100)}
    path = save_bci2000(tmp_path / "b.dat", UV * 10, states, names=NAMES, gains=["0.1muV"] * 3, offsets=[0] * 3)
    given = dict(source="file", path=str(path))
    problems = acquire.inspect(acquire.Config(**given), "p1")["problems"]
    assert ["several trigger channels hold triggers" in one["problem"] for one in problems] == [True]
    assert problems[0]["cure"] == "name one: acquire.markers = 'StimulusCode'"
    assert not acquire.inspect(acquire.Config(**given, markers="Target"), "p1")["problems"]
    # An option that stops the shaping of channels is the one problem, too: what follows from it is none.
    problems = acquire.inspect(acquire.Config(**given, drop=("fz",)), "p1")["problems"]
    assert ["acquire.drop names" in one["problem"] for one in problems] == [True]


def test_a_trigger_channel_without_triggers_is_named_where_there_are_no_events(tmp_path):
    states = {"StimulusCode": np.repeat([3, 0], 200)}
    path = save_bci2000(tmp_path / "b.dat", UV * 10, states, names=NAMES, gains=["0.1muV"] * 3, offsets=[0] * 3)
    (problem,) = acquire.inspect(acquire.Config(source="file", path=str(path)), "p1")["problems"]
    assert "neither annotations nor triggers in StimulusCode" in problem["problem"]
    assert "acquire.markers" in problem["cure"]
    assert "vmrk" not in problem["cure"]


def test_curry_s_files_belong_together(tmp_path):
    path = save_curry(tmp_path / "c.cdt", UV, NAMES, [(50, 1)], unit="mV")
    assert {file.name for file in recording_files(str(path), "p1").values()} == {"c.cdt", "c.cdt.dpa", "c.cdt.ceo"}
    np.testing.assert_allclose(read_recording(path).data, UV * 1e-3, rtol=1e-6)
    path.with_suffix(".cdt.dpa").unlink()
    with pytest.raises(DataError, match="needs its parameters beside it"):
        read_recording(path)


def test_each_event_of_curry_has_its_own_words(tmp_path):
    path = save_curry(tmp_path / "c.cdt", UV, NAMES, [(300, 1), (50, 1)], remarks=["late", "early"])
    assert read_recording(path).markers.to_numpy().tolist() == [[0.5, "early"], [3.0, "late"]]


def test_a_folder_of_egi_is_answered_with_the_ways_out(tmp_path):
    (tmp_path / "x.mff").mkdir()
    with pytest.raises(ConfigError, match=r"x\.mff is a folder") as caught:
        recording_files(str(tmp_path / "x.mff"), "p1")
    assert "simple binary" in caught.value.cure


def test_a_data_file_of_brainvision_is_answered_with_its_header(tmp_path):
    (tmp_path / "x.dat").write_bytes(b"\0" * 100)
    (tmp_path / "x.vhdr").write_text("Brain Vision Data Exchange Header File Version 1.0\n")
    with pytest.raises(DataError, match=r"holds the samples of x\.vhdr"):
        read_recording(tmp_path / "x.dat")


@pytest.mark.parametrize(("kind", "library"), [("nedf", "defusedxml"), ("curry", "curryreader"), ("ant", "antio")])
def test_a_library_that_is_not_here_is_named_with_the_command_that_installs_it(tmp_path, monkeypatch, kind, library):
    monkeypatch.setitem(sys.modules, library, None)
    (tmp_path / "a.cnt").write_bytes(b"RIFF" + (92).to_bytes(4, "little") + b"CNT " + bytes(88))
    path = tmp_path / "a.cnt" if kind == "ant" else writers(tmp_path)[kind][0]
    with pytest.raises(ConfigError, match=f"needs {library}, which is not installed") as caught:
        read_recording(path)
    assert caught.value.cure == "pip install 'hrcneuro[formats]'"


def test_reading_curry_sets_up_no_logging_and_leaves_nothing_on_the_terminal(tmp_path, capfd):
    import logging

    before = list(logging.getLogger().handlers)
    read_recording(save_curry(tmp_path / "c.cdt", UV, NAMES))
    assert logging.getLogger().handlers == before
    assert capfd.readouterr() == ("", "")
