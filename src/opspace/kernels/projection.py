"""The nearest acceleration within bounds, compiled; see `opspace.law.nearest`."""

from __future__ import annotations

import math

from opspace.kernels.algebra import cholesky, solve_lower, solve_lower_transposed
from opspace.kernels.inertia import acceleration_of, unit_row, whitened_of
from opspace.law.nearest import HARD, SOFT, UNBOUNDED
from opspace.machine.jit import jit

ROUNDING = 1e-13
"""A bound that is broken by less than this part of the numbers involved is kept."""


@jit
def nearest_acceleration(f, acceleration, s):
    """Overwrite an acceleration with the nearest one within bounds.

    The multipliers of the bounds are found by the active-set method of Lawson and Hanson.

    Args:
        f: Handle of the inertia's factor.
        acceleration: (n,) rad/s².
        s: Handle of `Bounds`.
    """
    n = acceleration.shape[0]
    count = _normals(f, n, s)
    whitened_of(f, acceleration, s.x)
    _project(count, n, s)
    for a in range(n):
        acceleration[a] = s.y[a]
    acceleration_of(f, acceleration)


@jit
def _normals(f, n, s):
    """Write every bound that is finite as unit normal · x <= bound, with its softness.

    Returns:
        How many there are.
    """
    count = 0
    for j in range(n):
        unit_row(f, j, 1.0, s.row)
        count = _two_sided(count, n, s.lower[j], s.upper[j], SOFT, s)
        for a in range(n):
            s.row[a] = f.U[j, a]
        count = _two_sided(count, n, s.least[j], s.most[j], HARD, s)
    return count


@jit
def _two_sided(count, n, least, most, softness, s):
    size = 0.0
    for a in range(n):
        size += s.row[a] * s.row[a]
    size = math.sqrt(size)
    for side in range(2):
        sign = 1.0 if side == 0 else -1.0
        limit = most if side == 0 else -least
        if limit < UNBOUNDED:
            for a in range(n):
                s.normal[count, a] = sign * s.row[a] / size
            s.bound[count], s.softness[count] = limit / size, softness
            count += 1
    return count


@jit
def _project(count, n, s):
    """Y = x less the normals times their multipliers, none of which is negative."""
    for i in range(count):
        s.multiplier[i] = 0.0
    for a in range(n):
        s.y[a] = s.x[a]
    size = 0
    for _ in range(10 * count):
        worst = _most_broken(count, n, size, s)
        if worst < 0:
            break
        s.active[size] = worst
        size += 1
        while size > 0:
            _multipliers(n, size, s)
            if _advance(size, s):
                break
            size = _drop(size, s)
        for a in range(n):
            s.y[a] = s.x[a]
            for k in range(size):
                s.y[a] -= s.normal[s.active[k], a] * s.multiplier[s.active[k]]


@jit
def _most_broken(count, n, size, s):
    worst, most = -1, 0.0
    for i in range(count):
        known = False
        for k in range(size):
            if s.active[k] == i:
                known = True
        if known:
            continue
        over, scale = -s.bound[i], abs(s.bound[i])
        for a in range(n):
            over += s.normal[i, a] * s.y[a]
            scale += abs(s.normal[i, a] * s.x[a])
        if over > ROUNDING * scale and over > most:
            worst, most = i, over
    return worst


@jit
def _multipliers(n, size, s):
    """Solve (N Nᵀ + softness) λ = N x − bound for the bounds that hold."""
    for k in range(size):
        i = s.active[k]
        for b in range(k + 1):
            j = s.active[b]
            product = 0.0
            for a in range(n):
                product += s.normal[i, a] * s.normal[j, a]
            s.G[k, b] = product
        s.G[k, k] += s.softness[i]
        s.r[k] = -s.bound[i]
        for a in range(n):
            s.r[k] += s.normal[i, a] * s.x[a]
    cholesky(s.G, size, 0.0, s.factor)
    solve_lower(s.factor, size, s.r)
    solve_lower_transposed(s.factor, size, s.r)
    for k in range(size):
        s.wanted[s.active[k]] = s.r[k]


@jit
def _advance(size, s):
    """Move the multipliers towards what is wanted until one of them is zero.

    Returns:
        Whether they came all the way.
    """
    share = 1.0
    for k in range(size):
        i = s.active[k]
        if s.wanted[i] <= 0.0:
            way = s.multiplier[i] - s.wanted[i]
            share = min(share, s.multiplier[i] / way if way > 0.0 else 0.0)
    for k in range(size):
        i = s.active[k]
        gone = share * (s.multiplier[i] - s.wanted[i])
        if s.wanted[i] <= 0.0 and gone >= s.multiplier[i] * (1.0 - ROUNDING):
            s.multiplier[i] = 0.0
        else:
            s.multiplier[i] -= gone
    return share == 1.0


@jit
def _drop(size, s):
    """Forget the bounds whose multipliers have become zero.

    Returns:
        How many stay.
    """
    kept = 0
    for k in range(size):
        if s.multiplier[s.active[k]] > 0.0:
            s.active[kept] = s.active[k]
            kept += 1
    return kept
