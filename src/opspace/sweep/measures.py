"""What a run of a sweep did to its limits, whoever asked for what."""

from __future__ import annotations

import numpy as np

from opspace.controller import Command, Status
from opspace.scenario.build import Built
from opspace.tasks.joint_limits import Side

UNITS = {
    "max_torque_step": "N·m",
    "max_torque_use": "1",
    "max_joint_speed": "rad/s",
    "position_excess": "rad",
    "speed_excess": "rad/s",
    "not_finite": "ticks",
    "above_torque_limit": "ticks",
    "max_hard_solves": "1",
}
"""The unit of each number of a row."""

_ROUNDING = 1e-9


class Watch:
    """The observer of a run that keeps numbers instead of columns.

    ``position_excess`` is how far any joint went beyond a limit that could be respected: one that it
    had once been able to stop at, v <= v_adm(d) (`opspace.JointLimits`), and from which no push has
    driven it since. ``speed_excess`` likewise, for joints that were slow enough once.

    Args:
        built: The run.
    """

    def __init__(self, built: Built) -> None:
        limits = built.stack.limits
        self._limits = limits
        self._sides: tuple[Side, ...] = () if limits is None else limits.sides
        self._kept = np.zeros((len(self._sides), 2), dtype=bool)
        self._plant = built.plant
        self._pushes = built.scenario.plant.pushes
        self._torque_limit = built.robot.torque_limit
        self._dt = built.scenario.dt
        self._last: np.ndarray | None = None
        self._ticks = dict.fromkeys((status for status in Status if status), 0)
        self.numbers: dict[str, float] = dict.fromkeys(UNITS, 0.0)

    def observe(self, q: np.ndarray, v: np.ndarray, command: Command) -> None:
        """See one tick; the plant's state counts, not the measured one."""
        del q, v
        tau, numbers = command.tau, self.numbers
        v = self._plant.v
        if self._last is not None:
            self._most("max_torque_step", float(np.max(np.abs(tau - self._last))))
        self._last = tau
        self._most("max_torque_use", float(np.max(np.abs(tau) / self._torque_limit)))
        self._most("max_joint_speed", float(np.max(np.abs(v))))
        self._most("max_hard_solves", float(command.hard_solves))
        numbers["not_finite"] += not np.all(np.isfinite(tau))
        numbers["above_torque_limit"] += bool(np.any(np.abs(tau) > self._torque_limit))
        for status in self._ticks:
            self._ticks[status] += status in command.status
        self._watch_limits(command.t, self._plant.q, v)

    @property
    def seconds(self) -> dict[str, float]:
        """How long each status held that was seen, s."""
        return {str(s.name): n * self._dt for s, n in self._ticks.items() if n}

    def _most(self, name: str, value: float) -> None:
        self.numbers[name] = max(self.numbers[name], value)

    def _watch_limits(self, t: float, q: np.ndarray, v: np.ndarray) -> None:
        if any(push.at <= t <= push.at + push.duration + self._dt for push in self._pushes):
            self._kept[:] = False
        limits = self._limits
        if limits is None:
            return
        for i, side in enumerate(self._sides):
            distance = side.sign * (side.limit - float(q[side.index]))
            towards = side.sign * float(v[side.index])
            if distance >= 0.0 and towards <= limits.allowed_speed(side, distance):
                self._kept[i, 0] = True
            if towards <= side.speed:
                self._kept[i, 1] = True
            beyond = -distance - limits.clearance
            if self._kept[i, 0] and beyond > _ROUNDING:
                self._most("position_excess", beyond)
            if self._kept[i, 1] and towards > side.speed * (1.0 + _ROUNDING):
                self._most("speed_excess", towards - side.speed)
