"""A controller as numbers that a program without Python goes on from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from opspace.controller.batch import check_count
from opspace.controller.reference import ReferenceController
from opspace.errors import InputError, unknown_name
from opspace.plan.image import Image, image
from opspace.plan.pack_task import Packed
from opspace.plan.plan import Plan
from opspace.robots.adapter import AdapterBase
from opspace.stack import Member, Variable
from opspace.tasks.tracking import TrackingTask

if TYPE_CHECKING:
    from opspace.controller.controller import Controller


class Exported(NamedTuple):
    """What a program needs to tick as a controller does.

    Attributes:
        robot: The robot.
        plan: The layout of the tasks, which has not ticked.
        image: Its memory.
        period: Time between two ticks that was announced, s; 0 if none was.
        robot_adds: Whether the robot adds the torque against gravity.
    """

    robot: AdapterBase
    plan: Plan
    image: Image
    period: float
    robot_adds: bool


def exported(controller: Controller, absent: Sequence[str], profile: str) -> Exported:
    """Lay the tasks of the present stack out as at a start, for somebody else to tick.

    Args:
        controller: The controller; nothing about it changes.
        absent: Names of the tasks that are not there at first.
        profile: Name of the profile of all transitions, see `opspace.Profile`.

    Raises:
        InputError: The controller does something at its ticks that only Python can.
        UnknownNameError: The stack has no task of a name, or there is no such profile.
    """
    _check(controller)
    members = controller.stack.members
    names = [member.task.name for member in members]
    for name in absent:
        if name not in names:
            raise unknown_name("task in the stack", str(name), names)
    check_count(members, "an exported controller")
    rested = tuple(
        Member(m.task, Variable(float(m.task.name not in absent), profile), m.places)
        for m in members
    )
    robot, axes = controller.robot, controller._compiled_robot()
    if axes is None or controller._bodies is None or not isinstance(robot, AdapterBase):
        raise InputError(
            f"robot {robot.name!r} is not one of load_robot with hinges and slides; an exported "
            "controller needs its bodies"
        )
    plan = controller._planned(rested, axes)
    for packed in plan.packed:
        if not packed.settled:
            raise InputError(_reason(packed))
    timing = controller._rules.period, controller._robot_adds
    return Exported(robot, plan, image(plan.handle), *timing)


def _check(controller: ReferenceController) -> None:
    """Refuse by name what ticks of Python do and the exported one would leave out."""
    stack, limits = controller.stack, controller.stack.limits
    reasons = {
        "a floating base: contacts come and go in Python only": controller._base > 0,
        "collisions: what is kept apart may move in Python only": controller.collisions is not None,
        "on_time_jump other than 'report'": controller._holds
        or (controller._timing is not None and controller._timing.policy != "report"),
        f"observer_time of {type(limits).__name__}": controller._observer is not None,
        "a handover": controller._handover is not None,
        "a payload that is being taken": controller._loading is not None,
        "a transition on its way": not stack.settled,
        "a request that waits in the stack, such as an event of a scenario": stack.waiting,
    }
    for what, there in reasons.items():
        if there:
            raise InputError(f"an exported controller cannot have {what}")
    if own := controller._not_compiled():  # pyright: ignore[reportAttributeAccessIssue]
        raise InputError(f"an exported controller cannot call {own}")


def _reason(packed: Packed) -> str:
    """Say why a task is not numbers that stay."""
    task = packed.task
    if packed.own_kind:
        why = f"({type(task).__name__}) is evaluated in Python"
    elif packed.called is not None:
        why = "has an activation in Python: export it without, and set it from C"
    elif isinstance(task, TrackingTask) and task.holds_nothing_yet:
        why = "will hold what it finds at its first tick: give it a target"
    elif task._gains.max_acceleration is not None:
        why = "has a max_acceleration, which is kept in Python: send it targets that go on smoothly"
    elif task.ki is not None:
        why = "has a ki: integral action is in Python"
    else:
        why = "follows a reference in time: give it a target, and set later ones from C"
    return f"task {task.name!r} {why}"
