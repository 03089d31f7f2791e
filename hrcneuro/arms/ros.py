"""An arm behind ROS Noetic: JointState in, joint velocities out; ``rospy`` comes with ROS, not with pip.

Topics are those of UR's ROS driver with a velocity controller. They tell whether the arm's program runs, which a
protective or emergency stop ends, but not why. The node that takes the velocities must itself stop when they cease.
"""

from __future__ import annotations

import socket
from importlib import import_module
from typing import Any

from hrcneuro.arms.clock import Stamps, WallClock
from hrcneuro.errors import HardwareError
from hrcneuro.robot.backend import PLAYING, STOPPED, Packet

JOINTS = (
    "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"
)  # fmt: skip
_PATIENCE = 2.0  # s, for what must be there


class RosArm:
    """A backend; connecting publishes nothing."""

    def __init__(
        self,
        clock: WallClock,
        *,
        states: str = "/joint_states",
        command: str = "/joint_group_vel_controller/command",
        running: str = "/ur_hardware_interface/robot_program_running",
    ) -> None:
        """Join the ROS network, and wait for the arm's first joint state and for its controller.

        Raises:
            HardwareError: ROS is not installed or has no master, no arm publishes, or nothing takes its commands.
        """
        rospy, sensors, basics = _library()
        self._clock, self._stamps = clock, Stamps()
        self._packet: Packet | None = None
        self._runtime, self._lacks = PLAYING, ""
        self._message: Any = basics.Float64MultiArray
        if not rospy.core.is_initialized():
            # A process joins once, however many sessions it drives.
            rospy.init_node("hrcneuro", anonymous=True, disable_signals=True)
        self._publisher: Any = rospy.Publisher(command, basics.Float64MultiArray, queue_size=1, tcp_nodelay=True)
        self._subscribers: list[Any] = [
            rospy.Subscriber(states, sensors.JointState, self._take, queue_size=1, tcp_nodelay=True),
            rospy.Subscriber(running, basics.Bool, self._program, queue_size=1, tcp_nodelay=True),
        ]
        until = clock.now() + _PATIENCE
        while (self._packet is None or not self._publisher.get_num_connections()) and clock.now() < until:
            clock.wait_until(clock.now() + 0.01)
        if self._packet is None:
            self.close()
            raise HardwareError(
                f"no arm publishes on {states}" + (f": {self._lacks}" if self._lacks else ""),
                cure="start the arm's ROS driver",
            )
        if not self._publisher.get_num_connections():
            self.close()
            raise HardwareError(
                f"nothing takes joint velocities from {command}", cure="start the driver's joint_group_vel_controller"
            )

    def align(self) -> None:
        """Return just after a joint state has come."""
        first, until = self._packet, self._clock.now() + 0.1
        while self._packet is first and self._clock.now() < until:
            self._clock.wait_until(self._clock.now() + 2e-4)
        self._clock.wait_until(self._clock.now() + 1e-3)

    def state(self) -> Packet:
        """Return the newest joint state."""
        assert self._packet is not None
        return self._packet

    def speed(self, qd: list[float]) -> None:
        """Publish joint velocities, six, rad/s."""
        self._publisher.publish(self._message(data=qd))

    def stop(self, deceleration: float) -> None:
        """Publish zeros; the controller behind the topic brakes as it is set to."""
        self.speed([0.0] * 6)

    def close(self) -> None:
        """Leave the topics."""
        for subscriber in self._subscribers:
            subscriber.unregister()
        self._publisher.unregister()

    def _take(self, message: Any) -> None:
        # A gripper may publish on the same topic: only a message with all six joints is the arm's.
        place = {name: i for i, name in enumerate(message.name)}
        missing = [joint for joint in JOINTS if joint not in place]
        if missing or not len(message.position) == len(message.velocity) == len(message.name):
            self._lacks = f"messages there lack {missing[0] if missing else 'positions or velocities'}"
            return
        order = [place[joint] for joint in JOINTS]
        now, made = self._clock.now(), message.header.stamp.to_sec()
        self._packet = Packet(
            self._stamps.local(made, now) if made else now,
            [message.position[i] for i in order],
            [message.velocity[i] for i in order],
            runtime=self._runtime,
        )

    def _program(self, message: Any) -> None:
        self._runtime = PLAYING if message.data else STOPPED


def _library() -> tuple[Any, Any, Any]:
    try:
        rospy, sensors, basics = map(import_module, ("rospy", "sensor_msgs.msg", "std_msgs.msg"))
        master = import_module("rosgraph").get_master_uri()
    except ImportError as error:
        raise HardwareError(
            f"ROS Noetic is not there for this Python: {error}",
            cure="apt install ros-core python3-rospy python3-sensor-msgs, and let this Python find them (docs: robot)",
        ) from None
    # rospy itself waits for a master for ever.
    host, _, port = master.removeprefix("http://").strip("/").partition(":")
    try:
        socket.create_connection((host, int(port or 80)), _PATIENCE).close()
    except (OSError, ValueError) as error:
        raise HardwareError(
            f"no ROS master answers at {master}: {error}", cure="start roscore, or correct ROS_MASTER_URI"
        ) from None
    return rospy, sensors, basics
