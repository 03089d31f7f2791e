"""A BIDS data set: its subjects, sessions and runs, and what its tables say of channels, places and events."""

from __future__ import annotations

import json

import numpy as np
import pytest
from bids_files import NAMES, SFREQ, describe, recording, table
from edf_files import save_edf

from hrcneuro.contract import Inputs
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.io.fif import read_raw
from hrcneuro.io.tables import read_table
from hrcneuro.sources import bids_events, bids_layout, foreign
from hrcneuro.sources.formats.announced import announced_channels
from hrcneuro.stages import acquire

NAME = "sub-01_task-odd"


@pytest.fixture
def root(tmp_path):
    recording(tmp_path / "data", NAME, seconds=20)
    return tmp_path / "data"


def beside(root, kind, name=NAME):
    return next(root.rglob(f"{name}_{kind}.tsv"))


def run(root, subject="01", **options):
    config = acquire.Config(source="bids", path=str(root), **options)
    assert not acquire.check(config)
    out = root.parent / "out"
    out.mkdir(exist_ok=True)
    summary = acquire.run(config, Inputs(subject, {}), out)
    return summary, read_raw(out / f"{subject}_raw.fif", preload=True), read_table(out / "trials.parquet")


def test_types_units_bad_channels_and_events_are_those_of_the_tables(root):
    rows = [(name, "EOG" if name == "O2" else "EEG", "n/a", "bad" if name == "C3" else "good") for name in NAMES]
    table(beside(root, "channels"), ["name", "type", "units", "status"], rows)
    summary, raw, trials = run(root)
    assert raw.info["bads"] == ["C3"]
    assert dict(zip(raw.ch_names, raw.get_channel_types(), strict=True))["O2"] == "eog"
    assert summary["events"] == {"standard": 10, "target": 5}
    lines = beside(root, "events").read_text().splitlines()[1:]
    onsets = [float(line.split("\t")[0]) for line in lines]
    np.testing.assert_array_equal(trials["onset_s"], onsets)
    np.testing.assert_array_equal(trials["onset_sample"], np.rint(np.array(onsets) * SFREQ))


@pytest.mark.parametrize(("unit", "scale"), [("µV", 1), ("uV", 1), ("mV", 1e3), ("V", 1e6), ("nV", 1e-3), ("n/a", 1)])
def test_the_table_s_unit_scales_a_file_that_states_none(root, unit, scale):
    before = read(root)
    rows = [(name, "EEG" if name == "Cz" else "MISC", unit) for name in NAMES]
    table(beside(root, "channels"), ["name", "type", "units"], rows)
    np.testing.assert_allclose(read(root)[NAMES.index("Cz")], scale * before[NAMES.index("Cz")], rtol=1e-12)


def read(root):
    """Return the samples in V, unchecked."""
    config = acquire.Config(source="bids", path=str(root))
    return foreign.read(acquire.sources(config, "01"), config).data


def test_events_are_named_by_the_column_that_the_study_names(root):
    assert run(root, event_column="value")[0]["events"] == {"0": 3, "1": 2, "2": 2, "3": 2, "4": 2, "5": 2, "6": 2}
    with pytest.raises(ConfigError, match="no column 'kind'; its columns are onset, duration, trial_type, value"):
        run(root, event_column="kind")
    table(beside(root, "events"), ["onset", "duration", "stim"], [(1, 0, "a")])
    with pytest.raises(ConfigError, match="neither trial_type nor value"):
        run(root)


def two_sessions(root, one, two):
    """Write a subject's events of two sessions; rows are (onset, trial_type, value), and None leaves a column out."""
    tables = []
    for session, rows in (("1", one), ("2", two)):
        name = f"sub-01_ses-{session}_task-odd"
        path = recording(root, name, seconds=12)
        there = [i for i in range(3) if not rows or rows[0][i] is not None]
        columns = ["onset", "trial_type", "value"]
        cells = [[row[i] for i in there] for row in rows]
        tables.append(table(path.with_name(f"{name}_events.tsv"), [columns[i] for i in there], cells))
    return tables


WORDS = [(1, "target", 7), (2, "standard", 8), (3, "target", 7)]
CODES = [(at, None, value) for at, _, value in WORDS]
SILENT = [(at, "n/a", value) for at, _, value in WORDS]


@pytest.mark.parametrize("other", [CODES, SILENT])
def test_one_column_names_the_events_of_all_recordings_of_a_subject(tmp_path, other):
    for number, pair in enumerate([(WORDS, other), (other, WORDS)]):
        root = tmp_path / str(number) / "data"
        tables = two_sessions(root, *pair)
        with pytest.raises(ConfigError, match="trial_type") as caught:
            bids_layout.files(str(root), "01")
        assert tables[pair.index(other)].name in caught.value.problem
        assert "acquire.event_column = 'value'" in caught.value.cure
        summary, _, _ = run(root, event_column="value")
        assert summary["events"] == {"7": 4, "8": 2}


def test_where_no_column_names_all_events_the_cure_says_what_is_lacking(tmp_path):
    words = [(at, word, None) for at, word, _ in WORDS]
    first, _ = two_sessions(tmp_path / "data", words, CODES)
    with pytest.raises(ConfigError, match=r"by trial_type, .* by value") as caught:
        bids_layout.files(str(tmp_path / "data"), "01")
    assert f"but {first.name} has no words there" in caught.value.cure
    assert "acquire.sessions" in caught.value.cure
    assert bids_layout.files(str(tmp_path / "data"), "01", sessions=("2",))


def test_a_recording_without_events_or_whose_column_was_chosen_may_be_silent(tmp_path):
    two_sessions(tmp_path / "data", WORDS, [])
    assert run(tmp_path / "data")[0]["events"] == {"standard": 1, "target": 2}
    two_sessions(tmp_path / "data", WORDS, SILENT)
    assert run(tmp_path / "data", event_column="trial_type")[0]["events"] == {"standard": 1, "target": 2}


def test_a_silent_column_is_answered_with_the_one_that_speaks(root):
    table(beside(root, "events"), ["onset", "trial_type", "value"], SILENT)
    for given in ({}, {"event_column": "trial_type"}):
        with pytest.raises(ConfigError, match="trial_type names none of its 3 rows, and value does") as caught:
            bids_layout.files(str(root), "01", **given)
        assert caught.value.cure.endswith("acquire.event_column = 'value'")
    table(beside(root, "events"), ["onset", "trial_type", "value"], [(1, "n/a", "n/a"), ("n/a", "go", 1)])
    with pytest.raises(DataError, match="holds no events that have an onset and a name"):
        bids_layout.files(str(root), "01")
    table(beside(root, "events"), ["Onset", "trial_type"], [(1, "go")])
    with pytest.raises(DataError, match=r"no column 'onset' \(did you mean 'Onset'"):
        bids_layout.files(str(root), "01")


def test_a_table_of_events_is_read_anew_only_where_it_has_changed(root, monkeypatch):
    path, read = beside(root, "events"), []
    true = bids_events.cells_of
    monkeypatch.setattr(bids_events, "cells_of", lambda one: read.append(one) or true(one))
    for _ in range(3):
        bids_layout.files(str(root), "01")
    assert len(read) <= 1
    path.write_text(path.read_text().replace("onset", "start"))
    with pytest.raises(DataError, match="no column 'onset'"):
        bids_layout.files(str(root), "01")


def test_bad_stretches_breaks_rows_without_a_word_and_rows_outside(root):
    rows = [(1, 0, "go"), (2, 0.5, "BAD muscle"), (5, 0, "boundary"), (6, 0, "go"), (7, 0, "n/a"), ("n/a", 0, "go"),
            (99, 0, "go")]  # fmt: skip
    table(beside(root, "events"), ["onset", "duration", "trial_type"], rows)
    summary, raw, trials = run(root)
    assert trials["onset_s"].tolist() == [1, 6]
    assert summary["breaks"] == 1
    marks = dict(zip(raw.annotations.description, raw.annotations.onset, strict=True))
    assert marks["BAD muscle"] == 2
    assert marks["EDGE boundary"] == 5
    said = " ".join(summary["notes"] + summary["warnings"])
    for words in ("1 rows without an onset", "1 rows without a name in trial_type", "1 events lie before or after"):
        assert words in said


def test_channels_go_by_name_and_else_by_order(root):
    rows = [(name, "EEG", "µV") for name in reversed(NAMES)]
    table(beside(root, "channels"), ["name", "type", "units"], rows)
    assert run(root)[1].ch_names == list(NAMES)
    table(beside(root, "channels"), ["name", "type", "units"], [(f"A{i}", "EEG", "µV") for i in range(len(NAMES))])
    summary, raw, _ = run(root)
    assert raw.ch_names[:2] == ["A0", "A1"]
    assert any("otherwise than the recording, by their order: Fz = A0" in note for note in summary["notes"])
    table(beside(root, "channels"), ["name", "type", "units"], [("A0", "EEG", "µV")])
    with pytest.raises(DataError, match="has 1 channels and lacks Fz"):
        run(root)


def test_places_are_those_of_the_table_of_electrodes_in_its_system(root):
    home = beside(root, "events").parent
    rows = [(name, 10 * i, 50, 60 + i) for i, name in enumerate(NAMES[:-1])] + [("EOG1", "n/a", "n/a", "n/a")]
    table(home / "sub-01_space-CapTrak_electrodes.tsv", ["name", "x", "y", "z"], rows)
    system = {"EEGCoordinateSystem": "CapTrak", "EEGCoordinateUnits": "mm"}
    (home / "sub-01_space-CapTrak_coordsystem.json").write_text(json.dumps(system))
    raw = run(root)[1]
    np.testing.assert_allclose(raw.info["chs"][2]["loc"][:3], [0.02, 0.05, 0.062], atol=1e-7)
    system = {"EEGCoordinateSystem": "Other", "EEGCoordinateUnits": "mm"}
    (home / "sub-01_space-CapTrak_coordsystem.json").write_text(json.dumps(system))
    summary, raw, _ = run(root)
    assert any("places in Other (mm) without landmarks are not used" in note for note in summary["notes"])
    assert raw.info["chs"][2]["loc"][0] != pytest.approx(0.02)
    # The nose is x there, and lies where the mark of the nasion says.
    marks = {"NAS": [100, 0, 0], "LPA": [0, 80, 0], "RPA": [0, -80, 0]}
    system = {"EEGCoordinateSystem": "EEGLAB", "EEGCoordinateUnits": "mm", "AnatomicalLandmarkCoordinates": marks}
    (home / "sub-01_space-CapTrak_coordsystem.json").write_text(json.dumps(system))
    raw = run(root)[1]
    np.testing.assert_allclose(raw.info["chs"][2]["loc"][:3], [-0.05, 0.02, 0.062], atol=1e-6)


@pytest.mark.parametrize("nothing", ["", "N/A", "NaN"])
def test_an_electrode_without_a_place_has_none_however_that_is_written(root, nothing):
    home = beside(root, "events").parent
    rows = [(name, 10 * i, 50, 60 + i) for i, name in enumerate(NAMES[:-1])] + [("EOG1", nothing, nothing, nothing)]
    places, system = (home / f"sub-01_space-CapTrak_{name}" for name in ("electrodes.tsv", "coordsystem.json"))
    table(places, ["name", "x", "y", "z"], rows)
    system.write_text(json.dumps({"EEGCoordinateSystem": "CapTrak", "EEGCoordinateUnits": "mm"}))
    np.testing.assert_allclose(run(root)[1].info["chs"][2]["loc"][:3], [0.02, 0.05, 0.062], atol=1e-7)
    table(places, ["name", "x", "y", "z"], [*rows[:-1], ("EOG1", "left", "of", "it")])
    with pytest.raises(DataError, match="left, of, it of EOG1 is no place"):
        run(root)
    system.write_text('{"EEGCoordinateSystem": ')
    with pytest.raises(DataError, match=r"coordsystem\.json is no JSON object"):
        run(root)


def test_sessions_and_runs_are_joined_in_their_order_and_can_be_chosen(tmp_path):
    root = tmp_path / "data"
    for number in (10, 9):
        for session in (2, 1):
            recording(root, f"sub-01_ses-{session}_task-odd_run-{number}", seed=number + session, seconds=12)
    files = bids_layout.files(str(root), "01")
    names = [path.name.partition("_task")[0] + path.name.partition("_run")[2][:4] for label, path in files.items()
             if label.startswith("recording")]  # fmt: skip
    assert names == ["sub-01_ses-1-9_e", "sub-01_ses-1-10_", "sub-01_ses-2-9_e", "sub-01_ses-2-10_"]
    summary = run(root)[0]
    assert (summary["breaks"], summary["duration_s"]) == (3, 48)
    chosen = run(root, sessions=("2",), runs=("9",))[0]
    assert (chosen["breaks"], chosen["duration_s"]) == (0, 12)
    with pytest.raises(ConfigError, match=r"acquire\.runs names '11'; 01 has 9, 10"):
        run(root, runs=("11",))


def test_several_tasks_are_asked_about(root):
    recording(root, "sub-01_task-rest", seconds=12)
    with pytest.raises(ConfigError, match="several tasks: odd, rest") as caught:
        run(root)
    assert caught.value.cure == "say which: acquire.tasks = ['odd']"
    assert run(root, tasks=("odd",))[0]["duration_s"] == 20


def test_tables_further_up_count_for_every_recording_and_the_nearest_wins(tmp_path):
    root = tmp_path / "data"
    for session in (1, 2):
        recording(root, f"sub-01_ses-{session}_task-odd", seed=session, seconds=12)
    rows = [(name, "EEG", "µV", "bad" if name == "Pz" else "good") for name in NAMES]
    for path in root.rglob("*_channels.tsv"):
        path.unlink()
    table(root / "task-odd_channels.tsv", ["name", "type", "units", "status"], rows)
    table(root / "task-other_channels.tsv", ["name", "type", "units"], [("X", "EEG", "furlong")])
    assert run(root)[1].info["bads"] == ["Pz"]
    table(root / "sub-01" / "sub-01_task-odd_channels.tsv", ["name", "type", "units"], [row[:3] for row in rows])
    assert run(root)[1].info["bads"] == []


def test_subjects_are_those_that_have_eeg_in_the_order_of_participants(tmp_path):
    root = tmp_path / "data"
    for name in ("10", "9", "b"):
        recording(root, f"sub-{name}_task-odd", seconds=12)
    (root / "sub-77" / "anat").mkdir(parents=True)
    assert bids_layout.subjects(root) == ("b", "9", "10")
    table(root / "participants.tsv", ["participant_id"], [("sub-10",), ("sub-77",), ("sub-b",)])
    assert bids_layout.subjects(root) == ("10", "b", "9")
    assert bids_layout.without_eeg(root, bids_layout.subjects(root)) == ["77"]


def test_a_data_set_without_eeg_says_what_was_looked_for(tmp_path):
    for name in ("01", "02"):
        (tmp_path / f"sub-{name}" / "anat").mkdir(parents=True)
    with pytest.raises(DataError, match=r"holds 2 subjects, none with EEG .sub-…/eeg/…_eeg\.vhdr") as caught:
        bids_layout.subjects(bids_layout.root_of(str(tmp_path)))
    assert caught.value.cure


@pytest.mark.parametrize(
    ("harm", "message"),
    [
        (lambda root: beside(root, "events").unlink(), "has no table of events"),
        (
            lambda root: table(beside(root, "channels"), ["name", "type", "units"], [("Cz", "EEG", "furlong")]),
            "gives EEG channel Cz the unit 'furlong', which is no voltage",
        ),
        (lambda root: beside(root, "events").write_text("a\tb\n1\t2\t3\n"), "no table with tabs"),
        (lambda root: table(beside(root, "events"), ["onset", "trial_type"], [("soon", "a")]), "'soon' is no time"),
        (lambda root: beside(root, "events").write_text("onset\ttrial_type\n"), "no events"),
    ],
)
def test_what_a_data_set_lacks_is_refused_with_the_cure(root, harm, message):
    harm(root)
    with pytest.raises(DataError, match=message) as caught:
        run(root)
    assert caught.value.cure


@pytest.mark.parametrize("about", ["name", "type", "units", "sampling_frequency"])
def test_runs_of_unequal_channels_are_refused_by_their_tables(root, about):
    recording(root, "sub-01_task-odd_run-2", seconds=12)
    other = dict(name="Fz2", type="EOG", units="mV", sampling_frequency="256")
    row = dict(name="Fz", type="EEG", units="µV", sampling_frequency="128")
    for name, cells in ((NAME, row), ("sub-01_task-odd_run-2", row | {about: other[about]})):
        table(beside(root, "channels", name), list(cells), [list(cells.values())])
    with pytest.raises(DataError, match=f"do not go together: . channels differ in {about}"):
        bids_layout.files(str(root), "01")


def without_table(root, run, ending, names, rate):
    """Write a run without channels.tsv, as EDF or BrainVision."""
    home = root / "sub-01" / "eeg"
    stem = f"sub-01_task-odd_run-{run}"
    table(home / f"{stem}_events.tsv", ["onset", "duration", "trial_type"], [(1, 0, "go"), (2, 0, "go")])
    data = np.random.default_rng(run).normal(0, 10, (len(names), 8, rate))
    path = home / f"{stem}_eeg{ending}"
    if ending == ".edf":
        return save_edf(path, [(name, "uV", one) for name, one in zip(names, data, strict=True)])
    data.reshape(len(names), -1).T.astype("<f4").tofile(path.with_suffix(".eeg"))
    path.write_text(
        f"Brain Vision Data Exchange Header File Version 1.0\n[Common Infos]\nDataFile={path.stem}.eeg\n"
        f"DataFormat=BINARY\nDataOrientation=MULTIPLEXED\nNumberOfChannels={len(names)}\nSamplingInterval={1e6 / rate}"
        "\n[Binary Infos]\nBinaryFormat=IEEE_FLOAT_32\n[Channel Infos]\n"
        + "".join(f"Ch{i}={name},,1,µV\n" for i, name in enumerate(names, 1)),
        encoding="utf-8",
    )
    return path


@pytest.mark.parametrize("ending", [".edf", ".vhdr"])
@pytest.mark.parametrize(
    ("names", "rate", "about"),
    [(("Fz", "Cz"), 128, ""), (("Fz", "Pz"), 128, "name"), (("Fz",), 128, "name"), (("Fz", "Cz"), 64, "sampling_f")],
)
def test_runs_without_tables_of_channels_are_compared_by_their_headers(tmp_path, ending, names, rate, about):
    root = tmp_path / "data"
    (root / "sub-01" / "eeg").mkdir(parents=True)
    describe(root)
    without_table(root, 1, ending, ("Fz", "Cz"), 128)
    without_table(root, 2, ending, names, rate)
    if about:
        with pytest.raises(DataError, match=f"run-2_eeg{ending} do not go together: . channels differ in {about}"):
            bids_layout.files(str(root), "01")
    else:
        assert run(root)[1].ch_names == ["Fz", "Cz"]


def test_a_header_that_says_nothing_is_left_to_whoever_reads_the_recording(tmp_path):
    for name in ("cut.edf", "cut.vhdr", "a.set"):
        (tmp_path / name).write_bytes(b"0       ")
        assert announced_channels(tmp_path / name) is None


def test_runs_that_say_the_same_in_other_words_go_together(root):
    recording(root, "sub-01_task-odd_run-2", seconds=12)
    one = dict(name="Fz", type="EEG", units="µV", sampling_frequency="256", status="good")
    two = dict(name="Fz", type="eeg", units="uV", sampling_frequency="256.0")
    for name, cells in ((NAME, one), ("sub-01_task-odd_run-2", two)):
        table(beside(root, "channels", name), list(cells), [list(cells.values())])
    assert "recording 2" in bids_layout.files(str(root), "01")
    table(beside(root, "channels"), ["name", "units"], [("Fz", "n/a")])
    assert "recording 2" in bids_layout.files(str(root), "01")


def test_two_versions_of_one_recording_are_not_joined(tmp_path):
    root = tmp_path / "data"
    for version in ("raw", "filtered"):
        recording(root, f"sub-01_task-odd_acq-{version}", seconds=12)
    with pytest.raises(DataError, match=r"acq-.* are of the same session, task and run") as caught:
        bids_layout.files(str(root), "01")
    assert caught.value.cure


@pytest.mark.parametrize("unit", ["%", "°C", "kΩ", "fT", "m/s^2", "a.u."])
def test_a_unit_of_another_quantity_is_told_and_not_used(root, unit):
    table(beside(root, "channels"), ["name", "units"], [(name, unit) for name in NAMES])
    assert any(f"{unit!r} of" in note and "not used" in note for note in run(root)[0]["notes"])


@pytest.mark.parametrize(("columns", "cells"), [(["name", "units"], []), (["name", "units", "type"], ["n/a"]),
                                                (["name", "units", "type"], ["VIBES"])])  # fmt: skip
def test_a_unit_that_nobody_knows_is_refused_where_the_type_may_be_eeg(root, columns, cells):
    rows = [(name, "furlong" if name == "Pz" else "µV", *cells) for name in NAMES]
    table(beside(root, "channels"), columns, rows)
    kind = "no type" if cells in ([], ["n/a"]) else "type 'VIBES'"
    with pytest.raises(DataError, match=f"gives channel Pz of {kind} the unit 'furlong', which is not known") as caught:
        bids_layout.files(str(root), "01")
    assert "MISC" in caught.value.cure


@pytest.mark.parametrize("kind", ["MISC", "OTHER", "TRIG"])
def test_the_unit_of_a_channel_that_is_no_voltage_is_its_own_affair(root, kind):
    rows = [(name, *(("furlong", kind) if name == "Pz" else ("µV", "EEG"))) for name in NAMES]
    table(beside(root, "channels"), ["name", "units", "type"], rows)
    assert bids_layout.files(str(root), "01")


def test_a_root_that_is_none_and_a_subject_that_is_not_there(root):
    with pytest.raises(DataError, match="holds no subject") as caught:
        bids_layout.root_of(str(root / "sub-01"))
    assert str(root) in caught.value.cure
    # The names of recordings begin with sub-, too.
    with pytest.raises(DataError, match="holds no subject") as caught:
        bids_layout.root_of(str(root / "sub-01" / "eeg"))
    assert str(root) in caught.value.cure
    with pytest.raises(DataError, match="holds no subject") as caught:
        bids_layout.root_of(str(root.parent))
    assert str(root) in caught.value.cure
    with pytest.raises(DataError, match=r"has no EEG of '1'.* subjects with EEG: 01"):
        bids_layout.files(str(root), "1")
    with pytest.raises(ConfigError, match=r"acquire\.path is empty"):
        bids_layout.root_of("")


def test_what_a_data_set_says_of_its_reference_stays(root):
    describe(root)
    path = beside(root, "events")
    path.with_name(f"{NAME}_eeg.json").write_text(json.dumps({"EEGReference": "Cz"}))
    assert run(root)[0]["reference"] == "Cz"
    assert run(root, reference="nose")[0]["reference"] == "nose"
