"""The UR10's Denavit–Hartenberg parameters, base to wrist 3: lengths in metres, angles in radians.

Universal Robots, "DH parameters for calculations of kinematics and dynamics", UR10.
"""

from math import pi

D = (0.1273, 0.0, 0.0, 0.163941, 0.1157, 0.0922)
A = (0.0, -0.612, -0.5723, 0.0, 0.0, 0.0)
ALPHA = (pi / 2, 0.0, 0.0, pi / 2, -pi / 2, 0.0)
