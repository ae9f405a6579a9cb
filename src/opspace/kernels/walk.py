"""The whole law as one walk down the levels that branches only where something is half active."""

from __future__ import annotations

from opspace.kernels.inertia import torque_of
from opspace.kernels.level import project, solve_level, take_alternative
from opspace.kernels.saturation import room_for
from opspace.machine.jit import jit

# Columns of ``Space.cursor``: corners of a node, the next one, corners of its group, next alternative.
FIRST, END, NEXT, GROUP, GROUP_END, ALTERNATIVE = range(6)


@jit
def begin(n, levels, s):
    """Nothing decided, everything free, and nothing known about any level."""
    u, Z, top, got = s.u, s.Z, s.top, s.got
    for a in range(n):
        u[0, a] = 0.0
        for b in range(n):
            Z[0, a, b] = 0.0
        Z[0, a, a] = 1.0
    s.free[0] = n
    s.path[0] = 1.0
    for d in range(levels + 1):
        top[d] = 0.0
        got[d, 0], got[d, 1] = 0.0, 0.0
    if s.motors[0] != 0:
        for a in range(n):
            s.torque[0, a] = s.start[a]


@jit
def walk(first, levels, n, slots, J, f, masks, weights, corners, rest, buffer, s, u):
    """Add Σ_T w_T H(T; f̃) to u, starting from what depth ``first`` has decided.

    Args:
        first: Depth to start at; ``s.path[first]`` is the weight of everything found.
        levels: Depth at which the levels end.
        n: Number of joints.
        slots: (S, 3) of every task set in the order of the levels: depth, first row, rows.
        J: Whitened rows, (rows, n).
        f: Their desired values.
        masks: Corners as bit sets of slots, slot 0 the highest bit (`slot_bit`), falling.
        weights: Weight of each corner.
        corners: Their number.
        rest: (n + 1,) whitened desired value of what no task uses; entry n says whether there is one.
        buffer: See `opspace.kernels.level.solve_level`.
        s: The memory.
        u: (n,) whitened torque; the result is added.
    """
    cursor, alternatives, free, path, shares = s.cursor, s.alternatives, s.free, s.path, s.share
    _enter(first, 0, corners, cursor, alternatives)
    d = first
    while d >= first:
        if d == levels or free[d] == 0:
            _leaf(d, n, weights, rest, s, u)
            d -= 1
        elif cursor[d, ALTERNATIVE] < alternatives[d]:
            i = cursor[d, ALTERNATIVE]
            cursor[d, ALTERNATIVE] += 1
            share = 1.0
            if alternatives[d] > 1:
                share = shares[d, i]
                if share <= 0.0:
                    continue
                take_alternative(d, i, n, s)
                keep_inside(d, n, path[d] * share * group_weight(d, weights, cursor), s)
            path[d + 1] = path[d] * share
            _enter(d + 1, cursor[d, GROUP], cursor[d, GROUP_END], cursor, alternatives)
            d += 1
        elif cursor[d, NEXT] < cursor[d, END]:
            _next_group(d, levels, n, slots, J, f, masks, weights, rest, buffer, s)
        else:
            d -= 1


@jit
def slot_bit(k):
    """Bit of slot k in a corner: earlier slots are higher, so that corners sort like the levels."""
    return 1 << (61 - k)


@jit
def _enter(d, first, end, cursor, alternatives):
    cursor[d, FIRST], cursor[d, END], cursor[d, NEXT] = first, end, first
    cursor[d, ALTERNATIVE] = 0
    alternatives[d] = 0


@jit
def _leaf(d, n, weights, rest, s, u):
    U, Z = s.u, s.Z
    share = 0.0
    for c in range(s.cursor[d, FIRST], s.cursor[d, END]):
        share += weights[c]
    share *= s.path[d]
    for a in range(n):
        u[a] += share * U[d, a]
    if rest[n] == 0.0:
        return
    x = s.x
    for a in range(n):
        x[a] = 0.0
    for k in range(s.free[d]):
        along = 0.0
        for a in range(n):
            along += Z[d, k, a] * rest[a]
        for a in range(n):
            x[a] += along * Z[d, k, a]
    if s.motors[0] != 0:
        torque_of(s.inertia, x, s.part)
        scale = room_for(s.part, s.torque[d], s.limit)
        last = s.got.shape[0] - 1
        s.got[last, 0] += share * scale
        s.got[last, 1] += share
        share *= scale
    for a in range(n):
        u[a] += share * x[a]


@jit
def _next_group(d, levels, n, slots, J, f, masks, weights, rest, buffer, s):
    """Solve this level for the next corners that agree about it."""
    cursor, rows = s.cursor, s.rows
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
    share *= s.path[d]
    cursor[d, GROUP], cursor[d, GROUP_END], cursor[d, NEXT] = c, end, end
    cursor[d, ALTERNATIVE] = 0
    count = 0
    for k in range(slots.shape[0]):
        if present & slot_bit(k) != 0:
            for row in range(slots[k, 1], slots[k, 1] + slots[k, 2]):
                rows[count] = row
                count += 1
    if count == 0:
        pass_on(d, n, s)
        s.alternatives[d] = 1
        return
    last = d + 1 == levels and rest[n] == 0.0
    project(d, count, n, J, f, s)
    heaviest = share > s.top[d]
    if heaviest:
        _remember(d, count, share, present, s)
    found = solve_level(d, count, n, J, last, buffer, s)
    s.alternatives[d] = found
    if found == 1:
        keep_inside(d, n, share, s)
    if heaviest:
        s.off[d] = 1 if found > 1 and s.faded[0] != 0 else 0


@jit
def pass_on(d, n, s):
    """A level without tasks leaves everything as it is."""
    u, Z = s.u, s.Z
    r = s.free[d]
    s.free[d + 1] = r
    for a in range(n):
        u[d + 1, a] = u[d, a]
    for k in range(r):
        for a in range(n):
            Z[d + 1, k, a] = Z[d, k, a]
    if s.motors[0] != 0:
        for a in range(n):
            s.torque[d + 1, a] = s.torque[d, a]


@jit
def group_weight(d, weights, cursor):
    """Weight of the corners that the present group of a node stands for."""
    total = 0.0
    for c in range(cursor[d, GROUP], cursor[d, GROUP_END]):
        total += weights[c]
    return total


@jit
def keep_inside(d, n, weight, s):
    """Scale what the level at depth ``d`` has just added, so that the motors can give it."""
    if s.motors[0] == 0:
        return
    u, torque, part, x = s.u, s.torque, s.part, s.x
    for a in range(n):
        x[a] = u[d + 1, a] - u[d, a]
    torque_of(s.inertia, x, part)
    scale = room_for(part, torque[d], s.limit)
    s.got[d, 0] += weight * scale
    s.got[d, 1] += weight
    for a in range(n):
        torque[d + 1, a] = torque[d, a] + scale * part[a]
        if scale < 1.0:
            u[d + 1, a] = u[d, a] + scale * x[a]


@jit
def _remember(d, count, share, present, s):
    """Keep what the heaviest branch finds at this level, for its report."""
    B, kept, first, r = s.B, s.kept, s.first_kept[d], s.free[d]
    s.top[d] = share
    s.chosen[d] = present
    s.width[d] = r
    for i in range(count):
        for b in range(r):
            kept[first + i, b] = B[i, b]
