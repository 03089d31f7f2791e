"""The arm's side in a process of its own, so that neither window nor flow can hold up its loop.

Two pipes lead there and back. The loop itself touches neither: one thread takes requests, another sends reports. Where
the other process ends, however it does, the arm is stopped.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import queue
import signal
import threading
from collections import deque
from collections.abc import Callable
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection

from hrcneuro import interrupts
from hrcneuro.arms.clock import WallClock, seconds
from hrcneuro.arms.words import on_stderr
from hrcneuro.experiment import arm_side
from hrcneuro.experiment.ahead import Ahead
from hrcneuro.experiment.arm_side import ArmSettings
from hrcneuro.experiment.end_of_process import at_its_end
from hrcneuro.experiment.messages import Ended, Finish, Halted, Health, Ready, Report, Request, Said
from hrcneuro.experiment.stderr_lines import Lines, pass_on

_WAITING = 200  # reports that nobody has taken; beyond it, what tells of the arm's health is left out
_LAST_S = 2.0  # for the last reports to be taken
_KEEPS_S = 60.0  # to stop the arm and to keep what it did
# What a terminal sends to all of its processes is for the flow, which then asks the arm to finish.
_NOT_OURS = (signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU)
_BEGINS_S = 90.0  # without a word until it is ready: libraries, a controller that starts, somebody who records
_SILENT_S = 2.0  # afterwards: how the arm is comes a few times a second
_ENDS_S = 5.0  # once it is asked to finish: streams and ports are closed, a simulated controller ends
_LOOK_S = 0.25  # counts at most as silence between two looks: this process, or the machine, may have slept
_LOOK_FOR_END_S = 0.02  # much less than the quarter of a second in which an arm is to rest
_LOST = (
    "press the emergency stop if the arm moves on; once it rests, space (go on) begins with the arm anew; or end here, "
    "and start the experiment again with --resume"
)


class ArmProcess:
    """The arm's side as the flow sees it; a context manager, so that leaving it stops an arm that still moves.

    Attributes:
        connection: Becomes readable with the next report, for :func:`multiprocessing.connection.wait`.
    """

    def __init__(self, settings: ArmSettings, ahead: Ahead, *, say: Callable[[str], object] = on_stderr) -> None:
        """Start it; the first report is ``Ready``, after some seconds, or ``Halted``.

        Args:
            settings: Which arm, and how.
            ahead: Checks every request before it is sent.
            say: Takes what the experimenter should read, as reports are taken.
        """
        ahead.restart()
        self._ahead, self._say = ahead, say
        self._over = False
        self._patience, self._silence, self._looked = _BEGINS_S, 0.0, seconds()
        context = multiprocessing.get_context("spawn")
        requests, self._requests = context.Pipe(duplex=False)
        self.connection, reports = context.Pipe(duplex=False)
        self._lines, lines = Lines.pipe(context)
        self._process = context.Process(
            target=_main, args=(settings, requests, reports, lines, os.getpid()), name="arm", daemon=True
        )
        # The tracker of the library, which is started with the first process, changes what is blocked.
        resource_tracker.ensure_running()
        before = signal.pthread_sigmask(signal.SIG_BLOCK, _NOT_OURS)
        try:
            self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            # The other process's ends: as long as they are open here, too, no end is seen.
            requests.close()
            reports.close()
            lines.close()

    def __enter__(self) -> ArmProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def pid(self) -> int | None:
        """Number of the process."""
        return self._process.pid

    @property
    def over(self) -> bool:
        """Whether its last report was taken."""
        return self._over

    def send(self, request: Request) -> None:
        """Ask for something; where the arm's side has ended, its last report says why.

        Raises:
            ConfigError: The arm cannot do it; it was not asked.
        """
        self._ahead.check(request)
        if isinstance(request, Finish):
            self._patience = _ENDS_S
        with contextlib.suppress(OSError):
            self._requests.send(request)

    def reports(self) -> list[Report]:
        """Return what was reported since the last call; never waits.

        A process that says nothing for too long, as one that is frozen, is killed; that is then its last report.
        """
        found: list[Report] = []
        try:
            while not self._over and self.connection.poll():
                report = self.connection.recv()
                self._silence = 0.0
                if isinstance(report, Said):
                    self._say(report.text)
                    continue
                if isinstance(report, Ready) and self._patience == _BEGINS_S:
                    self._patience = _SILENT_S
                found.append(report)
                self._over = isinstance(report, Ended | Halted)
        except (EOFError, OSError):
            found.append(self._lost("has ended without a word"))
        self._take_lines()
        if not self._over and self._is_silent():
            self.kill()
            found.append(self._lost(f"has said nothing for {self._patience:g} s and was ended"))
        return found

    def kill(self) -> None:
        """End the process at once, whatever it does; it then keeps nothing of what the arm did, and reports nothing."""
        self._over = True
        self._process.kill()
        # One that waits for a broken device cannot even be killed.
        self._process.join(_LAST_S)

    def _is_silent(self) -> bool:
        now = seconds()
        self._silence += min(now - self._looked, _LOOK_S)
        self._looked = now
        return self._silence > self._patience

    def _lost(self, what: str) -> Halted:
        self._over = True
        return Halted(
            f"the process that drives the arm {what}: the arm's own watchdog stops it", _LOST, False, seconds()
        )

    def close(self) -> None:
        """Ask for nothing more, which stops an arm that still moves, and wait until what it did is kept."""
        self._requests.close()
        until = seconds() + _KEEPS_S
        while self._process.is_alive() and seconds() < until:
            # What nobody takes would hold up the last report.
            self._take_words()
            self._process.join(0.05)
        if self._process.is_alive():
            self.kill()
        self._take_words()
        self._take_lines()
        self.connection.close()
        self._lines.close()

    def _take_lines(self) -> None:
        for line in self._lines.take():
            self._say(f"arm: {line}\n")

    def _take_words(self) -> None:
        """Say what is left to be said; what else was reported comes too late."""
        with contextlib.suppress(EOFError, OSError):
            while self.connection.poll():
                if isinstance(report := self.connection.recv(), Said):
                    self._say(report.text)


def _main(settings: ArmSettings, requests: Connection, reports: Connection, lines: Connection, asker: int) -> None:
    pass_on(lines)
    for number in _NOT_OURS:
        signal.signal(number, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _NOT_OURS)
    inbox, outbox = _Inbox(requests, asker), _Outbox(reports)
    with contextlib.suppress(KeyboardInterrupt), interrupts.whole():
        interrupts.once(lambda: None)
        arm_side.run(settings, outbox.put, inbox.take, gone=lambda: inbox.gone, say=outbox.say)
    outbox.end()


class _Inbox:
    """Takes requests from a pipe in a thread; it also sees the end of the pipe, or of the process that asks."""

    def __init__(self, requests: Connection, asker: int) -> None:
        self.gone = ""
        self._requests, self._asker = requests, asker
        self._taken: deque[Request] = deque()
        threading.Thread(target=self._read, name="requests", daemon=True).start()

    def take(self, now: float) -> Request | None:
        """Return the next request, none where none has come."""
        return self._taken.popleft() if self._taken else None

    def _read(self) -> None:
        # On a busy machine the end of the other process must be seen as soon as packets are.
        WallClock().raise_priority()
        try:
            while not at_its_end(self._asker):
                if self._requests.poll(_LOOK_FOR_END_S):
                    self._taken.append(self._requests.recv())
        except (EOFError, OSError):
            pass
        self.gone = "the experiment that asks for the motions has ended"


class _Outbox:
    """Sends reports in a thread: a pipe that nobody reads must not hold up the arm."""

    def __init__(self, reports: Connection) -> None:
        self._reports = reports
        self._waiting: queue.SimpleQueue[Report | Said | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._write, name="reports", daemon=True)
        self._thread.start()

    def put(self, report: Report) -> None:
        """Let a report be sent; return at once."""
        if not isinstance(report, Health) or self._waiting.qsize() < _WAITING:
            self._waiting.put(report)

    def say(self, text: str) -> None:
        """Let something be said; return at once."""
        self._waiting.put(Said(text))

    def end(self) -> None:
        """Wait for the last report to be sent, but not for ever."""
        self._waiting.put(None)
        self._thread.join(_LAST_S)

    def _write(self) -> None:
        WallClock().raise_priority()
        while (report := self._waiting.get()) is not None:
            try:
                self._reports.send(report)
            except OSError:
                # Nobody is left on the other side; whoever sits at the terminal must know of the arm all the same.
                if isinstance(report, Said):
                    on_stderr(report.text)
