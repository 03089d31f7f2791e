"""An arm behind ROS Noetic: JointState in, joint velocities out; ``rospy`` comes with ROS, not with pip.

Topics are those of UR's ROS driver with a velocity controller. ROS tells nothing of the arm's safety state here, so
the node that takes the velocities must itself stop when they cease; packets that do not come stop the session.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from hrcneuro.errors import HardwareError
from hrcneuro.robot.backend import State
from hrcneuro.robot.backends.clock import WallClock

JOINTS = (
    "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"
)  # fmt: skip


class RosArm:
    """A backend; connecting publishes nothing."""

    def __init__(
        self, clock: WallClock, *, states: str = "/joint_states", command: str = "/joint_group_vel_controller/command"
    ) -> None:
        """Join the ROS network, and wait for the arm's first joint state.

        Raises:
            HardwareError: ROS is not installed, has no master, or no arm publishes.
        """
        try:
            rospy, sensors, basics = map(import_module, ("rospy", "sensor_msgs.msg", "std_msgs.msg"))
        except ImportError:
            raise HardwareError(
                "ROS Noetic's rospy is not installed for this Python",
                cure="install ros-core and python3-rospy (Debian), and run hrcneuro with that Python",
            ) from None
        self._clock = clock
        self._packet: State | None = None
        self._message: Any = basics.Float64MultiArray
        try:
            rospy.init_node("hrcneuro", anonymous=True, disable_signals=True)
            self._publisher: Any = rospy.Publisher(command, basics.Float64MultiArray, queue_size=1)
            self._subscriber: Any = rospy.Subscriber(
                states, sensors.JointState, self._take, queue_size=1, tcp_nodelay=True
            )
        except rospy.ROSException as error:
            raise HardwareError(f"ROS is not there: {error}", cure="start roscore, and set ROS_MASTER_URI") from None
        until = clock.now() + 2.0
        while self._packet is None and clock.now() < until:
            clock.wait_until(clock.now() + 0.01)
        if self._packet is None:
            raise HardwareError(f"no arm publishes on {states}", cure="start the arm's ROS driver")

    def align(self) -> None:
        """Do nothing: topics have no phase."""

    def state(self) -> State:
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
        self._subscriber.unregister()
        self._publisher.unregister()

    def _take(self, message: Any) -> None:
        place = {name: i for i, name in enumerate(message.name)}
        if all(joint in place for joint in JOINTS):
            order = [place[joint] for joint in JOINTS]
            self._packet = State(
                self._clock.now(), [message.position[i] for i in order], [message.velocity[i] for i in order]
            )
