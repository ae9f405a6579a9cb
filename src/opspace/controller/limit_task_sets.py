"""Joint-limit task sets of one tick: which are needed, and how much."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from opspace.law import TaskSet
from opspace.law.scalars import rises
from opspace.tasks import JointLimits
from opspace.tasks.joint_limits import Side

TOP = -1
"""Priority of joint limits: above every level of the stack."""


@dataclass(frozen=True)
class LimitTerms:
    """One limit in one tick, with accelerations counted towards the limit.

    Attributes:
        side: The limit.
        position: Of the joint, rad.
        speed: Of the joint, rad/s.
        command: Acceleration that the task set asks for, rad/s².
    """

    side: Side
    position: float
    speed: float
    command: float


def limit_terms(
    limits: JointLimits,
    positions: np.ndarray,
    v: np.ndarray,
    disturbance: np.ndarray | None = None,
) -> list[LimitTerms]:
    """Evaluate every limit at the present state.

    Args:
        limits: The limits, bound to the robot.
        positions: (n,) joint positions, rad.
        v: (n,) joint velocities, rad/s.
        disturbance: (n,) accelerations that come on top of the commanded ones, rad/s²; None for none.

    Returns:
        One entry per limit.
    """
    terms: list[LimitTerms] = []
    for side in limits.sides:
        position, speed = float(positions[side.index]), float(v[side.index])
        command = limits.admissible(side, position, speed)
        if disturbance is not None:
            command -= side.sign * float(disturbance[side.index])
        terms.append(LimitTerms(side, position, speed, command))
    return terms


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
        acceleration: (n,) joint accelerations under the stack with the insertions known so far.
        known: Insertions so far, by index of the limit.

    Returns:
        The insertions with an activation above 0, by index of the limit.
    """
    found: dict[int, Insertion] = {}
    for i, term in enumerate(terms):
        side = term.side
        before = known.get(i, Insertion(0.0, -np.inf))
        other = float(side.sign * acceleration[side.index])
        h, desired = limits.presence(side, term.position, term.speed, other, term.command)
        h, desired = max(h, before.activation), max(desired, before.desired)
        if h > 0.0:
            new = rises(h, before.activation) or rises(desired, before.desired)
            found[i] = Insertion(h, desired) if new else before
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
