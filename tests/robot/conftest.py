"""Factories: a cell, and a loop over the in-process arm."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from hrcneuro.robot.cell import Cell
from hrcneuro.robot.limits import Limits
from hrcneuro.robot.loop import Loop
from hrcneuro.robot.parameters import Safety
from hrcneuro.robot.safety import Supervisor
from hrcneuro.robot.sim import Disturbance, SimArm, VirtualClock
from hrcneuro.robot.tracking import ResolvedRate, Tracking
from hrcneuro.robot.workspace import DOWN, Workspace


@pytest.fixture(scope="session")
def workspace() -> Workspace:
    return Workspace(Cell())


@pytest.fixture
def make_loop(workspace: Workspace) -> Callable[..., Loop]:
    """Return a factory of a loop whose arm stands at ``start`` (default: over the grid's centre, at hover)."""

    def make(
        start=None, *, disturbances: tuple[Disturbance, ...] = (), lag: float = 0.015, lead: float = 0.027, **changes
    ) -> Loop:
        clock = changes.pop("clock", None) or VirtualClock()
        q = workspace.reach.q[3, 3] if start is None else start
        arm = changes.pop("arm", None) or SimArm(clock, list(q), disturbances=disturbances, lag=lag)
        tool = workspace.cell.tool
        parts = {
            "law": ResolvedRate(Tracking(), tool=tool, orientation=DOWN.tolist()),
            "limits": Limits(Safety(), box=workspace.box, tool=tool),
            "supervisor": Supervisor(Safety()),
            "stop": Safety().stop,
        }
        loop = Loop(arm, clock, **(parts | changes))
        loop.lead = lead
        return loop

    return make
