"""The whole law as one walk down the levels that branches only where something is half active."""

from __future__ import annotations

import math

from opspace.kernels import columns
from opspace.kernels.compiled_scalars import room_for
from opspace.kernels.inertia import torque_of
from opspace.kernels.level import project, solve_level, take_alternative
from opspace.kernels.whole_vectors import copy, fill, put_unit, whole
from opspace.machine.jit import jit

# Columns of ``Space.cursor``: corners of a node, the next one, corners of its group, next alternative.
FIRST, END, NEXT, GROUP, GROUP_END, ALTERNATIVE = range(6)


@jit
def begin(levels, space):
    """Nothing is known about any level."""
    for d in range(levels + 1):
        space.top[d] = 0.0
        space.got[d, 0], space.got[d, 1] = 0.0, 0.0


@jit
def start_at(d, n, space):
    """Nothing is decided above depth d, and everything free: u [√J/s], Z, free, path, torque [N·m]."""
    fill(0.0, space.u[d], 0, whole(n))
    for a in range(n):
        put_unit(1.0, a, space.Z[d, a], whole(n))
    space.free[d] = n
    space.path[d] = 1.0
    if space.motors[0] != 0:
        for a in range(n):
            space.torque[d, a] = space.start[a]


@jit
def walk(first, levels, n, slots, J, f, masks, weights, corners, rest, buffer, space, u):
    """Add Σ_T w_T H(T; f̃) to u, starting from what depth ``first`` has decided.

    Args:
        first: Depth to start at; ``space.path[first]`` is the weight of everything found.
        levels: Depth at which the levels end.
        n: Number of joints.
        slots: (S, 3) of every task set in the order of the levels: depth, first row, rows.
        J: (rows, n) whitened rows.
        f: (rows,) their desired values, √J/s.
        masks: (corners,) as bit sets of slots, slot 0 the highest bit (`slot_bit`), falling.
        weights: (corners,) weight of each.
        corners: Their number.
        rest: (n + 1,) whitened desired value of what no task uses; entry n says whether there is one.
        buffer: See `opspace.kernels.level.solve_level`.
        space: `SPACE`, where `begin` has been.
        u: (n,) whitened torque, √J/s; the result is added.
    """
    cursor, alternatives, free, path, shares = (
        space.cursor,
        space.alternatives,
        space.free,
        space.path,
        space.share,
    )
    _enter(first, 0, corners, cursor, alternatives)
    d = first
    while d >= first:
        if d == levels or free[d] == 0:
            _leaf(d, n, weights, rest, space, u)
            d -= 1
        elif cursor[d, ALTERNATIVE] < alternatives[d]:
            i = cursor[d, ALTERNATIVE]
            cursor[d, ALTERNATIVE] += 1
            share = 1.0
            if alternatives[d] > 1:
                share = shares[d, i]
                if share <= 0.0:
                    continue
                take_alternative(d, i, n, space)
                keep_inside(d, n, path[d] * share * group_weight(d, weights, cursor), space)
            path[d + 1] = path[d] * share
            _enter(d + 1, cursor[d, GROUP], cursor[d, GROUP_END], cursor, alternatives)
            d += 1
        elif cursor[d, NEXT] < cursor[d, END]:
            _next_group(d, levels, n, slots, J, f, masks, weights, rest, buffer, space)
        else:
            d -= 1


slot_bit = jit(columns.slot_bit)


@jit
def _enter(d, first, end, cursor, alternatives):
    cursor[d, FIRST], cursor[d, END], cursor[d, NEXT] = first, end, first
    cursor[d, ALTERNATIVE] = 0
    alternatives[d] = 0


@jit
def _leaf(d, n, weights, rest, space, u):
    U, Z = space.u, space.Z
    share = 0.0
    for c in range(space.cursor[d, FIRST], space.cursor[d, END]):
        share += weights[c]
    share *= space.path[d]
    for a in range(n):
        u[a] += share * U[d, a]
    if rest[n] == 0.0:
        return
    x = space.x
    for a in range(n):
        x[a] = 0.0
    for k in range(space.free[d]):
        along = 0.0
        for a in range(n):
            along += Z[d, k, a] * rest[a]
        for a in range(n):
            x[a] += along * Z[d, k, a]
    if space.motors[0] != 0:
        torque_of(space.inertia, x, space.part)
        scale = room_for(space.part, space.torque[d], space.limit)
        last = space.got.shape[0] - 1
        space.got[last, 0] += share * scale
        space.got[last, 1] += share
        share *= scale
    for a in range(n):
        u[a] += share * x[a]


@jit
def _next_group(d, levels, n, slots, J, f, masks, weights, rest, buffer, space):
    """Solve this level for the next corners that agree about it."""
    cursor, rows = space.cursor, space.rows
    here = 0
    for k in range(slots.shape[0]):
        if slots[k, 0] == d:
            here |= slot_bit(k)
    c = cursor[d, NEXT]
    present = masks[c] & here
    share = 0.0
    end = c
    while end < cursor[d, END] and masks[end] & here == present:
        share += weights[end]
        end += 1
    share *= space.path[d]
    cursor[d, GROUP], cursor[d, GROUP_END], cursor[d, NEXT] = c, end, end
    cursor[d, ALTERNATIVE] = 0
    count = 0
    for k in range(slots.shape[0]):
        if present & slot_bit(k) != 0:
            for row in range(slots[k, 1], slots[k, 1] + slots[k, 2]):
                rows[count] = row
                count += 1
    if count == 0:
        pass_on(d, n, space)
        space.alternatives[d] = 1
        return
    last = d + 1 == levels and rest[n] == 0.0
    project(d, count, n, J, f, space)
    heaviest = share > space.top[d]
    if heaviest:
        _remember(d, count, share, present, space)
    found = solve_level(d, count, n, J, last, buffer, space)
    space.alternatives[d] = found
    if found == 1:
        keep_inside(d, n, share, space)
    if heaviest:
        space.off[d] = 1 if found > 1 and space.faded[0] != 0 else 0


@jit
def pass_on(d, n, space):
    """A level without tasks leaves u, Z and free as they are, at depth d + 1."""
    u, Z = space.u, space.Z
    r = space.free[d]
    space.free[d + 1] = r
    copy(u[d], u[d + 1], 0, whole(n))
    for k in range(r):
        copy(Z[d, k], Z[d + 1, k], 0, whole(n))
    if space.motors[0] != 0:
        for a in range(n):
            space.torque[d + 1, a] = space.torque[d, a]


@jit
def group_weight(d, weights, cursor):
    """Weight of the corners that the present group of a node stands for."""
    total = 0.0
    for c in range(cursor[d, GROUP], cursor[d, GROUP_END]):
        total += weights[c]
    return total


@jit
def keep_inside(d, n, weight, space):
    """Scale what the level at depth ``d`` has just added, so that the motors can give it, N·m."""
    if space.motors[0] == 0:
        return
    u, torque, part, x = space.u, space.torque, space.part, space.x
    for a in range(n):
        x[a] = u[d + 1, a] - u[d, a]
    torque_of(space.inertia, x, part)
    scale = room_for(part, torque[d], space.limit)
    space.got[d, 0] += weight * scale
    space.got[d, 1] += weight
    for a in range(n):
        torque[d + 1, a] = torque[d, a] + scale * part[a]
        if scale < 1.0:
            u[d + 1, a] = u[d, a] + scale * x[a]


@jit
def _remember(d, count, share, present, space):
    """Keep what the heaviest branch finds at this level, for its report."""
    B, kept, first, r = space.B, space.kept, space.first_kept[d], space.free[d]
    space.top[d] = share
    space.chosen[d] = present
    space.width[d] = r
    unrest = 0.0
    for i in range(count):
        unrest += space.unrest[space.rows[i]]
        copy(B[i], kept[first + i], 0, whole(r))
    space.unrest_there[d] = math.sqrt(unrest)
