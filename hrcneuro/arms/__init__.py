"""Arms beyond this process: the package's only modules that open sockets and read a clock.

``ur`` drives a UR10 through ur_rtde, ``script`` through port 30003 as the paper did, ``ursim`` starts a simulated
controller and drives it as ``ur`` does, ``ros`` hands joint velocities to a ROS node. None moves on connecting.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hrcneuro.arms.clock import WallClock
    from hrcneuro.arms.ros import RosArm
    from hrcneuro.arms.script import ScriptArm
    from hrcneuro.arms.ur import UrArm
    from hrcneuro.arms.ursim import UrSim
    from hrcneuro.robot.backend import Backend


def connect(backend: str, *, host: str = "", driver: str = "rtde", max_delay: float = 0.2) -> tuple[Backend, WallClock]:
    """Return an arm that stands still, and the clock of its loop, which should begin at once.

    From here on this thread runs before the machine's other work, until the clock's ``restore_priority``.

    Args:
        backend: "ur", "ursim" or "ros".
        host: Address of the controller, for "ur".
        driver: "rtde" or "script", for "ur" and "ursim".
        max_delay: The longest time there and back, seconds, for "ur" and "ursim".

    Raises:
        HardwareError: The arm is not there, not ready, answers too slowly, or what drives it is not installed.
    """
    from hrcneuro.arms.clock import WallClock

    clock = WallClock()
    clock.raise_priority()
    try:
        arm = _arm(backend, host, driver, clock, max_delay)
        arm.align()
    except BaseException:
        clock.restore_priority()
        raise
    return arm, clock


def _arm(
    backend: str, host: str, driver: str, clock: WallClock, max_delay: float
) -> RosArm | ScriptArm | UrArm | UrSim:
    if backend == "ros":
        from hrcneuro.arms.ros import RosArm

        return RosArm(clock)

    from hrcneuro.arms.script import ScriptArm
    from hrcneuro.arms.ur import UrArm
    from hrcneuro.arms.ursim import UrSim

    def drive(address: str) -> ScriptArm | UrArm:
        arm = ScriptArm if driver == "script" else UrArm
        return arm(address, clock, max_delay=max_delay)

    return UrSim(drive) if backend == "ursim" else drive(host)
