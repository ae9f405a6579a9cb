"""The nearest acceleration within bounds, compiled; see `opspace.law.nearest`."""

from __future__ import annotations

import math

from opspace.kernels.algebra import cholesky, cholesky_row, solve_lower, solve_lower_transposed
from opspace.kernels.compiled_scalars import hardened, level_weight
from opspace.kernels.distances import faster, row_softness
from opspace.kernels.inertia import acceleration_of, joint_row, unit_row, whiten, whitened_of
from opspace.kernels.walk import slot_bit
from opspace.law.scalars import BROKEN, CLEANINGS, HANDOVERS, HARD, ROUNDING, SOFT, UNBOUNDED
from opspace.machine.jit import jit


@jit
def weigh_places(work, stacks):
    """How much of a task is at each of its places, and the levels below, into here and below (slots,).

    Reads the slots and the corners with their weights; see `opspace.law.levels_below`.
    """
    slots = work.slots.shape[0]
    below, absent = 0.0, 1.0
    for s in range(slots - 1, -1, -1):
        # Where no stack has it nothing is left, not even rounding: places for later change no bit.
        here, somewhere = 1.0, False
        for c in range(stacks):
            if work.corner_on[c] & slot_bit(s) == 0:
                here -= work.corner_weight[c]
            elif work.corner_weight[c] > 0.0:
                somewhere = True
        work.here[s] = max(here, 0.0) if somewhere else 0.0
        work.below[s] = below
        absent *= 1.0 - work.here[s]
        if s == 0 or work.slots[s - 1, 0] != work.slots[s, 0]:
            below += 1.0 - absent
            absent = 1.0


@jit
def task_metric(work, stacks):
    """W = I + Σ_l ω_l Σ_{k in l} h_k Ĵ_kᵀ Ĵ_k, into bounds.W (n, n); see `opspace.law.task_metric`.

    Reads the slots, the whitened rows Jw and the corners with their weights.
    """
    n = work.v.shape[0]
    W, Jw = work.bounds.W, work.Jw
    weigh_places(work, stacks)
    for a in range(n):
        for b in range(n):
            W[a, b] = 0.0
        W[a, a] = 1.0
    for s in range(work.slots.shape[0] - 1, -1, -1):
        weight = level_weight(work.below[s]) * work.here[s]
        for row in range(work.slots[s, 1], work.slots[s, 1] + work.slots[s, 2]):
            for a in range(n):
                factor = weight * Jw[row, a]
                for b in range(a + 1):
                    W[a, b] += factor * Jw[row, b]


@jit
def nearest_acceleration(inertia, acceleration, bounds, distances):
    """Overwrite an acceleration with the nearest one within bounds, in the metric bounds.W.

    The multipliers of the bounds are found by the active-set method of Lawson and Hanson. With
    W = C Cᵀ the point is z = Cᵀ x, x = Uᵀ q̈. Of the distances only those are projected on that would
    shrink too fast without: the answer is the same, and the others cost a product each.

    Args:
        inertia: `INERTIA`, factored.
        acceleration: (n,) rad/s², overwritten.
        bounds: `BOUNDS`: W, lower and upper, rad/s², least and most, N·m, are read; C and taken written.
        distances: `DISTANCES`: G and most are read.
    """
    n = acceleration.shape[0]
    cholesky(bounds.W, n, 0.0, bounds.C)
    count = _normals(inertia, n, bounds)
    whitened_of(inertia, acceleration, bounds.row)
    for a in range(n):
        bounds.z[a] = bounds.row[a] / bounds.C[a, a]  # the factor's diagonal is inverted
        for b in range(a + 1, n):
            bounds.z[a] += bounds.C[b, a] * bounds.row[b]
    for i in range(distances.held.shape[0]):
        distances.held[i] = 0
    count = _take_in(0, inertia, acceleration, count, n, bounds, distances)
    for a in range(n):
        bounds.x[a] = bounds.z[a]
    for a in range(bounds.taken.shape[0]):
        bounds.taken[a] = 0.0
    # Several times, what softness leaves of an excess included.
    for turn in range(CLEANINGS):
        while True:
            project_on_bounds(count, n, 0, bounds.normal, bounds)
            for a in range(n):
                acceleration[a] = bounds.y[a]
            solve_lower_transposed(bounds.C, n, acceleration)
            acceleration_of(inertia, acceleration)
            before = count
            count = _take_in(turn, inertia, acceleration, count, n, bounds, distances)
            if count == before:
                break
        for a in range(n):
            bounds.x[a] = bounds.y[a]
        for i in range(count):
            bounds.taken[bounds.owner[i]] += bounds.multiplier[i] * bounds.size[i]
            if turn == HANDOVERS - 1:
                bounds.softness[i] = hardened(bounds.softness[i])


@jit
def _take_in(turn, inertia, acceleration, count, n, bounds, distances):
    """Append the distances that shrink faster than they may, as unit normals.

    Returns:
        How many bounds there are then.
    """
    for i in range(distances.held.shape[0]):
        most = distances.most[i]
        over = faster(distances, i, acceleration) - most
        if distances.held[i] != 0 or not over > -BROKEN * max(1.0, abs(most)):
            continue
        distances.held[i] = 1
        for a in range(n):
            bounds.row[a] = distances.G[i, a]
        whiten(inertia, bounds.row)
        softness = row_softness(inertia, distances, i)
        if softness == math.inf:
            continue
        if turn >= HANDOVERS:
            softness = hardened(softness)
        # The second side is free.
        count = _two_sided(count, n, 4 * n + i, -math.inf, most, softness, bounds)
    return count


@jit
def _normals(inertia, n, bounds):
    """Write every bound that is finite as unit normal · z <= bound, with its softness.

    Returns:
        How many there are.
    """
    count = 0
    for j in range(n):
        unit_row(inertia, j, 1.0, bounds.row)
        count = _two_sided(count, n, j, bounds.lower[j], bounds.upper[j], SOFT, bounds)
        joint_row(inertia, j, bounds.row)
        count = _two_sided(count, n, 2 * n + j, bounds.least[j], bounds.most[j], HARD, bounds)
    return count


@jit
def _two_sided(count, n, owner, least, most, softness, bounds):
    if not (least > -UNBOUNDED or most < UNBOUNDED):
        return count
    solve_lower(bounds.C, n, bounds.row)
    size = 0.0
    for a in range(n):
        size += bounds.row[a] * bounds.row[a]
    size = math.sqrt(size)
    if size == 0.0:
        return count
    for side in range(2):
        sign = 1.0 if side == 0 else -1.0
        limit = most if side == 0 else -least
        if limit < UNBOUNDED:
            for a in range(n):
                bounds.normal[count, a] = sign * bounds.row[a] / size
            bounds.bound[count], bounds.softness[count] = limit / size, softness
            bounds.owner[count], bounds.size[count] = owner + side * n, size
            count += 1
    return count


@jit
def project_on_bounds(count, n, held, way, bounds):
    """Find y = x less the ways times their multipliers, none of which is negative.

    Args:
        count: Number of bounds.
        n: Size of x.
        held: How many bounds held last, if only x is another one since; 0 to begin with none.
        way: (count, n) where x goes for each bound; the normals themselves where near is ‖y − x‖.
        bounds: `BOUNDS`; x, normal, bound and softness are read, y and multiplier written.

    Returns:
        How many bounds hold.
    """
    for i in range(count):
        bounds.multiplier[i], bounds.scale[i] = 0.0, abs(bounds.bound[i])
        for a in range(n):
            bounds.scale[i] += abs(bounds.normal[i, a] * bounds.x[a])
    known, size = held, held
    for _ in range(10 * count + 1):
        while size > 0:
            multipliers(n, known, size, way, bounds)
            if advance(size, bounds):
                break
            known, size = _drop(size, bounds)
        for a in range(n):
            bounds.y[a] = bounds.x[a]
            for k in range(size):
                bounds.y[a] -= way[bounds.active[k], a] * bounds.multiplier[bounds.active[k]]
        worst = _most_broken(count, n, bounds)
        if worst < 0:
            break
        bounds.active[size] = worst
        known, size = size, size + 1
    return size


@jit
def _most_broken(count, n, bounds):
    worst, most = -1, 0.0
    for i in range(count):
        if bounds.multiplier[i] > 0.0:  # it holds already
            continue
        over = -bounds.bound[i]
        for a in range(n):
            over += bounds.normal[i, a] * bounds.y[a]
        if over > ROUNDING * bounds.scale[i] and over > most:
            worst, most = i, over
    return worst


@jit
def multipliers(n, known, size, way, bounds):
    """Solve (N wayᵀ + softness) λ = N x − bound for the bounds that hold, some of which are factored.

    What a bound adds to those before it, the pivot, is its softness at least: N wayᵀ has no negative
    eigenvalues. Less than that is rounding, where its normal is a combination of theirs.
    """
    for k in range(size):
        i = bounds.active[k]
        bounds.r[k] = -bounds.bound[i]
        for a in range(n):
            bounds.r[k] += bounds.normal[i, a] * bounds.x[a]
        if k < known:
            continue
        for b in range(k + 1):
            j = bounds.active[b]
            product = 0.0
            for a in range(n):
                product += bounds.normal[i, a] * way[j, a]
            bounds.G[k, b] = product
        bounds.G[k, k] += bounds.softness[i]
        largest = 1.0 / math.sqrt(bounds.softness[i])
        positive = cholesky_row(bounds.G, k, 0.0, bounds.factor)
        if not positive or bounds.factor[k, k] > largest:
            bounds.factor[k, k] = largest
    solve_lower(bounds.factor, size, bounds.r)
    solve_lower_transposed(bounds.factor, size, bounds.r)
    for k in range(size):
        bounds.wanted[bounds.active[k]] = bounds.r[k]


@jit
def advance(size, bounds):
    """Move the multipliers towards what is wanted until one of them is zero.

    Returns:
        Whether they came all the way.
    """
    share = 1.0
    for k in range(size):
        i = bounds.active[k]
        if bounds.wanted[i] <= 0.0:
            way = bounds.multiplier[i] - bounds.wanted[i]
            share = min(share, bounds.multiplier[i] / way if way > 0.0 else 0.0)
    for k in range(size):
        i = bounds.active[k]
        gone = share * (bounds.multiplier[i] - bounds.wanted[i])
        if bounds.wanted[i] <= 0.0 and gone >= bounds.multiplier[i] * (1.0 - ROUNDING):
            bounds.multiplier[i] = 0.0
        else:
            bounds.multiplier[i] -= gone
    return share == 1.0


@jit
def _drop(size, bounds):
    """Forget the bounds whose multipliers have become zero.

    Returns:
        How many before the first of them are factored still, and how many stay.
    """
    first, kept = 0, 0
    for k in range(size):
        if bounds.multiplier[bounds.active[k]] > 0.0:
            if kept == k:
                first += 1
            bounds.active[kept] = bounds.active[k]
            kept += 1
    return first, kept
