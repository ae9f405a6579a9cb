"""Ready-made activations for tasks that are there only in some states."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError, unknown_name
from opspace.law import Buffer
from opspace.tasks.joint_layout import joint_layout
from opspace.tasks.validation import finite_array, shown

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot
    from opspace.tasks.task import Task


class JointBuffer:
    """Activation by the position of a joint of one degree of freedom, see `opspace.Buffer`.

    Of a joint that turns without end whole turns make no difference: the task is there on the half of
    the circle beyond ``on`` and absent on the half beyond ``off``, with a rise at either end.

    Args:
        joint: Name of the joint.
        off: Position at and beyond which the task is absent, rad or m.
        on: Position at and beyond which it is fully there; below ``off`` if that is the side.
        profile: Name of the profile.

    Raises:
        InputError: The two positions coincide or are not finite; at binding, they are half a turn
            or more apart on a joint that turns without end.
        UnknownNameError: An unknown profile; at binding an unknown joint.
    """

    def __init__(self, joint: str, off: float, on: float, profile: str = "quintic") -> None:
        self.joint = joint
        self.buffer = Buffer(off, on, profile)
        self._endless: bool | None = None
        self._entry = 0

    def bind(self, robot: Robot) -> None:
        """Check that the robot has the joint, and see whether it turns without end."""
        if self.joint not in robot.joint_names:
            raise unknown_name("joint", self.joint, robot.joint_names)
        layout = joint_layout(robot, [self.joint])
        self._endless, self._entry = bool(layout.endless[0]), int(layout.entries[0])
        if self._endless and abs(self.buffer.on - self.buffer.off) >= math.pi:
            raise InputError(
                f"joint {self.joint!r} turns without end: off={self.buffer.off:g} and "
                f"on={self.buffer.on:g} must be less than half a turn apart"
            )

    def __call__(self, robot: Robot, t: float) -> float:
        """Evaluate the activation at the robot's present state."""
        if self._endless is None:
            self.bind(robot)
        position = float(robot.q[self._entry])
        return self.buffer(self._folded(position) if self._endless else position).value

    def _folded(self, position: float) -> float:
        """Fold the far half of the circle onto the near one, about the middle of the buffer."""
        middle = 0.5 * (self.buffer.off + self.buffer.on)
        away = math.remainder(position - middle, 2.0 * math.pi)
        if abs(away) > 0.5 * math.pi:
            away = math.copysign(math.pi - abs(away), away)
        return middle + away


class DistanceBuffer:
    """Activation by the distance of a frame from a point in the world, see `opspace.Buffer`.

    Args:
        point: (3,) m.
        off: Distance at and beyond which the task is absent, m.
        on: Distance at and beyond which it is fully there, m; below ``off`` for a task that is
            there near the point.
        frame: Name of the frame; None is the robot's tool.
        profile: Name of the profile.

    Raises:
        InputError: The two distances coincide, or a number that is not finite.
        UnknownNameError: An unknown profile; at binding an unknown frame.
    """

    def __init__(
        self,
        point: ArrayLike,
        off: float,
        on: float,
        *,
        frame: str | None = None,
        profile: str = "quintic",
    ) -> None:
        self.point = finite_array(point, (3,), "point of a distance buffer")
        self.frame = frame
        self.buffer = Buffer(off, on, profile)

    def bind(self, robot: Robot) -> None:
        """Check that the robot has the frame."""
        self._frame(robot)

    def __call__(self, robot: Robot, t: float) -> float:
        """Evaluate the activation at the robot's present state."""
        away = robot.position(self._frame(robot)) - self.point
        return self.buffer(float(np.linalg.norm(away))).value

    def _frame(self, robot: Robot) -> int:
        return robot.frame_id(robot.tool if self.frame is None else self.frame)


class ActivationProduct:
    """Product of several activations: the task is there as far as all of them let it.

    Args:
        factors: Functions (robot, t) -> [0, 1].
    """

    def __init__(self, *factors: Callable[[Robot, float], float]) -> None:
        self.factors = factors

    def bind(self, robot: Robot) -> None:
        """Check the names that the factors use."""
        for factor in self.factors:
            bind = getattr(factor, "bind", None)
            if bind is not None:
                bind(robot)

    def __call__(self, robot: Robot, t: float) -> float:
        """Evaluate the product at the robot's present state."""
        product = 1.0
        for factor in self.factors:
            product *= factor(robot, t)
        return product


class ActivationUnion:
    """The task is there as far as any of several activations wants it, 1 − Π (1 − h).

    As smooth as they are. Of `Contact` and a `DistanceBuffer` it inserts a force task before the
    touch, and keeps it where something is touched that was not expected.

    Args:
        parts: Functions (robot, t) -> [0, 1].
    """

    def __init__(self, *parts: Callable[[Robot, float], float]) -> None:
        self.parts = parts

    def bind(self, robot: Robot) -> None:
        """Check the names that the parts use."""
        ActivationProduct(*self.parts).bind(robot)

    def __call__(self, robot: Robot, t: float) -> float:
        """Evaluate the union at the robot's present state."""
        absent = 1.0
        for part in self.parts:
            absent *= 1.0 - part(robot, t)
        return 1.0 - absent


def own_activation(task: Task, robot: Robot, t: float) -> float:
    """Evaluate the activation that the user gave a task, 1 where there is none.

    Args:
        task: The task.
        robot: The robot at the present state.
        t: Time, s.

    Returns:
        h, 0 to 1.

    Raises:
        InputError: It is not in [0, 1].
    """
    return checked_activation(f"task {task.name!r}", task.activation, robot, t)


def checked_activation(
    who: str, activation: Callable[[Robot, float], float] | None, robot: Robot, t: float
) -> float:
    """Evaluate an activation of the user's, 1 where there is none.

    Args:
        who: Whose it is, for the error.
        activation: The function.
        robot: The robot at the present state.
        t: Time, s.

    Returns:
        h, 0 to 1.

    Raises:
        InputError: It is not in [0, 1].
    """
    if activation is None:
        return 1.0
    given = activation(robot, t)
    try:
        h = float(given)
    except (TypeError, ValueError, OverflowError):
        h = math.nan
    if not 0.0 <= h <= 1.0:
        raise InputError(
            f"{who}: activation at t = {t:.6g} s must be in [0, 1], got {shown(given)}"
        )
    return h
