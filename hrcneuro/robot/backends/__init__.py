"""Arms beyond this process: the package's only modules that open sockets and read a clock.

``ur`` drives a UR10 through ur_rtde, ``script`` through port 30003 as the paper did, ``ursim`` starts a simulated
controller and drives it as ``ur`` does, ``ros`` hands joint velocities to a ROS node. None moves on connecting.
"""
