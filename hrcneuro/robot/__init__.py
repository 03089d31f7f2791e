"""The arm: workspace, kinematics, trajectories, the tracking law, limits, safety, and one 125 Hz loop over any backend.

Numbers only: a backend and a clock are handed in, and nothing here opens a file or reads the time. SI units and
radians; vectors of joints run from base to wrist 3; poses are in UR's frame ``base``.
"""
