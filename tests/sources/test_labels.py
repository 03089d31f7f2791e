"""What labels and units say: types, sites, twins."""

from __future__ import annotations

import numpy as np
import pytest

from hrcneuro.sources import labels
from hrcneuro.sources.channels import shape, standard_montage
from hrcneuro.sources.recording import Recording, markers_of, to_raw
from hrcneuro.sources.units import is_no_voltage

KNOWN = standard_montage().ch_names
OPTIONS = {"rename": {}, "types": {}, "drop": (), "bads": (), "montage": "auto", "unit": ""}


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        ("eog", ["EOG", "EOG3", "HEOG", "EOG horizontal", "VEOGu", "EEG LOC-Ref", "ROC"]),
        ("ecg", ["ECG", "ECG EKG", "EKG1", "EEG EKG1-REF", "ECG-LA"]),
        ("emg", ["EMG Chin", "EMG submental", "Chin1", "L TIB", "LAT", "Leg/R", "Chin1-Chin2"]),
        ("misc", [
            "SaO2", "SaO2 X9", "SpO2", "Resp oro-nasal", "RESP1-REF", "Temp rectal", "Plet", "GSR1", "Pulse Rate",
            "Airflow", "POL DC01", "PHOTIC-REF", "AccX", "Aux 1", "THOR RES", "PTAF", "Therm", "Pos", "Nasal Pressure",
        ]),
        ("stim", ["STI 014", "STI101", "Status", "TRIGGER", "Event marker", "Trig1"]),
        ("", [*KNOWN, "EEG Fp1-Ref", "A1", "M2", "E128", "EXG1", "B32", "T3", "EEG C3-A2", "Fp1-F7", "Ch 1", "X1"]),
    ],
)  # fmt: skip
def test_types_by_label(kind, names):
    assert {name: labels.kind_of(name) for name in names} == dict.fromkeys(names, kind)


def test_units_of_no_voltage():
    assert all(
        map(is_no_voltage, ["%", "°C", "degC", "bpm", "mmHg", "uS", "μS", "kOhm", "Boolean", "cmH2O", "dB", "Deg C"])
    )
    assert not any(map(is_no_voltage, ["", "uV", "µV", "mV", "V", "nV", "UV", "n/a", "microvolts", "a.u.", "£V"]))


def test_eye_channels_of_sleep_recordings_are_not_those_of_a_net():
    assert labels.eyes(["F3-M2", "E1-M2", "E2-M1", "C4"]) == {"E1-M2", "E2-M1"}
    assert labels.eyes(["EEG E1-Ref", "E2", "Cz"]) == {"EEG E1-Ref", "E2"}
    assert labels.eyes(["E1", "E2", "E3"]) == set()
    one = shaped(recording(["E1-M2", "E2-M2", "C3-M2"]), rename={"E1-M2": "left"})
    assert (one.ch_names, one.ch_types) == (["left", "E2-M2", "C3"], ["eog", "eog", "eeg"])


@pytest.mark.parametrize(
    ("names", "short"),
    [
        (["EEG Fp1-Ref", "EEG FP2-REF"], {"EEG Fp1-Ref": "Fp1", "EEG FP2-REF": "FP2"}),
        (["EEG C3-LE", "EEG T3-A1A2", "EEG A1-Ref"], {"EEG C3-LE": "C3", "EEG T3-A1A2": "T3", "EEG A1-Ref": "A1"}),
        (["C3-A2", "C4-M1"], {"C3-A2": "C3", "C4-M1": "C4"}),
        (["Fc5.", "C3..", "Cz "], {"Fc5.": "Fc5", "C3..": "C3", "Cz ": "Cz"}),
        (["Fp1-Cz", "F3-Cz", "C3-Cz"], {"Fp1-Cz": "Fp1", "F3-Cz": "F3", "C3-Cz": "C3"}),
        (["Fp1-F7", "F7-T3", "EEG Fpz-Cz"], {}),
        (["EEG C3-A1", "EEG C3-A2"], {}),
        (["Cz", "Cz "], {}),
        (["EEG 1-Ref", "EEG ECG-Ref", "Fp1", "CZ"], {}),
    ],
)
def test_sites_by_label(names, short):
    assert labels.sites(names, ["eeg"] * len(names), KNOWN) == short


def recording(names: list[str], units: list[str] | None = None, kinds: list[str] | None = None) -> Recording:
    data = np.arange(len(names) * 10.0).reshape(len(names), 10) * 1e-6
    return Recording(
        data, list(names), kinds or ["eeg"] * len(names), 100.0, markers_of([], []), units=units or ["uV"] * len(names)
    )


def shaped(one: Recording, **options) -> Recording:
    shape(one, **{**OPTIONS, **options})
    return one


def test_what_is_no_eeg_is_retyped_with_a_note_and_options_win():
    names = ["Fz", "Cz", "ECG", "X1", "X2", "EMG1"]
    found = shaped(recording(names, ["uV", "uV", "uV", "%", "uV", "uV"]), types={"EMG1": "eeg"})
    assert found.ch_types == ["eeg", "eeg", "ecg", "misc", "eeg", "eeg"]
    assert "taken for ECG, not EEG, by the label: ECG" in found.notes
    assert "taken for MISC, not EEG, by the unit %: X1" in found.notes
    assert not any("EMG" in note for note in found.notes)


def test_types_that_the_file_states_stay():
    assert shaped(recording(["Cz", "ECG"], kinds=["eeg", "eog"])).ch_types == ["eeg", "eog"]


def test_a_trigger_channel_that_was_read_as_volts_holds_codes_again():
    one = recording(["Cz", "STI 014"])
    one.data[1] = np.array([0, 0, 7, 7, 7, 7, 0, 0, 0, 0]) * 1e-6
    np.testing.assert_allclose(shaped(one).data[1], [0, 0, 7, 7, 7, 7, 0, 0, 0, 0], atol=1e-9)
    assert one.ch_types == ["eeg", "stim"]


def test_a_unit_is_no_unit_of_what_is_no_voltage():
    one = shaped(recording(["Cz", "SaO2"], ["V", "%"]), unit="uV")
    np.testing.assert_allclose(one.data[1], np.arange(10, 20) * 1e-6)


def test_options_name_a_channel_by_its_label_or_its_site():
    names = ["EEG Fp1-Ref", "EEG Fz-Ref", "EEG Cz-Ref", "EEG Pz-Ref", "EEG Oz-Ref"]
    for fp1, fz, cz, pz in (names[:4], ["Fp1", "Fz", "Cz", "Pz"]):
        found = shaped(recording(names), drop=(fp1,), rename={fz: "mid"}, types={cz: "misc"}, bads=(pz,))
        assert found.ch_names == ["mid", "Cz", "Pz", "Oz"]
        assert found.ch_types == ["eeg", "misc", "eeg", "eeg"]
        assert found.bads == ["Pz"]
        assert found.file_names["Oz"] == "EEG Oz-Ref"
    assert "labels shortened to the electrode's site: 'EEG Cz-Ref' -> Cz" in found.notes[0]


def test_a_name_that_the_map_gives_away_is_not_taken_by_a_label():
    found = shaped(recording(["EEG Cz-Ref", "X"]), rename={"X": "Cz"})
    assert found.ch_names == ["EEG Cz-Ref", "Cz"]


@pytest.mark.parametrize(
    ("names", "placed", "note"),
    [
        (["Fp1", "C3", "c3"], ["Fp1", "C3"], "'C3', 'c3'"),
        (["FP1", "CZ", "Oz"], ["FP1", "CZ", "Oz"], ""),
        (["cz", "CZ", "Oz"], ["Oz"], "'cz', 'CZ'"),
        (["Cz", "Cz ", "Oz"], ["Cz", "Oz"], "'Cz', 'Cz '"),
        (["Cz ", "Oz "], ["Cz", "Oz"], ""),
        (["Cz-0", "Cz-1", "Oz"], ["Oz"], "'Cz-0', 'Cz-1'"),
        (["T3", "T7"], ["T3", "T7"], ""),
    ],
)
def test_positions_by_name_and_twins(names, placed, note):
    one = shaped(recording(names))
    raw = to_raw(one, markers_of([], []).assign(onset_sample=[]))
    standard = standard_montage().get_positions()["ch_pos"]
    found = raw.get_montage().get_positions()["ch_pos"] if raw.get_montage() else {}
    at = [name for name, place in found.items() if np.isfinite(place).all()]
    assert at == placed
    assert {name.lower() for name in at} <= {name.lower() for name in standard}
    told = [n for n in one.notes if "channels of one name but for case, blanks or number" in n]
    assert [note in one_note for one_note in told] == ([True] if note else [])


def test_channels_between_two_electrodes_are_said():
    one = shaped(recording(["Fp1-F7", "EEG Fpz-Cz", "Oz"]))
    assert "channels between two electrodes, without a position of their own: Fp1-F7, EEG Fpz-Cz" in one.notes


def test_inputs_for_anything_are_said():
    one = shaped(recording(["Cz", "EXG1", "EXG2"]), types={"EXG2": "eog"})
    assert one.ch_types == ["eeg", "eeg", "eog"]
    assert [note.endswith("what they are: EXG1") for note in one.notes] == [True]
