"""A session put together: what is drawn for the subject, what is left of it, its log, and its flow."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from hrcneuro.errors import ConfigError
from hrcneuro.experiment import messages as m
from hrcneuro.experiment import opening
from hrcneuro.experiment.ahead import Ahead
from hrcneuro.experiment.flow import Flow
from hrcneuro.experiment.flow_log import FlowLog
from hrcneuro.experiment.log import Log
from hrcneuro.experiment.parameters import ExperimentOptions
from hrcneuro.experiment.person import SimulatedPerson
from hrcneuro.experiment.ports import Pacing
from hrcneuro.experiment.turns import Turns
from hrcneuro.paradigm.params import SessionParams, TimingParams
from hrcneuro.paradigm.session import draw_session, protocol
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
    opening.refuse(setup.folder, setup.subject, options=_deciding(setup), simulated=setup.simulated, resume=resume)


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
    about: Mapping[str, Any] | None = None,
) -> Iterator[Running]:
    """Open the log of a session, and hand over its flow; leaving it closes the log.

    Args:
        setup: What it is run with.
        resume: It goes on behind the block that was broken off.
        now: The clock of all times, seconds.
        arm, restart, show: As :class:`~hrcneuro.experiment.flow.Flow` takes them.
        about: What else is worth knowing, as JSON values; it goes into the log.

    Raises:
        ConfigError, DataError, HardwareError, StageError: The log cannot be begun, or gone on with.
    """
    human, blocks = draw_session(setup.session, rng=generator(setup.seed, setup.subject, "moves"))
    begin = opening.resume if resume else opening.begin
    with begin(
        setup.folder, setup.subject, options=_deciding(setup), about={**_about(setup), **(about or {})},
        simulated=setup.simulated, real_time=setup.real_time, now=now,
    ) as log:  # fmt: skip
        left = [drawn for drawn in blocks if not log.progress.done(drawn.block)]
        person = SimulatedPerson(human, setup.timing) if setup.simulated else None
        turns = Turns(
            setup.subject, setup.timing, n_blocks=len(left), n_moves=log.counters.moves, person=person,
            truth=setup.options.truth, code=setup.robot.trigger.move_code,
        )  # fmt: skip
        kept = FlowLog(log, each_move=setup.real_time)
        flow = Flow(left, turns, _pacing(setup), arm=arm, restart=restart, show=show, log=kept)
        kept.trouble = flow.trouble
        yield Running(flow, log)
        log.close(complete=flow.seen.whole, why="" if flow.seen.whole else flow.seen.ended or "ended early")


def lasts_s(setup: Setup) -> float:
    """Return about how long a session lasts, seconds: for the room on the disk."""
    episodes = sum(block.episodes for block in protocol(setup.session))
    return 120.0 + episodes * (13.8 * 0.95 + setup.options.pause_s + 4.0) + 60.0 * (setup.session.blocks + 2)


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
    return {"seed": setup.seed, "session": asdict(setup.session), "timing": asdict(setup.timing)}


def _about(setup: Setup) -> dict[str, Any]:
    return {"hrcneuro": version("hrcneuro"), "pace": setup.options.pace, "arm": setup.arm.backend}
