"""What a spring and a damper ask for (`opspace.tasks.impedance`)."""

from __future__ import annotations

import math

from opspace.kernels.columns import (
    FIRST_ROW,
    GOAL_VELOCITY,
    JOINT,
    ROWS,
)
from opspace.kernels.inertia import whiten_rows
from opspace.kernels.motion import selected
from opspace.law.scalars import LIGHTEST
from opspace.machine.jit import jit


@jit
def add_spring(work, i, size):
    """Add σ (K e + D ė + F), σ = J A⁻¹ Jᵀ, D_i = 2 ζ √(K_i/σ_ii), to the wanted rows of task i.

    Reads J, error, spring and the motion of the task, of which ``size`` numbers count.
    """
    first, rows, n = work.kind[i, FIRST_ROW], work.kind[i, ROWS], work.v.shape[0]
    X, pull, spring = work.Jw, work.fw, work.spring
    whiten_rows(work.inertia, work.kind[i, JOINT], first, first + rows, work.J, X)
    for row in range(first, first + rows):
        light, rate = LIGHTEST, _wanted_rate(work, i, row, size)
        total = 0.0
        for a in range(n):
            total += X[row, a] * X[row, a]
            rate -= work.J[row, a] * work.v[a]
        damping = spring[row, 1] / math.sqrt(max(total, light))
        pull[row] = spring[row, 0] * work.error[row] + damping * rate + spring[row, 2]
    for row in range(first, first + rows):
        for other in range(first, first + rows):
            sigma = 0.0
            for a in range(n):
                sigma += X[row, a] * X[other, a]
            work.wanted[row] += sigma * pull[other]


@jit
def _wanted_rate(work, i, row, size):
    """Speed that the goal has along a row."""
    number, total = work.numbers[i], 0.0
    for c in range(size):
        total += selected(work, i, row, c) * number[GOAL_VELOCITY + c]
    return total
