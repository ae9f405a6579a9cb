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
        haste: How much of the command is there because the joint is too fast, rad/s².
        last: Acceleration with which the joint just stops at its limit, rad/s²; inf where it is not
            too fast.
        by_position: The command if no speed were limited, rad/s².
    """

    side: Side
    command: float
    margin: float
    haste: float = 0.0
    last: float = np.inf
    by_position: float = np.inf


def limit_terms(
    limits: JointLimits,
    q: np.ndarray,
    v: np.ndarray,
    most: np.ndarray,
    period: float,
    disturbance: np.ndarray | None = None,
) -> list[LimitTerms]:
    """Evaluate every limit at the present state.

    Args:
        limits: The limits, bound to the robot.
        q: (n,) joint positions, rad.
        v: (n,) joint velocities, rad/s.
        most: (n,) braking that the motors can give each joint, see `braking`, rad/s².
        period: Time between two ticks, s; 0 where it is not known.
        disturbance: (n,) accelerations that come on top of the commanded ones, rad/s²; None for none.

    Returns:
        One entry per limit.
    """
    beside = np.zeros(v.size) if disturbance is None else disturbance
    terms: list[LimitTerms] = []
    for side, command, by_position, margin, (stopping, last) in zip(
        limits.sides,
        limits.commands(q, v),
        limits.commands(q, v, speeds=False),
        limits.margins(),
        limits.hurries(q, v, most, period),
        strict=True,
    ):
        haste = max(command - stopping, 0.0)
        more = side.sign * float(beside[side.index])
        terms.append(
            LimitTerms(side, command - haste - more, margin, haste, last - more, by_position - more)
        )
    return terms


def braking(M: np.ndarray, bias: np.ndarray, torque_limit: np.ndarray) -> np.ndarray:
    """How much each joint can be braked while its motors hold the others, whatever the direction.

    Args:
        M: (n, n) inertia.
        bias: (n,) Coriolis, centrifugal and gravity torque, N·m.
        torque_limit: (n,) what the motors give, N·m.

    Returns:
        (n,) min_i (limit_i − |bias_i|) / |M_ij|, rad/s², at least 0.
    """
    room = np.maximum(torque_limit - np.abs(bias), 0.0)
    moved = np.abs(M)
    there = moved > 0.0
    return np.min(
        np.divide(room[:, None], moved, out=np.full(M.shape, np.inf), where=there), axis=0
    )


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
