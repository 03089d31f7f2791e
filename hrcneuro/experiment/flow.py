"""The flow of a session: what happens, pauses and trouble; it knows no clock, no file and no window.

Whoever runs it hands in what happened, each with its time, and carries away what the arm, the window and the log are to
take. The next move of the robot, and of a simulated person, is decided at the onset of the one before, and goes to the
arm when the tool comes within its radius, so that the arm never waits for this process.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from hrcneuro.experiment import messages as m
from hrcneuro.experiment import scenes
from hrcneuro.experiment.course import Course
from hrcneuro.experiment.ports import Order
from hrcneuro.paradigm import markers

ESCAPE_TWICE_S = 2.0


class Flow(Course):
    """A session under way; the attributes are those of :class:`~hrcneuro.experiment.course.Course`."""

    # --- what happens ---------------------------------------------------------------------------------------------

    def tick(self, now: float) -> None:
        """Let what was waited for happen, if its time has come."""
        if self.wakes is not None and now >= self.wakes:
            then, self.wakes, self._then = self._then, None, None
            if then is not None:
                then(now)
        if self._wrong is not None:
            (problem, cure), self._wrong = self._wrong, None
            self.pause(now, problem)
            self.seen.trouble, self.seen.cure = problem, cure

    def report(self, report: m.Report) -> None:
        """Take what the arm's side says."""
        if isinstance(report, m.Health):
            self.seen.health = report
        elif isinstance(report, m.Ready):
            self._log.event("arm ready", report.when, lead_s=round(report.lead, 5))
            self._gone, self._resting = False, True
            self._gate(report.when, self._approached)
        elif isinstance(report, m.Arrived):
            self._resting = True
            self._gate(report.when, self._approached)
        elif isinstance(report, m.Onset):
            self._onset(report)
        elif isinstance(report, m.InRadius):
            self._turns.in_radius(report)
            if not (self._ending or self._turns.done):
                self._unoffered = self._pause is not None
                if not self._unoffered:
                    self._offer(report.when)
        elif isinstance(report, m.Executed):
            self._executed(report)
        elif isinstance(report, m.Trouble):
            self.seen.hardware = True
            self._log.event("trouble", report.when, problem=report.problem, cure=report.cure)
            self.trouble(report.problem, report.cure)
        elif isinstance(report, m.Halted):
            self._halted(report)
        elif isinstance(report, m.Ended):
            self.over = True

    def key(self, key: m.Key) -> None:
        """Take a key of the person's."""
        if key.name == "escape":
            if key.when - self._escaped <= ESCAPE_TWICE_S:
                self.end(key.when, "Esc was pressed twice")
            self._escaped = key.when
        elif key.name in ("N", "E", "S", "W"):
            if self._read is not None:
                if key.when >= self._read_from:
                    self._go_on(key.when)
                return
            ignored = self._turns.key(key)
            self.seen.keys[ignored] += 1
            self._log.key(key.name, ignored, key.when)
            self._mark(markers.of_key(self._turns.subject, key.name, ignored.replace(" ", "_")), key.when)
            if not ignored:
                self._release(key.when)

    def order(self, order: Order, now: float) -> None:
        """Take what the experimenter asks for."""
        if order is Order.END:
            self.end(now, "the experimenter ended it")
        elif order is Order.PAUSE:
            self.pause(now, "")
        elif self._gone:
            self._again(now)
        elif self._held is not None:
            self._log.event("goes on", now)
            held, self._held, self._pause = self._held, None, None
            self._forget_trouble()
            held(now)
        elif self._pause is not None:
            # Nothing was held yet: the arm goes on as if nobody had asked.
            self._log.event("goes on", now)
            self._pause = None
            self._forget_trouble()
            if self._unoffered:
                self._unoffered = False
                self._offer(now)
        elif self._read is not None:
            self._go_on(now)

    def remark(self, text: str, now: float) -> None:
        """Write down what the experimenter remarks."""
        self._log.event("remark", now, text=text)

    def took_up(self, kind: str, now: float, about: Mapping[str, Any]) -> None:
        """Write down what was taken up of the closed loop's words, or was not."""
        self._log.event(kind, now, **about)
        self.seen.loop = about.get("mode", self.seen.loop)
        if about.get("marker"):
            self.seen.unheard = 0

    def pause(self, now: float, why: str) -> None:
        """Pause as soon as the arm rests; ``why`` is empty where the experimenter asked for it."""
        if self._pause is not None or self._gone or self._ending:
            return
        self._pause = why
        self.seen.trouble, self.seen.asked = why, "a pause is asked for"
        self._log.event("pause", now, why=why)
        if self._resting and self._read is None and self._held is None:
            then = self._path_appears if self.seen.phase == "moves" else self._then
            self.wakes = self._then = None
            self._turns.close()
            self._hold(then or self._path_appears)

    def trouble(self, problem: str, cure: str) -> None:
        """Pause, with the next :meth:`tick`, for something that a person must mend; what is being done is not cut."""
        self._wrong = problem, cure

    def end(self, now: float, why: str, *, wanted: bool = True) -> None:
        """End the session as soon as the arm rests; ``wanted``: a person asked for it."""
        if self._ending:
            return
        self._ending = True
        self.seen.ended, self.seen.wanted = why, wanted
        self.seen.asked = "the end is asked for"
        self._log.event("ends early", now, why=why)
        if self._gone:
            self._finished()
        elif self._resting:
            self._finish(now)

    # --- pauses, trouble, the end ---------------------------------------------------------------------------------

    def _hold(self, then: Callable[[float], None]) -> None:
        self.seen.phase, self.seen.asked = "pause", ""
        self._unoffered = False
        # After a pause among moves the path appears anew, and the person has time to see it.
        self._held = then
        self._show(scenes.pause(self._pause or ""))

    def _halted(self, report: m.Halted) -> None:
        self.seen.stops += 1
        self.seen.phase, self.seen.trouble, self.seen.cure = "the arm was stopped", report.problem, report.cure
        self.seen.asked, self.seen.hardware = "", True
        self._log.event("arm stopped", report.when, problem=report.problem, cure=report.cure, rests=report.rests)
        self._gone, self._resting, self._pause, self._held = True, False, None, None
        self._unoffered = False
        self.wakes = self._then = self._read = None
        self._turns.close()
        if self._ending or self.seen.whole:
            self._finished()
        else:
            self._show(scenes.trouble("The robot was stopped."))

    def _again(self, now: float) -> None:
        """Begin with the arm anew; a move that was under way is made again, from its start tile."""
        self._log.event("goes on", now)
        self._forget_trouble()
        self._gone, self._approached = False, self._afresh
        self._show(scenes.welcome())
        self._restart()

    def _forget_trouble(self) -> None:
        self.seen.trouble = self.seen.cure = self.seen.asked = ""
        self.seen.hardware = False

    def _finish(self, now: float) -> None:
        self._turns.close()
        self.wakes = self._then = self._read = None
        self.seen.phase, self.seen.asked = "the end", ""
        self._show(scenes.end() if self.seen.whole else scenes.ended_early())
        self._ending = True
        self._resting = False
        self._mark(markers.of_end(self._turns.subject), now)
        self._arm(m.Finish())

    def _finished(self) -> None:
        self._show(scenes.end() if self.seen.whole else scenes.ended_early())
        self.over = True
