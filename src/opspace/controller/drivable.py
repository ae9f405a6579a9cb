"""Which robots the controller can drive."""

from __future__ import annotations

import numpy as np

from opspace.errors import InputError
from opspace.robots.protocol import BASE, Robot


def base_of(robot: Robot) -> int:
    """Number of the first coordinates that have no motor: those of a floating base."""
    return BASE if robot.floating_base else 0


def joint_positions(robot: Robot) -> np.ndarray:
    """Positions (n,) in the order of v, those of a floating base zero."""
    base = base_of(robot)
    return np.concatenate([np.zeros(base), robot.q[base + 1 :]]) if base else robot.q


def check_drivable(robot: Robot) -> None:
    """Check that every joint behind the base has one motor, with torque in both directions.

    Raises:
        InputError: It has not.
    """
    base = base_of(robot)
    if not np.all(robot.actuated[base:]):
        free = [n for n, a in zip(robot.joint_names, robot.actuated, strict=True) if not a][base:]
        raise InputError(
            f"robot {robot.name!r} is not fully actuated ({', '.join(free)}); this controller "
            "needs a motor at every joint"
        )
    if robot.nq != robot.nv + (1 if base else 0):
        raise InputError(
            f"robot {robot.name!r} has joints with several coordinates (nq={robot.nq}, "
            f"n={robot.nv}); this controller takes hinges and slides only"
        )
    weak = [
        n for n, most in zip(robot.joint_names, robot.torque_limit, strict=True) if not most > 0
    ]
    if weak:
        raise InputError(
            f"robot {robot.name!r} has motors without torque in one direction or both: "
            f"{', '.join(weak)}"
        )
