"""A controller as numbers that a program without Python goes on from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from opspace.contacts import GroundContact
from opspace.controller.batch import check_count
from opspace.controller.falling import FallWatch
from opspace.controller.reference import ReferenceController
from opspace.errors import InputError, unknown_name
from opspace.plan.image import Image, image
from opspace.plan.pack_contacts import fits
from opspace.plan.pack_task import Packed
from opspace.plan.plan import MOST, Plan
from opspace.robots.adapter import AdapterBase
from opspace.stack import ContactMember, Member, Variable
from opspace.stack.changes import checked_level
from opspace.stack.members import Place
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
        levels: Numbers of the levels, the most important first.
        at: Level of each task at first, a place among these.
        moves: Changes of place that can be on their way at once.
        base: Coordinates without a motor.
        contacts: What the robot may touch, packed in this order.
        there: Which of these it touches at first.
        fall: What watches whether it falls, or None.
    """

    robot: AdapterBase
    plan: Plan
    image: Image
    period: float
    robot_adds: bool
    levels: tuple[float, ...]
    at: tuple[int, ...]
    moves: int
    base: int
    contacts: tuple[GroundContact, ...]
    there: tuple[bool, ...]
    fall: FallWatch | None


def exported(
    controller: Controller,
    absent: Sequence[str],
    profile: str,
    levels: Sequence[float],
    moves: int,
) -> Exported:
    """Lay the tasks of the present stack out as at a start, for somebody else to tick.

    Args:
        controller: The controller; nothing about it changes.
        absent: Names of the tasks and contacts that are not there at first.
        profile: Name of the profile of all transitions, see `opspace.Profile`.
        levels: Numbers of levels to which tasks may move, beside those of the stack.
        moves: Changes of place that can be on their way at once.

    Raises:
        InputError: The controller does something at its ticks that only Python can, or there are more
            moves than there is room for.
        UnknownNameError: The stack has no task or contact of a name, or there is no such profile.
    """
    _check(controller)
    members, contacts = controller.stack.members, tuple(controller.stack.contacts.values())
    names = [*(member.task.name for member in members), *(one.name for one in contacts)]
    for name in absent:
        if name not in names:
            raise unknown_name("task or contact in the stack", str(name), names)
    check_count(members, "an exported controller")
    at = [member.level for member in members]
    numbers = tuple(sorted({*at, *(checked_level(level) for level in levels)}))
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
    moves = moves if members else 0
    leads = any(_is_led(member) for member in members)
    room = _with_room(rested, numbers, moves, profile)
    plan = controller._planned_apart(room, axes, leads=leads)
    for packed in plan.packed:
        if not packed.settled:
            packed.pack_value()  # what its integral adds comes later
        if not packed.settled:
            raise InputError(_reason(packed))
    if plan.contacts is not None:
        everything = [ContactMember(contact, 1.0, 1.0) for contact in contacts]
        plan.contacts.begin(everything, robot, 0.0)
    beside = {} if plan.integrals is None else {"integrals": plan.integrals.handle}
    return Exported(
        robot,
        plan,
        image(plan.handle, **beside),
        controller._rules.period,
        controller._robot_adds,
        numbers,
        tuple(numbers.index(level) for level in at),
        moves,
        controller._base,
        contacts,
        tuple(contact.name not in absent for contact in contacts),
        controller._fall,
    )


def _with_room(
    members: tuple[Member, ...], levels: Sequence[float], moves: int, profile: str
) -> tuple[Member, ...]:
    """Add places that nobody is at: two for every change, and all levels.

    Raises:
        InputError: A tick has no room for so many.
    """
    room = (MOST - 2 * len(members)) // 2
    if not 0 <= moves <= room:
        raise InputError(f"with {len(members)} tasks moves is from 0 to {room}, not {moves}")
    unused = sorted({*levels} - {member.level for member in members})
    if len(unused) > 2 * moves:
        raise InputError(f"{len(unused)} more levels need moves={(len(unused) + 1) // 2} at least")
    if not moves or not members:
        return members
    arrivals = [one for _ in range(moves) for one in [Variable(0.0, profile)] * 2]
    free = [*unused, *[levels[0]] * (2 * moves - len(unused))]
    spare = tuple(Place(*one) for one in zip(free, arrivals, strict=True))
    # Whoever comes to one of them has no more rows than the widest.
    widest = max(members, key=lambda member: member.task.rows)
    wide = Member(widest.task, widest.presence, (*widest.places, *spare))
    return tuple(wide if member is widest else member for member in members)


def _check(controller: ReferenceController) -> None:
    """Refuse by name what ticks of Python do and the exported one would leave out."""
    stack, limits = controller.stack, controller.stack.limits
    reasons = {
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
    for contact in stack.contacts.values():
        if contact.activation is not None:
            raise InputError(
                f"an exported controller cannot call the activation of {contact.name!r}"
            )
    if not fits(stack.touching):
        raise InputError("an exported controller cannot have a contact of one's own class")
    if own := controller._not_compiled():  # pyright: ignore[reportAttributeAccessIssue]
        raise InputError(f"an exported controller cannot call {own}")


def _is_led(member: Member) -> bool:
    """Tell whether a task goes to its targets on ways."""
    return isinstance(member.task, TrackingTask) and member.task.max_acceleration is not None


def _reason(packed: Packed) -> str:
    """Say why a task is not numbers that stay."""
    task = packed.task
    if packed.own_kind:
        why = f"({type(task).__name__}) is evaluated in Python"
    elif packed.called is not None:
        why = "has an activation in Python: export it without, and set it from C"
    elif isinstance(task, TrackingTask) and task.holds_nothing_yet:
        why = "will hold what it finds at its first tick: give it a target"
    else:
        why = "follows a reference in time: give it a target, and set later ones from C"
    return f"task {task.name!r} {why}"
