"""Forces and moments that the robot exerts on what it touches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.tasks.contact import LONGEST, Confidence, Reach, checked_thresholds, lag
from opspace.tasks.motion_task import AxesFrame, axes_selection
from opspace.tasks.motions import Motion, WorldFrame, as_offset
from opspace.tasks.task import Task, TaskTerms
from opspace.tasks.validation import Array, finite, finite_array, positive

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot

FILTER = 0.003
"""Time constant of the measured wrench, s."""
FRICTION_FILTER = 0.03
"""Time constant of the force along the surface that is fed through, s: where the tool sticks this is a
loop, and the lag is what keeps it slow."""
UNLOAD = 0.1
"""Time constant with which the integral empties out of contact, s."""
STALE_AFTER = 0.01
"""Without a new wrench for so long, what was measured last counts for nothing any more, s."""
LEVER = 0.1
"""Moment that counts like a force, per N: bounds of the integral of moment rows, m."""


class Touch(NamedTuple):
    """What a force task knows of its contact in one tick.

    Attributes:
        confidence: c, how sure it is that something is touched, 0 to 1.
        measured: (m,) wrench on the environment along the rows, filtered, N and N·m.
        commanded: (m,) wrench that is commanded there, N and N·m.
        sigma: J A⁻¹ Jᵀ along the force, one over the mass that moves, 1/kg.
        speed: Speed of the approach along the force, m/s.
        direction: (3,) where the force points, in world axes.
        travel: How far the point is along it, m.
    """

    confidence: float
    measured: Array
    commanded: Array
    sigma: float
    speed: float
    direction: Array
    travel: float


@dataclass
class _Memory:
    """What is remembered from tick to tick."""

    t: float
    integral: Array
    force: Array
    wrench: Array
    along: Array
    touch: Touch


class ForceTask(Task):
    r"""Presses with a force along chosen axes, and turns with a moment about chosen axes.

    Forces and moments are those of the robot **on** the environment, so a positive force along an axis
    pushes along it. With the measured wrench F_m along the rows J of the task (Khatib 1987)

        F   = F_d + K_p (F_d − F_m) + I,     İ = c K_i clip(F_d − F_m, ±|F_d|) − (1 − c) I/0.1 s
        f*  = kv ((1 − c) v_a − ẋ)           speed: the approach in the air, none in contact
        g   = c (Jᵀ F + J_tᵀ F_t)            torque that is balanced by the reaction

    where c is the confidence that something is touched (`opspace.tasks.contact.Confidence`), v_a the
    speed of the approach along the force and F_t the measured force along the surface. The speed v_a
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
        self._reach = Reach(positive(reach, f"task {name!r}: reach"))
        self._confidence = Confidence(0.0, 1.0)
        self._memory: _Memory | None = None
        self._wrench: tuple[float, Array] | None = None
        self._frozen = False
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
        return None if self._memory is None else self._memory.touch

    def bind(self, robot: Robot) -> None:
        """Look up the frame."""
        self.source.bind(robot)
        self._tool = robot.tool

    def reset(self) -> None:
        """Begin without contact."""
        self._memory = None
        self._confidence.value = 0.0
        self._reach.floor = math.inf

    def resume(self, pause: float) -> None:
        """Keep what is known of the contact: an arm that presses goes on pressing."""
        if self._memory is not None:
            self._memory.t += pause
        if self._wrench is not None:
            self._wrench = self._wrench[0] + pause, self._wrench[1]

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
            self._wrench = t, wrench
        return self._fresh(t)

    @property
    def measured_once(self) -> bool:
        """Whether it has ever been told a wrench."""
        return self._wrench is not None

    def _fresh(self, t: float) -> bool:
        # Times are sums of floating-point numbers: a millionth more is no time.
        return self._wrench is not None and t - self._wrench[0] <= STALE_AFTER * (1.0 + 1e-6)

    def freeze(self, frozen: bool) -> None:
        """Keep the integral where it is from the next tick on, or let it go on."""
        self._frozen = frozen

    def sense(self, robot: Robot, t: float) -> Touch:
        """Learn from the wrench of this tick; asked again at the same time it answers the same.

        Args:
            robot: The robot at the present state.
            t: Time, s.
        """
        memory = self._memory
        if memory is not None and memory.t == t:
            return memory.touch
        motion = self.source.measure(robot)
        return self._learn(robot, t, motion, self._axes(motion)).touch

    def evaluate(self, robot: Robot, t: float) -> TaskTerms:
        """Return the terms of the task at the robot's present state."""
        motion = self.source.measure(robot)
        axes = self._axes(motion)
        memory = self._memory
        if memory is None or memory.t != t:
            memory = self._learn(robot, t, motion, axes)
        touch = memory.touch
        c, direction = touch.confidence, self._direction(memory.force)
        ahead = (1.0 - c) * touch.speed * direction
        J = axes @ motion.J
        torque = J.T @ touch.commanded
        if self.friction:
            torque += motion.J[:3].T @ memory.along
        return TaskTerms(
            J=J,
            drift=axes @ motion.drift,
            acceleration=self._gains.kv * (ahead - axes @ motion.velocity),
            error=memory.force - touch.measured,
            torque=c * torque,
        )

    def row_axes(self, robot: Robot) -> Array:
        """See `Task.row_axes`."""
        return self._axes(self.source.measure(robot))

    def _learn(self, robot: Robot, t: float, motion: Motion, axes: Array) -> _Memory:
        """Bring confidence, integral, friction and approach up to time t."""
        wrench = np.zeros(6) if self._wrench is None else self._wrench[1]
        memory = self._memory
        if memory is None:
            memory = _Memory(
                t,
                np.zeros(self.rows),
                self._wanted.copy(),
                wrench.copy(),
                np.zeros(3),
                Touch(0.0, np.zeros(self.rows), np.zeros(self.rows), 0.0, 0.0, np.zeros(3), 0.0),
            )
            self._memory = memory
        dt = t - memory.t
        dt = dt if 0.0 < dt <= LONGEST else 0.0
        memory.t = t
        step = self._scale * self.force_rate * dt
        memory.force = memory.force + np.clip(self._wanted - memory.force, -step, step)
        measured = axes @ memory.wrench
        if self._fresh(t):
            memory.wrench = memory.wrench + lag(dt, FILTER) * (wrench - memory.wrench)
            measured = axes @ memory.wrench
            self._integrate(memory, axes, measured, dt)
        direction = self._direction(memory.force)
        A = np.linalg.solve(robot.M, motion.J.T @ (axes.T @ direction))
        sigma = float(direction @ (axes @ (motion.J @ A)))
        size = float(np.linalg.norm(memory.force[: self.forces]))
        most = min(self.approach_speed, sigma * size / float(np.max(self._gains.kv)))
        ahead = (axes.T @ direction)[:3]
        travel = float(ahead @ motion.position)
        c = self._confidence.value
        slope = 0.25 * float(np.min(self._gains.kv))  # critically damped
        self._reach.learn(travel, c, most / slope, dt)
        memory.touch = Touch(
            c,
            measured,
            memory.force + self._kp * (memory.force - measured) + memory.integral,
            sigma,
            self._reach.speed(travel, most, slope),
            ahead,
            travel,
        )
        return memory

    def _integrate(self, memory: _Memory, axes: Array, measured: Array, dt: float) -> None:
        pressed = float(self._direction(memory.force) @ measured)
        c = self._confidence.learn(pressed, dt)
        along = memory.wrench[:3] - axes[:, :3].T @ (axes[:, :3] @ memory.wrench[:3])
        memory.along = memory.along + lag(dt, FRICTION_FILTER) * (along - memory.along)
        if self._frozen:
            return
        # An impact of many times the force, of a few milliseconds, must not unwind the integral.
        most = np.where(memory.force == 0.0, self._bound, np.abs(memory.force))
        grown = c * self._ki * np.clip(memory.force - measured, -most, most)
        emptied = (1.0 - c) / UNLOAD * memory.integral
        memory.integral = np.clip(
            memory.integral + dt * (grown - emptied), -self._bound, self._bound
        )

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
        return np.where(np.arange(self.rows) < self.forces, 1.0, LEVER)

    @property
    def _bound(self) -> Array:
        return self.max_integral * self._scale

    def _set_wanted(self, force: Array, moment: Array) -> None:
        size = float(np.linalg.norm(force))
        if size == 0.0:
            raise InputError(
                f"task {self.name!r}: a force of zero cannot tell whether it touches; an "
                "ImpedanceTask gives way without pressing"
            )
        thresholds = checked_thresholds(self._thresholds, size, self.name)
        self._confidence.off, self._confidence.on = thresholds.off, thresholds.on
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
