"""The loop of a session with all its parts, as its options have them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hrcneuro.robot.backend import Backend, Clock
from hrcneuro.robot.cycle import OnStop
from hrcneuro.robot.limits import Limits
from hrcneuro.robot.loop import Loop
from hrcneuro.robot.parameters import Safety
from hrcneuro.robot.rehearsal import MakeLoop
from hrcneuro.robot.safety import Supervisor
from hrcneuro.robot.tracking import ResolvedRate, Tracking
from hrcneuro.robot.workspace import DOWN, Workspace


def make_loop(
    arm: Backend,
    clock: Clock,
    workspace: Workspace,
    *,
    tracking: Tracking,
    safety: Safety,
    keeper: Callable[[], str] = str,
    **told: Any,
) -> Loop:
    """Return a loop that begins now.

    Args:
        arm: At rest.
        clock: The loop's.
        workspace: Its box and its tool bound what the loop commands.
        tracking: Of the law.
        safety: What bounds and stops the arm.
        keeper: Says why the session cannot be written down any more; an empty text while it can.
        told: Who is told of what, as :class:`hrcneuro.robot.cycle.Cycle` has it.
    """
    tool = workspace.cell.tool
    return Loop(
        arm,
        clock,
        law=ResolvedRate(tracking, tool=tool, orientation=DOWN.tolist()),
        limits=Limits(safety, box=workspace.box, tool=tool),
        supervisor=Supervisor(safety, keeper=keeper),
        stop=safety.stop,
        **told,
    )


def rehearsing(workspace: Workspace, *, tracking: Tracking, safety: Safety) -> MakeLoop:
    """Return what makes the session's own loop over a simulated arm, for a rehearsal."""

    def make(arm: Backend, clock: Clock, on_stop: OnStop) -> Loop:
        return make_loop(arm, clock, workspace, tracking=tracking, safety=safety, on_stop=on_stop)

    return make
