"""A simulated UR10 CB3 controller that speaks UR's own protocols; it knows nothing of the study.

``geometry`` and ``motion`` move the arm, ``controller`` holds PolyScope's states and runs one cycle, ``urscript``
interprets programs, ``dashboard``, ``rtde`` and ``streams`` are the protocols as bytes in and bytes out, ``server``
gives them sockets and a clock. SI units and radians; poses are x, y, z and a rotation vector, in UR's ``base``.
"""

SOFTWARE = "3.9.1.64192"
"""The version that the controller says it is, where nothing else is asked for."""
