"""What motors give in either direction, as the middle of it and how far it goes to both sides."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from opspace.robots.protocol import Robot


class MotorRange(NamedTuple):
    r"""Torques from middle − limit to middle + limit.

    A motor that gives more one way than the other is one that gives the same both ways beside a
    constant torque: with c the middle, Γ − c is within ± limit, and M q̈ + (b + g − c) = Γ − c. So
    whoever takes c from the bias, and adds it to the torque in the end, needs no other law.

    Attributes:
        limit: (n,) half of what there is from the least to the largest torque, N·m or N.
        middle: (n,) c, N·m or N; 0 for motors that are alike in both directions.
    """

    limit: np.ndarray
    middle: np.ndarray

    @property
    def least(self) -> np.ndarray:
        """Return the least torques, (n,) N·m or N."""
        return self.middle - self.limit

    @property
    def most(self) -> np.ndarray:
        """Return the largest torques, (n,) N·m or N."""
        return self.middle + self.limit


def motor_range(robot: Robot) -> MotorRange:
    """Return what the motors of a robot give.

    A robot of one's own that says ``torque_limit`` only has motors that are alike in both directions,
    as has one whose ``torque_limit`` was assigned after it was read, one that is unlimited one way,
    and one with a floating base.

    Args:
        robot: The robot.

    Returns:
        (n,) each, N·m or N.
    """
    limit, middle = np.array(robot.torque_limit), np.zeros(robot.nv)
    told = getattr(robot, "torque_range", None)
    if told is None or robot.floating_base:
        return MotorRange(limit, middle)
    least, most = np.asarray(told, dtype=float)
    uneven = np.isfinite(least) & np.isfinite(most) & (-least != most)
    uneven &= np.minimum(-least, most) == limit
    limit[uneven] = 0.5 * (most[uneven] - least[uneven])
    middle[uneven] = 0.5 * (most[uneven] + least[uneven])
    return MotorRange(limit, middle)
