import importlib.metadata

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.robot import kinematics
from hrcneuro.robot.kinematics import Unreachable, forward, inverse, jacobian, pose_error, rotation_vector

configurations = st.lists(st.floats(-2 * np.pi, 2 * np.pi), min_size=6, max_size=6).map(np.array)


def dh_product(q, tool):
    """The same arm from elementary transforms, one after the other: Rot z, Trans z, Trans x, Rot x."""

    def rot(axis, angle):
        c, s = np.cos(angle), np.sin(angle)
        i, j = {"z": (0, 1), "x": (1, 2)}[axis]
        m = np.eye(4)
        m[i, i] = m[j, j] = c
        m[i, j], m[j, i] = -s, s
        return m

    def trans(axis, length):
        m = np.eye(4)
        m[{"x": 0, "z": 2}[axis], 3] = length
        return m

    # UR's published table, row by row: a, d, alpha.
    table = [
        (0, 0.1273, np.pi / 2),
        (-0.612, 0, 0),
        (-0.5723, 0, 0),
        (0, 0.163941, np.pi / 2),
        (0, 0.1157, -np.pi / 2),
        (0, 0.0922, 0),
    ]
    pose = np.eye(4)
    for angle, (a, d, alpha) in zip(q, table, strict=True):
        pose = pose @ rot("z", angle) @ trans("z", d) @ trans("x", a) @ rot("x", alpha)
    return pose @ trans("z", tool)


def test_forward_equals_a_product_of_elementary_transforms():
    rng = np.random.default_rng(1)
    q = rng.uniform(-2 * np.pi, 2 * np.pi, (300, 6))
    for tool in (0.0, 0.1):
        expected = np.array([dh_product(one, tool) for one in q])
        assert np.abs(forward(q, tool=tool) - expected).max() < 1e-14


def test_jacobian_equals_finite_differences():
    rng = np.random.default_rng(2)
    h = 1e-5
    for q in rng.uniform(-np.pi, np.pi, (40, 6)):
        columns = []
        for i in range(6):
            step = h * np.eye(6)[i]
            low, high = forward(q - step, tool=0.1), forward(q + step, tool=0.1)
            columns.append(pose_error(high, low) / (2 * h))
        assert np.abs(jacobian(q, tool=0.1) - np.array(columns).T).max() < 1e-9


@settings(max_examples=40, deadline=None)
@given(configurations)
def test_a_pose_is_rigid(q):
    pose = forward(q)
    assert np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.isclose(np.linalg.det(pose[:3, :3]), 1.0)
    assert np.linalg.norm(pose[:3, 3]) < 0.612 + 0.5723 + 0.1273 + 0.163941 + 0.1157 + 0.0922


def test_inverse_finds_the_configuration_near_its_seed(workspace):
    rng = np.random.default_rng(3)
    for q in workspace.reach.q.reshape(-1, 6)[::5]:
        found = inverse(forward(q, tool=0.1), q + rng.uniform(-0.2, 0.2, 6), tool=0.1)
        assert np.abs(found - q).max() < 1e-8


def test_inverse_refuses_what_the_arm_does_not_reach(workspace):
    target = forward(workspace.reach.q[3, 3])
    target[:3, 3] = (-1.9, 0.0, 0.0)
    with pytest.raises(Unreachable, match=r"\(-1.900, 0.000, 0.000\)"):
        inverse(target, workspace.reach.q[3, 3])


def test_rotation_vector_is_axis_times_angle():
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert np.allclose(rotation_vector(quarter), (0, 0, np.pi / 2))
    assert rotation_vector(np.broadcast_to(quarter, (2, 3, 3, 3))).shape == (2, 3, 3)


def test_equal_to_pinocchio():
    """Frame ``base`` -> ``tool0`` of the UR10 in example-robot-data; from ``base_link`` it differs by Rz(pi)."""
    pin = pytest.importorskip("pinocchio", reason="pinocchio (pin on PyPI) is not installed")
    try:
        files = importlib.metadata.files("example-robot-data") or []
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("example-robot-data, which has the UR10's URDF, is not installed")
    urdf = next(f for f in files if f.name == "ur10_robot.urdf")
    model = pin.buildModelFromUrdf(str(urdf.locate()))
    data = model.createData()
    base, tool0, link = (model.getFrameId(name) for name in ("base", "tool0", "base_link"))
    q = np.random.default_rng(4).uniform(-2 * np.pi, 2 * np.pi, (2000, 6))
    ours, our_jacobians = forward(q), jacobian(q)
    worst = worst_jacobian = 0.0
    for one, pose, jac in zip(q, ours, our_jacobians, strict=True):
        pin.framesForwardKinematics(model, data, one)
        pin.computeJointJacobians(model, data, one)
        frame = data.oMf[base].inverse() * data.oMf[tool0]
        worst = max(worst, float(np.abs(frame.homogeneous - pose).max()))
        turn = data.oMf[base].rotation.T
        theirs = pin.getFrameJacobian(model, data, tool0, pin.LOCAL_WORLD_ALIGNED)
        theirs = np.vstack([turn @ theirs[:3], turn @ theirs[3:]])
        worst_jacobian = max(worst_jacobian, float(np.abs(theirs - jac).max()))
    print(f"pinocchio {pin.__version__}: pose {worst:.2e}, Jacobian {worst_jacobian:.2e} over {len(q)} configurations")
    assert worst < 1e-9
    assert worst_jacobian < 1e-9
    half_turn = data.oMf[base].inverse() * data.oMf[link]
    assert np.allclose(half_turn.rotation, np.diag([-1.0, -1.0, 1.0]), atol=1e-9)


def test_frames_have_the_shape_of_their_input():
    assert kinematics.frames(np.zeros((2, 3, 6))).shape == (2, 3, 7, 4, 4)
