"""What levels leave of a joint's last way to its limit to those above; see `opspace.law.leave_room`."""

from __future__ import annotations

import math

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
    if not _over(work, work.joint_acceleration, BROKEN, n):
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
def _over(work, acceleration, tolerance, n):
    """Whether a joint does more than what levels below others may use."""
    for j in range(n):
        for side in range(2):
            most = _most(work, j, side)
            towards = acceleration[j] if side == 0 else -acceleration[j]
            if towards - most > tolerance * max(1.0, most):
                return True
    return False


@jit
def _leave_above(work, stacks, first, share, n):
    """Let what is wanted behind the first slots leave room; z is what all want together, √J/s."""
    bounds = work.bounds
    for a in range(n):
        bounds.x[a] = bounds.z[a]
        bounds.row[a] = bounds.z[a]
    acceleration_of(work.inertia, bounds.row)
    if not _over(work, bounds.row, 0.0, n):
        return
    _motions_left(work, stacks, first, n)
    count = _seen_rows(work, n)
    held = 0
    for _ in range(ROOM_CLEANINGS):
        held = project_on_bounds(count, n, held, bounds.way, bounds)
        if held == 0:
            break
        for a in range(n):
            bounds.x[a] = bounds.y[a]
        for i in range(count):
            bounds.gave_way[bounds.owner[i]] += share * bounds.multiplier[i] * bounds.size[i]
    for a in range(n):
        bounds.z[a] += share * (bounds.x[a] - bounds.z[a])


@jit
def _motions_left(work, stacks, first, n):
    """P = Σ_T w_T (I + κ Σ Ĵᵀ Ĵ of the first slots + Σ ω Ĵᵀ Ĵ of the others)⁻¹, into bounds.P.

    Without the others it is what the first slots do not see; what is left of z goes into bounds.above.
    """
    bounds = work.bounds
    P, UD = bounds.P, bounds.UD
    for a in range(n):
        bounds.above[a] = bounds.z[a]
        for b in range(n):
            P[a, b] = 0.0
    for c in range(stacks):
        present, weight = work.corner_on[c], work.corner_weight[c]
        _not_seen(work, present, first, n)
        _take_unseen(bounds, weight, n)
        _narrow_by_others(work, present, first, n)
        for k in range(n):
            factor = weight * UD[k, k]
            for a in range(k):
                for b in range(a + 1):
                    P[a, b] += factor * UD[k, a] * UD[k, b]
                P[k, a] += factor * UD[k, a]
            P[k, k] += factor
    for a in range(n):
        for b in range(a):
            P[b, a] = P[a, b]


@jit
def _not_seen(work, present, first, n):
    """U D Uᵀ = (I + κ Σ Ĵᵀ Ĵ of the first slots)⁻¹ of one stack, into bounds.UD."""
    UD = work.bounds.UD
    for a in range(n):
        for b in range(a):
            UD[a, b] = 0.0
        UD[a, a] = 1.0
    for s in range(first):
        if present & slot_bit(s):
            for row in range(work.slots[s, 1], work.slots[s, 1] + work.slots[s, 2]):
                _narrow(work.Jw[row], UNSEEN, n, UD, work.bounds.row)


@jit
def _narrow_by_others(work, present, first, n):
    """Count in Σ ω Ĵᵀ Ĵ of the slots of one stack that are not the first."""
    slots = work.slots
    below, here = 0.0, 0.0
    for s in range(slots.shape[0] - 1, first - 1, -1):
        if present & slot_bit(s):
            here = 1.0
            for row in range(slots[s, 1], slots[s, 1] + slots[s, 2]):
                _narrow(work.Jw[row], level_weight(below), n, work.bounds.UD, work.bounds.row)
        if s == 0 or slots[s - 1, 0] != slots[s, 0]:
            below += here
            here = 0.0


@jit
def _narrow(row, weight, n, UD, gain):
    """Count a row in: U D Uᵀ becomes ((U D Uᵀ)⁻¹ + weight rowᵀ row)⁻¹.

    Bierman's update of a covariance (Factorization Methods for Discrete Sequential Estimation, 1977,
    chapter V): as exact as one of a root, at half the products.
    """
    total = 1.0 / weight
    for j in range(n):
        f = row[j]
        for i in range(j):
            f += UD[j, i] * row[i]
        seen, before = UD[j, j] * f, total
        total += f * seen
        UD[j, j] *= before / total
        factor = f / before
        for i in range(j):
            was = UD[j, i]
            UD[j, i] = was - factor * gain[i]
            gain[i] += seen * was
        gain[j] = seen


@jit
def _take_unseen(bounds, weight, n):
    """Take U D Uᵀ z, as far as a stack is there, from bounds.above."""
    UD, z, above = bounds.UD, bounds.z, bounds.above
    for k in range(n):
        f = z[k]
        for a in range(k):
            f += UD[k, a] * z[a]
        f *= weight * UD[k, k]
        for a in range(k):
            above[a] -= f * UD[k, a]
        above[k] -= f


@jit
def _seen_rows(work, n):
    """Write every limit as row · x <= bound, and the way of what is behind the first slots, P row.

    Returns:
        How many there are.
    """
    bounds = work.bounds
    count = 0
    for j in range(n):
        if not min(_most(work, j, 0), _most(work, j, 1)) < UNBOUNDED:
            continue
        unit_row(work.inertia, j, 1.0, bounds.row)
        size, above = 0.0, 0.0
        for a in range(n):
            size += bounds.row[a] * bounds.row[a]
            above += bounds.row[a] * bounds.above[a]
        size = math.sqrt(size)
        seen = _way(bounds, size, n)
        for side in range(2):
            sign = 1.0 if side == 0 else -1.0
            most = _most(work, j, side)
            if not most < UNBOUNDED:
                continue
            for a in range(n):
                bounds.normal[count, a] = sign * bounds.row[a]
                bounds.way[count, a] = sign * bounds.y[a]
            bounds.bound[count] = (most + max(sign * above, 0.0)) / size
            bounds.softness[count] = ROOM_SOFT
            bounds.owner[count], bounds.size[count] = j + side * n, seen * size
            count += 1
    return count


@jit
def _way(bounds, size, n):
    """Give bounds.row unit length, and fill bounds.y (n,) with P row.

    Returns:
        row · P row.
    """
    P, row, y = bounds.P, bounds.row, bounds.y
    seen = 0.0
    for a in range(n):
        row[a] /= size
    for a in range(n):
        along = 0.0
        for b in range(n):
            along += P[a, b] * row[b]
        y[a] = along
        seen += along * row[a]
    return seen
