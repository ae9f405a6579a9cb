"""Rotations: exponential and logarithm of SO(3), quaternions wxyz, checked input."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.tasks.validation import Array, numbers, require_finite

Quaternion = tuple[float, float, float, float]

# Rotations typed with three decimals pass and are renormalised; anything further off is a mistake.
ORTHONORMAL_TOLERANCE = 1e-3
_NOWHERE = np.eye(4)


def cross(a: Array, b: Array) -> Array:
    """Return a × b; for three numbers much faster than the general ``numpy.cross``."""
    a0, a1, a2 = a.tolist()
    b0, b1, b2 = b.tolist()
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


def skew(a: Array) -> Array:
    """Return the (3, 3) matrix [a]× with [a]× b = a × b."""
    x, y, z = a.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def quaternion_from_matrix(R: Array) -> Quaternion:
    """Return the unit quaternion wxyz of a rotation matrix, with w >= 0.

    The largest component is found first and the others are divided by it (Shepperd 1978), which
    is accurate to rounding at every angle. At exactly half a turn, where q and −q are equally
    good, the largest component is positive.

    Args:
        R: (3, 3) rotation matrix.

    Returns:
        (w, x, y, z).
    """
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = R.tolist()
    candidates = (r00 + r11 + r22, r00, r11, r22)
    largest = candidates.index(max(candidates))
    if largest == 0:
        q = (1.0 + candidates[0], r21 - r12, r02 - r20, r10 - r01)
    elif largest == 1:
        q = (r21 - r12, 1.0 + r00 - r11 - r22, r01 + r10, r02 + r20)
    elif largest == 2:
        q = (r02 - r20, r01 + r10, 1.0 - r00 + r11 - r22, r12 + r21)
    else:
        q = (r10 - r01, r02 + r20, r12 + r21, 1.0 - r00 - r11 + r22)
    norm = math.copysign(math.hypot(*q), q[0] if q[0] != 0.0 else 1.0)
    return (q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm)


def matrix_from_quaternion(q: Quaternion) -> Array:
    """Return the (3, 3) rotation matrix of a unit quaternion wxyz."""
    w, x, y, z = q
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def rotation_vector(q: Quaternion) -> Array:
    """Return axis times angle of a unit quaternion, the angle in [0, 2π).

    A quaternion with w >= 0 gives the short way, at most π; its negative gives the long way round
    to the same rotation.

    Args:
        q: Unit quaternion wxyz.

    Returns:
        (3,) rotation vector, rad.
    """
    w, x, y, z = q
    sine = math.hypot(x, y, z)
    # Below the smallest normal number sine / angle is noise, and 2/w is its limit.
    scale = 2.0 * math.atan2(sine, w) / sine if sine > 1e-300 else 2.0 / w
    return np.array([scale * x, scale * y, scale * z])


def log_rotation(R: Array) -> Array:
    """Return the logarithm of a rotation: the shortest φ with exp([φ]×) = R.

    Args:
        R: (3, 3) rotation matrix.

    Returns:
        (3,) rotation vector, rad, of length at most π; at half a turn the axis with the positive
        largest component.
    """
    return rotation_vector(quaternion_from_matrix(R))


def exp_rotation(phi: Array) -> Array:
    """Return the rotation exp([φ]×) by the angle ‖φ‖ about φ.

    Args:
        phi: (3,) rotation vector, rad.

    Returns:
        (3, 3) rotation matrix.
    """
    x, y, z = phi.tolist()
    angle = math.hypot(x, y, z)
    scale = math.sin(0.5 * angle) / angle if angle > 1e-300 else 0.5
    return matrix_from_quaternion((math.cos(0.5 * angle), scale * x, scale * y, scale * z))


def homogeneous(position: Array, R: Array) -> Array:
    """Return the (4, 4) matrix of a position (3,) m and a rotation matrix."""
    pose = _NOWHERE.copy()
    pose[:3, :3] = R
    pose[:3, 3] = position
    return pose


def as_rotation(value: ArrayLike, what: str) -> Array:
    """Read a rotation matrix or a quaternion wxyz and make it exactly orthonormal.

    Args:
        value: (3, 3) rotation matrix or (4,) quaternion wxyz.
        what: What the value is, at the start of the error message.

    Returns:
        (3, 3) rotation matrix, read-only.

    Raises:
        InputError: Another shape, a value that is not finite, or one further than
            ``ORTHONORMAL_TOLERANCE`` from a rotation.
    """
    given = numbers(value, what)
    if given.shape == (4,):
        require_finite(given, what)
        w, x, y, z = given.tolist()
        norm = math.hypot(w, x, y, z)
        if abs(norm - 1.0) > ORTHONORMAL_TOLERANCE:
            raise InputError(f"{what} is a quaternion (wxyz) of norm {norm:.6g}, not 1")
        R = matrix_from_quaternion((w / norm, x / norm, y / norm, z / norm))
    elif given.shape == (3, 3):
        require_finite(given, what)
        R = matrix_from_quaternion(quaternion_from_matrix(given))
        gap = float(np.abs(given - R).max())
        if gap > ORTHONORMAL_TOLERANCE:
            raise InputError(f"{what} is not a rotation matrix: it is off by {gap:.3g}")
    else:
        raise InputError(
            f"{what} must be a (3, 3) rotation matrix or a (4,) quaternion wxyz, "
            f"not of shape {given.shape}"
        )
    R.flags.writeable = False
    return R


def turning_rates(phi: Array, rate: Array, curvature: Array) -> tuple[Array, Array]:
    """Return ω = V φ̇ and ω̇ = V φ̈ + V̇ φ̇ of R = exp([φ]×) R_0, with V = I + a [φ]× + b [φ]×².

    Args:
        phi: (3,) rotation vector φ in world axes, rad.
        rate: (3,) φ̇, rad/s.
        curvature: (3,) φ̈, rad/s².
    """
    a, b, a_rate, b_rate = _turning(math.sqrt(float(phi @ phi)), float(phi @ rate))
    once, bent = cross(phi, rate), cross(phi, curvature)
    twice = cross(phi, once)
    omega = rate + a * once + b * twice
    alpha = curvature + a * bent + b * cross(phi, bent)
    alpha += a_rate * once + b_rate * twice + b * cross(rate, once)
    return omega, alpha


_SERIES_BELOW = 1e-2
"""Angle in rad below which series are more accurate than differences of near numbers."""


def _turning(angle: float, growth: float) -> tuple[float, float, float, float]:
    """Return a = (1 − cos θ)/θ², b = (θ − sin θ)/θ³ and their rates, with growth = θ θ̇."""
    square = angle * angle
    if angle < _SERIES_BELOW:
        a, b = 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
        return (
            a,
            b,
            growth * (-1.0 / 12.0 + square / 180.0),
            growth * (-1.0 / 60.0 + square / 1260.0),
        )
    sine, cosine = math.sin(angle), math.cos(angle)
    a, b = (1.0 - cosine) / square, (angle - sine) / (square * angle)
    a_rate = growth * (sine / angle - 2.0 * a) / square
    b_rate = growth * (a - 3.0 * b) / square
    return a, b, a_rate, b_rate
