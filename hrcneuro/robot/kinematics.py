"""UR10 (CB3) kinematics in plain NumPy, for whole sets of configurations: the reference of the fast scalar form.

Frame ``base`` is the controller's own (denavit-hartenberg's frame 0); ROS' ``base_link`` is turned by π about z.
"""

from __future__ import annotations

import numpy as np

from hrcneuro.robot.dh import ALPHA, A, D


class Unreachable(ValueError):
    """No configuration near the seed brings the tool to the pose."""


def frames(q: np.ndarray) -> np.ndarray:
    """Return the frames 0 … 6 in ``base``, shape (..., 7, 4, 4), from joint angles ``q``, shape (..., 6), radians."""
    q = np.asarray(q, float)
    chain = np.empty((*q.shape[:-1], 7, 4, 4))
    chain[..., 0, :, :] = np.eye(4)
    for i in range(6):
        c, s = np.cos(q[..., i]), np.sin(q[..., i])
        ca, sa = np.cos(ALPHA[i]), np.sin(ALPHA[i])
        link = np.zeros((*q.shape[:-1], 4, 4))
        link[..., 0, 0], link[..., 0, 1], link[..., 0, 2], link[..., 0, 3] = c, -s * ca, s * sa, A[i] * c
        link[..., 1, 0], link[..., 1, 1], link[..., 1, 2], link[..., 1, 3] = s, c * ca, -c * sa, A[i] * s
        link[..., 2, 1], link[..., 2, 2], link[..., 2, 3] = sa, ca, D[i]
        link[..., 3, 3] = 1.0
        chain[..., i + 1, :, :] = chain[..., i, :, :] @ link
    return chain


def forward(q: np.ndarray, *, tool: float = 0.0) -> np.ndarray:
    """Return the tool's pose in ``base``, shape (..., 4, 4), metres.

    Args:
        q: Joint angles, shape (..., 6), radians.
        tool: Length of the tool along the flange's z, metres; 0 is UR's ``tool0``.
    """
    return _pose(frames(q), tool)


def pose_and_jacobian(q: np.ndarray, *, tool: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return what :func:`forward` and :func:`jacobian` do, for three quarters of their time."""
    chain = frames(q)
    return _pose(chain, tool), _jacobian(chain, tool)


def jacobian(q: np.ndarray, *, tool: float = 0.0) -> np.ndarray:
    """Return the geometric Jacobian in ``base``, shape (..., 6, 6): rows vx vy vz wx wy wz, columns joints.

    Args:
        q: Joint angles, shape (..., 6), radians.
        tool: Length of the tool along the flange's z, metres.
    """
    return _jacobian(frames(q), tool)


def _pose(chain: np.ndarray, tool: float) -> np.ndarray:
    pose = chain[..., 6, :, :].copy()
    pose[..., :3, 3] += tool * pose[..., :3, 2]
    return pose


def _jacobian(chain: np.ndarray, tool: float) -> np.ndarray:
    tip = chain[..., 6, :3, 3] + tool * chain[..., 6, :3, 2]
    axes = np.moveaxis(chain[..., :6, :3, 2], -2, -1)
    arms = np.moveaxis(tip[..., None, :] - chain[..., :6, :3, 3], -2, -1)
    return np.concatenate([np.cross(axes, arms, axis=-2), axes], axis=-2)


def rotation_vector(rotation: np.ndarray) -> np.ndarray:
    """Return axis times angle, shape (..., 3), radians, of rotation matrices, shape (..., 3, 3)."""
    from scipy.spatial.transform import Rotation

    rotation = np.asarray(rotation, float)
    flat = rotation.reshape(-1, 3, 3)
    return Rotation.from_matrix(flat).as_rotvec().reshape(*rotation.shape[:-2], 3)


def pose_error(target: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """Return the twist that leads in a second from ``pose`` to ``target``, both (..., 4, 4): (..., 6), m and rad."""
    turn = target[..., :3, :3] @ np.swapaxes(pose[..., :3, :3], -1, -2)
    return np.concatenate([target[..., :3, 3] - pose[..., :3, 3], rotation_vector(turn)], axis=-1)


def inverse(target: np.ndarray, seed: np.ndarray, *, tool: float = 0.0, tolerance: float = 1e-11) -> np.ndarray:
    """Return the joint angles near ``seed`` that bring the tool to ``target``, shape (6,), by damped Newton steps.

    Args:
        target: The tool's pose in ``base``, shape (4, 4).
        seed: Joint angles to start from, shape (6,); the branch (elbow, wrist) of the seed is kept.
        tool: Length of the tool along the flange's z, metres.
        tolerance: Largest error left, metres and radians.

    Raises:
        Unreachable: No convergence, as outside the arm's reach.
    """
    q = np.array(seed, float)
    error = pose_error(target, forward(q, tool=tool))
    size, damping = float(np.linalg.norm(error)), 1e-3
    for _ in range(200):
        if size < tolerance:
            return q
        jac = jacobian(q, tool=tool)
        step = jac.T @ np.linalg.solve(jac @ jac.T + damping * np.eye(6), error)
        # A step of more than half a radian leaves the region in which the Jacobian tells the truth.
        trial = q + step * min(1.0, 0.5 / float(np.abs(step).max()))
        trial_error = pose_error(target, forward(trial, tool=tool))
        trial_size = float(np.linalg.norm(trial_error))
        if trial_size < size:
            q, error, size, damping = trial, trial_error, trial_size, max(damping * 0.1, 1e-15)
        else:
            damping *= 10.0
            if damping > 1e6:
                break
    place = ", ".join(f"{v:.3f}" for v in target[:3, 3])
    raise Unreachable(f"no configuration near the seed reaches ({place}) m: {size:.3g} m or rad are left")
