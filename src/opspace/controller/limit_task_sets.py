"""Joint limits of one tick: what each asks for, and the task sets of those that are inserted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from opspace.law import TaskSet
from opspace.tasks import JointLimits
from opspace.tasks.joint_limits import Side

TOP = -1
"""Priority of joint limits: above every level of the stack."""


class LimitTerms(NamedTuple):
    """One limit in one tick.

    Attributes:
        side: The limit.
        command: Acceleration towards the limit that it asks for or allows, rad/s².
        margin: Acceleration that it must take from its joint to be told fully active, rad/s².
    """

    side: Side
    command: float
    margin: float


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
        LimitTerms(side, command - side.sign * float(beside[side.index]), margin)
        for side, command, margin in zip(
            limits.sides, limits.commands(q, v), limits.margins(), strict=True
        )
    ]


def limit_task_sets(
    terms: Sequence[LimitTerms], inserted: Mapping[int, float], n: int, sigma_reference: float
) -> list[TaskSet]:
    """Build the task sets e_jᵀ q̈ = ± command of the limits that are inserted, with activation h."""
    identity = np.eye(n)
    return [
        TaskSet(
            identity[terms[i].side.index : terms[i].side.index + 1],
            [terms[i].side.sign * terms[i].command],
            TOP,
            h,
            terms[i].side.name,
            sigma_reference,
        )
        for i, h in inserted.items()
    ]
