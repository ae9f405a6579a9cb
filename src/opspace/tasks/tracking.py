"""Tasks that follow a target: a value, a reference in time, or the value found at the start."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError, UnknownNameError
from opspace.tasks.gains import one_or_all, paced
from opspace.tasks.references.sample import Constant, Reference, Sample
from opspace.tasks.references.start import begun
from opspace.tasks.rotation import quaternion_from_matrix
from opspace.tasks.task import Task
from opspace.tasks.validation import Array, brief, finite_array, positive, shown
from opspace.tasks.ways import Pace, VectorWay, Way

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


@dataclass(frozen=True)
class Followed:
    """A reference on its way.

    Attributes:
        target: The target that it belongs to; another one ends it.
        reference: The reference, begun.
        pauses: How long it has stood still so far, s.
    """

    target: Target
    reference: Reference
    pauses: float = 0.0


@dataclass(frozen=True)
class Led:
    """A value that is approached on a way.

    Attributes:
        target: The target that it belongs to; another one ends it.
        way: The way to its value.
    """

    target: Target
    way: Way


Progress: TypeAlias = tuple[
    "tuple[Hold, Array] | None", "Followed | None", "Led | None", "Target | None"
]


class TrackingTask(Task):
    """Base class of tasks with a target.

    Subclasses say what a target value looks like (``_check_value``), look up names (``_resolve``),
    compute their terms (``evaluate``) and value (``_current``) and, where that is no vector, how one
    is approached (``_way``). ``motion_size`` is k, the length of desired velocities, None while it is
    not known.
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
        max_acceleration: float | Sequence[float] | None = None,
        ki: float | None = None,
        max_integral: float = 0.05,
    ) -> None:
        super().__init__(name, rows=rows, units=units, kp=kp, kv=kv, max_speed=max_speed)
        self._motion_size = motion_size
        self._before: Target | None = None
        self._target = Target(Hold(), self._vector(None, ""), self._vector(None, ""))
        self.max_acceleration = max_acceleration
        self._ki = None if ki is None else positive(ki, f"task {name!r}: ki")
        self._max_integral = positive(max_integral, f"task {name!r}: max_integral")
        self._integral: Array | None = None
        self._robot: Robot | None = None
        self._held: tuple[Hold, Array] | None = None
        self._followed: Followed | None = None
        self._led: Led | None = None

    def bind(self, robot: Robot) -> None:
        """Look up names and sizes on a robot; a second call with the same robot does nothing."""
        if robot is self._robot:
            return
        try:
            self._resolve(robot)
        except UnknownNameError as error:
            raise error.reworded(f"task {self.name!r}: {error}") from None
        if self._ki is not None and np.any(self._ki >= self._gains.kp * self._gains.kv):
            raise InputError(
                f"task {self.name!r}: ki = {self._ki:g} 1/s³ diverges; it must be below kp kv = "
                f"{float(np.min(self._gains.kp * self._gains.kv)):g} 1/s³"
            )
        self._robot = robot
        self._followed = None
        self.reset()

    def resume(self, pause: float) -> None:
        """See `Task.resume`; a reference and the integral go on where they were."""
        integral = self._integral
        super().resume(pause)
        self._integral = integral
        followed = self._followed
        if followed is not None:
            self._followed = replace(followed, pauses=followed.pauses + pause)

    def reset(self) -> None:
        """Forget the held start value, the integral, and where a way has come to."""
        memory = self._held, self._led, self._before, self._integral
        if any(part is not None for part in memory):  # else nothing changes, and no tick need look
            self._held = self._led = self._before = self._integral = None

    @property
    def ki(self) -> float | None:
        """Integral gain, 1/s³; None is no integral action. See `opspace.controller.integral`."""
        return self._ki

    @property
    def integral(self) -> Array:
        """(k,) acceleration that the integral adds to f*, m/s² or rad/s², before rows are selected."""
        return self._vector(None, "") if self._integral is None else self._integral

    def integrate(self, robot: Robot, error: Array, dt: float) -> None:
        """Add to the integral, within its bound.

        Args:
            robot: The robot given to ``bind``, at the state of the error.
            error: (m,) error to integrate, m or rad.
            dt: For how long, s.
        """
        assert self._ki is not None
        basis = self._basis(robot)
        most = np.abs(basis).T @ np.broadcast_to(self._max_integral * self._gains.kp, len(basis))
        moved = self.integral + self._ki * dt * (basis.T @ error)
        self._integral = np.clip(moved, -most, most)

    def remember_integral(self, integral: Array) -> None:
        """Take over an integral (k,) that somebody else has computed."""
        if not np.array_equal(integral, self.integral):
            self._integral = integral.copy()

    def asks_too_much(self, error: Array) -> bool:
        """Tell whether an error (m,) asks for more than ``max_speed``."""
        return self._gains.saturates(error)

    def pushed(self, desired: Sample) -> Sample:
        """Add the integral to the desired acceleration."""
        return desired if self._integral is None else desired._replace(a=desired.a + self._integral)

    def _basis(self, robot: Robot) -> Array:
        """Return the task's rows, (m, k), in the coordinates of its motion."""
        del robot
        return np.eye(self.rows)

    @property
    def progress(self) -> Progress:
        """What it has found, begun and come to so far; ``recall`` goes back to it."""
        return self._held, self._followed, self._led, self._before

    def recall(self, progress: Progress) -> None:
        """Go back to where it was, after somebody has only asked what it would do."""
        if any(a is not b for a, b in zip(progress, self.progress, strict=True)):
            self._held, self._followed, self._led, self._before = progress

    @property
    def max_acceleration(self) -> float | tuple[float, ...] | None:
        """Acceleration of the way to a new target value, m/s² or rad/s²; None follows it at once.

        With it, a value that is assigned is not followed at once: what the task follows goes there from
        where it is, within ``max_speed``, this acceleration, and the jerk that reaches it in 0.1 s. So
        the torque does not step. A task that comes in begins where it finds the robot. References, and
        values with a ``target_velocity``, are followed as they are.
        """
        return one_or_all(self._gains.max_acceleration)

    @max_acceleration.setter
    def max_acceleration(self, value: float | Sequence[float] | None) -> None:
        gains = self._gains
        found = paced(value, gains.max_speed, len(self._speed_groups), self.name)
        if found != gains.max_acceleration:
            if gains.max_acceleration is None and self._before is not self._target:
                self._before = (
                    None  # followed before it had none, and left since: none begins there
                )
            self._gains = replace(gains, max_acceleration=found)

    @property
    def target(self) -> Array | Reference | None:
        """Target value, reference in time (t ↦ Sample), or None to hold the value found next.

        May be assigned at any time, also from another thread; it is checked at once and followed
        from the next tick on. A reference without a start time begins at the first tick that follows
        it; assigned again, it begins again. It brings its own velocity and acceleration and clears
        ``target_velocity`` and ``target_acceleration``; a value leaves them as they are.
        """
        goal = self._target.goal
        return None if isinstance(goal, Hold) else goal

    @target.setter
    def target(self, value: ArrayLike | Reference | None) -> None:
        if callable(value):
            if isinstance(value, Constant):
                self._goal(value.value)
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
    def begins_where_found(self) -> bool:
        """Whether the way to its target begins where the next tick finds the robot."""
        target = self._target
        led = self._gains.max_acceleration is not None and isinstance(target.goal, np.ndarray)
        return led and self._before is None and not target.velocity.any()

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

    def asked(self, robot: Robot, t: float) -> Sample:
        """Return what the task asks for at time ``t`` [s]: what is desired, pushed by the integral.

        Raises:
            InputError: Not bound to this robot, or a reference that gave unusable numbers.
        """
        if robot is not self._robot:
            raise InputError(f"task {self.name!r} is not bound to this robot: call bind(robot)")
        return self.pushed(self.desired(robot, t))

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
        return self._desired(t, lambda: self._current(robot))

    @abstractmethod
    def _current(self, robot: Robot) -> Array:
        """Return the value that the robot has now, in the task's own form."""

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
        if self._gains.max_acceleration is None:
            return self._followed_at(target, t, current)
        if self.approaches(target):
            assert isinstance(target.goal, np.ndarray)
            rest, before = self._vector(None, ""), self._before
            if before is None:
                now = Sample(current().copy(), rest, rest)
            else:
                now = self._followed_at(before, t, current)
            self.go_on(target, self._way(now, target.goal, t))
        if target is not self._before:
            self._before = target
        return self._followed_at(target, t, current)

    def approaches(self, target: Target) -> bool:
        """Tell whether a way to a target is to begin; one to the same value, as streamed, goes on."""
        before, led, goal = self._before, self._led, target.goal
        if target is before or not isinstance(goal, np.ndarray) or target.velocity.any():
            return False
        known = None if before is None else before.goal
        same = isinstance(known, np.ndarray) and np.array_equal(known, goal)
        if same and led is not None and led.target is before:
            self.go_on(target, led.way)
            return False
        return True

    def go_on(self, target: Target, way: Way) -> None:
        """Be on a way to a target."""
        self._led, self._before = Led(target, way), target

    @property
    def way(self) -> Way | None:
        """The way that it is on, or has come to the end of; None where it follows what it is told."""
        led = self._led
        return led.way if led is not None and led.target is self._before else None

    def followed_before(self, robot: Robot, t: float) -> Sample | None:
        """Return what has been followed until time ``t`` [s]; None where nothing has."""
        before = self._before
        if before is None:
            return None
        return self._followed_at(before, t, lambda: self._current(robot))

    def _followed_at(self, target: Target, t: float, current: Callable[[], Array]) -> Sample:
        """Return what a target means at time t: what is held, referred to, approached or given."""
        goal = target.goal
        if isinstance(goal, Hold):
            held = self._held
            if held is None or held[0] is not goal:  # see `holds_nothing_yet`
                held = self._held = (goal, current().copy())
            goal = held[1]
        elif callable(goal):
            return self._sampled(target, goal, t)
        elif self._led is not None and self._led.target is target:
            return self._led.way(t)
        return Sample(goal, target.velocity, target.acceleration)

    def moves(self, t: float) -> bool:
        """Tell whether what is desired changes after time ``t`` [s] without anything being assigned."""
        target, led = self._target, self._led
        if callable(target.goal) or self._ki is not None:
            return True
        return led is not None and led.target is target and t < led.way.end

    def _pace(self, group: int = 0) -> Pace:
        """Return the limits of the way of a group of rows."""
        speed, acceleration = self._gains.max_speed, self._gains.max_acceleration
        assert speed is not None
        assert acceleration is not None
        return Pace(speed[group], acceleration[group])

    def _way(self, now: Sample, goal: Array, t: float) -> Way:
        """Make the way from what is followed at time t to a value, which is in the task's own form."""
        return VectorWay.to(now, goal, t, self._pace())

    def _sampled(self, target: Target, reference: Reference, t: float) -> Sample:
        followed = self._followed
        if followed is None or followed.target is not target:
            followed = self._followed = Followed(target, begun(reference, t))
        sample = followed.reference(t - followed.pauses)
        try:
            return self._checked(sample, "")
        except InputError:  # once more, for the words
            return self._checked(sample, f"task {self.name!r}: reference at t = {t:.6g} s: ")

    def _checked(self, sample: object, what: str) -> Sample:
        """Return what a reference gave, in the task's own form."""
        if not isinstance(sample, tuple) or len(sample) != 3:
            raise InputError(f"{what}must give a Sample(x, v, a), not {shown(sample)}")
        x, v, a = sample
        return Sample(
            self._check_value(x, what + "x"),
            self._vector(v if np.size(v) else None, what + "v"),
            self._vector(a if np.size(a) else None, what + "a"),
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
