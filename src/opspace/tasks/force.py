"""Forces and moments that the robot exerts on what it touches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.law import press_columns as at
from opspace.law import scalars
from opspace.tasks.contact import checked_thresholds
from opspace.tasks.motion_task import AxesFrame, axes_selection
from opspace.tasks.motions import Motion, WorldFrame, as_offset
from opspace.tasks.rotation import cross
from opspace.tasks.task import Task, TaskTerms
from opspace.tasks.touch_memory import Touch, TouchMemory
from opspace.tasks.validation import Array, finite, finite_array, positive

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot


class ForceTask(Task):
    r"""Presses with a force along chosen axes, and turns with a moment about chosen axes.

    Forces and moments are those of the robot **on** the environment, so a positive force along an axis
    pushes along it. With the measured wrench F_m along the rows J of the task (Khatib 1987)

        F   = F_d + K_p (F_d − F_m) + I,     İ = c K_i clip(F_d − F_m, ±|F_d|) − (1 − c) I/0.1 s
        f*  = kv ((1 − c) v_a − ẋ)           speed: the approach in the air, none in contact
        g   = c (Jᵀ F + J_tᵀ F_t)            torque that is balanced by the reaction

    where c is the confidence that something is touched (`opspace.law.scalars.confidence`), v_a the
    speed of the approach along the force and F_t the measured force along the surface, which turns with
    the direction of sliding. The speed v_a
    is at most σ |F_d| / kv with σ = J A⁻¹ Jᵀ: with that the arm pushes with F_d at standstill whatever
    c is.
    When the touch is lost the tool follows the surface by ``reach`` and stops there.

    A tick that has no new wrench (None) goes on with the last one; after 10 ms the status is
    ``WRENCH_STALE``, and confidence, integral and friction stay what they are: an arm in contact
    presses on with the force that it commanded, one in the air goes on approaching, with at most that
    force.

    Args:
        frame: Name of the frame; None is the robot's tool.
        force: Force on the environment along ``axes``, a number or one per axis, N.
        axes: Axes with a force, some of "xyz".
        moment_axes: Axes with a moment, some of "xyz"; with the moment 0 the tool turns until a
            surface does not turn it any more.
        moment: Moment on the environment about ``moment_axes``, a number or one per axis, N·m.
        axes_frame: Whether these are the axes of the world or of the frame ("tool").
        kv: Damping, a number or one per row, 1/s.
        ki: Integral gain, 1/s; stable for every stiffness up to half of kv, 0 is none.
        kp: Proportional gain, 1; only where the stiffness of the surface is known, at most
            kv / (σ k T) with its stiffness k [N/m] and the delay T [s] of the loop.
        max_integral: Force that the integral may add, N; a tenth of it as a moment, N·m.
        approach_speed: Speed in the air along the force, m/s.
        reach: How far a lost surface is followed, m.
        contact: Forces (off, on) between which the confidence rises, N; None is a tenth and four
            tenths of the force. ``off`` should be above three standard deviations of the filtered
            noise, ``on`` below half the force.
        friction: Feed the measured force along the surface through, so that it displaces no task.
        force_rate: How fast an assigned force is approached, N/s, a tenth of it N·m/s.
        offset: (3,) point that presses in the frame's axes, m; None is the frame's origin.
        name: Name of the task.

    Raises:
        InputError: A number that cannot be used, a gain outside of what is stable for every stiffness,
            or a force below ``contact``.
    """

    def __init__(
        self,
        frame: str | None = None,
        force: ArrayLike = 10.0,
        *,
        axes: str = "z",
        moment_axes: str = "",
        moment: ArrayLike = 0.0,
        axes_frame: AxesFrame = "tool",
        kv: ArrayLike = 40.0,
        ki: float = 8.0,
        kp: float = 0.0,
        max_integral: float = 10.0,
        approach_speed: float = 0.05,
        reach: float = 0.004,
        contact: tuple[float, float] | None = None,
        friction: bool = True,
        force_rate: float = 100.0,
        offset: ArrayLike | None = None,
        name: str = "force",
    ) -> None:
        if axes_frame not in ("world", "tool"):
            raise InputError(
                f"task {name!r}: axes_frame must be 'world' or 'tool', not {axes_frame!r}"
            )
        linear = axes_selection(axes, name)
        angular = axes_selection(moment_axes, name) if moment_axes else np.zeros((0, 3))
        rows = len(linear) + len(angular)
        super().__init__(
            name,
            rows=rows,
            units=("m",) * len(linear) + ("rad",) * len(angular),
            kp=0.0,
            kv=kv,
        )
        self.source = WorldFrame(frame, as_offset(offset, name))
        self.in_tool_axes = axes_frame == "tool"
        self.selection = np.zeros((rows, 6))
        self.selection[: len(linear), :3] = linear
        self.selection[len(linear) :, 3:] = angular
        self.forces = len(linear)
        self._ki, self._kp = finite(ki, "ki"), finite(kp, "kp")
        self._check_gains()
        self.max_integral = positive(max_integral, f"task {name!r}: max_integral")
        self.approach_speed = finite(approach_speed, f"task {name!r}: approach_speed")
        self.force_rate = positive(force_rate, f"task {name!r}: force_rate")
        self.friction = bool(friction)
        self._thresholds = contact
        self.reach = positive(reach, f"task {name!r}: reach")
        self.memory = TouchMemory(rows)
        self._tool = ""
        self._wanted = np.zeros(rows)
        self._set_wanted(
            _each(force, len(linear), "force", name), _each(moment, len(angular), "moment", name)
        )

    @property
    def force(self) -> Array:
        """Force on the environment along ``axes``, N. Assigned, it is approached at ``force_rate``."""
        return self._wanted[: self.forces].copy()

    @force.setter
    def force(self, value: ArrayLike) -> None:
        self._set_wanted(_each(value, self.forces, "force", self.name), self._wanted[self.forces :])

    @property
    def moment(self) -> Array:
        """Moment on the environment about ``moment_axes``, N·m."""
        return self._wanted[self.forces :].copy()

    @moment.setter
    def moment(self, value: ArrayLike) -> None:
        size = self.rows - self.forces
        self._set_wanted(self._wanted[: self.forces], _each(value, size, "moment", self.name))

    @property
    def kp(self) -> float:
        """Proportional gain on the force, 1."""
        return self._kp

    @kp.setter
    def kp(self, value: ArrayLike) -> None:
        self._change_gains(finite(value, f"task {self.name!r}: kp"), self._ki)

    @property
    def kv(self) -> float | Array:
        """Damping, 1/s: a number or (m,)."""
        return super().kv

    @kv.setter
    def kv(self, value: ArrayLike | None) -> None:
        before = self._gains
        self._set_gains(0.0, value, None)
        try:
            self._check_gains()
        except InputError:
            self._gains = before
            raise

    @property
    def ki(self) -> float:
        """Integral gain on the force, 1/s."""
        return self._ki

    @ki.setter
    def ki(self, value: float) -> None:
        self._change_gains(self._kp, finite(value, f"task {self.name!r}: ki"))

    @property
    def max_speed(self) -> None:
        """None: what limits the speed of a force task is its ``approach_speed``."""
        return None

    @max_speed.setter
    def max_speed(self, value: object) -> None:
        raise InputError(f"task {self.name!r}: a force task has an approach_speed, no max_speed")

    @property
    def sensor(self) -> str:
        """Name under which the controller is given the wrench of this task: that of its frame."""
        return self._tool if self.source.frame is None else self.source.frame

    @property
    def error_units(self) -> tuple[str, ...]:
        """Unit of each row of the error, which is the missing force or moment."""
        return ("N",) * self.forces + ("N·m",) * (self.rows - self.forces)

    @property
    def touch(self) -> Touch | None:
        """What it knew of its contact in the last tick; None before the first."""
        return self.memory.touch

    @property
    def wanted(self) -> Array:
        """(m,) force and moment of every row, N and N·m."""
        return self._wanted.copy()

    @property
    def thresholds(self) -> tuple[float, float]:
        """Forces (off, on) between which the confidence rises, N."""
        return self._between

    @property
    def thresholds_are_given(self) -> bool:
        """Whether these stay what they are when it is to press with another force."""
        return self._thresholds is not None

    def bind(self, robot: Robot) -> None:
        """Look up the frame."""
        self.source.bind(robot)
        self._tool = robot.tool

    def reset(self) -> None:
        """Begin without contact."""
        self.memory.forget()

    def resume(self, pause: float) -> None:
        """Keep what is known of the contact: an arm that presses goes on pressing."""
        self.memory.wait(pause)

    def take(self, t: float, wrench: Array | None) -> bool:
        """Be told the wrench on the environment at time ``t`` [s].

        Args:
            t: Time, s.
            wrench: (6,) N and N·m in world axes at the point of the task; None where nothing new has
                been measured.

        Returns:
            Whether it is fresh enough to be used.
        """
        if wrench is not None:
            self.memory.take(t, wrench)
            return True
        return scalars.is_fresh(t - self.memory[at.GIVEN_AT])

    @property
    def measured_once(self) -> bool:
        """Whether it has ever been told a wrench."""
        return self.memory[at.GIVEN_AT] > -math.inf

    def freeze(self, frozen: bool) -> None:
        """Keep the integral where it is from the next tick on, or let it go on."""
        self.memory[at.FROZEN] = frozen

    def sense(self, robot: Robot, t: float) -> Touch:
        """Learn from the wrench of this tick; asked again at the same time it answers the same.

        Args:
            robot: The robot at the present state.
            t: Time, s.
        """
        if not self._knows(t):
            motion = self.source.measure(robot)
            self._learn(robot, t, motion, self._axes(motion))
        touch = self.memory.touch
        assert touch is not None
        return touch

    def evaluate(self, robot: Robot, t: float) -> TaskTerms:
        """Return the terms of the task at the robot's present state."""
        motion = self.source.measure(robot)
        axes = self._axes(motion)
        if not self._knows(t):
            self._learn(robot, t, motion, axes)
        memory = self.memory
        c, force = memory[at.CONFIDENCE], memory.part(at.PUSH)
        ahead = (1.0 - c) * memory[at.SPEED] * self._direction(force)
        J = axes @ motion.J
        torque = J.T @ memory.part(at.COMMANDED)
        if self.friction:
            torque += motion.J[:3].T @ memory.part(at.ALONG, 3)
        return TaskTerms(
            J=J,
            drift=axes @ motion.drift,
            acceleration=self._gains.kv * (ahead - axes @ motion.velocity),
            error=force - memory.part(at.MEASURED),
            torque=c * torque,
        )

    def row_axes(self, robot: Robot) -> Array:
        """See `Task.row_axes`."""
        return self._axes(self.source.measure(robot))

    def _knows(self, t: float) -> bool:
        """Tell whether it has learnt from the tick at time t."""
        return self.memory[at.BEGUN] != 0.0 and self.memory[at.WHEN] == t

    def _learn(self, robot: Robot, t: float, motion: Motion, axes: Array) -> None:
        """Bring confidence, integral, friction and approach up to time t."""
        memory = self.memory
        dt = self._begin(t)
        force, wrench = memory.part(at.PUSH), memory.part(at.WRENCH, 6)
        step = self._scale * self.force_rate * dt
        force += np.clip(self._wanted - force, -step, step)
        fresh = scalars.is_fresh(t - memory[at.GIVEN_AT])
        memory[at.FRESH] = fresh
        if fresh:
            given = memory.part(at.GIVEN, 6)
            wrench += scalars.lag(dt, scalars.WRENCH_FILTER) * (given - wrench)
            self._feel(axes, axes @ wrench, dt)
            self._rub(axes, motion.velocity[:3], dt)
        measured = axes @ wrench
        memory.part(at.MEASURED)[:] = measured
        memory.part(at.COMMANDED)[:] = (
            force + self._kp * (force - measured) + memory.part(at.INTEGRAL)
        )
        self._approach(robot, motion, axes, dt)

    def _begin(self, t: float) -> float:
        """Begin the tick at time t; how long after the one before, s."""
        memory = self.memory
        if memory[at.BEGUN]:
            dt = scalars.passed(t, memory[at.WHEN])
            memory[at.EARLIER] = memory[at.CONFIDENCE]
            memory[at.EARLIER_TRAVEL] = memory[at.TRAVEL]
            memory.part(at.EARLIER_AHEAD, 3)[:] = memory.part(at.AHEAD, 3)
        else:
            dt = 0.0
            memory.part(at.EARLIER, at.GIVEN - at.EARLIER)[:] = 0.0
            memory.part(at.INTEGRAL)[:] = 0.0
            memory.part(at.PUSH)[:] = self._wanted
            memory.part(at.WRENCH, 6)[:] = memory.part(at.GIVEN, 6)
            memory.part(at.ALONG, 3)[:] = memory.part(at.SLIDING, 3)[:] = 0.0
            memory[at.BEGUN] = 1.0
        memory[at.WHEN], memory[at.PASSED] = t, dt
        return dt

    def _feel(self, axes: Array, measured: Array, dt: float) -> None:
        """Learn confidence and integral from the filtered wrench."""
        memory = self.memory
        force = memory.part(at.PUSH)
        pressed = float(self._direction(force) @ measured)
        c = scalars.confidence(memory[at.CONFIDENCE], pressed, *self._between, dt)
        memory[at.CONFIDENCE] = c
        if memory[at.FROZEN]:
            return
        integral = memory.part(at.INTEGRAL)
        for i, bound in enumerate(self._bound):
            missing = float(force[i] - measured[i])
            integral[i] = scalars.integral_after(
                float(integral[i]), missing, float(force[i]), float(bound), self._ki, c, dt
            )

    def _rub(self, axes: Array, velocity: Array, dt: float) -> None:
        """Learn the force along the surface, which turns with the direction u of sliding.

        Ḟ_t = (u × u̇) × F_t + (F − F_t)/τ,  u = v/√(v² + v₀²): what lags is its size alone.
        """
        memory = self.memory
        wrench, along = memory.part(at.WRENCH, 3), memory.part(at.ALONG, 3)
        sliding, n = memory.part(at.SLIDING, 3), axes[:, :3]
        u = velocity - n.T @ (n @ velocity)
        u = u / math.sqrt(float(u @ u) + scalars.SLIDING_SPEED**2)
        if dt > 0.0:
            along += cross(cross(sliding, u), along)
        sliding[:] = u
        now = wrench - n.T @ (n @ wrench)
        along += scalars.lag(dt, scalars.FRICTION_FILTER) * (now - along)

    def _approach(self, robot: Robot, motion: Motion, axes: Array, dt: float) -> None:
        """Find how fast it may come, and how far."""
        memory = self.memory
        force = memory.part(at.PUSH)
        direction = self._direction(force)
        ahead = axes.T @ direction
        row = ahead @ motion.J
        sigma = float(row @ np.linalg.solve(robot.M, row))
        size = float(np.linalg.norm(force[: self.forces]))
        most = min(self.approach_speed, sigma * size / float(np.max(self._gains.kv)))
        slope = 0.25 * float(np.min(self._gains.kv))  # critically damped
        travel, c = float(ahead[:3] @ motion.position), memory[at.CONFIDENCE]
        floor = scalars.floor_of(memory[at.FLOOR], travel, c, most / slope, dt)
        memory[at.SIGMA], memory[at.FLOOR], memory[at.TRAVEL] = sigma, floor, travel
        memory[at.SPEED] = scalars.approach(floor, self.reach, travel, most, slope)
        memory.part(at.AHEAD, 3)[:] = ahead[:3]

    def _axes(self, motion: Motion) -> Array:
        """Return the rows (m, 6) in world axes."""
        if not self.in_tool_axes:
            return self.selection
        axes = self.selection.copy()
        axes[:, :3] = self.selection[:, :3] @ motion.rotation.T
        axes[:, 3:] = self.selection[:, 3:] @ motion.rotation.T
        return axes

    def _direction(self, force: Array) -> Array:
        """Return where the task presses, (m,) of length 1."""
        direction = np.zeros(self.rows)
        direction[: self.forces] = force[: self.forces]
        size = float(np.linalg.norm(direction))
        return direction / size if size > 0.0 else direction

    @property
    def _scale(self) -> Array:
        """What counts like 1 N in each row."""
        return np.where(np.arange(self.rows) < self.forces, 1.0, scalars.LEVER)

    @property
    def _bound(self) -> Array:
        return self.max_integral * self._scale

    def _set_wanted(self, force: Array, moment: Array) -> None:
        size = math.sqrt(sum(x * x for x in force.tolist()))  # as in C, to the last bit
        if size == 0.0:
            raise InputError(
                f"task {self.name!r}: a force of zero cannot tell whether it touches; an "
                "ImpedanceTask gives way without pressing"
            )
        self._between = checked_thresholds(self._thresholds, size, self.name)
        self._wanted = np.concatenate([force, moment])

    def _change_gains(self, kp: float, ki: float) -> None:
        before = self._kp, self._ki
        self._kp, self._ki = kp, ki
        try:
            self._check_gains()
        except InputError:
            self._kp, self._ki = before
            raise

    def _check_gains(self) -> None:
        least = float(np.min(self._gains.kv))
        if least <= 0.0:
            raise InputError(f"task {self.name!r}: kv must be above zero 1/s, not {least:g}")
        if self._ki < 0.0 or self._kp < 0.0:
            raise InputError(f"task {self.name!r}: ki and kp must be at least zero")
        if self._ki > 0.5 * least * (1.0 + self._kp):
            raise InputError(
                f"task {self.name!r}: ki = {self._ki:g} 1/s is not stable on every surface; it must be "
                f"at most kv (1 + kp) / 2 = {0.5 * least * (1.0 + self._kp):g} 1/s"
            )

    def _words(self) -> list[str]:
        force = ", ".join(f"{value:g}" for value in self.force)
        return [f"force=[{force}] N", f"rows={self.rows}"]


def _each(value: ArrayLike, size: int, what: str, name: str) -> Array:
    """Check a number or one per axis, (size,)."""
    given: Sequence[float] | Array = np.asarray(value, dtype=float)
    if np.ndim(given) == 0:
        given = np.full(size, given)
    return finite_array(given, (size,), f"task {name!r}: {what}")
