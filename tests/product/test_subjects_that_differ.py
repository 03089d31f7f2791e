"""Subjects that lack a condition or a channel, or have options of their own, in one small study of any recordings."""

import warnings

import mne
import numpy as np
import pytest

STUDY = """
[study]
name = "differ"
subjects = ["p1", "p2"]
exclude = []
split = ""
[acquire]
source = "file"
path = "{subject}_raw.fif"
event_map = { go = "go", stop = "stop", bad_choice = "bad_choice" }
drop = ["GSR"]
[conditions]
go = "event == 'go'"
stop = "event == 'stop'"
bad = "event == 'bad_choice'"
[contrasts]
"go-stop" = ["go", "stop"]
"go-bad" = ["go", "bad"]
[problems]
"goVSstop" = ["go", "stop"]
"goVSbad" = ["go", "bad"]
[preprocess]
sfreq = 100.0
bad_channels = "none"
eog = "none"
[epoch]
tmax = 0.8
[decode]
repeats = 1
permutations = 0
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """A folder with the study: p2 never stops, and has no channel GSR."""
    folder = tmp_path_factory.mktemp("differ")
    (folder / "hrcneuro.toml").write_text(STUDY)
    for seed, (subject, events, more) in enumerate(
        (("p1", ["go", "stop", "bad_choice"], ["GSR"]), ("p2", ["go", "bad_choice", "go"], []))
    ):
        names = ["Fz", "Cz", "Pz", "Oz", *more]
        data = np.random.default_rng(seed).normal(0, 1e-5, (len(names), 7000))
        raw = mne.io.RawArray(data, mne.create_info(names, 100.0, "eeg"), verbose="error")
        raw.set_annotations(mne.Annotations(2 + 2.0 * np.arange(30), 0, events * 10))
        with warnings.catch_warnings(action="ignore"):
            raw.save(folder / f"{subject}_raw.fif", verbose="error")
    return folder


def test_a_subject_without_a_condition_or_a_channel_passes_every_stage(hrcneuro, study):
    for stage in ("erp", "ersp", "decode"):
        done = hrcneuro(stage, "--no-figures", "--json", cwd=study)
        assert done.code == 0, done.err
    found = hrcneuro("epoch", "--no-figures", "--json", cwd=study).json["items"]
    items = {item["unit"]: item["summary"] for item in found if item["stage"] == "epoch"}
    assert items["p1"]["total"] == {"bad_choice": 10, "go": 10, "stop": 10}
    assert items["p2"]["total"] == {"bad_choice": 10, "go": 20}
    told = hrcneuro("acquire", "p2", "--json", cwd=study).json["items"][0]["summary"]["warnings"]
    assert any("'stop'" in text for text in told)
    assert any("'GSR'" in text for text in told)


def test_a_subject_s_own_options_change_its_key_alone(hrcneuro, study):
    before, after = (
        {
            item["unit"]: item["key"]
            for item in hrcneuro("acquire", "--dry-run", "--json", *own, cwd=study).json["items"]
        }
        for own in ((), ("--set", 'acquire.subjects.p2.bads=["Oz"]'))
    )
    assert before["p1"] == after["p1"]
    assert before["p2"] != after["p2"]


def test_one_subject_without_eog_can_go_without_the_regression(hrcneuro, study, tmp_path):
    given = (
        "--set",
        "preprocess.eog=regression",
        "--set",
        'acquire.subjects.p1.channel_types={Oz="eog"}',
        "--no-figures",
    )
    refused = hrcneuro("preprocess", *given, "--workdir", tmp_path, cwd=study)
    assert refused.code == 3
    assert "[preprocess.subjects.SUBJECT]" in refused.err
    own = ("--set", "preprocess.subjects.p2.eog=none")
    done = hrcneuro("preprocess", *given, *own, "--workdir", tmp_path, "--json", cwd=study)
    assert done.code == 0, done.err


@pytest.mark.parametrize(
    ("setting", "code"),
    [("acquire.montage=auto", 0), ('acquire.drop=["gsr"]', 2), ("acquire.path={subject}.fif", 3)],
)
def test_inspection_ends_with_the_code_of_acquire(hrcneuro, study, tmp_path, setting, code):
    inspected = hrcneuro("acquire", "p1", "--inspect", "--json", "--set", setting, cwd=study)
    assert inspected.code == code
    assert inspected.json["ok"] is (code == 0)
    ran = hrcneuro("acquire", "p1", "--set", setting, "--workdir", tmp_path, cwd=study)
    assert ran.code == code, ran.err


SLIP = ["--set", "acquire.event_map.gone=gone", "--set", "conditions.slip=\"event == 'stopp'\""]


def test_what_no_subject_has_is_a_mistake_of_the_configuration(hrcneuro, study):
    checked = hrcneuro("config", "check", *SLIP, cwd=study)
    one = hrcneuro("erp", "p1", *SLIP, "--no-figures", cwd=study)
    group = hrcneuro("erp", *SLIP, "--no-figures", cwd=study)
    assert (checked.code, one.code, group.code) == (2, 0, 2), checked.err + one.err + group.err
    for text in (checked.err, group.err):
        assert "the marker 'gone' of acquire.event_map" in text
        assert "the condition slip = \"event == 'stopp'\" (did you mean 'stop'?)" in text
    assert "markers of the map that do not occur: 'gone'" in one.err
    assert "no trial is of the condition slip" in one.err


def test_what_only_some_subjects_lack_is_a_note(hrcneuro, study):
    checked = hrcneuro("config", "check", cwd=study)
    assert checked.code == 0, checked.err
    assert "note: p2: the recording has not the marker 'stop'" in checked.out
    assert "the configuration is sound" in checked.out


def test_a_recording_that_is_not_here_is_not_looked_at(hrcneuro, study):
    checked = hrcneuro("config", "check", "--set", 'study.subjects=["p1", "p9"]', cwd=study)
    assert checked.code == 0, checked.err
    assert "note: p9 was not looked at: " in checked.out
