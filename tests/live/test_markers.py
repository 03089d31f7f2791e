"""Markers over LSL: a real stream through the loopback interface, and a session that sends them."""

from __future__ import annotations

import _thread
import contextlib
import json
import os
import signal
import subprocess
import sys
import threading

import numpy as np
import pandas as pd
import pytest

from hrcneuro.errors import HardwareError
from hrcneuro.live import onsets
from hrcneuro.live.lsl import LslInlet, described
from hrcneuro.live.markers import MarkerOutlet
from hrcneuro.live.transport import MOVES, TRUTH, Lost

STUDY = """[study]
name = "one"
subjects = ["s01"]
exclude = []
[acquire]
sfreq = 500.0
[acquire.session]
practice_episodes = 1
blocks = 2
episodes_per_block = 1
[robot]
backend = "ursim"
driver = "script"
markers = "lsl"
recorder_wait_s = 60.0
lead_s = 0.027
blocks = [1]
t_f_s = 0.6
pause_s = 0.0
longest_gap_s = 0.0
# The machine runs other tests beside this one.
max_packet_age_s = 0.5
"""


def listen(lsl, source):
    """Return an inlet that is connected to the stream of ``source`` and knows its clock."""
    (found,) = lsl.resolve_streams(timeout=60.0, name=MOVES, source_id=source)
    inlet = lsl.StreamInlet(found)
    inlet.open_stream(timeout=10.0)
    # Both clocks are this machine's.
    assert abs(inlet.time_correction(timeout=10.0)) < 1e-3
    return inlet


def test_a_stream_whose_description_is_no_xml_is_lost_and_raises_nothing_else(lsl):
    about = lsl.StreamInfo("odd", "Markers", 1, 0.0, "string", "test of a description")
    about.desc.append_child_value("note", "a\x01b")
    outlet = lsl.StreamOutlet(about)
    (found,) = lsl.resolve_streams(timeout=60.0, name="odd", source_id="test of a description")
    with pytest.raises(Lost, match="cannot be read"):
        LslInlet(lsl, described(found))
    del outlet


def test_every_marker_arrives_in_order_with_the_time_it_was_given(lsl):
    with MarkerOutlet("test of markers") as outlet:
        inlet = listen(lsl, "test of markers")
        outlet.wait(10.0)
        texts = [f"move/trial={i}" for i in range(200)]
        before = lsl.local_clock()
        stamps = [outlet.send(text, age=lambda: 0.25) for text in texts]
        after = lsl.local_clock()
        got = [inlet.pull_sample(timeout=10.0) for _ in texts]
        arrived = lsl.local_clock()
        assert [sample[0] for sample, _ in got] == texts
        assert [stamp for _, stamp in got] == stamps == sorted(stamps)
        assert before - 0.25 <= stamps[0] <= stamps[-1] <= after - 0.25
        assert arrived - after < 5.0
        about = inlet.get_sinfo()
        assert (about.name, about.stype, about.sfreq, about.n_channels) == (MOVES, "Markers", 0.0, 1)
        inlet.close_stream()


def test_a_stall_between_two_clocks_does_not_move_the_stamp(lsl):
    """The age is read before and after LSL's clock, and again where much time went by in between."""
    began = lsl.local_clock()
    lost = iter([0.0, 0.030, 0.0, 0.0, 0.0, 0.0])
    with MarkerOutlet("test of stalls") as outlet:
        # The second reading comes late by a stall, which the first did not see.
        stamp = outlet.send("move", age=lambda: lsl.local_clock() - began + next(lost))
    assert stamp == pytest.approx(began, abs=2e-4)


def test_a_session_that_waits_for_a_recorder_says_so(lsl):
    with (
        MarkerOutlet("test of waiting") as outlet,
        pytest.raises(HardwareError, match=r"nobody listens .* after 0\.05 s; nothing has moved") as caught,
    ):
        outlet.wait(0.05)
    assert "robot.recorder_wait_s" in caught.value.cure


def test_without_the_extra_the_cure_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "mne_lsl", None)
    with pytest.raises(HardwareError, match="mne-lsl, which is not installed") as caught:
        MarkerOutlet("test")
    assert "hrcneuro[lsl]" in caught.value.cure
    assert caught.value.exit_code == 4


def test_ctrl_c_ends_the_wait_for_a_recorder(lsl):
    began = lsl.local_clock()
    with MarkerOutlet("test wait") as outlet, pytest.raises(KeyboardInterrupt):
        interrupt = threading.Timer(0.05, _thread.interrupt_main)
        interrupt.start()
        outlet.wait(10.0)
    interrupt.join()
    assert lsl.local_clock() - began < 8.0


def test_liblsl_is_silent_where_nobody_configured_it(lsl, tmp_path):
    """Its greeting on standard error is no error; a laboratory's own settings are left alone."""
    greeting = 'import sys; from hrcneuro.live.liblsl import library; library("markers go out through").local_clock()'
    bare = {k: v for k, v in os.environ.items() if k != "LSLAPICFG"} | {"HOME": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", greeting], capture_output=True, text=True, env=bare, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_recorder_beside_the_arm_gets_each_onset(lsl, hrcneuro, tmp_path):
    """The whole way: the command line, a simulated controller in real time, an inlet as a recorder has it."""
    (tmp_path / "one.toml").write_text(STUDY)
    given = ["robot", "s01", "--config", tmp_path / "one.toml", "--workdir", tmp_path]
    assert hrcneuro("acquire", *given[1:]).code == 0
    command = [sys.executable, "-m", "hrcneuro", *map(str, given), "--timing"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path)
    inlet, got, late = listen(lsl, "hrcneuro robot s01"), [], []
    while process.poll() is None:
        sample, stamp = inlet.pull_sample(timeout=0.2)
        if stamp is not None:
            got.append((sample[0], stamp))
            late.append(lsl.local_clock() - stamp)
    out, err = process.communicate()
    assert process.returncode == 0, err

    (place,) = (tmp_path / "cache" / "robot" / "s01").glob("*/moves.parquet")
    moves = pd.read_parquet(place)
    moved = moves[~moves["clamped"]]
    assert [text for text, _ in got] == [
        f"move/subject=s01/scenario={m.scenario}/block={m.block}/episode={m.episode}/trial={m.trial}"
        for m in moved.itertuples()
    ]
    assert np.array_equal([stamp for _, stamp in got], moved["lsl_s"])
    # The stamps are the onsets on another clock: apart by one constant, to well under a millisecond.
    apart = moved["lsl_s"] - moved["onset_s"]
    assert np.ptp(apart) < 5e-4
    assert (moved["marker_latency_ms"] > 0).all()
    # It arrives after it was sent, and a stamp that is older than the marker's own delay was the onset.
    assert (np.array(late) > 1e-3 * moved["marker_latency_ms"] - 5e-4).all()
    assert moves.loc[moves["clamped"], ["lsl_s", "marker_s", "stim_sample"]].isna().all(axis=None)
    assert (moved["stim_latency_ms"] - moved["marker_latency_ms"]).between(-1e-3, 2.0 + 1e-3).all()
    assert "t = 0 to the marker sent" in out


def test_ctrl_c_in_mid_move_ends_at_rest_and_keeps_the_record(lsl, hrcneuro, tmp_path):
    """The first marker tells that the arm moves; the interrupt comes then."""
    (tmp_path / "one.toml").write_text(STUDY)
    given = ["s01", "--config", tmp_path / "one.toml", "--workdir", tmp_path]
    assert hrcneuro("acquire", *given).code == 0
    command = [sys.executable, "-m", "hrcneuro", "robot", *map(str, given)]
    # As in a terminal, the interrupt goes to everything that the command started.
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path, start_new_session=True
    )
    inlet = listen(lsl, "hrcneuro robot s01")
    sample, _ = inlet.pull_sample(timeout=60.0)
    with pytest.raises(subprocess.TimeoutExpired):
        # Half of the move, 0.6 s, goes by.
        process.wait(timeout=0.3)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=60.0)
    assert process.returncode == 130, err
    assert "Traceback" not in err
    (kept,) = (tmp_path / "recordings" / "s01").iterdir()
    told = " ".join(err.split())
    assert f"the record is in {kept}; it ended in block 1, episode" in told
    assert "begins the session anew" in told
    assert "goes on from here" not in told
    telemetry = pd.read_parquet(kept / "telemetry.parquet")
    assert sample[0].endswith("trial=0")
    assert (telemetry["move"] == 0).sum() > 1
    stop = telemetry[telemetry["phase"] == "stop"]
    assert stop.filter(like="qd_command").iloc[0].abs().max() > 0.05, "a controlled stop, not a sudden one"
    assert telemetry["phase"].iloc[-1] == "stop"
    assert telemetry.filter(regex=r"^qd_\d").iloc[-1].abs().max() < 1e-3
    assert telemetry.filter(like="qd_command").iloc[-1].abs().max() == 0.0
    inlet.close_stream()


def test_the_simulated_person_is_told_of_the_next_move_at_the_onset_before(lsl):
    moves = [
        {"marker": "move/a", "actor": "robot"},
        {"marker": "move/b", "actor": "human", "condition_before": "RH"},
        {"marker": "move/c", "actor": "human"},
    ]
    with contextlib.ExitStack() as stack:
        tell = onsets.truth("test of truth", moves, [0.9, float("nan"), float("nan")], stack)
        (found,) = lsl.resolve_streams(timeout=30.0, name=TRUTH, source_id="test of truth")
        inlet = lsl.StreamInlet(found)
        inlet.open_stream(timeout=10.0)
        begun = lsl.local_clock()
        for move in range(3):
            tell(lambda: 0.1, move)
        told = [json.loads(inlet.pull_sample(timeout=10.0)[0][0]) for _ in range(2)]
        inlet.close_stream()
    # Its own move begins 0.9 s after the onset that was 0.1 s ago; of one after a pause the time is not known.
    assert told[0].pop("key_s") == pytest.approx(begun + 0.8, abs=0.1)
    assert told == moves[1:]
