"""One joint of the robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.tasks.posture import PostureTask
from opspace.tasks.references.sample import Reference
from opspace.tasks.validation import Array, numbers

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot


class JointTask(PostureTask):
    """Moves one joint of one degree of freedom: f* = a_d + kv (v_d − v) + kp (q_d − q).

    Args:
        joint: Name of the joint.
        target: Value in rad (m for a prismatic joint), a reference that gives such values, or
            None to hold the value found first.
        kp: Stiffness, 1/s².
        kv: Damping, 1/s; None is critical, 2 sqrt(kp).
        max_speed: Speed that the error may ask for, rad/s or m/s.
        max_acceleration: Acceleration of the way to a new target, rad/s² or m/s²; see
            `TrackingTask.max_acceleration`.
        ki: Integral gain, 1/s³, against friction and payload; None is none.
        max_integral: Error in m or rad whose pull, kp times it, the integral may add at most.
        name: Name of the task; None is the name of the joint.

    Raises:
        InputError: A gain or target that cannot be used.
    """

    def __init__(
        self,
        joint: str,
        target: ArrayLike | Reference | None = None,
        *,
        kp: float = 100.0,
        kv: float | None = None,
        max_speed: float | None = None,
        max_acceleration: float | None = None,
        ki: float | None = None,
        max_integral: float = 0.05,
        name: str | None = None,
    ) -> None:
        super().__init__(
            target,
            kp=kp,
            kv=kv,
            joints=[joint],
            max_speed=max_speed,
            max_acceleration=max_acceleration,
            ki=ki,
            max_integral=max_integral,
            name=joint if name is None else name,
        )

    def _resolve(self, robot: Robot) -> None:
        super()._resolve(robot)
        layout = self.layout
        if layout is not None and len(layout.entries) * self.rows != 1:
            raise InputError(
                f"task {self.name!r}: a joint task needs a joint of one degree of freedom, but "
                f"the configuration of {', '.join(layout.names)} is {len(layout.entries)} numbers"
            )

    def _check_value(self, value: ArrayLike, what: str) -> Array:
        return super()._check_value(np.atleast_1d(numbers(value, what)), what)

    def _vector(self, value: ArrayLike | None, what: str) -> Array:
        rate = None if value is None else np.atleast_1d(numbers(value, what))
        return super()._vector(rate, what)
