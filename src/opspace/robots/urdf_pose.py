"""Rotations as URDF writes them, and the pose of a joint that is held somewhere."""

from __future__ import annotations

import copy
import math
import xml.etree.ElementTree as ET

import numpy as np


def rpy_matrix(rpy: np.ndarray) -> np.ndarray:
    """Return the rotation matrix of URDF's roll, pitch and yaw (fixed axes x, y, z).

    Args:
        rpy: (3,) angles in rad.

    Returns:
        (3, 3) rotation matrix.
    """
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def attribute_floats(element: ET.Element | None, key: str) -> np.ndarray:
    """Return the three numbers of an attribute, zeros where it is not there."""
    text = element.get(key) if element is not None else None
    return np.array([float(x) for x in text.split()]) if text else np.zeros(3)


def held_at(joint: ET.Element, axis: tuple[float, ...], slides: bool, value: float) -> ET.Element:
    """Return a joint's element with its motion moved into its origin.

    Args:
        joint: The element; it is left alone.
        axis: Of unit length.
        slides: Whether it is prismatic.
        value: Where it is held, rad or m.
    """
    held = copy.deepcopy(joint)
    if value == 0.0:
        return held
    origin = held.find("origin")
    if origin is None:
        origin = ET.SubElement(held, "origin")
    xyz, rpy = attribute_floats(origin, "xyz"), attribute_floats(origin, "rpy")
    rotation, direction = rpy_matrix(rpy), np.array(axis)
    if slides:
        xyz = xyz + rotation @ direction * value
    else:
        rpy = matrix_rpy(rotation @ _turn(direction, value))
    origin.set("xyz", " ".join(repr(float(x)) for x in xyz))
    origin.set("rpy", " ".join(repr(float(x)) for x in rpy))
    return held


def _turn(axis: np.ndarray, angle: float) -> np.ndarray:
    x, y, z = axis
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * skew + (1.0 - math.cos(angle)) * skew @ skew


def matrix_rpy(R: np.ndarray) -> np.ndarray:
    """Return URDF's roll, pitch and yaw (3,) of a rotation matrix, rad."""
    pitch = math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0]))
    if math.hypot(R[0, 0], R[1, 0]) < 1e-9:  # roll and yaw turn about one axis
        return np.array([math.atan2(-R[1, 2], R[1, 1]), pitch, 0.0])
    return np.array([math.atan2(R[2, 1], R[2, 2]), pitch, math.atan2(R[1, 0], R[0, 0])])
