"""Tasks that follow a target: a value, a reference in time, or the value found at the start."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError, UnknownNameError
from opspace.tasks.references.sample import Reference, Sample
from opspace.tasks.rotation import quaternion_from_matrix
from opspace.tasks.task import Task, TaskTerms
from opspace.tasks.validation import Array, brief, finite_array, shown

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot


class Hold:
    """The wish to keep the value of the next tick; each assignment of None makes a new one."""


@dataclass(frozen=True)
class Target:
    """What a task follows, replaced as a whole so that a tick never sees half of a change.

    Attributes:
        goal: A value in the task's own form, a reference, or the wish to hold.
        velocity: (k,) desired velocity beside a value, m/s or rad/s.
        acceleration: (k,) desired acceleration beside a value, m/s² or rad/s².
    """

    goal: Array | Reference | Hold
    velocity: Array
    acceleration: Array


class TrackingTask(Task):
    """Base class of tasks with a target.

    Subclasses say what a target value looks like (``_check_value``), look up names (``_resolve``)
    and compute their terms (``evaluate``). ``motion_size`` is k, the length of desired velocities,
    None while it is not known.
    """

    def __init__(
        self,
        name: str,
        *,
        rows: int,
        units: tuple[str, ...],
        motion_size: int | None,
        kp: ArrayLike,
        kv: ArrayLike | None,
        max_speed: float | Sequence[float] | None,
    ) -> None:
        super().__init__(name, rows=rows, units=units, kp=kp, kv=kv, max_speed=max_speed)
        self._robot: Robot | None = None
        self._motion_size = motion_size
        self._held: tuple[Hold, Array] | None = None
        self._target = Target(Hold(), self._vector(None, ""), self._vector(None, ""))

    def bind(self, robot: Robot) -> None:
        """Look up names and sizes on a robot; a second call with the same robot does nothing."""
        if robot is self._robot:
            return
        try:
            self._resolve(robot)
        except UnknownNameError as error:
            raise error.reworded(f"task {self.name!r}: {error}") from None
        self._robot = robot
        self.reset()

    def reset(self) -> None:
        """Forget the held start value; the next tick finds a new one."""
        if self._held is not None:  # else nothing changes, and no tick need look
            self._held = None

    @property
    def target(self) -> Array | Reference | None:
        """Target value, reference in time (t ↦ Sample), or None to hold the value found next.

        May be assigned at any time, also from another thread; it is checked at once and followed
        from the next tick on. A reference brings its own velocity and acceleration and clears
        ``target_velocity`` and ``target_acceleration``; a value leaves them as they are.
        """
        goal = self._target.goal
        return None if isinstance(goal, Hold) else goal

    @target.setter
    def target(self, value: ArrayLike | Reference | None) -> None:
        if callable(value):
            rest = self._vector(None, "")
            self._target = Target(value, rest, rest)
        else:
            self._target = replace(self._target, goal=self._goal(value))

    @property
    def holds_nothing_yet(self) -> bool:
        """Whether the task will hold what it finds, and has found nothing yet."""
        goal = self._target.goal
        return isinstance(goal, Hold) and (self._held is None or self._held[0] is not goal)

    @property
    def target_velocity(self) -> Array:
        """(k,) desired velocity beside a target value, m/s or rad/s; None sets it to zero."""
        return self._target.velocity

    @target_velocity.setter
    def target_velocity(self, value: ArrayLike | None) -> None:
        velocity = self._feedforward(value, "target_velocity")
        self._target = replace(self._target, velocity=velocity)

    @property
    def target_acceleration(self) -> Array:
        """(k,) desired acceleration beside a value, m/s² or rad/s²; None sets it to zero."""
        return self._target.acceleration

    @target_acceleration.setter
    def target_acceleration(self, value: ArrayLike | None) -> None:
        acceleration = self._feedforward(value, "target_acceleration")
        self._target = replace(self._target, acceleration=acceleration)

    def set_target(
        self,
        value: ArrayLike | None,
        velocity: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
    ) -> None:
        """Set value, velocity and acceleration together, so that no tick sees only some of them.

        Args:
            value: Target value in the form of ``target``; None holds the value found next.
            velocity: (k,) desired velocity, m/s or rad/s; None is zero.
            acceleration: (k,) desired acceleration, m/s² or rad/s²; None is zero.

        Raises:
            InputError: A value of another shape, not finite or not a rotation.
        """
        self._target = Target(
            self._goal(value),
            self._vector(velocity, f"task {self.name!r}: target velocity"),
            self._vector(acceleration, f"task {self.name!r}: target acceleration"),
        )

    @abstractmethod
    def desired(self, robot: Robot, t: float) -> Sample:
        """Return what the task follows at time ``t`` [s]; without a target, what it finds now.

        Args:
            robot: The robot given to ``bind``, updated.
            t: Time, s.

        Returns:
            Value in the task's own form, velocity (k,) and acceleration (k,).

        Raises:
            InputError: A reference that gave unusable numbers.
        """

    @abstractmethod
    def _resolve(self, robot: Robot) -> None:
        """Look up names and sizes on a robot."""

    @abstractmethod
    def _check_value(self, value: ArrayLike, what: str) -> Array:
        """Return a target value in the task's own form, read-only, or raise InputError."""

    def _desired(self, t: float, current: Callable[[], Array]) -> Sample:
        """Return the desired value, velocity and acceleration at time t.

        Args:
            t: Time, s.
            current: Gives the present value, kept when the target is to hold.
        """
        target = self._target  # read once: another thread may replace it during this tick
        goal = target.goal
        if isinstance(goal, Hold):
            held = self._held
            if held is None or held[0] is not goal:  # see `holds_nothing_yet`
                held = self._held = (goal, current().copy())
            goal = held[1]
        elif callable(goal):
            return self._sampled(goal, t)
        return Sample(goal, target.velocity, target.acceleration)

    def _sampled(self, reference: Reference, t: float) -> Sample:
        what = f"task {self.name!r}: reference at t = {t:.6g} s:"
        sample = reference(t)
        if not isinstance(sample, tuple) or len(sample) != 3:
            raise InputError(f"{what} must give a Sample(x, v, a), not {shown(sample)}")
        return Sample(
            self._check_value(sample[0], f"{what} x"),
            self._vector(sample[1], f"{what} v"),
            self._vector(sample[2], f"{what} a"),
        )

    def _terms(
        self,
        basis: Array,
        *,
        J: Array,
        drift: Array,
        velocity: Array,
        error: Array,
        desired: Sample,
    ) -> TaskTerms:
        """Project the motion of k coordinates on the m task rows and apply Eq. 24 there.

        Args:
            basis: (m, k) rows of the task in the coordinates of the other arguments.
            J: (k, n) Jacobian.
            drift: (k,) J̇ v.
            velocity: (k,) J v.
            error: (k,) x_d − x.
            desired: Desired motion; only its velocity and acceleration (k,) are read.
        """
        error = basis @ error
        return TaskTerms(
            J=basis @ J,
            drift=basis @ drift,
            acceleration=self._gains.acceleration(
                error, basis @ (desired.v - velocity), basis @ desired.a
            ),
            error=error,
        )

    def _words(self) -> list[str]:
        goal = self._target.goal
        if isinstance(goal, np.ndarray):
            if goal.ndim == 2:  # a rotation, or a pose
                turn = quaternion_from_matrix(goal[:3, :3])
                goal = np.array([*goal[:3, 3:].ravel(), *turn])
            return [f"target={brief(goal)}"]
        return [
            "target=what it finds" if isinstance(goal, Hold) else f"target={type(goal).__name__}"
        ]

    def _require_bound(self, robot: Robot) -> None:
        if robot is not self._robot:
            raise InputError(f"task {self.name!r} is not bound to this robot: call bind(robot)")

    def _goal(self, value: ArrayLike | None) -> Array | Hold:
        return Hold() if value is None else self._check_value(value, f"task {self.name!r}: target")

    def _feedforward(self, value: ArrayLike | None, what: str) -> Array:
        if callable(self._target.goal):
            raise InputError(
                f"task {self.name!r}: {what} goes with a target value, but the target is a "
                "reference, which brings its own velocity and acceleration"
            )
        return self._vector(value, f"task {self.name!r}: {what}")

    def _vector(self, value: ArrayLike | None, what: str) -> Array:
        """Return a velocity or acceleration (k,), zero for None; any length before k is known."""
        if value is None:
            rest = np.zeros(self._motion_size or 0)
            rest.flags.writeable = False
            return rest
        return finite_array(value, (self._motion_size,), what)
