"""Which robots the controller can drive."""

from __future__ import annotations

import numpy as np

from opspace.errors import InputError
from opspace.robots.protocol import Robot


def check_drivable(robot: Robot) -> None:
    """Check that a robot has one motor for every coordinate, with torque in both directions.

    Raises:
        InputError: It has not.
    """
    if not np.all(robot.actuated):
        free = [n for n, a in zip(robot.joint_names, robot.actuated, strict=True) if not a]
        raise InputError(
            f"robot {robot.name!r} is not fully actuated ({', '.join(free)}); this controller "
            "needs a motor at every joint"
        )
    if robot.nq != robot.nv:
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
