"""A G1 that stands on both soles, for the scripts that have it lift a foot or push it."""

from __future__ import annotations

import numpy as np

import opspace as osc

HALF, OFFSET = (0.085, 0.025), (0.035, 0.0, -0.035)
"""Half the sides of a sole, and its middle in the frame of the ankle, m."""


def g1_on_soles() -> tuple[osc.Robot, list[osc.SoleContact], np.ndarray]:
    """Return the robot, its contacts left and right, and q of its reference posture on the ground."""
    robot = osc.load_robot("g1")
    soles = [
        osc.SoleContact(f"{side}_ankle_roll_link", HALF, offset=OFFSET, name=side)
        for side in ("left", "right")
    ]
    robot.update(robot.q_reference, np.zeros(robot.nv))
    q = robot.q_reference.copy()
    q[2] -= robot.position(robot.frame_id("left_ankle_roll_link"))[2] + OFFSET[2]
    return robot, soles, q
