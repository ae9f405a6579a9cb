"""What a run of a sweep did to its limits, whoever asked for what."""

from __future__ import annotations

import numpy as np

from opspace.command import Command, Status
from opspace.robots.motor_range import motor_range
from opspace.scenario.build import Built
from opspace.tasks.joint_limits import Side

UNITS = {
    "max_torque_step": "N·m",
    "max_torque_use": "1",
    "max_joint_speed": "rad/s",
    "position_excess": "rad",
    "position_outside": "rad",
    "speed_excess": "rad/s",
    "distance_excess": "m",
    "not_finite": "ticks",
    "above_torque_limit": "ticks",
    "max_hard_solves": "1",
}
"""The unit of each number of a row; for joints that slide read N, m/s and m."""

_ROUNDING = 1e-9


class LimitWatch:
    """The observer of a run that keeps numbers instead of columns.

    ``position_excess`` is how far any joint went beyond a limit that could be respected: one that it
    had once been able to stop at, v <= v_adm(d) (`opspace.JointLimits`), and since then neither a
    push has driven it nor has a tick said ``LIMIT_LOST``. ``speed_excess`` likewise, for joints that
    were slow enough once. ``position_outside`` asks for no reason: it is how far any joint went beyond a
    limit that it had once been inside of. ``distance_excess`` is how much nearer than the margin a pair
    of bodies came, as measured, that is kept apart (`opspace.CollisionAvoidance`) and had once been
    outside of it, before the first push and the first tick that said ``COLLISION_LOST``; NaN where
    nothing is kept apart.

    Args:
        built: The run.
    """

    def __init__(self, built: Built) -> None:
        limits = built.stack.limits
        self._limits = limits
        self._sides: tuple[Side, ...] = () if limits is None else limits.sides
        self._sign = np.array([side.sign for side in self._sides])
        self._index = np.array([side.index for side in self._sides], dtype=int)
        self._limit = np.array([side.limit for side in self._sides])
        self._speed = np.array([side.speed for side in self._sides])
        self._rounding = _ROUNDING * self._speed
        self._stops = np.zeros(len(self._sides), dtype=bool)
        self._slow = np.zeros(len(self._sides), dtype=bool)
        self._inside = np.zeros(len(self._sides), dtype=bool)
        self._guard = built.controller.collisions
        self._within: set[str] | None = None
        self._kept = True
        self._plant = built.plant
        self._pushes = built.scenario.plant.pushes
        self._motors = motor_range(built.robot)
        self._dt = built.scenario.dt
        self._last: np.ndarray | None = None
        self._ticks = dict.fromkeys((status for status in Status if status), 0)
        self.numbers: dict[str, float] = dict.fromkeys(UNITS, 0.0)
        if self._guard is None:
            self.numbers["distance_excess"] = np.nan

    def observe(self, q: np.ndarray, v: np.ndarray, command: Command) -> None:
        """See one tick; the plant's state counts, not the measured one, except for distances."""
        del q, v
        tau, numbers = command.tau, self.numbers
        v = self._plant.v
        if self._last is not None:
            self._most("max_torque_step", float(np.abs(tau - self._last).max()))
        self._last = tau
        used = float((np.abs(tau - self._motors.middle) / self._motors.limit).max())
        self._most("max_torque_use", used)
        self._most("max_joint_speed", float(np.abs(v).max()))
        self._most("max_hard_solves", float(command.hard_solves))
        numbers["not_finite"] += not np.isfinite(tau).all()
        numbers["above_torque_limit"] += used > 1.0
        # Nearly every tick has none.
        for status in self._ticks if command.status else ():
            self._ticks[status] += status in command.status
        pushed = self._pushed(command.t)
        self._watch_limits(command, self._plant.q, v, pushed)
        self._watch_distances(command, pushed)

    @property
    def seconds(self) -> dict[str, float]:
        """How long each status held that was seen, s."""
        return {str(s.name): n * self._dt for s, n in self._ticks.items() if n}

    def _most(self, name: str, value: float) -> None:
        self.numbers[name] = max(self.numbers[name], value)

    def _pushed(self, t: float) -> bool:
        return any(p.at <= t <= p.at + p.duration + self._dt for p in self._pushes)

    def _watch_distances(self, command: Command, pushed: bool) -> None:
        guard = self._guard
        if guard is None:
            return
        self._kept &= not pushed and Status.COLLISION_LOST not in command.status
        if not self._kept:
            return
        beyond = {pair: guard.margin - d.distance for pair, d in command.distances.items()}
        beyond = {pair: value for pair, value in beyond.items() if value > 0.0}
        # Those that have been within the margin from the start on are not the controller's fault.
        self._within = beyond.keys() & (beyond.keys() if self._within is None else self._within)
        for pair in beyond.keys() - self._within:
            self._most("distance_excess", beyond[pair])

    def _watch_limits(self, command: Command, q: np.ndarray, v: np.ndarray, pushed: bool) -> None:
        limits = self._limits
        if limits is None:
            return
        distance = self._sign * (self._limit - q[self._index])
        towards = self._sign * v[self._index]
        beyond = np.maximum(-distance - limits.clearance - _ROUNDING, 0.0)
        inside = beyond == 0.0
        self._inside |= inside
        out = None if inside.all() else beyond
        self._most("position_outside", _largest(out, self._inside))
        if pushed or Status.LIMIT_LOST in command.status:
            self._stops[:] = self._slow[:] = False
            return
        for i in np.flatnonzero(~self._stops & (distance >= 0.0)):
            allowed = limits.allowed_speed(self._sides[i], float(distance[i]))
            self._stops[i] = towards[i] <= allowed
        self._slow |= towards <= self._speed
        self._most("position_excess", _largest(out, self._stops))
        over = towards - self._speed
        fast = self._slow & (over > self._rounding)
        self._most("speed_excess", _largest(over if fast.any() else None, fast))


def _largest(values: np.ndarray | None, where: np.ndarray) -> float:
    """Return the largest of some values; 0 of none."""
    return 0.0 if values is None else float(np.max(values, where=where, initial=0.0))
