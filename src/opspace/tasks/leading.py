"""Give a task another goal while it moves, without a step in what it asks for."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.tasks.motion_task import MotionTask
from opspace.tasks.motions import CenterOfMass, WorldFrame
from opspace.tasks.quantities import Orientation, Pose, Position
from opspace.tasks.references import (
    JerkLimited,
    OrientationJerkLimited,
    PoseReference,
    Reference,
    Sample,
)
from opspace.tasks.task import Task

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot

MOVING: Mapping[str, float] = MappingProxyType(
    {"max_velocity": 0.6, "max_acceleration": 3.0, "max_jerk": 30.0}
)
"""Limits of the way to a position, m/s, m/s², m/s³."""

TURNING: Mapping[str, float] = MappingProxyType(
    {"max_velocity": 1.5, "max_acceleration": 8.0, "max_jerk": 80.0}
)
"""Limits of the way to an orientation, rad/s, rad/s², rad/s³."""


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
        task.target = _pose(now, t, *_goals(task, now, position, orientation))
    elif isinstance(quantity, Position) and position is not None and orientation is None:
        task.target = _position(now, t, position)
    elif isinstance(quantity, Orientation) and orientation is not None and position is None:
        task.target = _orientation(now, t, orientation)
    else:
        takes = "a position" if isinstance(quantity, Position) else "an orientation"
        raise InputError(f"task {task.name!r} is led to {takes} and nothing else")


def _position(now: Sample, t: float, goal: ArrayLike) -> JerkLimited:
    return JerkLimited(
        now.x, goal, **MOVING, start_time=t, start_velocity=now.v, start_acceleration=now.a
    )


def _orientation(now: Sample, t: float, goal: ArrayLike) -> OrientationJerkLimited:
    return OrientationJerkLimited(
        now.x, goal, **TURNING, start_time=t, start_velocity=now.v, start_acceleration=now.a
    )


def _goals(
    task: MotionTask, now: Sample, position: ArrayLike | None, orientation: ArrayLike | None
) -> tuple[ArrayLike, ArrayLike]:
    """Fill in the goals that are kept: those of a way that is being led, or where the target is."""
    led, kept = task.target, (now.x[:3, 3], now.x[:3, :3])
    if isinstance(led, PoseReference):
        ways = (led.position, led.orientation)
        if isinstance(ways[0], JerkLimited) and isinstance(ways[1], OrientationJerkLimited):
            kept = (ways[0].goal, ways[1].goal)
    return (
        kept[0] if position is None else position,
        np.array(kept[1]) if orientation is None else orientation,
    )


def _pose(now: Sample, t: float, position: ArrayLike, orientation: ArrayLike) -> Reference:
    linear = Sample(now.x[:3, 3], now.v[:3], now.a[:3])
    angular = Sample(now.x[:3, :3], now.v[3:], now.a[3:])
    return PoseReference(_position(linear, t, position), _orientation(angular, t, orientation))
