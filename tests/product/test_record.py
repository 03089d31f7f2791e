"""Recording over real LSL on loopback: the command line from preflight to verdict, briefly; ``make live`` has more."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from live_lab import Lab, foreign

for _name, _extra in (("mne_lsl", "lsl"), ("pyxdf", "xdf")):
    pytest.importorskip(_name, reason=f"{_name} is not installed: hrcneuro[{_extra}]")
if "LSLAPICFG" in os.environ:
    pytest.skip("LSLAPICFG is set: this laboratory's streams are its own", allow_module_level=True)

STREAMS = 'record.streams={eeg={type="EEG",sfreq=1000}}'
EEG = ["--set", STREAMS, "--set", "record.look_s=0.5", "--set", "record.wait_s=3"]


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    return Lab(tmp_path_factory.mktemp("live"))


@pytest.fixture(scope="module")
def amplifier(lab):
    with lab.amplifier() as running:
        yield running


def test_without_streams_it_refuses_and_says_what_is_missing(tmp_path):
    code, answer, said = Lab(tmp_path).record("--check", *EEG, "--set", "record.wait_s=1")
    assert code == 4
    assert "eeg: missing" in said
    assert "no stream of markers is declared (record.streams names eeg)" in said
    assert answer["ok"] is False
    assert not (tmp_path / "recordings").exists()


def test_a_recording_is_whole_resumed_and_nowhere_overwritten(lab, amplifier):
    code, looked, _ = lab.record("--check", *EEG)
    assert (code, looked["eeg"]["channels"]) == (0, 31)
    code, answer, said = lab.record("--seconds", "2", *EEG)
    assert (code, answer["whole"]) == (0, True), said
    first = lab.recording / "part1.xdf"
    before = first.read_bytes()
    code, answer, said = lab.record("--resume", "--seconds", "1", *EEG)
    assert (code, {one["part"] for one in answer["check"]}) == (0, {1, 2}), said
    assert first.read_bytes() == before
    assert {one["stream"] for one in answer["check"]} == {"eeg"}
    about = json.loads((lab.recording / "session.json").read_text())
    assert [one["state"] for one in about["parts"]] == ["ended", "ended"]
    assert b"<hostname>" not in before


def test_ctrl_c_is_how_a_recording_ends(lab, amplifier):
    before = set(lab.parts())
    recorder = lab.start("record", "s01", "--json", *EEG)
    _until(lambda: set(lab.parts()) - before and lab.samples_on_disk() > 100_000, recorder)
    os.killpg(recorder.pid, signal.SIGINT)
    out, said = recorder.communicate(timeout=60)
    assert (recorder.returncode, json.loads(out)["whole"]) == (0, True), said


def test_a_killed_recorder_leaves_a_file_that_opens(lab, amplifier):
    import pyxdf

    before = set(lab.parts())
    recorder = lab.start("record", "s01", *EEG)
    _until(lambda: set(lab.parts()) - before and lab.samples_on_disk() > 500_000, recorder)
    os.killpg(recorder.pid, signal.SIGKILL)
    recorder.communicate()
    (part,) = set(lab.parts()) - before
    streams, _ = pyxdf.load_xdf(part, synchronize_clocks=False, dejitter_timestamps=False)
    assert max(len(one["time_stamps"]) for one in streams) > 1000
    assert json.loads((part.parent / "session.json").read_text())["parts"][0]["state"] == "recording"


def _until(holds, process):
    end = time.monotonic() + 60
    while not holds():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["s99"], 2, "unknown subject 's99'"),
        (["s01", "--resume"], 3, "no recording to go on with"),
        (["s01", "--set", "record.stram={}"], 2, "did you mean 'streams'"),
        (["s01", "--set", 'record.streams={eeg={nmae="x"}}'], 2, "did you mean 'name'"),
        (["s01", "--set", "record.folder=cache/x"], 2, "lies in the cache"),
    ],
)
def test_mistakes_are_told_before_anything_is_looked_for(tmp_path, words, code, said):
    lab = Lab(tmp_path)
    done = lab.start("record", *words)
    _, err = done.communicate(timeout=60)
    assert (done.returncode, said in err) == (code, True), err


@pytest.mark.parametrize(
    ("fault", "kind"),
    [
        ("stuck", "not moving"),
        ("rate=500", "other rate"),
        ("flat=3", "flat"),
        ("volts", "other unit"),
        ("twin", "doubled"),
    ],
)
def test_what_goes_wrong_with_an_amplifier_is_refused_over_lsl_too(tmp_path, fault, kind):
    lab = Lab(tmp_path)
    with lab.amplifier("--fault", fault):
        streams = 'record.streams={eeg={type="EEG",sfreq=1000,unit="microvolts"}}'
        code, _, said = lab.record("--check", *EEG[2:], "--set", streams)
    assert (code, f"eeg: {kind}" in said) == (4, True), said


def test_pylsl_s_outlet_is_recorded_and_its_inlet_reads_the_amplifier(tmp_path):
    pytest.importorskip("pylsl", reason="pylsl is not installed, or finds no liblsl")
    for claim, holds, more in foreign(Lab(tmp_path)):
        assert holds, (claim, more)


def test_timing_of_a_running_session_needs_markers(lab, amplifier):
    done = lab.start("timing", "s01", "--live", "1", *EEG)
    _, err = done.communicate(timeout=60)
    assert (done.returncode, "no markers of moves" in err) == (3, True), err
    # What was recorded of a person is kept, and is no part of the session.
    assert len(list(lab.folder.glob("timing/s01/*/part1.xdf"))) == 1
    assert not any("timing" in str(part) for part in lab.parts())


def test_the_brief_live_runs_are_listed(tmp_path):
    path = Path(__file__).with_name("live_runs.py")
    done = subprocess.run([sys.executable, path, "--help"], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert "amplifier_dies" in done.stdout
