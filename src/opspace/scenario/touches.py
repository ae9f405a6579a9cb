"""Joins tasks to the force tasks whose touch they go by."""

from __future__ import annotations

from collections.abc import Mapping

from opspace.errors import OpspaceError, unknown_name
from opspace.robots.protocol import Robot
from opspace.scenario.document import Key
from opspace.scenario.schema import Scenario
from opspace.scenario.surface_entries import ActivationEntry
from opspace.tasks import ActivationUnion, Contact, ForceTask, GiveWay, Task
from opspace.tasks.contact import HardContact
from opspace.tasks.motion_task import MotionTask
from opspace.tasks.quantities import Pose


def join_touches(scenario: Scenario, robot: Robot, tasks: Mapping[str, Task]) -> None:
    """Give tasks their activations, and let targets give way.

    Args:
        scenario: The scenario.
        robot: The robot, updated at the start of the run.
        tasks: Its tasks by name, bound; they are changed.

    Raises:
        ScenarioError: There is no force task of a name, nothing that it could press, or no frame.
    """
    forces = {name: task for name, task in tasks.items() if isinstance(task, ForceTask)}
    _check_world(scenario, robot, forces)

    def force(key: Key, name: str) -> ForceTask:
        if name not in forces:
            raise scenario.error(key, str(unknown_name("force task", name, forces)))
        return forces[name]

    for name, entry in scenario.tasks.items():
        task, key = tasks[name], ("tasks", name, "activation")
        activation, touched = entry.activation, None
        if activation is not None and activation.contact is not None:
            kind = Contact if scenario.method == "transition" else HardContact
            touched = kind(force((*key, "contact"), activation.contact))
        if activation is not None:
            try:
                task.activation = _joined(activation, touched, robot)
            except OpspaceError as error:
                raise scenario.error((*key, "near"), str(error)) from error
        pressing = getattr(entry, "give_way", None)
        if pressing is not None and isinstance(task, MotionTask):
            found = force(("tasks", name, "give_way"), pressing)
            if isinstance(task.quantity, Pose):
                raise scenario.error(
                    ("tasks", name, "give_way"),
                    "is for a position; a spring of six numbers gives way with a stiffness of 0",
                )
            held = task.source.measure(robot).position
            task.target = GiveWay(held if task.target is None else task.target, found)


def _joined(
    entry: ActivationEntry, touched: Contact | None, robot: Robot
) -> Contact | ActivationUnion:
    if entry.near is None:
        assert touched is not None
        return touched
    near = entry.near.build()
    near.bind(robot)
    return ActivationUnion(near) if touched is None else ActivationUnion(touched, near)


def _check_world(scenario: Scenario, robot: Robot, forces: Mapping[str, ForceTask]) -> None:
    """Refuse what would never be measured."""
    for name, task in forces.items():
        if not (scenario.plant.surfaces or scenario.plant.holes):
            raise scenario.error(
                ("tasks", name),
                "presses on nothing: the plant has no surfaces and no holes, so no wrench",
            )
        if task.sensor != robot.tool:
            raise scenario.error(
                ("tasks", name, "frame"),
                f"surfaces touch the tool, {robot.tool!r}, and nothing measures the wrench of "
                f"{task.sensor!r}",
            )
