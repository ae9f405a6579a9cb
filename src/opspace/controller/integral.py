"""Integral action: takes away what friction and payload leave of an error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from opspace.command import Command, LevelStatus, Status
from opspace.law.scalars import LONGEST_LESSON
from opspace.plan.pack_integrals import PackedIntegrals
from opspace.plan.scales import Scales
from opspace.robots.protocol import Robot
from opspace.stack import Member
from opspace.tasks import TrackingTask

FROZEN = ~(Status.OK | Status.DIRECTION_OFF | Status.LATE)
"""What keeps all integrals where they are: limits, motors, faults, another controller's torque."""
ON = 1.0 - 1e-9
"""A direction is on from this activation."""


class IntegralAction:
    r"""Integrates the errors of the tasks that ask for it, from tick to tick.

        z ← clip(z + k_i Δt P e, ± k_p e_max),        f* = a_d + k_v (v_d − ẋ) + k_p (x_d − x) + z

    P projects on the directions of the task's level that are fully on. A task on its way in, out or to
    another level, one whose error asks for more than its ``max_speed``, and every task while the status
    says that anything saturates, keep their z: what did not follow the command teaches nothing.

    Args:
        robot: The robot.
        scales: References of the tasks' rows.
    """

    def __init__(self, robot: Robot, scales: Scales) -> None:
        self._robot = robot
        self._scales = scales
        self._before: float | None = None

    def after(
        self,
        command: Command,
        members: Sequence[Member],
        compiled: PackedIntegrals | None = None,
    ) -> None:
        """Learn from the errors of a tick.

        Args:
            command: Its answer.
            members: Its tasks.
            compiled: What does it for all of them, where compiled code has ticked.
        """
        before, self._before = self._before, command.t
        if before is None:
            return
        dt = command.t - before
        if not 0.0 < dt <= LONGEST_LESSON or command.status & FROZEN:
            return
        if compiled is not None:
            compiled.learn(dt, int(command.status))
            return
        rows = {member.task.name: member.task.rows for member in members}
        for member in members:
            task = member.task
            if isinstance(task, TrackingTask) and task.ki is not None:
                self._integrate(task, command, rows, dt)

    def _integrate(
        self, task: TrackingTask, command: Command, rows: Mapping[str, int], dt: float
    ) -> None:
        status = command.tasks[task.name]
        if status.activation < 1.0 or len(status.levels) > 1 or task.asks_too_much(status.error):
            return
        error, level = status.error, command.levels[0]
        if command.status & Status.DIRECTION_OFF or task.name not in level.tasks:
            level = next((one for one in command.levels if task.name in one.tasks), None)
            if level is None or not level.sigma.size:
                return  # nothing is left to it
            first = sum(rows[name] for name in level.tasks[: level.tasks.index(task.name)])
            error = self._on(task, level, slice(first, first + task.rows), error)
        task.integrate(self._robot, error, dt)

    def _on(
        self, task: TrackingTask, level: LevelStatus, mine: slice, error: np.ndarray
    ) -> np.ndarray:
        """Return the part of an error (m,) in the directions of its level that are on."""
        weight = 1.0 / np.sqrt(self._scales.reference(task))
        D = level.directions[mine, level.activation >= ON]
        return D @ (D.T @ (weight * error)) / weight
