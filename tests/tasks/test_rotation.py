"""Laws of the rotation functions, with scipy as the second implementation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from opspace.errors import InputError
from opspace.law.scalars import BRANCH_END, BRANCH_HOLD
from opspace.tasks.rotation import (
    as_rotation,
    cross,
    exp_rotation,
    log_rotation,
    matrix_from_quaternion,
    quaternion_from_matrix,
    rotation_vector,
    skew,
)
from opspace.tasks.rotation_error import RotationError

unit = st.floats(-1.0, 1.0)
axes = (
    st.tuples(unit, unit, unit)
    .filter(lambda a: math.hypot(*a) > 1e-3)
    .map(lambda a: np.array(a) / math.hypot(*a))
)
small = st.integers(1, 17).map(lambda k: 10.0**-k)
# Every size, with extra weight on both ends, where careless formulas lose digits.
angles = st.one_of(st.floats(0.0, math.pi), small, small.map(lambda a: math.pi - a))
vectors = st.tuples(axes, angles).map(lambda p: p[0] * p[1])
triples = st.tuples(*[st.floats(-1e3, 1e3)] * 3).map(np.array)


@given(vectors)
def test_exponential_agrees_with_scipy(phi):
    expected = Rotation.from_rotvec(phi).as_matrix()
    np.testing.assert_allclose(exp_rotation(phi), expected, rtol=0, atol=1e-14)


@given(axes, angles)
def test_logarithm_undoes_scipys_exponential(axis, angle):
    phi = log_rotation(Rotation.from_rotvec(axis * angle).as_matrix())
    if angle > math.pi - 1e-14:  # both ways round are equally short
        phi = phi * math.copysign(1.0, phi @ axis)
    np.testing.assert_allclose(phi, axis * angle, rtol=0, atol=1e-12)


@given(axes, small)
def test_logarithm_keeps_the_relative_accuracy_that_the_matrix_holds(axis, angle):
    phi = log_rotation(exp_rotation(axis * angle))
    np.testing.assert_allclose(phi, axis * angle, rtol=0, atol=1e-15 * angle + 1e-16)


@given(vectors)
def test_exponential_undoes_the_logarithm(phi):
    R = exp_rotation(phi)
    np.testing.assert_allclose(exp_rotation(log_rotation(R)), R, rtol=0, atol=1e-14)


@given(vectors)
def test_rotations_are_orthonormal(phi):
    R = exp_rotation(phi)
    np.testing.assert_allclose(R @ R.T, np.eye(3), rtol=0, atol=1e-14)
    assert np.linalg.det(R) > 0.0


@pytest.mark.parametrize("axis", np.vstack((np.eye(3), -np.eye(3))))
def test_half_a_turn_about_a_coordinate_axis_has_one_answer(axis):
    R = 2.0 * np.outer(axis, axis) - np.eye(3)
    np.testing.assert_array_equal(log_rotation(R), math.pi * np.abs(axis))


@given(vectors)
def test_quaternion_and_matrix_are_inverse(phi):
    q = quaternion_from_matrix(exp_rotation(phi))
    assert q[0] >= 0.0
    again = quaternion_from_matrix(matrix_from_quaternion(q))
    np.testing.assert_allclose(abs(np.dot(q, again)), 1.0, rtol=0, atol=1e-14)


@given(vectors)
def test_the_negative_quaternion_goes_the_long_way_round(phi):
    q = quaternion_from_matrix(exp_rotation(phi))
    short, long = rotation_vector(q), rotation_vector((-q[0], -q[1], -q[2], -q[3]))
    if np.linalg.norm(short) > 1e-9:
        np.testing.assert_allclose(
            np.linalg.norm(short) + np.linalg.norm(long), 2.0 * math.pi, rtol=0, atol=1e-12
        )
    np.testing.assert_allclose(exp_rotation(short), exp_rotation(long), rtol=0, atol=1e-13)


@given(triples, triples)
def test_cross_and_skew_agree_with_numpy(a, b):
    np.testing.assert_allclose(cross(a, b), np.cross(a, b), rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(skew(a) @ b, np.cross(a, b), rtol=1e-12, atol=1e-9)


@given(axes, axes.filter(lambda a: abs(a[0]) > 0.1))
def test_error_is_continuous_through_half_a_turn(axis, wobble):
    """Grow the error past π with a wobbling axis: no step is larger than the motion itself."""
    error, previous = RotationError(), None
    for angle in np.linspace(2.8, math.pi + 0.9 * BRANCH_HOLD, 120):
        about = axis + 0.05 * math.sin(7.0 * angle) * wobble
        about /= np.linalg.norm(about)
        phi = error(exp_rotation(angle * about))
        np.testing.assert_allclose(phi, angle * about, rtol=0, atol=1e-9)
        if previous is not None:
            assert np.linalg.norm(phi - previous) < 0.06
        previous = phi


@given(axes, st.integers(0, 2**32 - 1))
def test_noise_at_half_a_turn_does_not_flip_the_error(axis, seed):
    rng, error = np.random.default_rng(seed), RotationError()
    first = error(exp_rotation((math.pi - 1e-3) * axis))
    for _ in range(20):
        phi = error(exp_rotation(math.pi * axis) @ exp_rotation(rng.normal(0.0, 1e-6, 3)))
        assert np.linalg.norm(phi - first) < 1e-2


@given(axes)
def test_error_takes_the_short_way_once_the_long_one_is_too_long(axis):
    error = RotationError()
    for angle in np.arange(3.0, math.pi + BRANCH_END, 0.1):
        error(exp_rotation(angle * axis))
    for beyond in np.arange(math.pi + BRANCH_END + 0.01, 2.0 * math.pi + 1.0, 0.1):
        np.testing.assert_allclose(
            error(exp_rotation(beyond * axis)), (beyond - 2.0 * math.pi) * axis, rtol=0, atol=1e-9
        )


@given(st.lists(vectors, min_size=1, max_size=6))
def test_error_is_always_a_logarithm_of_bounded_length(path):
    """Except where it turns from one way to the other: there it is the axis, and shorter."""
    error = RotationError()
    for phi in path:
        R = exp_rotation(phi)
        answer, short = error(R), log_rotation(R)
        length = np.linalg.norm(answer)
        assert length <= math.pi + BRANCH_HOLD + 1e-9
        if error.previous[0] >= math.cos(0.5 * (math.pi + BRANCH_HOLD)):
            np.testing.assert_allclose(exp_rotation(answer), R, rtol=0, atol=1e-13)
        else:
            np.testing.assert_allclose(np.cross(answer, short), 0.0, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_error_moves_no_faster_than_a_multiple_of_the_motion(seed):
    """Turn on and on about a wandering axis: ten times finer, the largest step is a tenth."""
    rng = np.random.default_rng(seed)
    axis, wander = rng.normal(size=3), 0.3 * rng.normal(size=3)

    def largest(steps):
        error, R, found, before = RotationError(), np.eye(3), 0.0, None
        for s in np.linspace(0.0, 1.0, steps):
            about = axis + wander * math.sin(9.0 * s + seed)
            R = exp_rotation(about / np.linalg.norm(about) * 20.0 / steps) @ R
            now = error(R)
            if before is not None:
                found = max(found, float(np.linalg.norm(now - before)))
            before = now
        return found

    coarse, fine = largest(2000), largest(20000)
    assert fine < 0.15 * coarse
    assert fine < 7.0 * 20.0 / 20000


@given(axes, st.floats(-0.9 * math.pi, 0.9 * math.pi), st.floats(-0.9 * math.pi, 0.9 * math.pi))
def test_a_leap_takes_the_short_way(axis, first, second):
    """A target that leaps by more than a turn of 1 rad has no way that it came."""
    error = RotationError()
    error(exp_rotation(first * axis))
    answer = error(exp_rotation(second * axis))
    if 1.01 < abs(second - first) < 2.0 * math.pi - 1.01:
        np.testing.assert_allclose(answer, second * axis, rtol=0, atol=1e-9)


@given(axes)
def test_reset_forgets_the_way_round(axis):
    error, beyond = RotationError(), exp_rotation((math.pi + 0.2) * axis)
    error(exp_rotation((math.pi - 0.2) * axis))
    assert np.linalg.norm(error(beyond)) > math.pi
    error.reset()
    np.testing.assert_array_equal(error(beyond), log_rotation(beyond))


@given(vectors, st.floats(-9e-4, 9e-4))
def test_small_deviations_are_renormalised(phi, deviation):
    R = exp_rotation(phi)
    q = np.array(quaternion_from_matrix(R)) * (1.0 + deviation)
    np.testing.assert_allclose(as_rotation(q, "target"), R, rtol=0, atol=1e-13)
    rounded = as_rotation(np.round(R, 4), "target")
    np.testing.assert_allclose(rounded @ rounded.T, np.eye(3), rtol=0, atol=1e-14)
    np.testing.assert_allclose(rounded, R, rtol=0, atol=3e-4)


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        ([1.0, 0.1, 0.0, 0.0], "norm"),
        ([0.0, 0.0, 0.0, 0.0], "norm"),
        (2.0 * np.eye(3), "rotation matrix"),
        (np.diag([1.0, 1.0, -1.0]), "rotation matrix"),
        ([0.0, 0.0, 1.0], "shape"),
        (np.full((3, 3), np.nan), "finite"),
        ("upright", "numbers"),
        ([[1.0, 0.0], [0.0]], "numbers"),
    ],
)
def test_what_is_not_a_rotation_is_refused(value, reason):
    with pytest.raises(InputError, match=reason):
        as_rotation(value, "task 'orientation': target")
