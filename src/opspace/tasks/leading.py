"""Give a task another goal while it moves, without a step in what it asks for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.tasks.motion_task import MotionTask
from opspace.tasks.motions import CenterOfMass, WorldFrame
from opspace.tasks.quantities import Orientation, Pose, Position
from opspace.tasks.references import Sample
from opspace.tasks.rotation import as_rotation, homogeneous
from opspace.tasks.task import Task
from opspace.tasks.validation import Array, finite_array
from opspace.tasks.ways import Pace, PoseWay, RotationWay, VectorWay

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot

MOVING = Pace(0.6, 3.0)
"""Limits of the way to a position, m/s, m/s²."""

TURNING = Pace(1.5, 8.0)
"""Limits of the way to an orientation, rad/s, rad/s²."""


def can_be_led(task: Task) -> bool:
    """Tell whether a task has a target in the world that `lead` can move."""
    return isinstance(task, MotionTask) and isinstance(task.source, WorldFrame | CenterOfMass)


def lead(
    task: Task,
    robot: Robot,
    t: float,
    *,
    position: ArrayLike | None = None,
    orientation: ArrayLike | None = None,
) -> None:
    """Lead a task from what it follows now to a goal, within limits of speed, acceleration and jerk.

    The way begins with the desired value, velocity and acceleration of time ``t``, so it may be
    asked for again and again, as a hand that drags a target does.

    Args:
        task: A position, orientation, pose or centre-of-mass task in the world.
        robot: The robot that it is bound to, updated.
        t: Time of the present tick, s.
        position: (3,) goal of the position, m; None keeps the goal that there is.
        orientation: Goal of the orientation, (3, 3) or quaternion wxyz; None keeps that there is.

    Raises:
        InputError: A task of another kind, or a goal that it does not have.
    """
    if not isinstance(task, MotionTask) or not can_be_led(task):
        raise InputError(f"task {task.name!r} has no target in the world that could be led")
    now, quantity = task.desired(robot, t), task.quantity
    if isinstance(quantity, Pose):
        goal = _goal(task, now, position, orientation)
        task.target = PoseWay.to(now, goal, t, MOVING, TURNING)
    elif isinstance(quantity, Position) and position is not None and orientation is None:
        task.target = VectorWay.to(now, finite_array(position, (3,), _goal_of(task)), t, MOVING)
    elif isinstance(quantity, Orientation) and orientation is not None and position is None:
        task.target = RotationWay.to(now, as_rotation(orientation, _goal_of(task)), t, TURNING)
    else:
        takes = "a position" if isinstance(quantity, Position) else "an orientation"
        raise InputError(f"task {task.name!r} is led to {takes} and nothing else")


def _goal(
    task: MotionTask, now: Sample, position: ArrayLike | None, orientation: ArrayLike | None
) -> Array:
    """Fill in the goals that are kept: those of a way that is being led, or where the target is."""
    kept = task.target.goal if isinstance(task.target, PoseWay) else now.x
    what = _goal_of(task)
    return homogeneous(
        kept[:3, 3] if position is None else finite_array(position, (3,), what),
        kept[:3, :3] if orientation is None else as_rotation(orientation, what),
    )


def _goal_of(task: MotionTask) -> str:
    return f"task {task.name!r}: goal"
