"""The compiled tick at many states."""

from __future__ import annotations

import math

import numpy as np

from opspace.kernels.columns import BASE, DAMPING, REMEMBERS, TURN
from opspace.kernels.tick import tick
from opspace.law.press_columns import MEMORY_SIZE
from opspace.machine.jit import jit

LARGEST = float(np.finfo(float).max)


@jit
def ticks(t, work, states, first, end):
    """Compute the torque at the states ``first`` to ``end`` − 1, each as the tick after ``before``.

    Args:
        t: Time, s.
        work: `TICK` of a robot that it computes itself.
        states: `STATES`; its tau is filled.
        first: First state.
        end: State after the last one.
    """
    n = work.v.shape[0]
    Q, V, own, tau = states.Q, states.V, states.own, states.tau
    for i in range(first, end):
        for a in range(work.q.shape[0]):
            work.q[a] = Q[i, a]
        for a in range(n):
            work.v[a] = V[i, a]
        begin_state(work, states.before, own[i if own.shape[0] > 1 else 0])
        if tick(t, work) < 0:
            brake(work, tau[i])
        else:
            for a in range(n):
                tau[i, a] = work.tau[a]


@jit
def begin_state(work, before, own):
    """Go back to what the tick before knew."""
    for i in range(before.group.shape[0]):
        work.group[i] = before.group[i]
    work.stance.remembered[0] = 0
    for i in range(before.remembers.shape[0]):
        work.own[i] = own[i]
        work.kind[i, REMEMBERS] = before.remembers[i]
        for c in range(4):
            work.numbers[i, TURN + c] = before.turn[i, c]
    for p in range(before.press.shape[0]):
        for c in range(MEMORY_SIZE):
            work.press[p, c] = before.press[p, c]
    for row in range(before.row_unrest.shape[0]):
        work.row_unrest[row] = before.row_unrest[row]
    work.unrest_at[0] = before.unrest_at[0]


@jit
def brake(work, tau):
    """Bias with joint damping (n,), N·m, inside the motors' limits; finite whatever the model says."""
    for a in range(tau.shape[0]):
        if a < work.option[BASE]:
            tau[a] = 0.0
            continue
        x = work.bias[a] - work.option[DAMPING] * work.M[a, a] * work.v[a] - work.torque_middle[a]
        limit = min(work.torque_limit[a], LARGEST)
        tau[a] = 0.0 if math.isnan(x) else min(max(x, -limit), limit) + work.torque_middle[a]
