"""The EEG of the co-adaptation study by its ready configuration: files of its layout, and the one real header."""

import shutil
from pathlib import Path

import foreign
import numpy as np
import pandas as pd
import pytest
import scipy.io
from tiny_study import ROOT

from hrcneuro.analyses.gaze_scores import Replay
from hrcneuro.config import settings
from hrcneuro.learning.gaze_counts import is_path
from hrcneuro.sources import foreign as reading
from hrcneuro.sources import gaze_logs, layout

HEADERS = ROOT.parent / "shared" / "data" / "recordings" / "eeglab" / "ehrlich_headers"
LOGS = ROOT.parent / "shared" / "data" / "coadaptation"
# As the published headers have them: the label EOG3 three times.
CHANNELS = [
    *("Fp1", "Fz", "F3", "F7", "EOG3", "FC5", "FC1", "C3", "T7", "CP5", "CP1", "Pz", "P3", "P7", "O1", "EOG3", "O2"),
    *("P4", "P8", "CP6", "CP2", "Cz", "C4", "T8", "EOG3", "FC6", "FC2", "F4", "F8", "Fp2"),
]
SFREQ = 256


def write_run(path, *, trials, seed):
    """Write a closed session in the layout of the repository: 256 Hz, numeric codes, fractional latencies, a boundary.

    After wrong guesses Cz goes down by 10 µV 250 to 350 ms behind the outcome's code.
    """
    rng = np.random.default_rng(seed)
    # Mostly shared, as neighbours share it: channels of their own noise alone would be taken for broken ones.
    data = foreign.eeg_uv(len(CHANNELS), int(SFREQ * (3 + 4 * trials)), seed) * 0.6
    data += foreign.eeg_uv(1, data.shape[1], seed + 100)
    events, wrong = [("boundary", 1.5)], 0
    for trial in range(trials):
        at = SFREQ * (2.0 + 4.0 * trial) + float(rng.random())
        error = trial % 3 == 0
        wrong += error
        events += [(33036, at - 300.0), (33039, at - 200.0), (33028, at - 180.0)]
        events += [(33033 if error else 33031, at), (33034, at + 1.3), (33035, at + 550.0)]
        if error:
            first = round(at - 1 + 0.25 * SFREQ)
            data[CHANNELS.index("Cz"), first : first + SFREQ // 10] -= 10
    foreign.save_set(path, data, CHANNELS, float(SFREQ), events)
    return wrong


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """Return a folder of two subjects with two runs each, and how many guesses were wrong in each subject."""
    folder = tmp_path_factory.mktemp("eeg") / "data_coadaptation"
    wrong = {
        subject: sum(
            write_run(folder / subject / f"{subject}_corl{run}.set", trials=15, seed=10 * i + run) for run in (1, 2)
        )
        for i, subject in enumerate(("s03", "s04"))
    }
    return folder, wrong


def test_two_subjects_of_the_layout_go_through_to_the_error_potential(hrcneuro, data, tmp_path):
    folder, wrong = data
    given = ("--config", "coadaptation", "--set", f"acquire.path={folder}/{{subject}}/{{subject}}_corl*.set")
    # Channels of mere noise are as like each other as no EEG is: the least one stands out.
    given += (
        "--set",
        "preprocess.bad_channels=none",
        "--set",
        "study.subjects=['s03', 's04']",
        "--workdir",
        tmp_path,
        "-j",
        "1",
        "--no-figures",
    )
    done = hrcneuro("erp", *given, "--json")
    assert done.code == 0, done.err
    found = {(item["stage"], item["unit"]): item["summary"] for item in done.json["items"]}
    for subject, n in wrong.items():
        assert found["epoch", subject]["total"] == {"error": n, "noError": 30 - n}
        # Two runs are joined with a break between, beside the one that a boundary marks in each.
        assert found["acquire", subject]["breaks"] >= 1
    place = hrcneuro("path", "erp", "s03", "waveforms.parquet", *given[:-3])
    assert place.code == 0, place.err
    waves = pd.read_parquet(place.out.strip()).query("channel == 'Cz'").set_index("condition")
    difference = np.array(waves.loc["error", "mean_uv"]) - np.array(waves.loc["noError", "mean_uv"])
    times = waves.loc["error", "start_s"] + np.arange(len(difference)) / SFREQ
    # Where it was planted, and nowhere else nearly as deep.
    assert 0.25 < times[difference.argmin()] < 0.36
    assert difference.min() < -5
    assert np.abs(difference[times < 0.1]).max() < 5


def read(folder):
    """Return s03's closed sessions as the ready configuration has them read, and their events."""
    place = f"acquire.path={folder}/{{subject}}/{{subject}}_corl*.set"
    options = settings.load(Path("coadaptation"), [place]).sections["acquire"]
    files = layout.recording_files(options.path, "s03")
    recording = reading.read(files, options)
    reading.shape(recording, options)
    return recording, reading.events(recording, files, options)


def test_eog_channels_of_one_label_are_three_and_no_eeg(data):
    recording, _ = read(data[0])
    assert recording.ch_types.count("eog") == 3
    assert recording.ch_types.count("eeg") == 27
    assert len(set(recording.ch_names)) == 30
    assert recording.sfreq == SFREQ


@pytest.fixture(scope="module")
def published(tmp_path_factory):
    """Return the published header of s03's first closed session with noise for its samples, which are not here."""
    header = HEADERS / "s03_corl1.set"
    if not header.is_file():
        pytest.skip("the published header is not here (shared/data)")
    folder = tmp_path_factory.mktemp("published")
    (folder / "s03").mkdir()
    shutil.copy(header, folder / "s03")
    shape = scipy.io.loadmat(header, squeeze_me=True, variable_names=["EEG"], struct_as_record=False)["EEG"]
    foreign.eeg_uv(int(shape.pnts), int(shape.nbchan)).tofile(folder / "s03" / "s03_corl1.fdt")
    return folder


def test_the_published_header_has_the_outcomes_of_its_log(published):
    recording, events = read(published)
    assert recording.ch_types.count("eog") == 3
    assert events["event"].value_counts().to_dict() == {"noError": 48, "error": 2}
    if LOGS.is_dir():
        log = next(one for one in gaze_logs.read_sessions(LOGS) if (one.subject, one.run) == ("s03", 1))
        assert ((events["event"] == "noError").to_numpy() == log.right).all()


def test_the_gaze_that_was_recorded_is_the_one_that_the_policies_tell_of(published):
    """The header's gaze events: changes of the gaze's target, which no part of the inference has seen."""
    if not LOGS.is_dir():
        pytest.skip("the published session logs are not here (shared/data)")
    files = layout.recording_files(f"{published}/{{subject}}/{{subject}}_corl*.set", "s03")
    codes = reading.read(files, settings.load(Path("coadaptation")).sections["acquire"]).markers["event"].astype(int)
    trials, changes, before = [], np.zeros((4, 4), int), None
    for code in codes:
        if 33036 <= code <= 33039:
            if before is not None:
                changes[before, code - 33036] += 1
            before = code - 33036
        elif code == 33034:
            trials.append(changes)
            changes, before = np.zeros((4, 4), int), None
    log = next(one for one in gaze_logs.read_sessions(LOGS) if (one.subject, one.run) == ("s03", 1))
    told = 0
    for seen, counts, logged in zip(trials, Replay([log]).counts[0], log.transitions, strict=True):
        ways = counts.matrices(int(logged))
        away = ways[is_path(ways)] - seen
        away[:, np.arange(4), np.arange(4)] = 0  # staying where it is changes nothing that is marked
        # The last transition of a trial is drawn and not walked any more.
        told += bool(len(away)) and bool((((away >= 0).all(axis=(1, 2))) & (away.sum(axis=(1, 2)) <= 1)).any())
    assert len(trials) == 50
    assert told == 48  # of two trials more counts were possible than are gone through
