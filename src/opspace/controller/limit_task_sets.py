"""Joint-limit task sets of one tick: which are needed, and how much."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from opspace.law import TaskSet
from opspace.law.scalars import rises
from opspace.tasks import JointLimits
from opspace.tasks.joint_limits import Side

TOP = -1
"""Priority of joint limits: above every level of the stack."""


class LimitTerms(NamedTuple):
    """One limit in one tick.

    Attributes:
        side: The limit.
        command: Acceleration towards the limit that the task set asks for, rad/s².
    """

    side: Side
    command: float


def limit_terms(
    limits: JointLimits, q: np.ndarray, v: np.ndarray, disturbance: np.ndarray | None = None
) -> list[LimitTerms]:
    """Evaluate every limit at the present state.

    Args:
        limits: The limits, bound to the robot.
        q: (n,) joint positions, rad.
        v: (n,) joint velocities, rad/s.
        disturbance: (n,) accelerations that come on top of the commanded ones, rad/s²; None for none.

    Returns:
        One entry per limit.
    """
    beside = np.zeros(v.size) if disturbance is None else disturbance
    return [
        LimitTerms(side, command - side.sign * float(beside[side.index]))
        for side, command in zip(limits.sides, limits.commands(q, v), strict=True)
    ]


@dataclass(frozen=True)
class Insertion:
    """How one limit takes part in the stack.

    Attributes:
        activation: h of its task set.
        desired: Acceleration towards the limit that the task set asks for, rad/s².
    """

    activation: float
    desired: float


def insertions(
    limits: JointLimits,
    terms: Sequence[LimitTerms],
    q: np.ndarray,
    v: np.ndarray,
    acceleration: np.ndarray,
    known: Mapping[int, Insertion],
) -> dict[int, Insertion]:
    """Decide which limits take part, for the accelerations that the stack would now cause.

    In mode ``admissible`` a limit asks for the smaller of what is admissible and what the joint does
    anyway: while the second holds, inserting the task set changes nothing, so its activation can
    rise before it is needed without pushing the joint anywhere. Neither activation nor desired value
    fall below those known: a limit that works does not leave because it works. All of it is
    continuous in the accelerations, hence so is the result of any fixed number of repetitions.

    Args:
        limits: Their law.
        terms: Every limit.
        q: (n,) joint positions, rad.
        v: (n,) joint velocities, rad/s.
        acceleration: (n,) joint accelerations under the stack with the insertions known so far.
        known: Insertions so far, by index of the limit.

    Returns:
        The insertions with an activation above 0, by index of the limit.
    """
    found: dict[int, Insertion] = {}
    commands = [term.command for term in terms]
    for i, (h, wish) in enumerate(limits.presences(q, v, acceleration, commands)):
        before = known.get(i, Insertion(0.0, -np.inf))
        now = Insertion(max(h, before.activation), max(wish, before.desired))
        if now.activation > 0.0:
            more = rises(now.activation, before.activation) or rises(now.desired, before.desired)
            found[i] = now if more else before
    return found


def limit_task_sets(
    terms: Sequence[LimitTerms], inserted: Mapping[int, Insertion], n: int, sigma_reference: float
) -> list[TaskSet]:
    """Build the task sets e_jᵀ q̈ = ± desired of the limits that take part."""
    identity = np.eye(n)
    return [
        TaskSet(
            identity[terms[i].side.index : terms[i].side.index + 1],
            [terms[i].side.sign * limit.desired],
            TOP,
            limit.activation,
            terms[i].side.name,
            sigma_reference,
        )
        for i, limit in inserted.items()
    ]
