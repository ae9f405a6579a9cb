"""What a recording says about the robot and the tasks it is about, for those who look at it later."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from opspace.contacts import GroundContact
from opspace.controller import ReferenceController
from opspace.record.contact_columns import GROUP, subject_of_contact
from opspace.record.obstacle_columns import HEADER_KEY, about_collisions
from opspace.record.wrench_columns import subject_of_touch
from opspace.robots.adapter import added_frames, held_joints
from opspace.robots.catalogue import CATALOGUE, locate
from opspace.robots.joint_units import joint_units
from opspace.robots.motor_range import motor_range
from opspace.robots.protocol import Robot
from opspace.tasks import ForceTask, ImpedanceTask, Task
from opspace.tasks.leading import can_be_led
from opspace.tasks.motion_task import MotionTask
from opspace.tasks.motions import CenterOfMass, WorldFrame
from opspace.tasks.quantities import Orientation, Position


def subject_of(
    controller: ReferenceController,
    tasks: Sequence[Task] = (),
    contacts: Sequence[GroundContact] = (),
) -> dict[str, Any]:
    """Describe robot, tasks and contacts in JSON's own types.

    Args:
        controller: The controller that is recorded.
        tasks: Tasks that are not in its stack yet.
        contacts: Contacts that are there or may come.

    Returns:
        ``robot`` (name or file, joints, their units and limits in rad or m, torque limits, the buffer
        before a limit in rad or m, and by limit the acceleration that its joint brakes with; null
        where there is none), ``tasks`` (units, stiffness, level, what its target can be led to, and
        where and with what a force task presses), ``contacts`` (frame, offset in m, friction, half
        the sides in m, direction of an edge, normal of an edge or a point), which only robots with
        a floating base have,
        and ``collisions``, see `opspace.record.obstacle_columns.about_collisions`, where something
        is kept apart.
    """
    stack = controller.stack
    found = {
        task.name: _task(task, number)
        for number, level in stack.levels_by_number.items()
        for task in level
    }
    found.update({task.name: _task(task, None) for task in tasks})
    about = {"robot": _robot(controller), "tasks": found}
    if controller.collisions is not None:
        about[HEADER_KEY] = about_collisions(controller.collisions)
    if contacts:
        about[GROUP] = {one.name: subject_of_contact(one) for one in contacts}
    return about


def _robot(controller: ReferenceController) -> dict[str, Any]:
    robot, limits = controller.robot, controller.stack.limits
    lower, upper = np.array(robot.q_lower), np.array(robot.q_upper)
    motors = motor_range(robot)
    for side in limits.sides if limits is not None else ():
        (upper if side.sign > 0 else lower)[side.index] = side.limit
    return {
        "name": robot.name,
        "file": None if _has_name(robot) or robot.source is None else str(robot.source),
        "floating_base": robot.floating_base,
        "locked_joints": dict(held_joints(robot)),
        "frames": added_frames(robot),
        "tool": robot.tool,
        "gravity": controller.gravity,
        "joints": list(robot.joint_names),
        "units": list(joint_units(robot)),
        "lower": _finite(lower),
        "upper": _finite(upper),
        "torque_limit": _finite(robot.torque_limit),
        "torque_range": [_finite(end) for end in (motors.least, motors.most)],
        "buffer": limits.buffer if limits is not None and limits.mode == "buffer" else None,
        "brake": {side.name: side.brake for side in limits.sides} if limits is not None else {},
    }


def _has_name(robot: Robot) -> bool:
    """Whether loading it by name gives this robot; a file of this name may be loaded otherwise."""
    entry = CATALOGUE.get(robot.name)
    return (
        entry is not None
        and locate(entry) == robot.source
        and robot.floating_base >= entry.floating_base
        and set(entry.locked_joints) <= set(held_joints(robot))
    )


def _task(task: Task, level: float | None) -> dict[str, Any]:
    return {
        "units": list(task.error_units),
        "kp": np.asarray(task.kp).tolist(),
        "level": level,
        "led_by": _led_by(task),
        **(_place(task) if can_be_led(task) else {}),
        **({"press": subject_of_touch(task)} if isinstance(task, ForceTask) else {}),
        **({"stiffness": task.stiffness.tolist()} if isinstance(task, ImpedanceTask) else {}),
    }


def _place(task: Task) -> dict[str, Any]:
    """Tell where the motion of a task is measured, and which rows of it its error has."""
    assert isinstance(task, MotionTask)
    source = task.source
    frame = source if isinstance(source, WorldFrame) else None
    offset = None if frame is None else frame.offset
    return {
        "frame": None if frame is None else frame.frame,
        "offset": None if offset is None else offset.tolist(),
        "center_of_mass": isinstance(source, CenterOfMass),
        "selection": task.selection.tolist(),
        "in_tool_axes": task.in_tool_axes,
    }


def _led_by(task: Task) -> list[str]:
    if not isinstance(task, MotionTask) or not can_be_led(task):
        return []
    one = {Position: ["position"], Orientation: ["orientation"]}
    return one.get(type(task.quantity), ["position", "orientation"])


def _finite(values: np.ndarray) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]
