"""A ROS node that plays the arm: joint velocities in, joint states out at 125 Hz. A script, run beside the tests.

It is our in-process arm on the machine's clock, behind the topics of UR's ROS driver with a velocity controller.
``ros_arm.py ANGLES [FAULT]`` takes six joint angles, radians, comma-separated; after 40 commands that move it, FAULT
``program`` ends the arm's program and ``death`` the node. It prints the greatest joint speed when it is told to end.
"""

import os
import sys

import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Float64MultiArray

from hrcneuro.arms.clock import WallClock
from hrcneuro.robot.backend import PERIOD
from hrcneuro.robot.sim import SimArm

# UR's driver lists them by the alphabet, and a gripper's joint may stand among them.
NAMES = ["elbow_joint", "finger_joint", "shoulder_lift_joint", "shoulder_pan_joint",
         "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]  # fmt: skip
PLACES = (2, None, 1, 0, 3, 4, 5)


def main(angles: str, fault: str = "") -> None:
    clock = WallClock()
    clock.raise_priority()
    arm = SimArm(clock, [float(v) for v in angles.split(",")])
    rospy.init_node("arm")
    states = rospy.Publisher("/joint_states", JointState, queue_size=1, tcp_nodelay=True)
    running = rospy.Publisher("/ur_hardware_interface/robot_program_running", Bool, queue_size=1, latch=True)
    running.publish(True)
    moved = 0

    def take(message: Float64MultiArray) -> None:
        nonlocal moved
        arm.speed(list(message.data))
        moved += any(message.data)
        if fault == "program" and moved == 40:
            running.publish(False)
        if fault == "death" and moved == 40:
            os._exit(0)

    rospy.Subscriber("/joint_group_vel_controller/command", Float64MultiArray, take, queue_size=1, tcp_nodelay=True)
    due = clock.now()
    while not rospy.is_shutdown():
        due += PERIOD
        clock.wait_until(due)
        state = arm.state()
        message = JointState(name=NAMES)
        message.header.stamp = rospy.Time.now()
        message.position = [0.0 if i is None else state.q[i] for i in PLACES]
        message.velocity = [0.0 if i is None else state.qd[i] for i in PLACES]
        states.publish(message)
    print(max(map(abs, arm.state().qd)))


if __name__ == "__main__":
    main(*sys.argv[1:])
