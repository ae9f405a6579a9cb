"""The nearest acceleration within bounds, compiled; see `opspace.law.nearest`."""

from __future__ import annotations

import math

import numpy as np

from opspace.law.compiled.algebra import cholesky, solve_lower, solve_lower_transposed
from opspace.law.compiled.jit import jit
from opspace.law.nearest import HARD, SOFT, UNBOUNDED

ROUNDING = 1e-13
"""A bound that is broken by less than this part of the numbers involved is kept."""


@jit
def nearest_acceleration(L, acceleration, lower, upper, torque_lower, torque_upper):
    """Overwrite an acceleration with the nearest one within bounds.

    The multipliers of the bounds are found by the active-set method of Lawson and Hanson; it is
    called only where a bound is broken, hence its memory is its own.
    """
    n = acceleration.shape[0]
    normal, bound, softness = _bounds(L, n, lower, upper, torque_lower, torque_upper)
    x = np.empty(n)
    for a in range(n):
        x[a] = 0.0
        for b in range(a, n):
            x[a] += L[b, a] * acceleration[b]
    acceleration[:] = _project(normal, bound, softness, x)
    solve_lower_transposed(L, n, acceleration)


@jit
def _bounds(L, n, lower, upper, torque_lower, torque_upper):
    """Every bound as unit normal · x <= bound, with its softness."""
    normal, bound, softness = np.zeros((4 * n, n)), np.empty(4 * n), np.empty(4 * n)
    count = 0
    row = np.empty(n)
    for i in range(2 * n):
        j = i % n
        for a in range(n):
            row[a] = L[j, a] if a <= j else 0.0
        least, largest, soft = torque_lower[j], torque_upper[j], HARD
        if i < n:
            for a in range(n):
                row[a] = 1.0 if a == j else 0.0
            solve_lower(L, n, row)
            least, largest, soft = lower[j], upper[j], SOFT
        size = 0.0
        for a in range(n):
            size += row[a] * row[a]
        size = math.sqrt(size)
        for sign, limit in ((1.0, largest), (-1.0, -least)):
            if limit < UNBOUNDED:
                for a in range(n):
                    normal[count, a] = sign * row[a] / size
                bound[count], softness[count] = limit / size, soft
                count += 1
    return normal[:count], bound[:count], softness[:count]


@jit
def _project(normal, bound, softness, x):
    """The point nearest to x: x less the normals times their multipliers."""
    count, n = normal.shape
    multiplier, wanted = np.zeros(count), np.zeros(count)
    active = np.zeros(count, np.int64)
    size = 0
    y = x.copy()
    for _ in range(10 * count):
        worst = _most_broken(normal, bound, y, active[:size], x)
        if worst < 0:
            break
        active[size] = worst
        size += 1
        while size > 0:
            _multipliers(normal, bound, softness, x, active[:size], wanted)
            if _advance(active[:size], multiplier, wanted):
                break
            size = _drop(active, size, multiplier)
        for a in range(n):
            y[a] = x[a]
            for k in range(size):
                y[a] -= normal[active[k], a] * multiplier[active[k]]
    return y


@jit
def _most_broken(normal, bound, y, active, x):
    count, n = normal.shape
    worst, most = -1, 0.0
    for i in range(count):
        known = False
        for k in active:
            if k == i:
                known = True
        if known:
            continue
        s, scale = -bound[i], abs(bound[i])
        for a in range(n):
            s += normal[i, a] * y[a]
            scale += abs(normal[i, a] * x[a])
        if s > ROUNDING * scale and s > most:
            worst, most = i, s
    return worst


@jit
def _multipliers(normal, bound, softness, x, active, wanted):
    """Solve (N Nᵀ + softness) λ = N x − bound for the active bounds."""
    m, n = active.shape[0], normal.shape[1]
    G, L, r = np.empty((m, m)), np.zeros((m, m)), np.empty(m)
    for i in range(m):
        one = normal[active[i]]
        for j in range(i + 1):
            G[i, j] = 0.0
            for a in range(n):
                G[i, j] += one[a] * normal[active[j], a]
        G[i, i] += softness[active[i]]
        r[i] = -bound[active[i]]
        for a in range(n):
            r[i] += one[a] * x[a]
    cholesky(G, m, 0.0, L)
    solve_lower(L, m, r)
    solve_lower_transposed(L, m, r)
    for i in range(m):
        wanted[active[i]] = r[i]


@jit
def _advance(active, multiplier, wanted):
    """Move the multipliers towards what is wanted until one of them is zero.

    Returns:
        Whether they came all the way.
    """
    share = 1.0
    for i in active:
        if wanted[i] <= 0.0:
            way = multiplier[i] - wanted[i]
            share = min(share, multiplier[i] / way if way > 0.0 else 0.0)
    for i in active:
        gone = share * (multiplier[i] - wanted[i])
        if wanted[i] <= 0.0 and gone >= multiplier[i] * (1.0 - ROUNDING):
            multiplier[i] = 0.0
        else:
            multiplier[i] -= gone
    return share == 1.0


@jit
def _drop(active, size, multiplier):
    """Forget the bounds whose multipliers have become zero.

    Returns:
        How many stay.
    """
    kept = 0
    for k in range(size):
        if multiplier[active[k]] > 0.0:
            active[kept] = active[k]
            kept += 1
    return kept
