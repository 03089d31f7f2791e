"""An arm for one session, as its options name it: locked against a second session, and driven before other work."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from hrcneuro.arms.connection import Connection

if TYPE_CHECKING:
    from hrcneuro.robot.backend import Backend, Clock
    from hrcneuro.robot.workspace import Workspace


def held_arm(
    connection: Connection,
    workspace: Workspace,
    stack: contextlib.ExitStack,
    *,
    max_delay: float,
    real_time: bool = True,
) -> tuple[Backend, Clock]:
    """Return an arm that stands still, and the clock of its loop, which should begin at once.

    Args:
        connection: Which arm.
        workspace: Where ``sim`` stands: at home.
        stack: Takes back the priority of this thread, and lets a next session have the arm.
        max_delay: The longest time there and back, seconds, for "ur" and "ursim".
        real_time: Whether ``sim`` moves in the machine's time; else in a virtual one, as fast as it is computed.

    Raises:
        HardwareError: Another session drives the arm, or it is not there, not ready, or answers too slowly.
    """
    if connection.backend == "sim":
        from hrcneuro.robot.sim import SimArm, VirtualClock

        if not real_time:
            virtual = VirtualClock()
            return SimArm(virtual, workspace.home().tolist()), virtual

        from hrcneuro.arms.clock import WallClock

        wall = WallClock()
        wall.raise_priority()
        stack.callback(wall.restore_priority)
        arm = SimArm(wall, workspace.home().tolist())
        arm.align()
        return arm, wall

    from hrcneuro.arms import connect
    from hrcneuro.arms.lock import exclusive

    if connection.there_once:
        stack.enter_context(exclusive(connection.backend, connection.host))
    other, clock = connect(connection.backend, host=connection.host, driver=connection.driver, max_delay=max_delay)
    stack.callback(clock.restore_priority)
    return other, clock
