"""The command ``experiment`` from outside: the simulated study's rows, kills, signals, a full disk, what is refused."""

import contextlib
import os
import pty
import signal
import threading

import experiment_lab as lab
import pandas as pd
import pytest
from disks import mounted
from ur10_robot import Served

SMALL = lab.SessionParams(practice_episodes=1, blocks=2, episodes_per_block=2)
TWO = lab.SessionParams(practice_episodes=0, blocks=2, episodes_per_block=1)
ALONE = ("--backend", "none")
VIRTUAL = ("--human", "simulated", "--pace", "virtual")


def test_at_virtual_pace_the_rows_are_the_simulated_studys(hrcneuro, tmp_path):
    """In every column but the times; and the log is read as the authors' are."""
    words = [*VIRTUAL, *lab.sized(SMALL), "--workdir", tmp_path]
    done = hrcneuro("experiment", "s01", "s02", *words, "--json")
    assert done.code == 0, done.err
    assert [one["whole"] for one in done.json["sessions"]] == [True, True]
    for subject in ("s01", "s02"):
        table = pd.read_parquet(tmp_path / "recordings" / subject / "trials.parquet")
        lab.same(table, lab.expected(SMALL, subject=subject))
    study = ("--set", "study.subjects=['s01', 's02']", "--set", "study.exclude=[]")
    path = f"acquire.path={tmp_path / 'recordings'}"
    for source in ("semisynthetic", "dataset"):
        read = hrcneuro("acquire", "--rules", "--json", "--set", f"acquire.source={source}", "--set", path, *study)
        assert read.code == 0, read.err
        # What the experiment enforces; so few moves miss rules that leave room for chance.
        enforced = [rule for rule in read.json["rules"] if rule["target"] == "0"]
        assert len(enforced) > 5
        assert all(rule["ok"] for rule in enforced), enforced
    again = hrcneuro("experiment", "s01", *words)
    assert again.code == 2
    assert "s01 has a session already" in again.err
    resumed = hrcneuro("experiment", "s01", *words, "--resume")
    assert resumed.code == 2
    assert "is complete" in resumed.err


def test_a_session_that_is_there_is_refused_before_a_window_opens(hrcneuro, tmp_path):
    place = tmp_path / "recordings" / "s01"
    place.mkdir(parents=True)
    (place / "trials.parquet").touch()
    nowhere = {"DISPLAY": "", "WAYLAND_DISPLAY": "", "SDL_VIDEODRIVER": ""}
    done = hrcneuro("experiment", "s01", *ALONE, "--workdir", tmp_path, env=nowhere)
    assert (done.code, "s01 has a session already" in done.err) == (2, True), done.err


def test_at_virtual_pace_ctrl_c_ends_a_session_in_order(start, tmp_path):
    """No line of the log is cut in two; the sessions that would have followed are not begun."""
    words = ["experiment", "s01", "s02", *VIRTUAL, "--workdir", tmp_path]
    process, place = start(*words), tmp_path / "recordings" / "s01"
    lab.wait_for(lambda: lab.parts_of(place) and len(lab.rows_of(place)) > 20)
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "--resume" in out
    assert lab.last(place)["kind"] == "end"
    lab.check_log(place)
    assert not (tmp_path / "recordings" / "s02").exists()


def test_a_screen_that_is_smaller_than_the_grid_is_refused(hrcneuro, tmp_path):
    words = ("s01", *ALONE, "--set", "experiment.window.pixels_per_cm=60", "--workdir", tmp_path)
    done = hrcneuro("experiment", *words, env={"SDL_VIDEODRIVER": "dummy"})
    assert done.code == 4
    assert "the grid needs 49.0 × 49.0 cm" in done.err or "hrcneuro[experiment]" in done.err
    assert not list(tmp_path.rglob("experiment.jsonl"))


def test_what_cannot_be_gone_on_with_is_refused_before_a_window_opens(hrcneuro, tmp_path):
    """Where no window can open, that would be said otherwise."""
    place, nowhere = tmp_path / "recordings" / "s01", {"DISPLAY": "", "WAYLAND_DISPLAY": "", "SDL_VIDEODRIVER": ""}
    words = ["s01", *ALONE, "--human", "simulated", *lab.sized(TWO), "--workdir", tmp_path]

    def refused(code, text, *more):
        done = hrcneuro("experiment", *words, "--resume", *more, env=nowhere)
        assert (done.code, text in done.err) == (code, True), done.err

    refused(3, "no experiment to go on with")
    begun = hrcneuro("experiment", "s01", *VIRTUAL, *lab.sized(TWO), "--workdir", tmp_path)
    assert begun.code == 0, begun.err
    refused(2, "is complete")
    journal = place / "experiment.jsonl"
    lines = journal.read_text().splitlines(keepends=True)
    journal.write_text("".join(lines[:-8]))
    refused(2, "seed is 7, and was 2023", "--set", "acquire.seed=7")
    refused(4, "neither DISPLAY nor WAYLAND_DISPLAY is set")
    journal.write_text("".join([lines[0], "damaged\n", *lines[1:]]))
    refused(3, "line 2 is damaged")
    assert journal.read_text().splitlines()[1] == "damaged"


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("s01", *VIRTUAL, "--backend", "ursim"), 2, "robot.backend = 'ursim'; allowed: sim"),
        (("s01", "--pace", "virtual"), 2, "no person keeps up with a virtual clock"),
        (("s01", "s02", *ALONE, "--human", "simulated", "--no-screen"), 2, "2 subjects, s01, s02, in real time"),
        (("s01", "--backend", "ur", "--host", "192.0.2.1"), 2, "--i-am-at-the-robot"),
        (("s01", "--backend", "ur", "--host", "192.0.2.1", "--i-am-at-the-robot", "--windowed"), 2, "windowed = true"),
        (("s01", *VIRTUAL, "--backend", "ursim", "--set", "experiment.drawn_tool=true"), 2, "= 'ursim'; allowed: sim"),
        (("s01", "--backend", "nobody"), 2, "'nobody'; allowed: sim, ursim, ur, ros, none"),
        (("s01", *VIRTUAL, "--resume"), 3, "no experiment to go on with"),
        (("s01", *ALONE), 4, "neither DISPLAY nor WAYLAND_DISPLAY is set"),
    ],
)
def test_what_cannot_be_begun_is_refused_and_nothing_is_written(hrcneuro, tmp_path, monkeypatch, words, code, said):
    empty = {"DISPLAY": "", "WAYLAND_DISPLAY": "", "SDL_VIDEODRIVER": ""}
    done = hrcneuro("experiment", *words, "--workdir", tmp_path, env=empty)
    assert (done.code, said in done.err) == (code, True), done.err
    assert not list(tmp_path.rglob("experiment.jsonl"))


def test_ctrl_c_ends_a_session_at_rest_which_goes_on_only_as_it_was_begun(hrcneuro, tmp_path):
    """A second Ctrl-C changes nothing; nor does another experiment of the subject while this one runs."""
    with lab.Experiment(tmp_path, *ALONE, params=TWO) as run:
        run.until("move", 2)
        with lab.Experiment(tmp_path, *ALONE, "--resume", params=TWO) as second:
            code, _, err = second.end()
            assert code == 4
            assert "another experiment of s01 is running" in err
        run.process.send_signal(signal.SIGINT)
        run.until("ends early")
        run.process.send_signal(signal.SIGINT)
        code, out, err = run.end()
        assert code == 130
        assert "--resume" in out
        assert "the session ends as soon as the arm rests" in err
    assert lab.last(run.place)["kind"] == "end"
    lab.check_log(run.place)
    other = hrcneuro(
        "experiment", "s01", *VIRTUAL, *lab.sized(TWO), "--set", "acquire.seed=7", "--workdir", tmp_path, "--resume"
    )
    assert other.code == 2
    assert "seed is 7, and was 2023" in other.err


def test_a_killed_experiment_leaves_an_arm_at_rest_and_a_log_that_goes_on(hrcneuro, tmp_path):
    """Its other processes end, the simulated controller among them; the block that was broken off is not repeated."""
    with lab.Experiment(tmp_path, *lab.SIMULATED, params=TWO) as run:
        run.until("move", 2)
        stream, others = lab.stream_of(run.controller[1]), run.others()
        rest = lab.rest_after(stream, run.process.kill)
        assert rest <= 0.25
        assert lab.ended(others) == []
    lab.check_log(run.place, arm_moves=lab.arm_moves_of(run.place))
    before = len(lab.rows_of(run.place))
    rest = hrcneuro("experiment", "s01", *VIRTUAL, *lab.sized(TWO), "--workdir", tmp_path, "--resume")
    assert rest.code == 0, rest.err
    assert lab.check_session(run.place, TWO) == 1
    assert len(lab.rows_of(run.place)) > before


def test_where_the_arms_process_is_killed_the_arms_own_watchdog_stops_it(tmp_path):
    served = Served()
    words = ("--backend", "ur", "--host", served.address, "--i-am-at-the-robot", *lab.BORNE)
    try:
        with lab.Experiment(tmp_path, *words, params=TWO) as run:
            run.until("move", 1)
            arm, stream = run.spawned[0], lab.stream_of(served.address)
            assert lab.rest_after(stream, arm.kill) <= 0.25
            code, _, err = run.end()
            assert code == 4
            assert "has ended without a word" in err
    finally:
        served.end()
    lab.check_log(run.place)
    assert "without a word" in next(e for e in lab.entries(run.place) if e["kind"] == "arm stopped")["problem"]


class Terminal:
    """A terminal at which an experimenter sits."""

    def __init__(self, folder, *words, params):
        self.master, slave = pty.openpty()
        self._text = b""
        streams = {"stdin": slave, "stdout": slave, "stderr": slave, "text": False}
        self.run = lab.Experiment(folder, *words, params=params, **streams)
        os.close(slave)
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        with contextlib.suppress(OSError):
            while piece := os.read(self.master, 65536):
                self._text += piece

    def press(self, keys):
        os.write(self.master, keys.encode())

    def shows(self, text):
        """Wait until something is shown."""
        lab.wait_for(lambda: text.encode() in self._text)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.run.close()
        os.close(self.master)


def test_the_experimenter_pauses_notes_goes_on_and_ends(tmp_path):
    with Terminal(tmp_path, *ALONE, params=TWO) as desk:
        desk.run.until("move", 1)
        desk.press("p")
        desk.run.until("pause")
        desk.shows("\x1b[0m: pause")  # the foot has "p: pause"
        moves = len(desk.run.lines("move"))
        desk.press("na sneeze\r")
        assert desk.run.until("note")["text"] == "a sneeze"
        assert len(desk.run.lines("move")) == moves
        desk.press(" ")
        desk.run.until("goes on")
        desk.run.until("move", moves + 1)
        desk.press("q")
        desk.shows("q once more ends the session")
        desk.press("q")
        assert desk.run.process.wait(lab.PATIENCE) == 130
        desk.shows("ended early")
    end = lab.last(desk.run.place)
    assert (end["complete"], end["why"]) == (False, "the experimenter ended it")
    lab.check_log(desk.run.place)


def test_a_terminal_that_is_held_up_by_ctrl_s_holds_up_no_session(tmp_path):
    with Terminal(tmp_path, *ALONE, params=TWO) as desk:
        desk.run.until("move", 1)
        desk.press("\x13")
        assert desk.run.until("end")["complete"]
        desk.press("\x11")
        assert desk.run.process.wait(lab.PATIENCE) == 0
        desk.shows("recorded: no")


def test_a_full_disk_pauses_the_session_until_there_is_room(tmp_path):
    """Nothing is lost: what was not written comes with what follows."""
    with mounted(tmp_path / "disk", "size=60m") as disk, Terminal(disk, *ALONE, params=TWO) as desk:
        desk.run.until("move", 2)
        filled = disk / "filled"
        with filled.open("wb", buffering=0) as file, contextlib.suppress(OSError):
            for size in (1 << 20, 1 << 12, 1):
                with contextlib.suppress(OSError):
                    while True:
                        file.write(bytes(size))
        desk.shows("No space left on device")
        desk.shows("\x1b[0m: pause")  # the foot has "p: pause"
        filled.unlink()
        desk.press(" ")
        desk.run.until("move", 6)
        assert len(desk.run.lines("pause")) == 1
        desk.press("qq")
        assert desk.run.process.wait(lab.PATIENCE) == 130
        lab.check_log(desk.run.place)
        lab.same_so_far(desk.run.place, TWO)


def test_a_lost_arm_is_told_and_logged_and_the_move_is_made_again(tmp_path):
    with Terminal(tmp_path, *lab.SIMULATED, params=TWO) as desk:
        desk.run.until("move", 2)
        controller, _ = desk.run.controller
        controller.kill()
        assert desk.run.until("arm stopped")["problem"]
        desk.shows("the arm was stopped")
        desk.press(" ")
        desk.run.until("arm ready", 2)
        lab.wait_for(lambda: [row for row in lab.rows_of(desk.run.place) if row.get("again")])
        desk.press("qq")
        assert desk.run.process.wait(lab.PATIENCE) == 130
        assert len([row for row in lab.rows_of(desk.run.place) if row.get("again")]) == 1
        lab.check_log(desk.run.place)
        lab.same_so_far(desk.run.place, TWO)
