"""What the experiments need to know about an arm: its first axis and how far it reaches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from opspace.errors import InputError
from opspace.robots.protocol import Robot

SAMPLES = 300
REFINED = 5
"""Of the random postures so many are moved on to where the arm reaches farthest."""


@dataclass(frozen=True)
class Axis:
    """The axis of the first joint, seen from the tool.

    Attributes:
        center: (3,) point on the axis nearest to the tool, m.
        direction: (3,) unit vector.
        arm: (3,) from the center to the tool, m.
    """

    center: np.ndarray
    direction: np.ndarray
    arm: np.ndarray


def first_axis(robot: Robot) -> Axis:
    """Find the axis of the first joint at the robot's present state.

    The Jacobian's first column is z × r and z; with z × r turned back, (z × r) × z is the part of r
    across the axis.

    Args:
        robot: The robot, updated.

    Returns:
        The axis.

    Raises:
        InputError: The first joint is not a hinge.
    """
    tool = robot.frame_id(robot.tool)
    column = robot.jacobian(tool)[:, 0]
    z = column[3:]
    if not np.isclose(np.linalg.norm(z), 1.0):
        raise InputError(
            f"joint {robot.joint_names[0]!r} of {robot.name!r} is not a hinge that moves the tool; "
            "the experiments turn the arm about its first joint"
        )
    arm = np.cross(column[:3], z)
    return Axis(robot.position(tool) - arm, z, arm)


def reach(robot: Robot) -> float:
    """Find the largest distance of the tool from the first joint's axis.

    Random postures within the joint limits, always the same ones; the best of them climb to the
    next maximum.

    Args:
        robot: The robot; its state is changed.

    Returns:
        The distance, m.
    """
    from scipy.optimize import minimize  # noqa: PLC0415 - slow to import

    lower = np.where(np.isfinite(robot.q_lower), robot.q_lower, -np.pi)
    upper = np.where(np.isfinite(robot.q_upper), robot.q_upper, np.pi)

    def shortness(q: np.ndarray) -> tuple[float, np.ndarray]:
        robot.update(q, np.zeros(robot.nv))
        arm = first_axis(robot).arm
        length = float(np.linalg.norm(arm))
        J = robot.jacobian(robot.frame_id(robot.tool))[:3]
        return -length, -(arm / max(length, 1e-9)) @ J

    rng = np.random.default_rng(0)
    postures = sorted(
        (rng.uniform(lower, upper) for _ in range(SAMPLES)), key=lambda q: shortness(q)[0]
    )
    bounds = list(zip(lower, upper, strict=True))
    found = [
        minimize(shortness, q, jac=True, method="L-BFGS-B", bounds=bounds).fun
        for q in postures[:REFINED]
    ]
    return -float(min(found))
