"""Gains of the second-order tracking law, Eq. 24, with optional velocity saturation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.law.scalars import speed_scale
from opspace.tasks.validation import Array, finite_array, numbers


@dataclass(frozen=True)
class Gains:
    """Gains of one task, replaced as a whole whenever one of them changes.

    Attributes:
        kp: () or (m,) stiffness, 1/s².
        kv: () or (m,) damping, 1/s.
        critical: Whether kv follows kp as 2 sqrt(kp).
        max_speed: Speed limit of each group of rows, m/s or rad/s; None where there is none.
        groups: Rows that share a speed limit.
        max_acceleration: Acceleration of the way to a new target, of each group, m/s² or rad/s²; None
            where the target is followed at once.
    """

    kp: Array
    kv: Array
    critical: bool
    max_speed: tuple[float, ...] | None
    groups: tuple[slice, ...]
    max_acceleration: tuple[float, ...] | None = None

    def acceleration(self, error: Array, velocity_error: Array, feedforward: Array) -> Array:
        """Return the commanded acceleration of Eq. 24: f* = a_d + kv (v_d − ẋ) + kp (x_d − x).

        With a speed limit the position error asks for no more than that speed (Khatib 1987):
        f* = a_d + kv (v_d + v_sat − ẋ), v_sat = kp/kv (x_d − x) · min(1, max_speed / ‖·‖).

        Args:
            error: (m,) x_d − x, m or rad.
            velocity_error: (m,) v_d − ẋ, m/s or rad/s.
            feedforward: (m,) a_d, m/s² or rad/s².

        Returns:
            (m,) f*, m/s² or rad/s².
        """
        if self.max_speed is not None:
            error = self._within_speed(error, self.max_speed)
        return feedforward + self.kv * velocity_error + self.kp * error

    def saturates(self, error: Array) -> bool:
        """Tell whether a position error (m,) asks for more than the speed limit."""
        if self.max_speed is None:
            return False
        asked = speed_per_error(self.kp, self.kv) * error
        return any(
            math.hypot(*asked[rows]) > limit
            for rows, limit in zip(self.groups, self.max_speed, strict=True)
        )

    def _within_speed(self, error: Array, max_speed: tuple[float, ...]) -> Array:
        # kv v_sat = kp (scale · error): scaling the error saturates the speed it asks for.
        asked = speed_per_error(self.kp, self.kv) * error
        limited = error.copy()
        for rows, limit in zip(self.groups, max_speed, strict=True):
            limited[rows] *= speed_scale(math.hypot(*asked[rows]), limit)
        return limited


def speed_per_error(kp: Array, kv: Array) -> Array:
    """Return kp/kv, the speed that one unit of error asks for, 1/s; 0 where kp is 0."""
    return np.divide(kp, kv, out=np.zeros(np.broadcast(kp, kv).shape), where=kp > 0.0)


def make_gains(
    kp: ArrayLike,
    kv: ArrayLike | None,
    max_speed: float | Sequence[float] | None,
    *,
    max_acceleration: float | Sequence[float] | None = None,
    rows: int,
    groups: tuple[slice, ...],
    owner: str,
) -> Gains:
    """Check the gains of a task.

    Args:
        kp: Stiffness, a number or (m,), 1/s².
        kv: Damping, a number or (m,), 1/s; None is critical damping, 2 sqrt(kp).
        max_speed: Speed limit, one for each group, m/s or rad/s; None for no limit.
        max_acceleration: Acceleration of the way to a new target, one for each group, m/s² or rad/s²;
            None for no way.
        rows: m, or 0 while it is not known.
        groups: Rows that share a speed limit.
        owner: Name of the task, for the error message.

    Returns:
        The gains.

    Raises:
        InputError: A gain that is negative, not finite or of another size; a speed limit that is
            not above zero, or that meets kp > 0 with kv = 0.
    """
    stiffness = _gain(kp, "kp", rows, owner)
    damping = _gain(2.0 * np.sqrt(stiffness) if kv is None else kv, "kv", rows, owner)
    if stiffness.ndim and damping.ndim and stiffness.shape != damping.shape:
        raise InputError(
            f"task {owner!r}: kp has {stiffness.size} numbers but kv has {damping.size}"
        )
    limits = _limits(max_speed, "max_speed", len(groups), owner)
    accelerations = paced(max_acceleration, limits, len(groups), owner)
    if limits is not None and np.any((stiffness > 0.0) & (damping == 0.0)):
        raise InputError(f"task {owner!r}: max_speed needs kv above zero wherever kp is")
    return Gains(stiffness, damping, kv is None, limits, groups, accelerations)


def paced(
    max_acceleration: float | Sequence[float] | None,
    max_speed: tuple[float, ...] | None,
    count: int,
    owner: str,
) -> tuple[float, ...] | None:
    """Check the accelerations of the ways to new targets, which go with speeds.

    Args:
        max_acceleration: One for each group, m/s² or rad/s²; None for no way.
        max_speed: Speed limit of each group, checked.
        count: Number of groups.
        owner: Name of the task, for the error message.

    Returns:
        The accelerations.

    Raises:
        InputError: An acceleration that is none, or a speed that is missing or not finite.
    """
    found = _limits(max_acceleration, "max_acceleration", count, owner)
    if found is not None and not all(
        math.isfinite(x) for x in (*found, *(max_speed or (math.inf,)))
    ):
        raise InputError(f"task {owner!r}: max_acceleration needs max_speed, both finite")
    return found


def one_or_all(limits: tuple[float, ...] | None) -> float | tuple[float, ...] | None:
    """Return the limits of all groups, as a number where there is one."""
    return limits[0] if limits is not None and len(limits) == 1 else limits


def _gain(value: ArrayLike, what: str, rows: int, owner: str) -> Array:
    label = f"task {owner!r}: {what}"
    given = numbers(value, label)
    gain = finite_array(given, (rows or None,) if given.ndim else (), label)
    if (gain < 0.0).any():
        raise InputError(f"{label} must not be negative, not {gain.tolist()}")
    return gain


def _limits(
    value: float | Sequence[float] | None, what: str, count: int, owner: str
) -> tuple[float, ...] | None:
    if value is None:
        return None
    limits = tuple(numbers(value, f"task {owner!r}: {what}").reshape(-1).tolist())
    if len(limits) != count:
        raise InputError(f"task {owner!r}: {what} needs {count} number(s), not {len(limits)}")
    if not all(limit > 0.0 for limit in limits):
        raise InputError(f"task {owner!r}: {what} must be above zero, not {list(limits)}")
    return limits
