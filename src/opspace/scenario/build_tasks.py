"""Builds tasks from what a scenario says about them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from opspace import tasks
from opspace.errors import InputError, OpspaceError, UnknownNameError, unknown_name
from opspace.robots.protocol import Robot
from opspace.scenario import task_entries as entries
from opspace.scenario.document import Key
from opspace.scenario.references import Space, as_reference, build_target, rotations, vectors
from opspace.scenario.schema import Scenario
from opspace.scenario.targets import PoseParts
from opspace.tasks.joint_layout import joint_layout
from opspace.tasks.motions import CenterOfMass, MotionSource, RelativeFrame, WorldFrame
from opspace.tasks.tracking import TrackingTask
from opspace.tasks.validation import Array

KINDS: Mapping[type[entries.TaskEntry], type[TrackingTask]] = {
    entries.Position: tasks.PositionTask,
    entries.Orientation: tasks.OrientationTask,
    entries.Pose: tasks.PoseTask,
    entries.Posture: tasks.PostureTask,
    entries.Joint: tasks.JointTask,
    entries.Com: tasks.ComTask,
    entries.RelativePosition: tasks.RelativePositionTask,
    entries.RelativeOrientation: tasks.RelativeOrientationTask,
    entries.RelativePose: tasks.RelativePoseTask,
}

_NOT_OPTIONS = ("type", "level", "present", "target")


def build_tasks(scenario: Scenario, robot: Robot) -> dict[str, TrackingTask]:
    """Build every task of a scenario.

    Args:
        scenario: The scenario.
        robot: The robot, updated at the start of the run.

    Returns:
        Tasks bound to the robot, by name.

    Raises:
        ScenarioError: A name that the robot does not have, or a value that does not fit it.
    """
    built: dict[str, TrackingTask] = {}
    for name, entry in scenario.tasks.items():
        for key, problem in _unknown_names(entry, robot):
            raise scenario.error(("tasks", name, *key), problem) from None
        options = {
            key: getattr(entry, key) for key in type(entry).model_fields if key not in _NOT_OPTIONS
        }
        try:
            task = KINDS[type(entry)](**options, name=name)
            task.bind(robot)
        except OpspaceError as error:
            raise scenario.error(("tasks", name), str(error)) from error
        try:
            task.target = _target(entry, robot)
        except OpspaceError as error:
            raise scenario.error(("tasks", name, "target"), str(error)) from error
        built[name] = task
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


def _unknown_names(entry: entries.TaskEntry, robot: Robot) -> Iterator[tuple[Key, str]]:
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


def _target(entry: entries.TaskEntry, robot: Robot) -> Any:
    match entry:
        case entries.Joint():
            start = robot.q[joint_layout(robot, [entry.joint]).entries]
            return build_target(entry.target, vectors(start, np.atleast_1d))
        case entries.Posture():
            return build_target(entry.target, _posture(entry, robot))
    motion = _source(entry)
    motion.bind(robot)
    found = motion.measure(robot)
    match entry:
        case entries.Orientation() | entries.RelativeOrientation():
            return build_target(entry.target, rotations(found.rotation))
        case entries.Pose() | entries.RelativePose():
            return _pose(entry.target, vectors(found.position), rotations(found.rotation))
        case entries.Position() | entries.RelativePosition() | entries.Com():
            return build_target(entry.target, vectors(found.position))
        case _:
            raise AssertionError(entry)


def _source(entry: entries.TaskEntry) -> MotionSource:
    match entry:
        case entries.RelativePosition() | entries.RelativeOrientation() | entries.RelativePose():
            return RelativeFrame(entry.frame, entry.reference_frame)
        case entries.Position() | entries.Pose():
            offset = None if entry.offset is None else np.asarray(entry.offset)
            return WorldFrame(entry.frame, offset)
        case entries.Orientation():
            return WorldFrame(entry.frame)
        case _:
            return CenterOfMass()


def _posture(entry: entries.Posture, robot: Robot) -> Space:
    layout = joint_layout(robot, entry.joints)

    def read(value: str | tuple[float, ...]) -> Array:
        return layout.select(configuration(value, robot), "target")

    return vectors(robot.q[layout.entries], read)


def _pose(target: PoseParts | tuple[float, ...] | None, position: Space, rotation: Space) -> Any:
    if not isinstance(target, PoseParts):
        return target
    return tasks.PoseReference(
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
