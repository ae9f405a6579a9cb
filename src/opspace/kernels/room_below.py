"""What levels leave of a joint's last way to its limit to those above; see `opspace.law.leave_room`."""

from __future__ import annotations

import math

from opspace.kernels.algebra import cholesky, solve_lower, solve_lower_transposed
from opspace.kernels.compiled_scalars import level_weight
from opspace.kernels.inertia import acceleration_of, unit_row, whitened_of
from opspace.kernels.projection import project_on_bounds
from opspace.kernels.walk import slot_bit
from opspace.law.scalars import BROKEN, LEFT, ROOM_CLEANINGS, ROOM_SOFT, UNBOUNDED, UNSEEN
from opspace.machine.jit import jit


@jit
def leave_room(work, stacks, n):
    """Let levels drive no joint to its limit at the cost of those above them.

    Reads and writes joint_acceleration (n,), rad/s²; writes bounds.gave_way (2 n,), rad/s².

    Args:
        work: `opspace.plan.records.TICK`; of its bounds left is read.
        stacks: Number of stacks that were blended.
        n: Number of joints.

    Returns:
        Whether any acceleration is another one.
    """
    bounds = work.bounds
    for a in range(2 * n):
        bounds.gave_way[a] = 0.0
    if not _wants_more(work, n):
        return False
    whitened_of(work.inertia, work.joint_acceleration, bounds.z)
    end, below = work.slots.shape[0], work.rest[n] != 0.0
    while end > 0:
        begin = _level_begin(work, end)
        share = _share(work, stacks, begin, end)
        if share > 0.0:
            if below:
                _leave_above(work, stacks, end, share, n)
            below = True
        end = begin
    for a in range(n):
        work.joint_acceleration[a] = bounds.z[a]
    acceleration_of(work.inertia, work.joint_acceleration)
    return True


@jit
def _level_begin(work, end):
    """First slot of the level that ends before a slot."""
    begin = end - 1
    while begin > 0 and work.slots[begin - 1, 0] == work.slots[end - 1, 0]:
        begin -= 1
    return begin


@jit
def _share(work, stacks, begin, end):
    """Weights of the stacks that have any of the slots of a level."""
    share = 0.0
    for c in range(stacks):
        here = 0
        for s in range(begin, end):
            here |= work.corner_on[c] & slot_bit(s)
        if here != 0:
            share += work.corner_weight[c]
    return share


@jit
def _most(work, j, side):
    """What levels below others may use of a limit of joint j, rad/s²."""
    return LEFT * max(work.bounds.left[j + side * work.v.shape[0]], 0.0)


@jit
def _wants_more(work, n):
    x = work.joint_acceleration
    for j in range(n):
        for side in range(2):
            most = _most(work, j, side)
            towards = x[j] if side == 0 else -x[j]
            if towards - most > BROKEN * max(1.0, most):
                return True
    return False


@jit
def _leave_above(work, stacks, first, share, n):
    """Let what is wanted behind the first slots leave room; z is what all want together, √J/s."""
    bounds = work.bounds
    if not _motions_left(work, stacks, first, n, False):
        return
    for a in range(n):
        bounds.above[a] = bounds.z[a]
        for b in range(n):
            bounds.above[a] -= bounds.P[a, b] * bounds.z[b]
    if not _motions_left(work, stacks, first, n, True) or not cholesky(bounds.P, n, 0.0, bounds.C):
        return
    count = _seen_rows(work, n)
    for a in range(n):
        bounds.x[a] = bounds.z[a]
    solve_lower(bounds.C, n, bounds.x)
    for _ in range(ROOM_CLEANINGS):
        project_on_bounds(count, n, bounds)
        for a in range(n):
            bounds.x[a] = bounds.y[a]
        for i in range(count):
            bounds.gave_way[bounds.owner[i]] += share * bounds.multiplier[i] * bounds.size[i]
    for a in range(n):
        left = bounds.x[a] / bounds.C[a, a]  # the factor's diagonal is inverted
        for b in range(a):
            left += bounds.C[a, b] * bounds.x[b]
        bounds.z[a] += share * (left - bounds.z[a])


@jit
def _motions_left(work, stacks, first, n, weighed):
    """P = Σ_T w_T (I + κ Σ Ĵᵀ Ĵ of the first slots + Σ ω Ĵᵀ Ĵ of the others)⁻¹, into bounds.P.

    Returns:
        Whether there are digits enough for it.
    """
    P = work.bounds.P
    for a in range(n):
        for b in range(n):
            P[a, b] = 0.0
    for c in range(stacks):
        _weigh(work, work.corner_on[c], first, n, weighed)
        if not cholesky(work.bounds.W, n, 0.0, work.bounds.C):
            return False
        for a in range(n):
            column = work.bounds.row
            for b in range(n):
                column[b] = 0.0
            column[a] = 1.0
            solve_lower(work.bounds.C, n, column)
            solve_lower_transposed(work.bounds.C, n, column)
            for b in range(n):
                P[a, b] += work.corner_weight[c] * column[b]
    return True


@jit
def _weigh(work, present, first, n, weighed):
    """W = I + κ Σ Ĵᵀ Ĵ of the first slots + Σ ω Ĵᵀ Ĵ of the others, of one stack."""
    slots, W, Jw = work.slots, work.bounds.W, work.Jw
    for a in range(n):
        for b in range(n):
            W[a, b] = 0.0
        W[a, a] = 1.0
    below, here = 0.0, 0.0
    for s in range(slots.shape[0] - 1, -1, -1):
        if present & slot_bit(s):
            here = 1.0
            factor = UNSEEN
            if s >= first:
                factor = level_weight(below) if weighed else 0.0
            for row in range(slots[s, 1], slots[s, 1] + slots[s, 2]):
                for a in range(n):
                    for b in range(n):
                        W[a, b] += factor * Jw[row, a] * Jw[row, b]
        if s == 0 or slots[s - 1, 0] != slots[s, 0]:
            below += here
            here = 0.0


@jit
def _seen_rows(work, n):
    """Write every limit as row · x <= bound, the row as far as levels behind the first slots move it.

    Returns:
        How many there are.
    """
    bounds = work.bounds
    count = 0
    for j in range(n):
        unit_row(work.inertia, j, 1.0, bounds.row)
        size, above = 0.0, 0.0
        for a in range(n):
            size += bounds.row[a] * bounds.row[a]
            above += bounds.row[a] * bounds.above[a]
        size = math.sqrt(size)
        for side in range(2):
            sign = 1.0 if side == 0 else -1.0
            most = _most(work, j, side)
            if not most < UNBOUNDED:
                continue
            seen = 0.0
            for a in range(n):
                total = bounds.row[a] / bounds.C[a, a]
                for b in range(a + 1, n):
                    total += bounds.row[b] * bounds.C[b, a]
                bounds.normal[count, a] = sign * total / size
                seen += bounds.normal[count, a] * bounds.normal[count, a]
            bounds.bound[count] = (most + max(sign * above, 0.0)) / size
            bounds.softness[count] = ROOM_SOFT
            bounds.owner[count], bounds.size[count] = j + side * n, seen * size
            count += 1
    return count
