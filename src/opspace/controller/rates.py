"""Whether ticks come often enough for what a controller is asked to do."""

from __future__ import annotations

import math
from collections.abc import Callable

from opspace.errors import InputError
from opspace.tasks import JointLimits, Task


def longest_period(k1: float, k2: float) -> float:
    r"""Longest time between two ticks with which joint limits hold.

    A joint at its limit that moves away from it, e = |v|, comes back no further than to the limit if

        k₂ Δt + k₁ (k₁ + k₂) Δt² ≤ 1

    which is more than what a joint on its way to the limit needs, k₂ Δt (1 + k₁ Δt) ≤ 1.

    Args:
        k1: Slope of the allowed speed, 1/s.
        k2: Gain on the allowed speed, 1/s.

    Returns:
        Δt, s.
    """
    square = k1 * (k1 + k2)
    return 2.0 / (k2 + math.sqrt(k2 * k2 + 4.0 * square))


def check_limits(period: float, limits: JointLimits) -> None:
    """Check that joint limits hold with this time between two ticks, s.

    Raises:
        InputError: They do not.
    """
    longest = longest_period(limits.k1, limits.k2)
    if limits.law.bound and period > longest * (1.0 + 1e-9):
        raise InputError(
            f"joint limits do not hold with a period of {period:g} s: they need one of at most "
            f"{math.floor(1e5 * longest) / 1e5:g} s, or a smaller k1 and k2 than {limits.k1:g} and "
            f"{limits.k2:g} 1/s"
        )


def check_damping(period: float, kv: float, what: str) -> None:
    """Check that a damping [1/s] does not overshoot from tick to tick.

    Raises:
        InputError: kv Δt >= 2, with which the velocity error grows at every tick.
    """
    if kv * period >= 2.0:
        raise InputError(
            f"{what} {kv:g} 1/s diverges with a period of {period:g} s: it must be below "
            f"2/period = {2.0 / period:g} 1/s, which is that of kp = {1.0 / period**2:g} 1/s² with "
            "critical damping"
        )


def with_period(prepare: Callable[[Task], None], period: float) -> Callable[[Task], None]:
    """Check the gains of every task before it is prepared.

    Args:
        prepare: Gets a task ready for the controller's ticks.
        period: Time between two ticks, s.

    Returns:
        The same, which refuses a task whose damping does not fit the period.
    """

    def checked(task: Task) -> None:
        prepare(task)
        check_damping(period, float(task._gains.kv.max(initial=0.0)), f"task {task.name!r}: kv =")

    return checked
