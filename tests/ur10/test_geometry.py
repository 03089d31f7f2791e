"""The scalar geometry against the plain one, and its inverse."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hrcneuro.robot import kinematics
from hrcneuro.ur10 import geometry

angles = st.lists(st.floats(-3.1, 3.1), min_size=6, max_size=6)
vectors = st.lists(st.floats(-2.5, 2.5), min_size=3, max_size=3)


@given(angles)
def test_flange_and_jacobian_equal_the_reference(q):
    pose = kinematics.forward(np.array(q), tool=0.1)
    at, turn = geometry.flange(q)
    tip = geometry.pose(q, [0, 0, 0.1, 0, 0, 0])[:3]
    np.testing.assert_allclose(tip, pose[:3, 3], atol=1e-14)
    np.testing.assert_allclose(turn, pose[:3, :3].ravel(), atol=1e-14)
    np.testing.assert_allclose(at, kinematics.forward(np.array(q))[:3, 3], atol=1e-14)
    np.testing.assert_allclose(
        np.transpose(geometry.columns(q, tip)), kinematics.jacobian(np.array(q), tool=0.1), atol=1e-14
    )


@settings(max_examples=300)
@given(angles, st.lists(st.floats(-0.3, 0.3), min_size=6, max_size=6))
def test_the_inverse_finds_the_configuration_it_starts_near(q, tcp):
    _, *singular = np.linalg.svd(kinematics.jacobian(np.array(q)))
    assume(singular[0][-1] > 0.02)
    found = geometry.inverse(geometry.pose(q, tcp), tcp, q)
    np.testing.assert_allclose(found, q, atol=1e-8)


def test_the_inverse_takes_the_nearest_turn_and_stays_within_the_range():
    q = [-0.16, -0.69, 1.48, -2.36, -1.57, 6.0]
    pose = geometry.pose(q, [0] * 6)
    np.testing.assert_allclose(geometry.inverse(pose, [0] * 6, q), q, atol=1e-9)
    near = [*q[:5], 6.0 - 2 * np.pi + 0.1]
    assert geometry.inverse(pose, [0] * 6, near)[5] == pytest.approx(6.0 - 2 * np.pi)


def test_out_of_reach_has_no_inverse():
    assert geometry.inverse([2.0, 0, 0.3, 0, 0, 0], [0] * 6, [0] * 6) is None
    assert geometry.inverse([0.0, 0.0, 0.3, 3.14, 0, 0], [0] * 6, [0] * 6) is None


@given(vectors, vectors)
def test_poses_follow_the_rules_of_frames(a, b):
    one, two = [0.1, 0.2, 0.3, *a], [0.5, -0.2, 0.1, *b]
    np.testing.assert_allclose(geometry.pose_trans(one, geometry.pose_inv(one)), np.zeros(6), atol=1e-9)
    way = geometry.between(one, two)
    end = geometry.along(one, way, 1.0)
    np.testing.assert_allclose(end[:3], two[:3], atol=1e-12)
    np.testing.assert_allclose(geometry.rotation(end[3:]), geometry.rotation(two[3:]), atol=1e-7)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, -1, 0), (0.6, 0, -0.8), (0.48, 0.6, 0.64)])
@pytest.mark.parametrize("angle", [0.0, 1e-9, 1.0, np.pi - 1e-9, np.pi])
def test_rotation_vectors_survive_the_way_through_a_matrix(axis, angle):
    v = [angle * k for k in axis]
    back = geometry.rotation_vector(geometry.rotation(v))
    np.testing.assert_allclose(geometry.rotation(back), geometry.rotation(v), atol=1e-7)
    assert np.linalg.norm(back) == pytest.approx(angle, abs=1e-7)


def test_joint_rates_give_the_tool_its_twist():
    q, twist = [-0.16, -0.69, 1.48, -2.36, -1.57, -1.73], [0.1, -0.05, 0.02, 0.1, 0.0, -0.2]
    tip = geometry.pose(q, [0] * 6)[:3]
    np.testing.assert_allclose(geometry.twist(q, geometry.joint_rates(q, tip, twist), tip), twist, atol=1e-4)
