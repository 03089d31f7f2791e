"""A session at virtual pace: flow, arm and log in one process, on one virtual clock, as fast as they compute."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from hrcneuro import interrupts
from hrcneuro.errors import ConfigError, HardwareError
from hrcneuro.experiment import arm_side, session
from hrcneuro.experiment import messages as m
from hrcneuro.experiment.ahead import Ahead
from hrcneuro.experiment.closed import Policies
from hrcneuro.experiment.ports import Seen

Around = Callable[[float], None]
"""Is called in every cycle with the time, seconds: whoever else lives on this clock."""


class Virtual:
    """One session, from its first request to its last report."""

    def __init__(
        self,
        setup: session.Setup,
        *,
        policies: Policies | None = None,
        around: Around = lambda now: None,
        hear: Callable[[m.Request | m.Report], None] = lambda message: None,
        ahead: Ahead | None = None,
    ) -> None:
        """Prepare it.

        Args:
            setup: What it is run with; the person is simulated.
            policies: What the closed loop says, for closed blocks.
            around: Called in every cycle.
            hear: Is told every request and every report: what goes out over LSL in real time.
            ahead: Checks each request, and has tried the whole grid; none: it is made for this session.

        Raises:
            ConfigError: The arm cannot work in the cell.
        """
        if setup.closed and policies is None:
            raise ConfigError(
                "closed blocks at virtual pace, and nothing that decides beside them",
                cure=f"hrcneuro rehearse {setup.subject} --closed runs both; or --pace real, beside 'hrcneuro online'",
            )
        self._setup, self._policies, self._around, self._hear = setup, policies, around, hear
        self._ahead = ahead or session.looked_ahead(setup)
        self._ahead.restart()
        self._requests: deque[m.Request] = deque()
        self._now = 0.0
        self._running: session.Running

    def run(self, *, resume: bool = False) -> Seen:
        """Run it to its end, or, where a signal asks for that, to the next rest; return what was seen of it.

        Raises:
            HardwareError: The arm was stopped.
        """
        with interrupts.whole():
            # Nothing is cut in two: no line of the log, and no move.
            interrupts.once(lambda: None)
            interrupts.hold()
            seen = self._run(resume)
            interrupts.forget()
        return seen

    def _run(self, resume: bool) -> Seen:
        setup = self._setup
        with session.opened(
            setup,
            resume=resume,
            now=lambda: self._now,
            arm=self._send,
            restart=self._refuse,
            show=lambda scene: None,
            policies=self._policies,
        ) as self._running:
            settings = arm_side.ArmSettings(setup.arm, setup.subject, real_time=False)
            arm_side.run(settings, self._report, self._ask, ahead=self._ahead)
            seen = self._running.flow.seen
            if seen.stops:
                raise HardwareError(f"the arm was stopped: {seen.trouble}", cure=seen.cure)
        return seen

    def _send(self, request: m.Request) -> None:
        self._hear(request)
        self._requests.append(request)

    def _report(self, report: m.Report) -> None:
        self._now = report.when
        if not isinstance(report, m.Health):
            self._hear(report)
        self._running.flow.report(report)

    def _ask(self, now: float) -> m.Request | None:
        self._now = now
        if not self._requests:
            self._around(now)
            flow = self._running.flow
            if interrupts.asked() and not flow.seen.interrupted:
                flow.seen.interrupted = True
                flow.end(now, "interrupted")
            flow.tick(now)
        return self._requests.popleft() if self._requests else None

    def _refuse(self) -> None:
        raise ConfigError("an arm at virtual pace is not begun with anew", cure="run the session again")
