"""What every task is: a name, rows with units, gains, and the terms of its equation of motion."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.tasks.gains import Gains, make_gains, one_or_all
from opspace.tasks.known_attributes import KnownAttributes
from opspace.tasks.validation import Array, brief

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot


@dataclass(frozen=True, slots=True)
class TaskTerms:
    """What a task asks for at one state: ẍ = J q̈ + J̇ q̇ should become f*.

    Attributes:
        J: (m, n) task Jacobian, ẋ = J v.
        drift: (m,) J̇ v, task acceleration at zero joint acceleration.
        acceleration: (m,) commanded acceleration f* of Eq. 24.
        error: (m,) x_d − x; of an orientation the rotation vector from R to R_d.
        torque: (n,) balanced torque g, N·m, given beside the rows and scaled with the task's
            activation: what the world answers it with is no disturbance of any task. None is none.
    """

    J: Array
    drift: Array
    acceleration: Array
    error: Array
    torque: Array | None = None


class LastChange:
    """Tells a tick that some task may have changed: ``last`` is another object after every change."""

    def __init__(self) -> None:
        self.last = object()


CHANGES = LastChange()
"""Of all tasks there are: most ticks find that nothing has changed, and look at no task."""


class Task(KnownAttributes, ABC):
    """Base class of all tasks.

    A task of one's own needs ``bind`` (look up names, set ``rows`` and ``units``) and
    ``evaluate``. ``rows`` is 0 as long as it is not known. Attributes of one's own are made in its
    own methods, or declared in the class; elsewhere a name that it does not have is refused.

    Attributes:
        name: Name of the task, unique within a stack.
        rows: m, the number of task rows.
        units: Unit of each row of the error, "m" or "rad".
        activation: A function (robot, t) -> [0, 1] that the presence of the task in its stack is
            multiplied with at every tick, or None for 1. The torque is as smooth as its values:
            assigning another function is a step unless both have the same value then.
    """

    activation: Callable[[Robot, float], float] | None = None

    # Rows that share one number of max_speed.
    _speed_groups: tuple[slice, ...] = (slice(None),)

    def __init__(
        self,
        name: str,
        *,
        rows: int,
        units: tuple[str, ...],
        kp: ArrayLike = 100.0,
        kv: ArrayLike | None = None,
        max_speed: float | Sequence[float] | None = None,
    ) -> None:
        if not name:
            raise InputError("a task needs a name that is not empty")
        self.name = name
        self.rows = rows
        self.units = units
        self._set_gains(kp, kv, max_speed)

    if not TYPE_CHECKING:  # a type checker would take any name for an attribute

        def __setattr__(self, name: str, value: object) -> None:
            """Set a known attribute, then say so: a tick in between looks at the task once more."""
            super().__setattr__(name, value)
            CHANGES.last = object()

    @abstractmethod
    def bind(self, robot: Robot) -> None:
        """Look up names and sizes on a robot; a second call with the same robot does nothing.

        Args:
            robot: The robot that the task will be evaluated on.

        Raises:
            UnknownNameError: A frame or joint that the robot does not have.
            InputError: Gains or a target that do not fit the robot.
        """

    @abstractmethod
    def evaluate(self, robot: Robot, t: float) -> TaskTerms:
        """Return the terms of the task at the robot's present state.

        Args:
            robot: The robot given to ``bind``, updated.
            t: Time, s.

        Returns:
            The terms.

        Raises:
            InputError: Not bound to this robot, or a reference that gave unusable numbers.
        """

    def reset(self) -> None:
        """Forget what was remembered from earlier ticks, such as a held start value."""

    def resume(self, pause: float) -> None:
        """Go on after a pause, in which anything may have happened to the robot.

        Args:
            pause: How long it was, s.
        """
        del pause
        self.reset()

    @property
    def error_units(self) -> tuple[str, ...]:
        """Unit of each row of the error that a tick reports."""
        return self.units

    def row_axes(self, robot: Robot) -> Array | None:
        """Return the motion in world axes that each row is about, to be drawn.

        Args:
            robot: The robot given to ``bind``, updated.

        Returns:
            (m, 6) rows linear then angular, or None where the rows are about something else.
        """
        del robot
        return None

    @property
    def kp(self) -> float | Array:
        """Stiffness, 1/s²: a number for all rows or (m,). May be assigned at any time."""
        return _plain(self._gains.kp)

    @kp.setter
    def kp(self, value: ArrayLike) -> None:
        gains = self._gains
        self._set_gains(value, None if gains.critical else gains.kv, gains.max_speed)

    @property
    def kv(self) -> float | Array:
        """Damping, 1/s: a number or (m,). Assigning None makes it follow kp as 2 sqrt(kp)."""
        return _plain(self._gains.kv)

    @kv.setter
    def kv(self, value: ArrayLike | None) -> None:
        self._set_gains(self._gains.kp, value, self._gains.max_speed)

    @property
    def max_speed(self) -> float | tuple[float, ...] | None:
        """Speed that the position error may ask for, m/s or rad/s; None is no limit."""
        return one_or_all(self._gains.max_speed)

    @max_speed.setter
    def max_speed(self, value: float | Sequence[float] | None) -> None:
        gains = self._gains
        self._set_gains(gains.kp, None if gains.critical else gains.kv, value)

    def _set_gains(
        self, kp: ArrayLike, kv: ArrayLike | None, max_speed: float | Sequence[float] | None
    ) -> None:
        # One record, assigned once: a tick in another thread sees the old gains or the new ones.
        before: Gains | None = getattr(self, "_gains", None)
        self._gains = make_gains(
            kp,
            kv,
            max_speed,
            max_acceleration=None if before is None else before.max_acceleration,
            rows=self.rows,
            groups=self._speed_groups,
            owner=self.name,
        )

    def __repr__(self) -> str:
        gains = self._gains
        words = [repr(self.name), *self._words(), f"kp={brief(gains.kp)}, kv={brief(gains.kv)}"]
        if gains.max_speed is not None:
            words.append(f"max_speed={brief(gains.max_speed)}")
        if gains.max_acceleration is not None:
            words.append(f"max_acceleration={brief(gains.max_acceleration)}")
        return f"{type(self).__name__}({', '.join(words)})"

    def _words(self) -> list[str]:
        """Say what ``repr`` tells between name and gains."""
        return [f"rows={self.rows}"]


def _plain(gain: Array) -> float | Array:
    return gain if gain.ndim else float(gain)
