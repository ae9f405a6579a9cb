"""The compiled tick at many states."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from opspace.kernels.columns import DAMPING, REMEMBERS, TURN
from opspace.kernels.tick import tick
from opspace.machine.jit import jit

LARGEST = float(np.finfo(float).max)


@partial(jit, nogil=True)
def ticks(t, k, before, Q, V, own, first, end, tau):
    """Compute the torque at the states ``first`` to ``end`` − 1, each as the tick after ``before``.

    Args:
        t: Time, s.
        k: Handle of a `opspace.kernels.columns.Tick` that computes the robot itself.
        before: Handle of `Remembered`.
        Q: (states, n) configurations.
        V: (states, n) velocities.
        own: (states, tasks) activation of each task by its own function, or one row for all.
        first: First state.
        end: State after the last one.
        tau: (states, n) filled, N·m.
    """
    n = k.v.shape[0]
    for i in range(first, end):
        for a in range(n):
            k.q[a], k.v[a] = Q[i, a], V[i, a]
        begin_state(k, before, own[i if own.shape[0] > 1 else 0])
        if tick(t, k) < 0:
            brake(k, tau[i])
        else:
            for a in range(n):
                tau[i, a] = k.tau[a]


@jit
def begin_state(k, before, own):
    """Go back to what the tick before knew."""
    for i in range(before.group.shape[0]):
        k.group[i] = before.group[i]
    for i in range(before.remembers.shape[0]):
        k.own[i] = own[i]
        k.kind[i, REMEMBERS] = before.remembers[i]
        for c in range(4):
            k.numbers[i, TURN + c] = before.turn[i, c]


@jit
def brake(k, tau):
    """Bias with joint damping, inside the motors' limits; finite whatever the model says."""
    for a in range(tau.shape[0]):
        x = k.bias[a] - k.option[DAMPING] * k.M[a, a] * k.v[a]
        limit = min(k.torque_limit[a], LARGEST)
        tau[a] = 0.0 if math.isnan(x) else min(max(x, -limit), limit)
