"""Joint limits that keep an FR3 below the speeds at which it stops by itself."""

import math

import pytest

import opspace as osc
from opspace.law.scalars import allowed_speed

SPEEDS_OF_FR3 = [
    (2.62, 0.30, 6.0),
    (2.62, 0.20, 2.585),
    (2.62, 0.20, 3.5),
    (2.62, 0.30, 4.0),
    (5.26, 0.35, 17.0),
    (4.18, 0.35, 5.5),
    (5.26, 0.35, 17.0),
]
"""Largest speed v, offset o and deceleration a of every joint, rad/s and rad/s²: at a distance d from
its end it may move at min(v, √(2 a d) − o) (Franka's page on robot and interface specifications)."""


@pytest.mark.parametrize("joint", range(7))
def test_what_the_page_tells_to_set_stays_below_the_robots_own_curve(joint):
    limits = osc.JointLimits(clearance=0.03, brake_acceleration=1.5)
    most, offset, deceleration = SPEEDS_OF_FR3[joint]
    for distance in (0.001 * k for k in range(3000)):
        ours = min(allowed_speed(distance, limits.brake_acceleration, limits.k1)[0], 1.5)
        end = distance + limits.clearance
        assert ours < min(most, math.sqrt(2.0 * deceleration * end) - offset) - 0.08
