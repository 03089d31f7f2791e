"""A session in real time, in this process: an arm's side that freezes, and what else must not hang it."""

from __future__ import annotations

import dataclasses
import errno
import json
import os
import signal
from types import SimpleNamespace

import psutil
import pytest

from hrcneuro.arms.clock import seconds
from hrcneuro.errors import StageError
from hrcneuro.experiment import disk
from hrcneuro.experiment.ahead import Ahead
from hrcneuro.experiment.parameters import ExperimentOptions
from hrcneuro.experiment.ports import Order
from hrcneuro.experiment.real import RealTime
from hrcneuro.experiment.session import Setup
from hrcneuro.paradigm.params import SessionParams, TimingParams
from hrcneuro.sources import experiments
from hrcneuro.stages.robot import Config

PATIENCE = 60.0  # s, of a busy machine, in which nothing happens


class Desk:
    """An experimenter who does something each time that this looks, until the session ends."""

    def __init__(self, acts):
        self.attended, self.said, self._acts, self._seen = True, [], acts, None
        self._until, self._state = seconds() + PATIENCE, None

    def waits_for(self):
        return []

    def asked(self):
        assert seconds() < self._until, (self._seen, self.said)
        return [] if self._seen is None else self._acts(self._seen)

    def show(self, seen, now):
        self._seen = seen
        state = (seen.phase, seen.n_moves, seen.stops, seen.trouble, seen.asked)
        if state != self._state:
            self._until, self._state = seconds() + PATIENCE, state

    def say(self, text):
        self.said.append(text)


# On a busy machine a simulated arm may be held up: not what is tested here.
ROBOT = Config(lead_s=0.035, max_late_s=0.5)


@pytest.fixture(scope="module")
def ahead():
    """What checks requests, for all sessions: it has tried the whole grid."""
    return Ahead(ROBOT, shortest_s=TimingParams().t_f_min_s)


@pytest.fixture
def run(tmp_path, ahead):
    """Return what runs a session with an experimenter who acts so."""
    robot = dataclasses.replace(ROBOT, rescue_folder=str(tmp_path / "kept"))
    options = ExperimentOptions(
        human="simulated", drawn_tool=True, markers="none", screen=False, watch_recorder=False, pause_s=0.1, break_s=0.1
    )
    session = SessionParams(practice_episodes=0, blocks=2, episodes_per_block=1)

    def run(desk):
        setup = Setup("s01", options, session, TimingParams(), 1, robot, tmp_path / "recordings")
        return RealTime(setup, desk, ahead=ahead).run()

    return run


def the_arm():
    """Return the process of the arm's side."""
    (arm,) = (one for one in psutil.Process().children() if "spawn_main" in " ".join(one.cmdline()))
    return arm


def test_an_arms_side_that_freezes_stops_the_session_which_goes_on_or_ends(run):
    """Frozen while it moves, the session goes on with another; frozen again, it ends by Ctrl-C."""
    done = SimpleNamespace(frozen=[], at=[], troubles=[])

    def acts(seen):
        if seen.trouble and len(done.troubles) < len(done.frozen):
            done.troubles.append((seen.trouble, seen.cure, seconds() - done.at[-1]))
            return [Order.GO_ON]
        if seen.n_moves == len(done.frozen) + 1 and not seen.trouble and len(done.frozen) < 2:
            arm = the_arm()
            arm.suspend()
            done.frozen.append(arm)
            done.at.append(seconds())
            if len(done.frozen) == 2:
                os.kill(os.getpid(), signal.SIGINT)
        return []

    seen = run(Desk(acts))
    (first, cure, after), *_ = done.troubles
    assert "has said nothing for 2 s" in first
    assert cure.startswith("press the emergency stop if the arm moves on")
    assert "space (go on) begins with the arm anew" in cure
    assert "--resume" in cure
    assert 1.9 < after < 10.0
    assert seen.stops == 2
    assert seen.interrupted
    assert not seen.whole
    assert seen.n_moves >= 2
    assert not any(arm.is_running() for arm in done.frozen)


@pytest.mark.parametrize("waits", [True, False])
def test_a_disk_that_is_full_at_the_end_is_waited_for(run, monkeypatch, tmp_path, waits):
    """Or, asked to end once more, the session ends with the lines that are missing."""
    state, real = SimpleNamespace(full=False, asked=0), os.write

    def write(file, data):
        if state.full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return real(file, data)

    def acts(seen):
        if seen.n_moves >= 1 and not state.full and not state.asked:
            state.full = True
            return [Order.END]
        if any("as soon as there is room" in text for text in desk.said):
            state.asked += 1
            if state.asked == 3:
                state.full = not waits
                return [] if waits else [Order.END]
        return []

    desk = Desk(acts)
    with monkeypatch.context() as patch:
        patch.setattr(disk, "os", SimpleNamespace(**{**vars(os), "write": write}))
        if waits:
            run(desk)
        else:
            with pytest.raises(StageError, match=r"No space left on device; .*missing at the end of") as error:
                run(desk)
            assert json.loads(error.value.problem.splitlines()[-1])["kind"] == experiments.END
    assert state.asked == 3
    assert sum("as soon as there is room" in text for text in desk.said) == 1
    entries, _ = experiments.read(tmp_path / "recordings" / "s01" / experiments.FILE)
    kinds = [entry["kind"] for entry in entries]
    assert ("ends early" in kinds, kinds[-1] == experiments.END) == (waits, waits)


def test_ctrl_z_suspends_neither_the_session_nor_the_arm_and_is_as_before_afterwards(run):
    sent = []

    def acts(seen):
        if seen.n_moves == 1 and not sent:
            sent.append(the_arm())
            for number in (signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU):
                sent[0].send_signal(number)
            # Sent here, where it is not ignored, it would suspend the tests.
            assert signal.getsignal(signal.SIGTSTP) == signal.SIG_IGN
            os.kill(os.getpid(), signal.SIGTSTP)
        return [Order.END] if seen.n_moves == 3 else []

    before = signal.getsignal(signal.SIGTSTP)
    seen = run(Desk(acts))
    assert (seen.n_moves >= 3, seen.stops, sent[0].is_running()) == (True, 0, False)
    assert signal.getsignal(signal.SIGTSTP) == before
