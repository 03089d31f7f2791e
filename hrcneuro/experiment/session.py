"""A session put together: what is drawn for the subject, what is left of it, its log, and its flow."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from hrcneuro.errors import ConfigError
from hrcneuro.experiment import messages as m
from hrcneuro.experiment import opening
from hrcneuro.experiment.ahead import Ahead
from hrcneuro.experiment.closed import ClosedTurns, Policies
from hrcneuro.experiment.flow import Flow
from hrcneuro.experiment.flow_log import FlowLog
from hrcneuro.experiment.log import Log
from hrcneuro.experiment.parameters import ExperimentOptions
from hrcneuro.experiment.person import SimulatedPerson
from hrcneuro.experiment.ports import Pacing
from hrcneuro.experiment.turns import Turns
from hrcneuro.paradigm.closed import draw_closed
from hrcneuro.paradigm.params import SessionParams, TimingParams
from hrcneuro.paradigm.partners import Human
from hrcneuro.paradigm.session import DrawnBlock, draw_session, protocol
from hrcneuro.sources.simulated import generator


@dataclass(frozen=True)
class Setup:
    """What a session is run with.

    Attributes:
        subject: Whose session.
        options: How it is run.
        session, timing: Protocol; how long motions take.
        seed: Of everything that is drawn; each subject draws its own from it.
        robot: The robot stage's options.
        folder: Where recordings are kept.
    """

    subject: str
    options: ExperimentOptions
    session: SessionParams
    timing: TimingParams
    seed: int
    robot: Any
    folder: Path

    @property
    def real_time(self) -> bool:
        """Whether it runs on the machine's clock."""
        return self.options.pace == "real"

    @property
    def closed(self) -> bool:
        """Whether the robot draws from a policy who acts."""
        return self.options.loop == "closed"

    @property
    def within(self) -> str:
        """Where, below the subject's folder, the session lies: a session of closed blocks beside that of the study."""
        return "closed" if self.closed else ""

    @property
    def place(self) -> Path:
        """The folder of the session's log."""
        return self.folder / self.subject / self.within

    @property
    def n_blocks(self) -> int:
        """How many blocks it has."""
        return self.options.closed.blocks if self.closed else len(list(protocol(self.session)))

    @property
    def simulated(self) -> bool:
        """Whether nobody presses the keys."""
        return self.options.human == "simulated"

    @property
    def arm(self) -> Any:
        """The robot stage's options, with what the experiment says of markers; a drawn tool moves as ``sim`` does."""
        lsl = self.options.markers if self.real_time else "none"
        backend = "sim" if self.options.drawn_tool or not self.real_time else self.robot.backend
        return replace(self.robot, backend=backend, markers=lsl, truth=self.options.truth and self.real_time)

    @property
    def draws_tool(self) -> bool:
        """Whether the tool is drawn on the grid: no arm stands over it."""
        return not self.arm.there_once


def check(setup: Setup) -> None:
    """Refuse what contradicts itself only together.

    Raises:
        ConfigError: The pace does not suit the arm.
    """
    if not setup.real_time and not setup.options.drawn_tool and setup.robot.backend != "sim":
        raise ConfigError(
            f"experiment.pace = 'virtual' with robot.backend = {setup.robot.backend!r}; allowed: sim, which alone has "
            "a virtual clock",
            cure="leave --backend out, or run in real time: --pace real",
        )
    if setup.closed and setup.options.markers == "none":
        raise ConfigError(
            "experiment.loop = 'closed' with experiment.markers = 'none': the loop hears of moves by their markers; "
            "allowed: lsl",
            cure="leave --no-lsl out",
        )
    if not setup.draws_tool and setup.options.screen and setup.options.window.scale != 1.0:
        raise ConfigError(
            f"experiment.window.scale = {setup.options.window.scale:g} with the arm {setup.arm.backend!r}, whose tiles "
            "have the grid's true size; allowed: 1",
            cure="show the grid at true size: experiment.window.scale = 1",
        )
    if not setup.draws_tool and setup.options.screen and setup.options.window.windowed:
        raise ConfigError(
            f"experiment.window.windowed = true with the arm {setup.arm.backend!r}, whose tiles lie where the "
            "full screen has its grid; allowed: false",
            cure="leave --windowed out: the grid then lies in the middle of the screen",
        )


def looked_ahead(setup: Setup) -> Ahead:
    """Return what checks each request to the arm, once it has tried the whole grid; it serves any subject's session.

    Raises:
        ConfigError: The pace does not suit the arm, or the arm cannot work in the cell.
    """
    check(setup)
    return Ahead(setup.arm, shortest_s=setup.timing.t_f_min_s)


def refuse(setup: Setup, *, resume: bool) -> None:
    """Refuse a session that cannot be begun, or gone on with, before a window or an arm is touched for it.

    Raises:
        ConfigError, DataError, HardwareError, StageError: As :mod:`hrcneuro.experiment.opening` says.
    """
    opening.refuse(
        setup.folder, setup.subject, within=setup.within, options=_deciding(setup), simulated=setup.simulated,
        resume=resume,
    )  # fmt: skip


@dataclass
class Running:
    """A session that runs: its flow, and the log that it writes."""

    flow: Flow
    log: Log


@contextlib.contextmanager
def opened(
    setup: Setup,
    *,
    resume: bool,
    now: Callable[[], float],
    arm: Callable[[m.Request], None],
    restart: Callable[[], None],
    show: Callable[[m.Scene], None],
    policies: Policies | None = None,
    about: Mapping[str, Any] | None = None,
) -> Iterator[Running]:
    """Open the log of a session, and hand over its flow; leaving it closes the log.

    Args:
        setup: What it is run with.
        resume: It goes on behind the block that was broken off.
        now: The clock of all times, seconds.
        arm, restart, show: As :class:`~hrcneuro.experiment.flow.Flow` takes them.
        policies: What the closed loop says; needed for closed blocks.
        about: What else is worth knowing, as JSON values; it goes into the log.

    Raises:
        ConfigError, DataError, HardwareError, StageError: The log cannot be begun, or gone on with.
    """
    human, blocks = _drawn(setup)
    begin = opening.resume if resume else opening.begin
    with begin(
        setup.folder, setup.subject, within=setup.within, options=_deciding(setup),
        about={**_about(setup), **(about or {})},
        simulated=setup.simulated, real_time=setup.real_time, now=now,
    ) as log:  # fmt: skip
        left = [drawn for drawn in blocks if not log.progress.done(drawn.block)]
        person = SimulatedPerson(human, setup.timing) if setup.simulated else None
        shape: dict[str, Any] = {
            "n_blocks": len(left), "n_moves": log.counters.moves, "person": person, "truth": setup.options.truth,
            "code": setup.robot.trigger.move_code,
        }  # fmt: skip
        if setup.closed:
            assert policies is not None
            turns: Turns = ClosedTurns(
                setup.subject, setup.timing, policies=policies, wait_s=setup.options.closed.wait_s, **shape
            )
        else:
            turns = Turns(setup.subject, setup.timing, **shape)
        kept = FlowLog(log, each_move=setup.real_time)
        flow = Flow(left, turns, _pacing(setup), arm=arm, restart=restart, show=show, log=kept)
        kept.trouble = flow.trouble
        if policies is not None:
            policies.note = lambda kind, about: flow.took_up(kind, now(), about)
        yield Running(flow, log)
        if policies is not None:
            flow.seen.refused = sum(policies.refused.values())
        log.close(complete=flow.seen.whole, why="" if flow.seen.whole else flow.seen.ended or "ended early")


def _drawn(setup: Setup) -> tuple[Human, Sequence[DrawnBlock]]:
    """Return a simulated person's habits, the same in both kinds of session, and the blocks."""
    human, blocks = draw_session(setup.session, rng=generator(setup.seed, setup.subject, "moves"))
    if not setup.closed:
        return human, blocks
    return human, draw_closed(setup.options.closed, rng=generator(setup.seed, setup.subject, "closed moves"))


def lasts_s(setup: Setup) -> float:
    """Return about how long a session lasts, seconds: for the room on the disk."""
    closed = setup.options.closed
    episodes = (
        closed.blocks * closed.episodes_per_block
        if setup.closed
        else sum(block.episodes for block in protocol(setup.session))
    )
    waits = 3.0 * closed.wait_s if setup.closed else 0.0
    return 120.0 + episodes * (waits + 13.8 * 0.95 + setup.options.pause_s + 4.0) + 60.0 * (setup.n_blocks + 2)


def _pacing(setup: Setup) -> Pacing:
    options = setup.options
    return Pacing(
        path_after_s=options.path_after_s,
        pause_s=options.pause_s,
        break_s=options.break_s,
        show_turn=options.window.show_turn,
        draw_tool=setup.draws_tool,
        # At virtual pace only a rehearsal's parts are there to hear them.
        marks=setup.options.markers == "lsl" and (setup.real_time or setup.options.truth),
    )


def _deciding(setup: Setup) -> dict[str, Any]:
    if setup.closed:
        habits = {name: getattr(setup.session, name) for name in ("wrong_key_rate", "undo_rate")}
        closed = asdict(setup.options.closed)
        return {"seed": setup.seed, "closed": closed, "session": habits, "timing": asdict(setup.timing)}
    return {"seed": setup.seed, "session": asdict(setup.session), "timing": asdict(setup.timing)}


def _about(setup: Setup) -> dict[str, Any]:
    return {"hrcneuro": version("hrcneuro"), "pace": setup.options.pace, "arm": setup.arm.backend}
