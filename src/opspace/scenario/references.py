"""Builds what a task follows from what a scenario says about it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from opspace.errors import InputError
from opspace.scenario import targets
from opspace.scenario.arc import Arc
from opspace.tasks import (
    Chain,
    Circle,
    JerkLimited,
    MinimumJerk,
    OrientationMinimumJerk,
    Reference,
    ViaPoints,
)
from opspace.tasks.rotation import as_rotation, exp_rotation
from opspace.tasks.validation import Array

Move = Callable[[Array, Array, float, float], Reference]
"""Motion from one value to another: start, goal, duration [s], start time [s]."""


@dataclass(frozen=True)
class Values:
    """The values that a task can have.

    Attributes:
        start: Value at the start of the run.
        read: Makes a value from what the scenario says.
        shift: Adds an offset to a value.
        move: Goes straight from one value to another.
    """

    start: Array
    read: Callable[[Any], Array]
    shift: Callable[[Array, Any], Array]
    move: Move


def vectors(start: Array, read: Callable[[Any], Array] = np.asarray) -> Values:
    """Values that are added: points, joint positions.

    Args:
        start: Value at the start of the run.
        read: Makes a value from what the scenario says.

    Returns:
        The space.
    """
    return Values(start, read, lambda value, offset: value + np.asarray(offset), MinimumJerk)


def rotations(start: Array) -> Values:
    """Orientations; an offset is a rotation vector in the axes of the target.

    Args:
        start: (3, 3) rotation matrix at the start of the run.

    Returns:
        The space.
    """
    return Values(start, lambda value: as_rotation(value, "goal"), _turned, OrientationMinimumJerk)


def _turned(R: Array, offset: Any) -> Array:
    phi = np.asarray(offset, dtype=float)
    if np.linalg.norm(phi) >= np.pi:
        raise InputError("an offset of an orientation must be less than half a turn")
    return exp_rotation(phi) @ R


def build_target(target: Any, space: Values) -> Array | Reference | None:
    """Build a value or a reference.

    Args:
        target: What the scenario says.
        space: Values of the task.

    Returns:
        A value, a reference in time, or None to hold the start.

    Raises:
        InputError: A value that does not fit the task.
    """
    for kind, builder in _BUILDERS.items():
        if isinstance(target, kind):
            return builder(target, space)
    return None if target is None else space.read(target)


def as_reference(found: Array | Reference | None, space: Values) -> Reference:
    """Turn what ``build_target`` gives into a reference, a value into one that stays."""
    if callable(found):
        return found
    value = space.start if found is None else found
    return space.move(value, value, 1.0, 0.0)


def return_time(target: Any) -> float | None:
    """Time at which a target begins to come back to its start [s], None where it does not."""
    if isinstance(target, targets.OutAndBackEntry | targets.SwingEntry):
        return target.start_time + target.out_duration + target.hold_duration
    return None


def _goal(target: targets.MinimumJerkEntry | targets.JerkLimitedEntry, space: Values) -> Array:
    if target.goal is not None:
        return space.read(target.goal)
    return space.shift(space.start, target.offset)


def _there_and_back(
    target: targets.OutAndBackEntry | targets.SwingEntry, near: Array, far: Array, move: Move
) -> Chain:
    back = target.start_time + target.out_duration + target.hold_duration
    return Chain(
        (0.0, move(near, far, target.out_duration, target.start_time)),
        (back, move(far, near, target.back_duration, back)),
        start_time=0.0,
    )


def _hold(target: targets.HoldEntry, space: Values) -> None:
    del target, space


def _minimum_jerk(target: targets.MinimumJerkEntry, space: Values) -> Reference:
    return space.move(space.start, _goal(target, space), target.duration, target.start_time)


def _jerk_limited(target: targets.JerkLimitedEntry, space: Values) -> Reference:
    return JerkLimited(
        space.start,
        _goal(target, space),
        max_velocity=target.max_velocity,
        max_acceleration=target.max_acceleration,
        max_jerk=target.max_jerk,
        start_time=target.start_time,
    )


def _out_and_back(target: targets.OutAndBackEntry, space: Values) -> Reference:
    far = space.shift(space.start, target.offset)
    return _there_and_back(target, space.start, far, space.move)


def _via_points(target: targets.ViaPointsEntry, space: Values) -> Reference:
    if target.points:
        points = [space.read(point) for point in target.points]
    else:
        points = [space.shift(space.start, offset) for offset in target.offsets or ()]
    times = (target.start_time, *target.times)
    return ViaPoints(times, [space.start, *points], start_time=0.0)


def _stops(target: targets.StopsEntry, space: Values) -> Reference:
    here, legs = space.start, list[tuple[float, Reference]]()
    for i, move in enumerate(target.moves):
        there = (
            space.shift(space.start, move.offset) if move.goal is None else space.read(move.goal)
        )
        begins = move.at if i else 0.0
        legs.append((begins, space.move(here, there, move.duration, move.at)))
        here = there
    return Chain(*legs, start_time=0.0)


def _swing(target: targets.SwingEntry, space: Values) -> Reference:
    center, axis = np.asarray(target.center), np.asarray(target.axis)

    def move(near: Array, far: Array, duration: float, start_time: float) -> Reference:
        way = MinimumJerk(near, far, duration, start_time)
        return Arc(space.start, center, axis, target.angle, way)

    return _there_and_back(target, np.array(0.0), np.array(1.0), move)


def _circle(target: targets.CircleEntry, space: Values) -> Reference:
    def circle(center: Array) -> Circle:
        return Circle(
            center,
            target.radius,
            target.period,
            normal=target.normal,
            start_time=target.start_time,
            ramp=target.ramp,
        )

    return circle(space.start - circle(np.zeros(3)).start)


_BUILDERS: Mapping[type, Callable[[Any, Values], Reference | None]] = {
    targets.HoldEntry: _hold,
    targets.MinimumJerkEntry: _minimum_jerk,
    targets.JerkLimitedEntry: _jerk_limited,
    targets.OutAndBackEntry: _out_and_back,
    targets.SwingEntry: _swing,
    targets.StopsEntry: _stops,
    targets.ViaPointsEntry: _via_points,
    targets.CircleEntry: _circle,
}
