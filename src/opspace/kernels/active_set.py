"""The nearest point within bounds, found from the bounds that held at the tick before.

The same multipliers as `opspace.kernels.projection` finds from nothing: they are unique, and every set
of multipliers that are not negative is a start from which each step comes nearer to them.
"""

from __future__ import annotations

from opspace.kernels.projection import advance, multipliers
from opspace.law.scalars import ROUNDING
from opspace.machine.jit import jit


@jit
def begin_again(count, n, stance):
    """Begin at z with the bounds that held, and nothing taken.

    Returns:
        How many of them hold.
    """
    bounds = stance.bounds
    for a in range(n):
        bounds.x[a] = bounds.z[a]
    for a in range(bounds.taken.shape[0]):
        bounds.taken[a] = 0.0
    return _recall(count, stance)


@jit
def go_on_from(turn, n, size, stance):
    """Count what the bounds that hold take, and go on from the point that was found.

    Args:
        turn: How often it has been projected before; the first one is remembered.
        n: Size of z.
        size: How many hold.
        stance: `STANCE`.
    """
    bounds = stance.bounds
    for a in range(n):
        bounds.x[a] = bounds.y[a]
    for k in range(size):
        i = bounds.active[k]
        bounds.taken[bounds.owner[i]] += bounds.multiplier[i] * bounds.size[i]
        if turn == 0:
            stance.held[k], stance.pressed[k] = bounds.owner[i], bounds.multiplier[i]
    if turn == 0:
        stance.remembered[0] = size


@jit
def _recall(count, stance):
    """Begin with the bounds that held, as far as they are still there.

    Returns:
        How many they are.
    """
    bounds, place = stance.bounds, stance.place_of
    for i in range(place.shape[0]):
        place[i] = -1
    for i in range(count):
        place[bounds.owner[i]] = i
        bounds.multiplier[i] = 0.0
    size = 0
    for k in range(stance.remembered[0]):
        i = place[stance.held[k]]
        if i >= 0:
            bounds.active[size], bounds.multiplier[i] = i, stance.pressed[k]
            size += 1
    return size


@jit
def settle(count, n, known, size, stance):
    """Find y = x less the normals times their multipliers, ``known`` of which are factored.

    Returns:
        How many bounds hold; they are the first of ``active``.
    """
    bounds, tolerance = stance.bounds, stance.tolerance
    for i in range(count):
        scale = abs(bounds.bound[i])
        for a in range(n):
            scale += abs(bounds.normal[i, a] * bounds.x[a])
        tolerance[i] = ROUNDING * scale
    for _ in range(10 * count + 1):
        while size > 0:
            multipliers(n, known, size, bounds.normal, bounds)
            if advance(size, bounds):
                break
            known = _first_gone(size, bounds)
            size = _leave(known, size, bounds)
        known = size
        for a in range(n):
            bounds.y[a] = bounds.x[a]
        for k in range(size):
            i = bounds.active[k]
            factor = bounds.multiplier[i]
            for a in range(n):
                bounds.y[a] -= factor * bounds.normal[i, a]
        worst = _most_broken(count, n, bounds, tolerance)
        if worst < 0:
            break
        bounds.active[size] = worst
        size += 1
    return size


@jit
def _most_broken(count, n, bounds, tolerance):
    worst, most = -1, 0.0
    for i in range(count):
        if bounds.multiplier[i] > 0.0:
            continue
        over = -bounds.bound[i]
        for a in range(n):
            over += bounds.normal[i, a] * bounds.y[a]
        if over > tolerance[i] and over > most:
            worst, most = i, over
    return worst


@jit
def _first_gone(size, bounds):
    """Place of the first bound whose multiplier has become zero: those before it stay factored."""
    for k in range(size):
        if not bounds.multiplier[bounds.active[k]] > 0.0:
            return k
    return size


@jit
def _leave(first, size, bounds):
    """Forget the bounds whose multipliers have become zero.

    Returns:
        How many stay.
    """
    kept = first
    for k in range(first, size):
        if bounds.multiplier[bounds.active[k]] > 0.0:
            bounds.active[kept] = bounds.active[k]
            kept += 1
    return kept
