"""How much a robot as a whole turns."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from opspace.errors import InputError
from opspace.tasks.rotation import matrix_from_quaternion, skew
from opspace.tasks.task import Task, TaskTerms
from opspace.tasks.validation import Array

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot

AXES = 3


class AngularMomentumTask(Task):
    """Lets the angular momentum about the centre of mass decay: f* = −kv L.

    A robot that keeps its balance by its centre of mass alone swings its body as it likes; this task
    quiets it. L is a velocity with units of its own, so that only damping makes sense. With the base
    at p, turned by R, and the centre of mass at c, the rows of the base of M give

        L = (R M[3:6] − [c − p]× M[:3]) v

    Args:
        kv: Rate of decay, 1/s.
        name: Name of the task.

    Raises:
        InputError: A rate that cannot be used; at binding, a robot without a floating base, whose
            momentum its fixing takes up.
    """

    def __init__(self, *, kv: float = 10.0, name: str = "angular_momentum") -> None:
        super().__init__(name, rows=AXES, units=("rad",) * AXES, kp=0.0, kv=kv)

    def bind(self, robot: Robot) -> None:
        """See `opspace.Task.bind`."""
        if not robot.floating_base:
            raise InputError(
                f"task {self.name!r}: robot {robot.name!r} is bolted down; angular momentum is for "
                "floating bases"
            )

    def evaluate(self, robot: Robot, t: float) -> TaskTerms:
        """Return the terms of the task at the robot's present state."""
        del t
        rows = np.zeros((AXES, 2 * AXES))
        rows[:, :AXES] = -skew(robot.com_position() - robot.q[:AXES])
        rows[:, AXES:] = matrix_from_quaternion(tuple(robot.q[AXES : AXES + 4].tolist()))
        J: Array = rows @ robot.M[: 2 * AXES]
        drift: Array = rows @ (robot.bias - robot.gravity)[: 2 * AXES]
        error = np.zeros(AXES)
        wanted = self._gains.acceleration(error, -(J @ robot.v), error)
        return TaskTerms(J=J, drift=drift, acceleration=wanted, error=error)
