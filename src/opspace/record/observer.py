"""The observer that writes every tick of a run into a recording."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from opspace.command import Command, LevelStatus, TaskStatus
from opspace.contacts import GroundContact
from opspace.controller import ReferenceController
from opspace.errors import InputError
from opspace.record.contact_columns import Felt, columns_of_contacts, row_of_contacts
from opspace.record.format import Column, Ended
from opspace.record.obstacle_columns import CollisionRows, columns_of_collisions
from opspace.record.subject import subject_of
from opspace.record.wrench_columns import (
    columns_of_touches,
    columns_of_wrenches,
    row_of_touches,
    row_of_wrenches,
    sensors_of,
)
from opspace.record.writer import Recorder
from opspace.robots import Robot
from opspace.robots.joint_units import coordinates, effort_unit, joint_units
from opspace.tasks import Task

State = Callable[[], tuple[np.ndarray, np.ndarray]]
"""Tells a configuration (nq,) and a velocity (n,)."""

NOT_RECORDED = 0, 0
"""Place and size of a task or level that has no columns."""
_TWIST = {
    **{axis: f"linear part along {axis}" for axis in "xyz"},
    **{f"r{axis}": f"angular part about {axis}" for axis in "xyz"},
}
"""Axes of a direction in the world, and what they are."""
STATUS = Column("status", "1", "status flags of the command")


def state_columns(robot: Robot) -> list[Column]:
    """List the columns t, q, v and tau of a robot's recording."""
    joints = list(zip(robot.joint_names, joint_units(robot), strict=True))
    return [
        Column("t", "s", "time"),
        *(Column(f"q/{j}", unit, f"joint position of {j}") for j, unit in coordinates(robot)),
        *(Column(f"v/{j}", f"{unit}/s", f"joint velocity of {j}") for j, unit in joints),
        *(
            Column(f"tau/{j}", effort_unit(unit), f"commanded joint torque, bias included of {j}")
            for j, unit in joints
        ),
    ]


def columns_of(
    controller: ReferenceController,
    tasks: Sequence[Task] = (),
    levels: Mapping[float, Sequence[Task]] | None = None,
    contacts: Sequence[GroundContact] | None = None,
    measured: bool = False,
) -> list[Column]:
    """List the columns of a controller's recording, in the order of `TickRecorder`'s rows.

    Args:
        controller: The controller that will be recorded.
        tasks: Prepared tasks that will be in its stack later.
        levels: Tasks that may be at each level, by its number; None takes those of the stack.
        contacts: Contacts that may ever be there; None takes those of the stack.
        measured: Whether the forces on them are measured.

    Returns:
        Columns with names, units and descriptions.
    """
    robot, stack = controller.robot, controller.stack
    levels = stack.levels_by_number if levels is None else levels
    columns = state_columns(robot)
    columns += [Column(f"tool/{a}", "m", f"{robot.tool} position, {a}") for a in "xyz"]
    for task in [*stack, *tasks]:
        columns.append(Column(f"tasks/{task.name}/activation", "1", f"activation of {task.name}"))
        columns.append(
            Column(
                f"tasks/{task.name}/level", "1", "number of its level; on its way the mean of two"
            )
        )
        columns += [
            Column(f"tasks/{task.name}/error/{i}", unit, f"row {i}: desired minus actual")
            for i, unit in enumerate(task.error_units)
        ]
    for number, level in levels.items():
        size, prefix = _directions(controller, level), f"levels/{number:g}"
        names = ", ".join(task.name for task in level)
        columns += [
            Column(f"{prefix}/sigma/{k}", "1", f"eigenvalue {k} of Eq. 25 of {names}")
            for k in range(size)
        ]
        columns += [
            Column(f"{prefix}/activation/{k}", "1", f"activation of direction {k} of {names}")
            for k in range(size)
        ]
        columns += [
            Column(f"{prefix}/weakest/{axis}", "1", f"weakest direction of {names}, {what}")
            for axis, what in _TWIST.items()
        ]
    if stack.limits is not None:
        columns += [
            Column(f"limits/{side.name}", "1", f"activation of the limit {side.name}")
            for side in stack.limits.sides
        ]
    if controller.collisions is not None:
        columns += columns_of_collisions(controller.collisions)
    recorded = [*stack, *tasks]
    touching = list(stack.contacts.values()) if contacts is None else contacts
    if robot.floating_base:
        columns += [Column(f"com/{a}", "m", f"centre of mass, {a}") for a in "xyz"]
    return [
        *columns,
        *columns_of_contacts(touching, measured=measured),
        *columns_of_wrenches(sensors_of(recorded)),
        *columns_of_touches(recorded),
        Column("hard_solves", "1", "hard torques in the blend"),
        STATUS,
    ]


class TickRecorder:
    """Record a run: one row per tick, on disk before the plant advances.

    The columns are those of the tasks and levels in the stack at the start, and of the tasks and
    levels declared here; they hold NaN while there is no such task or level. A task or a level
    that appears without having been declared is not recorded, and of a level that grows beyond
    what was declared only the strongest directions are.

    Args:
        directory: Where the recording is written.
        controller: The controller of the run.
        header: What the recording says about itself: scenario, seed, time step.
        tasks: Tasks that will be inserted later.
        levels: Tasks that may ever be at each level, by its number; None takes those of the stack.
        truth: Tells the true state where the sensors are noisy; it is recorded as ``true/q`` and
            ``true/v``. None where the measured state is the true one.
        contacts: Contacts that will be inserted later, beside those of the stack.
        felt: Tells the forces on the contacts where they are measured.
        overwrite: Replace a recording that is already there.

    Raises:
        InputError: A declared task does not fit the robot, or its name is taken.
        UnknownNameError: A declared task names what the robot does not have.
        RecordingError: There is a recording already, or the directory cannot be written.
    """

    def __init__(
        self,
        directory: Path,
        controller: ReferenceController,
        header: Mapping[str, object],
        *,
        tasks: Sequence[Task] = (),
        levels: Mapping[float, Sequence[Task]] | None = None,
        truth: State | None = None,
        contacts: Sequence[GroundContact] = (),
        felt: Felt | None = None,
        overwrite: bool = False,
    ) -> None:
        stack = controller.stack
        for task in tasks:
            stack.prepare(task)
        self._controller = controller
        self._tool = controller.robot.frame_id(controller.robot.tool)
        names = [task.name for task in [*stack, *tasks]]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"two tasks to record are named {name!r}")
        levels = stack.levels_by_number if levels is None else levels
        self._tasks = {task.name: task for task in [*stack, *tasks]}
        sizes = {number: _directions(controller, level) for number, level in levels.items()}
        self._sensors = sensors_of(list(self._tasks.values()))
        self._truth = truth
        guard = controller.collisions
        self._apart = None if guard is None else CollisionRows(controller, guard)
        self._contacts = {one.name: one for one in [*stack.contacts.values(), *contacts]}
        self._felt = felt
        touching = list(self._contacts.values())
        columns = columns_of(controller, tasks, levels, touching, felt is not None)
        if truth is not None:
            columns += _truth_columns(controller)
        about = {**subject_of(controller, tasks, touching), **header}
        self._recorder = Recorder(directory, columns, about, overwrite=overwrite)
        self._row = np.full(len(columns), np.nan)
        self._known = controller.robot.nq + 2 * controller.robot.nv + 4
        place = self._known
        self._task_places: dict[str, tuple[int, int]] = {}
        for name, task in self._tasks.items():
            self._task_places[name] = place, task.rows
            place += 2 + task.rows
        self._level_places: dict[float, tuple[int, int]] = {}
        for number, size in sizes.items():
            self._level_places[number] = place, size
            place += 2 * size + len(_TWIST)
        self._rest = place

    def observe(self, q: np.ndarray, v: np.ndarray, command: Command) -> None:
        """Write one tick."""
        controller, row = self._controller, self._row
        row.fill(np.nan)
        state = [command.t], q, v, command.tau, controller.robot.position(self._tool)
        np.concatenate(state, out=row[: self._known])
        self._put_tasks(command.tasks)
        self._put_levels(command.levels)
        np.concatenate(self._others(command), out=row[self._rest :])
        self._recorder.append(row)

    def _put_tasks(self, tasks: Mapping[str, TaskStatus]) -> None:
        row = self._row
        for name, found in tasks.items():
            place, rows = self._task_places.get(name, NOT_RECORDED)
            if rows:
                row[place], row[place + 1] = found.activation, _level(found)
                row[place + 2 : place + 2 + rows] = found.error

    def _put_levels(self, levels: Sequence[LevelStatus]) -> None:
        row = self._row
        for level in levels:
            place, size = self._level_places.get(level.level, NOT_RECORDED)
            known = min(size, level.sigma.size)
            if known:
                row[place : place + known] = level.sigma[:known]
                place += size
                row[place : place + known] = level.activation[:known]
                self._put_weakest(level, row[place + size : place + size + len(_TWIST)])

    def _put_weakest(self, level: LevelStatus, into: np.ndarray) -> None:
        """Put the direction that a level would lose first, as a motion in the world, (6,)."""
        robot, row, weakest = self._controller.robot, 0, np.zeros(len(_TWIST))
        direction = level.directions[:, int(np.argmin(level.sigma))]
        for name in level.tasks:
            task = self._tasks.get(name)
            axes = None if task is None else task.row_axes(robot)
            if axes is None:
                return
            weakest += direction[row : row + len(axes)] @ axes
            row += len(axes)
        into[:] = weakest

    def _others(self, command: Command) -> list[ArrayLike]:
        """Limits, distances, contacts, wrenches, and how the tick ended, as their columns stand."""
        controller = self._controller
        parts: list[ArrayLike] = []
        if controller.stack.limits is not None:
            # Worked out anew each time it is asked for.
            limits = command.limits
            parts.append([limits.get(s.name, 0.0) for s in controller.stack.limits.sides])
        if self._apart is not None:
            parts += self._apart.row(command.distances)
        if controller.robot.floating_base:
            parts.append(controller.robot.com_position())
        felt = None if self._felt is None else self._felt()
        parts += row_of_contacts(list(self._contacts.values()), command.contacts, felt)
        parts += row_of_wrenches(controller.wrenches, self._sensors)
        parts += row_of_touches(list(self._tasks.values()))
        parts.append([float(command.hard_solves), float(command.status)])
        if self._truth is not None:
            parts += self._truth()
        return parts

    def close(self, how: Ended = "completed", reason: str = "") -> None:
        """Finish the recording and say how the run ended."""
        self._recorder.close(how, reason)


def _level(found: TaskStatus) -> float:
    """Return the number of a task's level, exactly where it is at one."""
    if len(found.levels) == 1:
        return found.levels[0][0]
    whole = sum(weight for _, weight in found.levels)
    return sum(number * weight for number, weight in found.levels) / whole if whole else np.nan


def _truth_columns(controller: ReferenceController) -> list[Column]:
    robot = controller.robot
    speeds = zip(robot.joint_names, joint_units(robot), strict=True)
    named = [("q", "joint position", coordinates(robot))]
    named.append(("v", "joint velocity", tuple((j, f"{unit}/s") for j, unit in speeds)))
    return [
        Column(f"true/{group}/{j}", unit, f"{what} of {j}, without the sensors' noise")
        for group, what, numbers in named
        for j, unit in numbers
    ]


def _directions(controller: ReferenceController, level: Sequence[Task]) -> int:
    return min(sum(task.rows for task in level), controller.robot.nv)
