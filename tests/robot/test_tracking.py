import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hrcneuro.robot.kinematics import forward, jacobian
from hrcneuro.robot.tracking import ResolvedRate, Tracking, ldl6, tip


def test_the_law_equals_its_plain_form():
    rng = np.random.default_rng(1)
    for q in rng.uniform(-np.pi, np.pi, (300, 6)):
        pose = forward(q, tool=0.1)
        turn = rng.normal(size=3) * 1e-5
        law = ResolvedRate(
            Tracking(gain=7.0, damping=0.02),
            tool=0.1,
            orientation=Rotation.from_rotvec(turn).as_matrix() @ pose[:3, :3],
        )
        off, v = rng.normal(size=3) * 1e-2, rng.normal(size=3) * 0.2
        qd, *error = law(q.tolist(), (pose[:3, 3] + off).tolist(), v.tolist())
        jac = jacobian(q, tool=0.1)
        twist = np.concatenate([v + 7.0 * off, 7.0 * turn])
        plain = jac.T @ np.linalg.solve(jac @ jac.T + 0.02**2 * np.eye(6), twist)
        assert np.abs(np.array(qd) - plain).max() < 1e-10 * max(1.0, float(np.abs(plain).max()))
        assert np.allclose(error, off, atol=1e-14)


def test_the_tip_equals_forward_kinematics():
    for q in np.random.default_rng(2).uniform(-np.pi, np.pi, (100, 6)):
        assert np.allclose(tip(q.tolist(), 0.07), forward(q, tool=0.07)[:3, 3], atol=1e-14)


def test_orientation_is_fed_back():
    q = np.radians([-9.4, -39.6, 84.7, -135.1, -90.0, -99.4])
    pose = forward(q, tool=0.1)
    for turn in np.eye(3) * 0.05:
        law = ResolvedRate(Tracking(), tool=0.1, orientation=Rotation.from_rotvec(turn).as_matrix() @ pose[:3, :3])
        qd, *_ = law(q.tolist(), pose[:3, 3].tolist(), (0.0, 0.0, 0.0))
        twist = jacobian(q, tool=0.1) @ qd
        assert np.allclose(twist[3:], 8.0 * turn, atol=0.01)
        assert np.abs(twist[:3]).max() < 2e-3


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(1e-4, 10.0))
def test_ldl6_solves(seed, damping):
    rng = np.random.default_rng(seed)
    root, b = rng.normal(size=(6, 6)), rng.normal(size=6)
    matrix = root @ root.T + damping * np.eye(6)
    found = np.array(ldl6(matrix[np.triu_indices(6)].tolist(), b.tolist()))
    assert np.abs(matrix @ found - b).max() < 1e-9 * np.linalg.cond(matrix) ** 0.5


def test_near_a_singularity_the_velocity_stays_bounded():
    q = np.radians([0.0, -90.0, 0.0, -90.0, 0.0, 0.0])  # the arm straight up, wrist aligned
    pose = forward(q, tool=0.1)
    law = ResolvedRate(Tracking(), tool=0.1, orientation=pose[:3, :3])
    qd, *_ = law(q.tolist(), pose[:3, 3].tolist(), (0.1, 0.1, 0.1))
    assert np.isfinite(qd).all()
    # |Jᵀ(JJᵀ+λ²)⁻¹| ≤ 1/(2λ)
    assert np.linalg.norm(qd) <= 0.1 * np.sqrt(3) / (2 * 0.01) + 1e-9
