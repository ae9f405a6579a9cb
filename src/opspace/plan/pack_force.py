"""Force and impedance tasks as numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from opspace.kernels.columns import CARRIES, FORCE, MOMENTUM, PRESS, SPRING
from opspace.law.press_columns import (
    APPROACH_SPEED,
    FLOOR,
    FOLLOWED,
    FORCE_RATE,
    FORCES,
    FRESH,
    FRICTION,
    GIVEN_AT,
    KI,
    KP,
    MAX_INTEGRAL,
    MEMORY_SIZE,
    OFF,
    ON,
    WANTED,
)
from opspace.machine.field_table import Record
from opspace.plan.pack_momentum import PackedMomentum
from opspace.plan.pack_task import Packed, code_of, kind_of
from opspace.robots.adapter import AdapterBase
from opspace.robots.motion_axes import MotionAxes
from opspace.stack import Member
from opspace.tasks.impedance import ImpedanceTask
from opspace.tasks.task import CHANGES


class PackedForce(Packed):
    """A force task in the arrays of a plan; see `Packed`.

    What it remembers is in the plan that ticks and nowhere else, see `opspace.tasks.touch_memory`.
    """

    _seen: object = None
    memory: np.ndarray

    def take_up(self) -> None:
        """Copy what the task remembers."""
        if self.task.memory.row is not self.memory:
            self.memory[:] = self.task.memory.row

    def keep(self) -> None:
        """Let the task remember here from now on."""
        self.task.memory.move(self.memory)

    @property
    def _changed(self) -> bool:
        return self._seen is not CHANGES.last

    @property
    def _packed_ahead(self) -> bool:
        return True

    def _pack_more(self, axes: MotionAxes) -> None:
        task, tick = self.task, self._tick
        self._pack_source(axes)
        at = self._presses[id(task)]
        self._row = tick.press[at]
        self.memory = self._row[:MEMORY_SIZE]
        self.memory[[FLOOR, GIVEN_AT, FRESH]] = np.inf, -np.inf, 1.0
        tick.kind[self.index, [PRESS, CARRIES]] = at, 1

    def _pack_ahead(self) -> None:
        """Pack all numbers, any of which may have changed where anything has."""
        self._seen = CHANGES.last
        task, tick, row = self.task, self._tick, self._row
        if task._gains is not self.gains:
            tick.kv[self.rows] = task._gains.kv
            self.gains = task._gains
        row[[FORCES, FRICTION, KI, KP]] = task.forces, task.friction, task.ki, task.kp
        row[[MAX_INTEGRAL, APPROACH_SPEED]] = task.max_integral, task.approach_speed
        row[[FORCE_RATE, FOLLOWED]] = task.force_rate, task.reach
        row[[OFF, ON]] = task.thresholds
        row[WANTED : WANTED + task.rows] = task.wanted

    def _pack(self, robot: AdapterBase, t: float) -> None:
        self._pack_ahead()


class PackedImpedance(Packed):
    """An impedance task in the arrays of a plan; see `Packed`."""

    _spring: tuple[object, ...] = ()

    @property
    def _changed(self) -> bool:
        return super()._changed or self._given() != self._spring

    def _pack_more(self, axes: MotionAxes) -> None:
        self._tick.kind[self.index, SPRING] = 1
        self._pack_spring()

    def _pack(self, robot: AdapterBase, t: float) -> None:
        self._pack_spring()
        super()._pack(robot, t)

    def _given(self) -> tuple[object, ...]:
        """What the spring is now: arrays that are replaced as a whole, by identity."""
        task = self.task
        return id(task._stiffness), task._ratio, id(task._force)

    def _pack_spring(self) -> None:
        self._spring = self._given()
        task, spring = self.task, self._tick.spring
        spring[self.rows, 0] = task._stiffness
        spring[self.rows, 1] = 2.0 * task._ratio * np.sqrt(task._stiffness)
        spring[self.rows, 2] = task._force


def pack(
    member: Member,
    index: int,
    first: int,
    axes: MotionAxes,
    tick: Record,
    presses: Mapping[int, int],
) -> Packed:
    """Lay a task out in the arrays of a plan; the arguments are those of `Packed`."""
    kind: Any = Packed
    code = code_of(member.task, axes)
    if code == FORCE:
        kind = PackedForce
    elif code == MOMENTUM:
        kind = PackedMomentum
    elif isinstance(member.task, ImpedanceTask) and code:
        kind = PackedImpedance
    return kind(member, index, first, axes, tick, presses)


def presses_of(members: tuple[Member, ...]) -> dict[int, int]:
    """Number the force tasks that compiled code evaluates, by identity."""
    tasks = [id(member.task) for member in members if kind_of(member.task) == FORCE]
    return {task: i for i, task in enumerate(tasks)}
