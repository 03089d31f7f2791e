"""The export to BIDS passes the official validator, and mne-bids reads back what was recorded."""

import json
import shutil
import subprocess

import numpy as np
import pytest
from bids_files import recording

pytest.importorskip("mne_bids", reason="needs the extra bids")

GIVEN = ("--config", "configs/smoke.toml")


@pytest.fixture(scope="module")
def bids(hrcneuro, smoke, tmp_path_factory):
    """The smoke study as a BIDS data set."""
    folder = tmp_path_factory.mktemp("export") / "bids"
    done = hrcneuro("export", "--bids", folder, *GIVEN, "--workdir", smoke, "--json")
    assert done.code == 0, done.err
    assert set(done.states.values()) == {"hit"}
    return folder


def verdict(folder, *options):
    """Return the errors that the validator finds, each with the file."""
    validator = shutil.which("bids-validator-deno")
    if validator is None:
        pytest.skip("needs bids-validator-deno")
    command = [validator, folder, "--format", "json", *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    found = json.loads(done.stdout)
    parts = [found, *found.get("derivativesSummary", {}).values()]
    assert all(part["summary"]["totalFiles"] > 10 for part in parts)
    return [i for part in parts for i in part["issues"]["issues"] if i["severity"] == "error"], len(parts)


def test_the_official_validator_finds_no_error(bids):
    assert verdict(bids, "--recursive") == ([], 2)
    assert verdict(bids / "derivatives" / "hrcneuro") == ([], 1)


def test_the_validator_would_find_one(bids, tmp_path):
    shutil.copytree(bids, tmp_path / "copy")
    (tmp_path / "copy" / "sub-s01" / "eeg" / "sub-s01_task-smoke_nonsense.tsv").write_text("a\n1\n")
    assert verdict(tmp_path / "copy")[0]


def test_mne_bids_reads_back_the_recording_and_its_moves(bids, smoke):
    import mne_bids

    import hrcneuro

    study = hrcneuro.open(smoke, "smoke")
    raw = mne_bids.read_raw_bids(
        mne_bids.BIDSPath(subject="s01", task="smoke", datatype="eeg", root=bids), verbose="error"
    )
    ours = study.raw("s01")
    assert raw.ch_names == ours.ch_names
    assert raw.get_channel_types() == ours.get_channel_types()
    assert raw.info["line_freq"] == 50
    np.testing.assert_allclose(raw.get_data(), ours.get_data(), atol=1e-11)
    moves = study.trials("s01").dropna(subset=["onset_sample"])
    np.testing.assert_array_equal(np.rint(raw.annotations.onset * raw.info["sfreq"]), moves["onset_sample"])


def test_what_was_exported_comes_back_equal_to_the_last_bit(hrcneuro, bids, smoke, tmp_path):
    import pandas as pd

    import hrcneuro as package

    given = ("--set", "acquire.source=bids", "--set", f"acquire.path={bids}", "--workdir", tmp_path)
    done = hrcneuro("acquire", "--no-figures", *given)
    assert done.code == 0, done.err
    before, after = package.open(smoke, "smoke"), package.open(tmp_path, last=True)
    for subject in ("s01", "s02", "s03"):
        one, two = before.raw(subject), after.raw(subject)
        assert one.get_data().tobytes() == two.get_data().tobytes()
        assert one.annotations == two.annotations
        assert one.ch_names == two.ch_names
        assert one.get_channel_types() == two.get_channel_types()
        places = [[channel["loc"] for channel in raw.info["chs"]] for raw in (one, two)]
        np.testing.assert_array_equal(*places)
        moves = before.trials(subject).dropna(subset=["onset_sample"]).reset_index(drop=True)
        pd.testing.assert_frame_equal(moves, after.trials(subject))
    kept = [study.summary("acquire", "s01") for study in (before, after)]
    assert kept[0]["origin"] == kept[1]["origin"]
    assert kept[0]["reference"] == kept[1]["reference"]


OWN = '[acquire]\nsource = "bids"\npath = "data"\n[conditions]\ntarget = "event == \'target\'"\n'
OWN += "standard = \"event == 'standard'\"\n"


@pytest.fixture
def oddball(tmp_path):
    """A data set of three subjects with two sessions, and a study that says what its conditions are, no more."""
    for subject in range(1, 4):
        for session in (1, 2):
            name = f"sub-{subject:02d}_ses-{session}_task-odd"
            recording(tmp_path / "data", name, seed=10 * subject + session, seconds=45)
    (tmp_path / "hrcneuro.toml").write_text(OWN)
    return tmp_path


def test_a_data_set_of_others_runs_with_no_other_setting_than_conditions(hrcneuro, oddball):
    done = hrcneuro("run", "--no-figures", "-j", "1", "--json", cwd=oddball)
    assert done.code == 0, done.err
    found = {(item["stage"], item["unit"]): item["summary"] for item in done.json["items"]}
    assert {unit for stage, unit in found if stage == "acquire"} == {"01", "02", "03"}
    for subject in ("01", "02", "03"):
        assert found["acquire", subject]["breaks"] == 1
        assert found["acquire", subject]["duration_s"] == 90
    # The planted wave is found: 15 µV over Pz, in every subject.
    best = found["decode", "group"]["all"]["target-standard"]
    assert best["bacc"] > 60
    assert "an oddball" in next((oddball / "results" / "reports").glob("*/report.html")).read_text()


@pytest.mark.parametrize(
    ("harm", "message"),
    [
        (lambda home: next(home.glob("*_events.tsv")).unlink(), "has no table of events"),
        (lambda home: swapped(home, "µV", "furlong"), "'furlong', which is no voltage"),
        (lambda home: swapped(home, "EOG1", "EOG2"), "do not go together"),
        (lambda home: emptied(home, "trial_type"), "acquire.event_column = 'value'"),
        (lambda home: next(home.glob("*_events.tsv")).write_text(""), "is no table with tabs"),
    ],
)
def test_a_fault_of_one_recording_is_told_before_anything_runs(hrcneuro, oddball, harm, message):
    harm(oddball / "data" / "sub-03" / "ses-2" / "eeg")
    for command in (("run", "--no-figures"), ("config", "check")):
        done = hrcneuro(*command, cwd=oddball)
        assert done.code == (2 if "event_column" in message else 3)
        assert message in done.err
        assert "cure: " in done.err
    assert not list(oddball.rglob("*_raw.fif"))
    # Who asks for another subject gets it.
    done = hrcneuro("acquire", "01", "--no-figures", cwd=oddball)
    assert done.code == 0, done.err


def emptied(home, column):
    path = next(home.glob("*_events.tsv"))
    header, *lines = (line.split("\t") for line in path.read_text().splitlines())
    rows = [["n/a" if name == column else cell for name, cell in zip(header, line, strict=True)] for line in lines]
    path.write_text("\n".join("\t".join(row) for row in [header, *rows]) + "\n")


def test_subjects_whose_events_are_named_by_different_columns_are_told_before_anything_runs(hrcneuro, oddball):
    for path in (oddball / "data" / "sub-03").rglob("*_events.tsv"):
        path.write_text(path.read_text().replace("trial_type", "kind"))
    done = hrcneuro("run", "--no-figures", cwd=oddball)
    assert done.code == 2
    assert "01 names its events by trial_type" in done.err
    assert "03 by value" in done.err
    assert "acquire.event_column" in done.err
    assert not list(oddball.rglob("*_raw.fif"))
    given = ("--set", "acquire.subjects.03.event_column=kind", "--dry-run")
    assert hrcneuro("run", *given, cwd=oddball).code == 0


def test_a_listed_subject_without_eeg_is_named_wherever_recordings_are_asked_for(hrcneuro, oddball):
    listed = "\n".join(["participant_id", "sub-01", "sub-04", "sub-02", "sub-03"])
    (oddball / "data" / "participants.tsv").write_text(f"{listed}\n")
    said = "participants.tsv lists subjects that have no EEG here and are left out: 04"
    for command in (("run", "--dry-run"), ("config", "check")):
        done = hrcneuro(*command, cwd=oddball)
        assert done.code == 0, done.err
        assert said in done.out + done.err
    given = ("--set", 'study.subjects=["01", "02"]')
    done = hrcneuro("run", "--dry-run", *given, cwd=oddball)
    assert said not in done.out + done.err


def swapped(home, old, new):
    path = next(home.glob("*_channels.tsv"))
    path.write_text(path.read_text().replace(old, new))


def test_a_root_that_is_none_is_told_and_a_folder_as_a_file_is_answered_with_the_source(hrcneuro, oddball):
    done = hrcneuro("run", "--set", "acquire.path=nowhere", cwd=oddball)
    assert done.code == 3
    assert "nowhere does not exist" in done.err
    done = hrcneuro("run", "--set", "acquire.path=data/sub-01/ses-1/eeg", cwd=oddball)
    assert done.code == 3
    assert "holds no subject" in done.err
    assert f"acquire.path = '{oddball / 'data'}'" in done.err
    text = OWN.replace('"bids"', '"file"') + '[study]\nsubjects = ["01"]\nexclude = []\nsplit = ""\n'
    (oddball / "hrcneuro.toml").write_text(f"contrasts = {{}}\nproblems = {{}}\n{text}")
    done = hrcneuro("acquire", "--no-figures", cwd=oddball)
    assert done.code != 0
    assert "it is a BIDS data set: acquire.source = 'bids'" in done.err


def test_events_carry_the_trial_table_and_say_what_it_means(bids, smoke):
    import pandas as pd

    import hrcneuro

    base = bids / "sub-s01" / "eeg" / "sub-s01_task-smoke_events"
    events = pd.read_csv(base.with_suffix(".tsv"), sep="\t", na_values="n/a", keep_default_na=False)
    trials = hrcneuro.open(smoke, "smoke").trials("s01")
    assert events["case"].dropna().tolist() == trials["case"].dropna().tolist()
    assert events["error"].tolist() == trials["error"].tolist()
    assert set(json.loads(base.with_suffix(".json").read_text())) == set(events.columns)


@pytest.mark.filterwarnings("ignore:The inplace keyword:DeprecationWarning")  # of MNE, under pandas 3
def test_clean_recordings_epochs_and_averages_open_in_mne(bids, smoke):
    import mne

    import hrcneuro

    study = hrcneuro.open(smoke, "smoke")
    derived = bids / "derivatives"
    clean = mne.io.read_raw_brainvision(
        derived / "hrcneuro" / "sub-s01" / "eeg" / "sub-s01_task-smoke_desc-clean_eeg.vhdr", verbose="error"
    )
    np.testing.assert_allclose(clean.get_data(), study.clean("s01").get_data(), atol=1e-11)
    stem = derived / "mne" / "sub-s01" / "eeg" / "sub-s01_task-smoke"
    assert len(mne.read_epochs(f"{stem}_epo.fif", verbose="error")) == len(study.epochs("s01"))
    assert len(mne.read_evokeds(f"{stem}_ave.fif", verbose="error")) == len(study.evokeds("s01"))


def test_a_foreign_recording_with_odd_channels_breaks_and_names_is_valid_too(hrcneuro, tmp_path):
    import mne

    names = [*(f"E{i}" for i in range(8)), "Cz", "VEOG", "ECG", "STI", "GSR"]
    info = mne.create_info(names, 256.0, ["eeg"] * 9 + ["eog", "ecg", "stim", "misc"])
    raw = mne.io.RawArray(np.random.default_rng(0).normal(scale=1e-5, size=(13, 256 * 30)), info, verbose="error")
    marks = mne.Annotations(np.arange(2, 26, 1.5), 0.2, ["go", "stop/x"] * 8)
    marks.append(20.1, 3.0, "BAD muscle")
    marks.append(28.2, 0, "boundary")
    raw.set_annotations(marks).set_meas_date(1.6e9)
    raw.save(tmp_path / "sub_A-1_raw.fif", verbose="error")
    (tmp_path / "hrcneuro.toml").write_text(
        '[study]\nname = "my study: β"\nsubjects = ["sub_A-1"]\nexclude = []\nsplit = ""\n'
        '[acquire]\nsource = "file"\npath = "{subject}_raw.fif"\n'
        "[conditions]\ngo = \"event == 'go'\"\nstop = \"event == 'stop/x'\"\n"
        '[contrasts]\n"go-stop" = ["go", "stop"]\n[problems]\ngs = ["go", "stop"]\n'
    )
    done = hrcneuro("export", "--bids", "bids", "--raw", cwd=tmp_path)
    assert done.code == 0, done.err
    assert verdict(tmp_path / "bids") == ([], 1)
    eeg = tmp_path / "bids" / "sub-subA1" / "eeg"
    told = (eeg / "sub-subA1_task-mystudy_events.tsv").read_text()
    assert [word in told for word in ("stop/x", "BAD muscle", "BAD boundary", "2020")] == [True, True, True, False]
    assert "10.1371" not in (tmp_path / "bids" / "dataset_description.json").read_text()


def test_two_names_with_one_label_are_refused(hrcneuro, tmp_path):
    given = ("--set", 'study.subjects=["a1", "a_1"]', "--set", "study.exclude=[]", "--workdir", tmp_path)
    done = hrcneuro("export", "--bids", tmp_path / "bids", *given)
    assert done.code == 2
    assert "'a_1' would be 'a1'" in done.err


def test_what_was_simulated_says_so_first(bids):
    assert json.loads((bids / "dataset_description.json").read_text())["Name"] == "smoke (synthetic data)"
    assert (bids / "README.md").read_text().splitlines()[2].startswith("SYNTHETIC")


def test_an_export_can_be_repeated_but_not_onto_something_else(hrcneuro, bids, smoke, tmp_path):
    again = hrcneuro("export", "--bids", bids, "s01", "--raw", *GIVEN, "--workdir", smoke)
    assert again.code == 0, again.err
    (tmp_path / "thesis.tex").touch()
    done = hrcneuro("export", "--bids", tmp_path, *GIVEN, "--workdir", smoke)
    assert done.code == 2
    assert "hrcneuro did not write" in done.err
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.tex"]
    assert hrcneuro("export", *GIVEN, "--workdir", smoke).code == 2


def test_without_the_extra_the_cure_is_named(hrcneuro, smoke, tmp_path):
    (tmp_path / "mne_bids.py").write_text("raise ImportError('not here')\n")
    done = hrcneuro("export", "--bids", tmp_path / "out", *GIVEN, "--workdir", smoke, env={"PYTHONPATH": str(tmp_path)})
    assert done.code == 2
    assert "pip install 'hrcneuro[bids]'" in done.err
