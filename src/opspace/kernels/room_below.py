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
        work: `opspace.plan.records.TICK`; of its bounds lower and upper are read.
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
    most = work.bounds.upper[j] if side == 0 else -work.bounds.lower[j]
    return LEFT * max(most, 0.0)


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
    _motions_left(work, stacks, first, n)
    count = _seen_rows(work, n)
    for a in range(n):
        bounds.x[a] = bounds.z[a]
    for _ in range(ROOM_CLEANINGS):
        project_on_bounds(count, n, bounds.way, bounds)
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
    for a in range(n):
        bounds.above[a] = bounds.z[a]
        for b in range(n):
            bounds.P[a, b] = 0.0
    for c in range(stacks):
        present, weight = work.corner_on[c], work.corner_weight[c]
        _not_seen(work, present, first, n)
        _take_unseen(bounds, weight, n)
        _narrow_by_others(work, present, first, n)
        for a in range(n):
            for b in range(n):
                for k in range(n):
                    bounds.P[a, b] += weight * bounds.S[a, k] * bounds.S[b, k]


@jit
def _not_seen(work, present, first, n):
    """S Sᵀ = (I + κ Σ Ĵᵀ Ĵ of the first slots)⁻¹ of one stack, into bounds.S."""
    S = work.bounds.S
    for a in range(n):
        for b in range(n):
            S[a, b] = 0.0
        S[a, a] = 1.0
    for s in range(first):
        if present & slot_bit(s):
            for row in range(work.slots[s, 1], work.slots[s, 1] + work.slots[s, 2]):
                _narrow(work.Jw[row], UNSEEN, n, work.bounds)


@jit
def _narrow_by_others(work, present, first, n):
    """Add Σ ω Ĵᵀ Ĵ of the slots that are not the first to the inverse of S Sᵀ, of one stack."""
    slots = work.slots
    below, here = 0.0, 0.0
    for s in range(slots.shape[0] - 1, first - 1, -1):
        if present & slot_bit(s):
            here = 1.0
            for row in range(slots[s, 1], slots[s, 1] + slots[s, 2]):
                _narrow(work.Jw[row], level_weight(below), n, work.bounds)
        if s == 0 or slots[s - 1, 0] != slots[s, 0]:
            below += here
            here = 0.0


@jit
def _narrow(row, weight, n, bounds):
    """Count a row in: S Sᵀ becomes (P⁻¹ + weight rowᵀ row)⁻¹; see `opspace.law.leave_room.narrowed`."""
    S, f = bounds.S, bounds.row
    for b in range(n):
        f[b] = 0.0
    for a in range(n):
        for b in range(n):
            f[b] += row[a] * S[a, b]
    seen, unseen = 0.0, 1.0 / weight
    for b in range(n):
        seen += f[b] * f[b]
    scale = 1.0 / (seen + unseen + math.sqrt(unseen * (seen + unseen)))
    for a in range(n):
        along = 0.0
        for b in range(n):
            along += S[a, b] * f[b]
        along *= scale
        for b in range(n):
            S[a, b] -= along * f[b]


@jit
def _take_unseen(bounds, weight, n):
    """Take S Sᵀ z, as far as a stack is there, from bounds.above."""
    for k in range(n):
        along = 0.0
        for a in range(n):
            along += bounds.S[a, k] * bounds.z[a]
        for a in range(n):
            bounds.above[a] -= weight * along * bounds.S[a, k]


@jit
def _seen_rows(work, n):
    """Write every limit as row · x <= bound, and the way of what is behind the first slots, P row.

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
                along = 0.0
                for b in range(n):
                    along += bounds.P[a, b] * bounds.row[b]
                bounds.normal[count, a] = sign * bounds.row[a] / size
                bounds.way[count, a] = sign * along / size
                seen += bounds.normal[count, a] * bounds.way[count, a]
            bounds.bound[count] = (most + max(sign * above, 0.0)) / size
            bounds.softness[count] = ROOM_SOFT
            bounds.owner[count], bounds.size[count] = j + side * n, seen * size
            count += 1
    return count
