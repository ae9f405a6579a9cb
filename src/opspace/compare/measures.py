"""What a change of tasks does to a robot, in numbers that are the same for every method."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from opspace.command import Command, Status
from opspace.controller import ReferenceController
from opspace.loop import Outcome
from opspace.robots import Robot
from opspace.scenario.events import Event


@dataclass(frozen=True)
class Measures:
    """One run of one method; None where the run does not tell.

    Attributes:
        completed: Whether it ran to its end.
        stopped_at: When it was given up, s.
        torque_step: Largest |Δτ| of any joint between two ticks, N·m.
        torque_step_outside: The same away from transitions, N·m.
        acceleration: Largest joint acceleration, rad/s².
        jerk: Largest change of joint acceleration per second, rad/s³.
        error_inside: RMS error of the most important level while tasks change, m and rad.
        error_outside: The same while none does, m and rad.
        leak: Largest ‖J q̈ + J̇ q̇ − f*‖ of the most important level where nothing is in its way:
            no joint limit, no faded direction, nothing that contacts do not give, no transition of
            its own; m/s² and rad/s².
        overshoot: Furthest that a joint got beyond a limit, rad.
        tick: Median time of a control tick, µs.
    """

    completed: bool
    stopped_at: float | None
    torque_step: float | None
    torque_step_outside: float | None
    acceleration: float | None
    jerk: float | None
    error_inside: float | None
    error_outside: float | None
    leak: float | None
    overshoot: float | None
    tick: float | None


class Timed:
    """A controller whose ticks are timed."""

    def __init__(self, controller: ReferenceController) -> None:
        self._controller = controller
        self.seconds: list[float] = []

    @property
    def robot(self) -> Robot:
        """The robot of the controller."""
        return self._controller.robot

    def step(self, t: float, q: np.ndarray, v: np.ndarray) -> Command:
        """See `opspace.Controller.step`."""
        start = time.perf_counter()
        command = self._controller.step(t, q, v)
        self.seconds.append(time.perf_counter() - start)
        return command


class Watch:
    """The observer that collects what is measured."""

    def __init__(self, controller: ReferenceController, events: Sequence[Event]) -> None:
        self._controller = controller
        self._tasks = {task.name: task for task in controller.stack}
        self._events = events
        self.t: list[float] = []
        self.tau: list[np.ndarray] = []
        self.v: list[np.ndarray] = []
        self.inside: list[bool] = []
        self.error: list[float] = []
        self.leak: list[float] = []
        self.overshoot = 0.0

    def observe(self, q: np.ndarray, v: np.ndarray, command: Command) -> None:
        """See one tick."""
        moving = any(
            0.0 < task.activation < 1.0 or len(task.levels) > 1 for task in command.tasks.values()
        )
        planned = any(event.at <= command.t <= event.end for event in self._events)
        top = self._top(command)
        self.t.append(command.t)
        self.tau.append(command.tau)
        self.v.append(np.array(v))
        self.inside.append(moving or planned)
        self.error.append(float(np.linalg.norm([command.tasks[n].error_norm for n in top])))
        self.leak.append(self._leak(command, top))
        limits = self._controller.stack.limits
        for side in limits.sides if limits is not None else ():
            # A floating base turns by four numbers and has three turning speeds.
            beyond = side.sign * (q[side.index + q.size - v.size] - side.limit)
            self.overshoot = max(self.overshoot, float(beyond))

    def _top(self, command: Command) -> list[str]:
        """Name the tasks that are fully at the most important level, if that is all of it."""
        level = min((n for task in command.tasks.values() for n, _ in task.levels), default=0.0)
        there = {
            name: task
            for name, task in command.tasks.items()
            if any(number == level for number, _ in task.levels)
        }
        whole = all(t.activation == 1.0 and len(t.levels) == 1 for t in there.values())
        return list(there) if whole else []

    def _leak(self, command: Command, top: Sequence[str]) -> float:
        if command.status & (Status.JOINT_LIMIT | Status.DIRECTION_OFF | Status.GIVEN_UP):
            return np.nan
        robot = self._controller.robot
        pushed = self._carried(command)
        acceleration = np.linalg.solve(robot.M, command.tau + pushed - robot.bias)
        known = {task.name: task for task in self._controller.stack}
        worst = np.nan
        for name in top:
            terms = known[name].evaluate(robot, command.t)
            missed = terms.J @ acceleration + terms.drift - terms.acceleration
            worst = np.fmax(worst, float(np.linalg.norm(missed)))
        return float(worst)

    def _carried(self, command: Command) -> np.ndarray:
        """Σ Jᵀ λ of the contacts of a tick, (n,)."""
        robot, contacts = self._controller.robot, self._controller.stack.contacts
        pushed = np.zeros(robot.nv)
        for name, told in command.contacts.items():
            if name in contacts:
                terms = contacts[name].evaluate(robot)
                own = np.concatenate([terms.axes.T @ told.force, terms.axes.T @ told.moment])
                pushed += terms.J.T @ own[: terms.J.shape[0]]
        return pushed


def measure(watch: Watch, timed: Timed, outcome: Outcome) -> Measures:
    """Put what was collected into numbers.

    Args:
        watch: What was collected.
        timed: The controller.
        outcome: How the run ended.

    Returns:
        The measures; numbers that are not finite are left out.
    """
    t, inside = np.array(watch.t), np.array(watch.inside)
    steps = np.abs(np.diff(watch.tau, axis=0)).max(axis=1, initial=0.0)
    outside = ~(inside[1:] | inside[:-1])
    dt = np.diff(t)[:, None]
    acceleration = np.diff(watch.v, axis=0) / dt
    jerk = np.diff(acceleration, axis=0) / dt[1:]
    error = np.array(watch.error)
    return Measures(
        outcome.completed,
        None if outcome.completed else outcome.t,
        _largest(steps),
        _largest(steps[outside]),
        _largest(np.abs(acceleration)),
        _largest(np.abs(jerk)),
        _rms(error[inside]),
        _rms(error[~inside]),
        _largest(np.array(watch.leak)),
        watch.overshoot if np.isfinite(watch.overshoot) else None,
        1e6 * float(np.median(timed.seconds)) if timed.seconds else None,
    )


def _largest(values: np.ndarray) -> float | None:
    finite = values[np.isfinite(values)]
    return float(finite.max()) if finite.size else None


def _rms(values: np.ndarray) -> float | None:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else None
