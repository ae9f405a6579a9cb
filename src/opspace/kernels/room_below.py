"""What levels leave of a joint's last way to its limit to those above; see `opspace.law.leave_room`."""

from __future__ import annotations

import math

from opspace.kernels.compiled_scalars import level_weight
from opspace.kernels.inertia import acceleration_of, unit_row, whitened_of
from opspace.kernels.projection import project_on_bounds, weigh_places
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
    weigh_places(work, stacks)
    end, below = work.slots.shape[0], work.rest[n] != 0.0
    while end > 0:
        begin = _level_begin(work, end)
        share = _share(work, stacks, begin, end)
        if share > 0.0:
            if below:
                _leave_above(work, end, share, n)
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
def _leave_above(work, first, share, n):
    """Let what is wanted behind the first slots leave room; z is what all want together, √J/s."""
    bounds = work.bounds
    for a in range(n):
        bounds.x[a] = bounds.z[a]
        bounds.row[a] = bounds.z[a]
    acceleration_of(work.inertia, bounds.row)
    if not _over(work, bounds.row, 0.0, n):
        return
    _motions_left(work, first, n)
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
def _motions_left(work, first, n):
    """P of `opspace.law.motions_left` for the first slots, into bounds.P.

    Without the others it is what the first slots do not see; what is left of z goes into bounds.above.
    """
    bounds, slots = work.bounds, work.slots.shape[0]
    for a in range(n):
        bounds.above[a] = bounds.z[a]
        for b in range(n):
            bounds.P[a, b] = 0.0
    _count_places(work, first)
    _nothing_seen(bounds, n)
    share, e = 1.0, _next_seen(work, 0, first, -1)
    while e >= 0:
        if work.seen_share[e] < share:
            _take_unseen(bounds, share - work.seen_share[e], n)
            share = work.seen_share[e]
        _see(work, e, n)
        e = _next_seen(work, 0, first, e)
    _take_unseen(bounds, share, n)
    begin = slots
    if share < 1.0:
        begin = 0
        _nothing_seen(bounds, n)
    share, e = 1.0, _next_seen(work, begin, 2 * slots, -1)
    while e >= 0:
        if work.seen_share[e] < share:
            _add_unseen(bounds, share - work.seen_share[e], n)
            share = work.seen_share[e]
        _see(work, e, n)
        e = _next_seen(work, begin, 2 * slots, e)
    _add_unseen(bounds, share, n)
    for a in range(n):
        for b in range(a):
            bounds.P[b, a] = bounds.P[a, b]


@jit
def _count_places(work, first):
    """How much of each task the first slots have, and how much all, into seen_share (2 slots,).

    What the rows count then goes into seen_weight: κ from entry 0 on, ω from entry ``slots`` on, each
    at the first place where its task is: places that are kept for later change no order, and so no bit.
    """
    slots, size = work.slots, work.slots.shape[0]
    for s in range(size):
        work.seen_share[s], work.seen_share[size + s] = 0.0, 0.0
    for s in range(size):
        before = work.here[s] <= 0.0
        for p in range(s):
            if slots[p, 1] == slots[s, 1] and work.here[p] > 0.0:
                before = True
        if before:
            continue
        above, others, count = 0.0, 0.0, 0.0
        for p in range(s, size):
            if slots[p, 1] == slots[s, 1]:
                if p < first:
                    above += work.here[p]
                else:
                    others += work.here[p]
                    count += work.here[p] * work.below[p]
        work.seen_share[s], work.seen_weight[s] = min(above, 1.0), UNSEEN
        if others > 0.0:
            work.seen_share[size + s] = min(above + others, 1.0)
            work.seen_weight[size + s] = level_weight(count / others)
            work.seen_weight[s] -= work.seen_weight[size + s]


@jit
def _next_seen(work, begin, end, e):
    """Entry of seen_share that follows entry e (-1: nothing), the largest first; -1 after the last."""
    found, most = -1, 0.0
    for i in range(begin, end):
        share = work.seen_share[i]
        if share > most and (
            e < 0 or share < work.seen_share[e] or (share == work.seen_share[e] and i > e)
        ):
            found, most = i, share
    return found


@jit
def _nothing_seen(bounds, n):
    """U D Uᵀ = I."""
    for a in range(n):
        for b in range(a):
            bounds.UD[a, b] = 0.0
        bounds.UD[a, a] = 1.0


@jit
def _see(work, e, n):
    """Count the rows of an entry in."""
    s = e % work.slots.shape[0]
    for row in range(work.slots[s, 1], work.slots[s, 1] + work.slots[s, 2]):
        _narrow(work.Jw[row], work.seen_weight[e], n, work.bounds.UD, work.bounds.row)


@jit
def _add_unseen(bounds, weight, n):
    """Add U D Uᵀ to the lower half of bounds.P."""
    P, UD = bounds.P, bounds.UD
    for k in range(n):
        factor = weight * UD[k, k]
        for a in range(k):
            for b in range(a + 1):
                P[a, b] += factor * UD[k, a] * UD[k, b]
            P[k, a] += factor * UD[k, a]
        P[k, k] += factor


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
    """Take U D Uᵀ z from bounds.above."""
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
