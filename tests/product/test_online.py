"""The command online from outside: over real LSL on loopback, over a recording, and what it refuses."""

import json
import os
import signal
import time

import pytest
from live_lab import Lab
from online_lab import Lab as Virtual
from online_lab import decoder as virtual_decoder
from online_lab import learner, moves

from hrcneuro.io.decoders import write_decoder
from hrcneuro.live.decisions import DecisionLog
from hrcneuro.live.online import Online

for _name, _extra in (("mne_lsl", "lsl"), ("pyxdf", "xdf")):
    pytest.importorskip(_name, reason=f"{_name} is not installed: hrcneuro[{_extra}]")
if "LSLAPICFG" in os.environ:
    pytest.skip("LSLAPICFG is set: this laboratory's streams are its own", allow_module_level=True)


def ran(lab, *words, timeout=120):
    """Return exit code, the JSON answer and what was said."""
    done = lab.start("online", "s01", "--json", *words)
    out, err = done.communicate(timeout=timeout)
    return done.returncode, json.loads(out or "{}"), err


@pytest.fixture
def recorded(tmp_path):
    """A virtual session with its recording, log and decoder, where the command looks for them."""
    lab = Lab(tmp_path)
    home = tmp_path / "recordings" / "s01"
    session = Virtual(moves(episodes=1), folder=home / "one").run()
    (home / "two-online").mkdir()
    log = DecisionLog(home / "two-online")
    for line in session.lines:
        log(line)
    log.close()
    (tmp_path / "made").mkdir()
    write_decoder(virtual_decoder(), tmp_path / "made", about={})
    return lab, session


def test_a_replay_finds_the_log_of_its_session_and_says_whether_scores_are_equal(recorded):
    lab, session = recorded
    words = ("--decoder", "made", "--replay", "recordings/s01/one", "--mode", "closed")
    code, answer, said = ran(lab, *words, "--chunk", "1000")
    assert (code, answer["against_log"]) == (
        0,
        {"equal": 8, "different": 0, "undecided": 0, "unrecorded": 0, "unknown": 0},
    ), said
    assert answer["learned"] == session.learner.policy()
    assert answer["causes"] == {"last": 1}
    # Another score in the log is found.
    path = lab.folder / "recordings" / "s01" / "two-online" / "decisions.jsonl"
    path.write_text(path.read_text().replace(f'"score": {session.trials[0]["score"]}', '"score": 0.125', 1))
    code, answer, _ = ran(lab, *words)
    assert (code, answer["ok"], answer["against_log"]["different"]) == (1, False, 1)


def test_a_replay_finds_every_log_of_a_session_whose_loop_was_begun_again(tmp_path):
    lab = Lab(tmp_path)
    home = tmp_path / "recordings" / "s01"
    session = Virtual(moves(episodes=2), folder=home / "one")
    first, second = session.lines, []
    session.network.on_wait.append(lambda now: begin_again(session, second, now))
    session.run()
    for name, lines in (("1-online", first), ("2-online", second), ("3-online", second[:4])):
        (home / name).mkdir()
        log = DecisionLog(home / name)
        for line in lines:
            log(line)
        log.close()
    (tmp_path / "made").mkdir()
    write_decoder(virtual_decoder(), tmp_path / "made", about={})
    code, answer, said = ran(lab, "--decoder", "made", "--replay", "recordings/s01/one", "--mode", "closed")
    counts = answer["against_log"]
    assert (code, counts["different"]) == (0, 0), said
    scored = [sum(line.get("score") is not None for line in lines) for lines in (first, second)]
    assert min(scored) > 2
    assert counts["equal"] == sum(scored)


def begin_again(session, lines, now):
    """Let another loop take the place of the one that a session has had, at its second 8.5."""
    if lines or now < session.begun + 8.5:
        return
    session.loop = Online(
        session.network, session.network.clock, session.loop.eeg, virtual_decoder(), learner(), session.options,
        subject="s01", publish=lambda text, stamp: None, log=lines.append,
    )  # fmt: skip


def test_what_is_missing_is_told_with_its_cure(recorded):
    lab, _ = recorded
    assert "hrcneuro calibrate" in ran(lab)[2]
    for words, code, said in (
        ((), 3, "calibrate of s01 has not run"),
        (("--decoder", "made", "--replay", "nowhere"), 3, "part1.xdf"),
        (("--decoder", "made", "--set", "online.wait_s=1"), 4, "the EEG is missing"),
        (("--decoder", "made", "--replay", "recordings/s01/one", "--go-on"), 2, "--go-on with --replay"),
        (("--decoder", "made", "--mode", "open"), 2, "shadow, semi, closed"),
    ):
        got, _, err = ran(lab, *words)
        assert got == code, err
        assert said in err
    assert not list(lab.folder.glob("recordings/s01/*-online/decisions.jsonl"))[1:]


def test_a_session_over_lsl_is_decided_until_ctrl_c(tmp_path):
    lab = Lab(tmp_path)
    made = lab.start("calibrate", "s01", "--no-figures", "--json")
    said = made.communicate(timeout=120)[1]
    assert made.returncode == 0, said
    with lab.amplifier("--replay"):
        loop = lab.start("online", "s01", "--json", "--mode", "closed")
        end = time.monotonic() + 60
        while time.monotonic() < end and loop.poll() is None:
            found = [path.read_text() for path in tmp_path.glob("recordings/s01/*-online/decisions.jsonl")]
            if found and found[0].count('"zero_from": "trigger"') >= 3:
                break
            time.sleep(0.1)
        code, _, told = ran(lab, "--mode", "closed")
        assert (code, "a closed loop of s01 is running" in told) == (4, True), told
        loop.send_signal(signal.SIGINT)
        out, err = loop.communicate(timeout=30)
    assert loop.returncode == 0, err
    answer = json.loads(out)
    assert answer["decided"] >= 3
    lines = [json.loads(line) for line in found[0].splitlines()]
    first = next(line for line in lines if line["kind"] == "move" and line["score"] is not None)
    assert first["problem"] in ("HHvsHR", "RRvsRH")
    assert first["last_stamp"] - first["zero_stamp"] == pytest.approx(0.599, abs=1e-6)
