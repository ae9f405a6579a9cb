"""Builds tasks from what a scenario says about them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from opspace.errors import InputError, OpspaceError, UnknownNameError, unknown_name
from opspace.robots.protocol import Robot
from opspace.scenario.document import Key
from opspace.scenario.references import Values, as_reference, build_target, rotations, vectors
from opspace.scenario.schema import Scenario
from opspace.scenario.targets import PoseParts
from opspace.scenario.task_entries import PlacedEntry, TaskEntry
from opspace.scenario.touches import join_touches
from opspace.tasks import TASK_KINDS, PoseReference, PostureTask, Task
from opspace.tasks.joint_layout import joint_layout
from opspace.tasks.motion_task import MotionTask
from opspace.tasks.quantities import Pose
from opspace.tasks.tracking import TrackingTask
from opspace.tasks.validation import Array

_NOT_OPTIONS = ("type", "level", "present", "target", "activation", "give_way")


def build_tasks(scenario: Scenario, robot: Robot) -> dict[str, Task]:
    """Build every task of a scenario.

    Args:
        scenario: The scenario.
        robot: The robot, updated at the start of the run.

    Returns:
        Tasks bound to the robot, by name.

    Raises:
        ScenarioError: A name that the robot does not have, or a value that does not fit it.
    """
    built: dict[str, Task] = {}
    for name, entry in scenario.tasks.items():
        for key, problem in _unknown_names(entry, robot):
            raise scenario.error(("tasks", name, *key), problem) from None
        options = {
            key: getattr(entry, key) for key in type(entry).model_fields if key not in _NOT_OPTIONS
        }
        try:
            task = TASK_KINDS[entry.type].task(**options, name=name)
            task.bind(robot)
        except OpspaceError as error:
            raise scenario.error(("tasks", name), str(error)) from error
        try:
            if isinstance(task, TrackingTask) and isinstance(entry, TaskEntry):
                task.target = _target(task, entry, robot)
        except OpspaceError as error:
            raise scenario.error(("tasks", name, "target"), str(error)) from error
        built[name] = task
    join_touches(scenario, robot, built)
    return built


def configuration(value: str | tuple[float, ...], robot: Robot) -> Array:
    """Find a configuration by name or take its numbers.

    Args:
        value: Name, or joint values.
        robot: The robot.

    Returns:
        The numbers as given, or (nq,) for a name.

    Raises:
        UnknownNameError: The robot has no such configuration.
    """
    if not isinstance(value, str):
        return np.asarray(value, dtype=float)
    known = {"reference": robot.q_reference, **robot.configurations}
    if value not in known:
        raise unknown_name(f"configuration of {robot.name}", value, known)
    return np.array(known[value])


def _unknown_names(entry: PlacedEntry, robot: Robot) -> Iterator[tuple[Key, str]]:
    """Find names of frames and joints that the robot does not have."""
    for key in ("frame", "reference_frame"):
        frame = getattr(entry, key, None)
        if frame is not None and frame not in robot.frame_names:
            yield (key,), str(unknown_name("frame", frame, robot.frame_names))
    joint, joints = getattr(entry, "joint", None), getattr(entry, "joints", None)
    named = [(("joint",), joint)] if joint else []
    named += [(("joints", i), name) for i, name in enumerate(joints or ())]
    for key, name in named:
        try:
            joint_layout(robot, [name])
        except UnknownNameError as error:
            yield key, str(error)


def _target(task: TrackingTask, entry: TaskEntry, robot: Robot) -> Any:
    controls = TASK_KINDS[entry.type].controls
    if isinstance(task, PostureTask):
        layout = task.layout
        assert layout is not None  # bound
        start = robot.q[layout.entries]
        if controls == "joint":
            return build_target(entry.target, vectors(start, np.atleast_1d))

        def read(value: str | tuple[float, ...]) -> Array:
            return layout.select(configuration(value, robot), "target")

        return build_target(entry.target, vectors(start, read))
    assert isinstance(task, MotionTask)
    found = task.source.measure(robot)
    position, rotation = vectors(found.position), rotations(found.rotation)
    if controls == "pose":
        return _pose(entry.target, position, rotation)
    if isinstance(task.quantity, Pose) and entry.target is not None:
        led = as_reference(build_target(entry.target, position), position)
        return PoseReference(led, as_reference(None, rotation))
    return build_target(entry.target, position if controls == "position" else rotation)


def _pose(target: PoseParts | tuple[float, ...] | None, position: Values, rotation: Values) -> Any:
    if not isinstance(target, PoseParts):
        return target
    return PoseReference(
        as_reference(build_target(target.position, position), position),
        as_reference(build_target(target.orientation, rotation), rotation),
    )


def check_configuration(q: Array, robot: Robot) -> Array:
    """Refuse a configuration of another length.

    Args:
        q: Configuration.
        robot: The robot.

    Returns:
        The configuration.

    Raises:
        InputError: It does not have nq numbers.
    """
    if q.shape != (robot.nq,):
        raise InputError(
            f"must have {robot.nq} numbers, one for each of {', '.join(robot.joint_names)}, "
            f"not {q.size}"
        )
    return q
