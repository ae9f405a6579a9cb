"""The projection of a motion and its forces on what contacts, joints and motors allow, compiled.

See `opspace.law.contact_forces.realise`. Its coordinates are y = (s, √(e R) d): s is the change of the
motion, unit in its metric, and d that of the forces. The equations of the base take six of them; the
others are orthonormal in z, where the nearest point within all bounds is found.
"""

from __future__ import annotations

import math

from opspace.kernels.active_set import begin_again, go_on_from, settle
from opspace.kernels.algebra import (
    apply_reflectors,
    apply_reflectors_transposed,
    cholesky,
    householder,
    singular_values,
    solve_lower,
)
from opspace.kernels.compiled_scalars import entering_weight, hardened
from opspace.kernels.contact_rows import close_contacts
from opspace.kernels.distances import faster, row_softness
from opspace.kernels.inertia import acceleration_of, torque_of
from opspace.kernels.projection import task_metric
from opspace.kernels.stance_columns import (
    BASE_SIZE,
    EACH,
    NORMAL,
    PLACE_FIRST,
    PLACE_ROWS,
)
from opspace.kernels.whole_vectors import clear_after, whole
from opspace.law.scalars import (
    BROKEN,
    CLEANINGS,
    HANDOVERS,
    HARD,
    LEAST_REGULAR,
    MOTOR_SOFT,
    NEARNESS,
    RANK_TOLERANCE,
    SOFT,
    UNBOUNDED,
    UNMOVED,
)
from opspace.machine.jit import jit


@jit
def nearest_with_forces(work, stacks, closings):
    """Move joint_acceleration, pull and carried to the nearest ones that everything allows.

    Args:
        work: `opspace.plan.records.TICK`; depth 0 of its space is as `law` has left it.
        stacks: Number of stacks that were blended.
        closings: Number of corners in which contacts close.
    """
    stance = work.stance
    if closings > 1:
        close_contacts(work, 0)
    _metric(work, stacks)
    free = work.space.free[0]
    _moves(work, free)
    _loosen(work, free)
    size = free + stance.rows[0]
    rank = _equations(work, free, size)
    count = _bounds(work, free, size, rank)
    z, n = stance.bounds.z, work.v.shape[0]
    for b in range(size - rank):
        z[b] = 0.0
    for i in range(work.distances.held.shape[0]):
        work.distances.held[i] = 0
    for a in range(n):
        stance.trial[a] = work.joint_acceleration[a]
    count = _take_in(work, 0, free, size, rank, count)
    held, known = begin_again(count, size - rank, stance), 0
    # Several times, what softness leaves of an excess included.
    for turn in range(CLEANINGS):
        while True:
            held = settle(count, size - rank, known, held, stance)
            known, before = held, count
            _point(stance, size, rank)
            _try(work, free)
            count = _take_in(work, turn, free, size, rank, count)
            if count == before:
                break
        go_on_from(turn, size - rank, held, stance)
        if turn == HANDOVERS - 1:
            known = 0
            for i in range(count):
                stance.bounds.softness[i] = hardened(stance.bounds.softness[i])
    _go(work, free)


@jit
def _try(work, free):
    """Accelerations at the coordinates in ``row``, into ``trial``."""
    stance = work.stance
    for a in range(work.v.shape[0]):
        stance.trial[a] = work.joint_acceleration[a]
    for k in range(free):
        for a in range(work.v.shape[0]):
            stance.trial[a] += stance.row[k] * stance.accelerations[k, a]


@jit
def _metric(work, stacks):
    """W of the tasks and of the contacts that are on their way in, both triangles."""
    stance, W, n = work.stance, work.bounds.W, work.v.shape[0]
    task_metric(work, stacks)
    for c in range(stance.count[0]):
        h = stance.motion[c]
        if 0.0 < h < 1.0:
            first = stance.place[c, PLACE_FIRST]
            for row in range(first, first + stance.place[c, PLACE_ROWS]):
                for a in range(n):
                    factor = entering_weight(h) * stance.Jw[row, a]
                    for b in range(a + 1):
                        W[a, b] += factor * stance.Jw[row, b]
    for a in range(n):
        for b in range(a):
            W[b, a] = W[a, b]


@jit
def _moves(work, free):
    """Motions that no closed contact holds, unit and independent in W, with what they cause."""
    stance, W, n = work.stance, work.bounds.W, work.v.shape[0]
    Z, K, C, row = work.space.Z[0], stance.K, stance.C, stance.row
    for k in range(free):
        for a in range(n):
            row[a] = 0.0
        for b in range(n):
            factor = Z[k, b]
            if factor != 0.0:
                for a in range(n):
                    row[a] += factor * W[b, a]
        for j in range(k + 1):
            total = 0.0
            for a in range(n):
                total += row[a] * Z[j, a]
            K[k, j] = total
    cholesky(K, free, 0.0, C)
    for k in range(free):
        move = stance.moves[k]
        for a in range(n):
            move[a] = Z[k, a]
        for j in range(k):
            factor = C[k, j]
            for a in range(n):
                move[a] -= factor * stance.moves[j, a]
        for a in range(n):
            move[a] *= C[k, k]  # the factor's diagonal is inverted
            stance.accelerations[k, a] = move[a]
        acceleration_of(work.inertia, stance.accelerations[k])
        torque_of(work.inertia, move, stance.torques[k])


@jit
def _loosen(work, free):
    """How far each component of the forces moves with its coordinate, 1/√(e R).

    e = ε Σ h tr(Gᵀ A⁻¹ G) / Σ h tr R,  A = E W⁻¹ Eᵀ, E the base's part of U: weighed with h, so
    that it does not step where a contact comes or goes.
    """
    stance, A, g = work.stance, work.stance.G, work.stance.g
    trace = 0.0
    for a in range(BASE_SIZE):
        for b in range(a + 1):
            total = 0.0
            for k in range(free):
                total += stance.torques[k, a] * stance.torques[k, b]
            A[a, b] = total
        trace += A[a, a]
    for a in range(BASE_SIZE):
        A[a, a] += LEAST_REGULAR * trace
    cholesky(A, BASE_SIZE, 0.0, stance.L)
    cause, resist = 0.0, 0.0
    for c in range(stance.count[0]):
        h, first = stance.force[c], stance.place[c, PLACE_FIRST]
        for i in range(first, first + stance.place[c, PLACE_ROWS]):
            for a in range(BASE_SIZE):
                g[a] = stance.J[i, a]
            solve_lower(stance.L, BASE_SIZE, g)
            for a in range(BASE_SIZE):
                cause += h * g[a] * g[a]
            resist += h * stance.metric[i]
    near = NEARNESS * cause / resist if resist > 0.0 else 1.0
    for c in range(stance.count[0]):
        first = stance.place[c, PLACE_FIRST]
        for i in range(first, first + stance.place[c, PLACE_ROWS]):
            # Who carries nothing stays out of it.
            there = stance.force[c] > 0.0
            stance.loose[i] = 1.0 / math.sqrt(near * stance.metric[i]) if there else 0.0


@jit
def _equations(work, free, size):
    """Shortest change that gives the base what it lacks, and what may be added to it.

    The rows of the base are E = X Q₁ᵀ with Q of reflectors and X (6, 6) by its singular values, so that
    contacts that cannot carry every wrench are no special case.

    Returns:
        Rank of the rows.
    """
    stance, E, X = work.stance, work.stance.E, work.stance.X
    for b in range(BASE_SIZE):
        for k in range(free):
            E[b, k] = stance.torques[k, b]
        for i in range(stance.rows[0]):
            E[b, free + i] = -stance.J[i, b] * stance.loose[i]
        clear_after(E[b], size, whole(size))
    householder(E, BASE_SIZE, size, stance.scale, stance.lower)
    for i in range(BASE_SIZE):
        for j in range(BASE_SIZE):
            X[i, j] = stance.lower[j, i] if j >= i else 0.0
    singular_values(X, BASE_SIZE, BASE_SIZE, stance.turned, stance.sigma)
    for a in range(BASE_SIZE):
        stance.start[a] = 0.0
    rank = 0
    while rank < BASE_SIZE and stance.sigma[rank] > RANK_TOLERANCE * stance.sigma[0]:
        along = 0.0
        for a in range(BASE_SIZE):
            along -= X[rank, a] * work.tau[a]
        along /= stance.sigma[rank] * stance.sigma[rank]
        for a in range(BASE_SIZE):
            stance.start[a] += along * stance.turned[rank, a]
        rank += 1
    return rank


@jit
def _bounds(work, free, size, rank):
    """Write every bound as unit normal · z <= bound.

    Returns:
        How many there are.
    """
    stance, row, n = work.stance, work.stance.row, work.v.shape[0]
    count = 0
    for c in range(stance.count[0]):
        if stance.force[c] > 0.0:
            count = _cone(stance, c, 4 * n + EACH * c, free, size, rank, count)
    x, lower, upper = work.joint_acceleration, work.bounds.lower, work.bounds.upper
    for j in range(n):
        if lower[j] > -UNBOUNDED or upper[j] < UNBOUNDED:
            for b in range(size):
                row[b] = stance.accelerations[b, j] if b < free else 0.0
            least, most = lower[j] - x[j], upper[j] - x[j]
            count = _two_sided(stance, count, j, n, least, most, SOFT, size, rank)
    for j in range(BASE_SIZE, n):
        if stance.room[j] < UNBOUNDED:
            for k in range(free):
                row[k] = stance.torques[k, j]
            for i in range(stance.rows[0]):
                row[free + i] = -stance.J[i, j] * stance.loose[i]
            least, most = -stance.room[j] - work.tau[j], stance.room[j] - work.tau[j]
            count = _two_sided(stance, count, 2 * n + j, n, least, most, MOTOR_SOFT, size, rank)
    return count


@jit
def _take_in(work, turn, free, size, rank, count):
    """Append the distances that shrink faster at ``trial`` than they may; ``row`` is then overwritten.

    Returns:
        How many bounds there are then.
    """
    stance, d, n = work.stance, work.distances, work.v.shape[0]
    first = 4 * n + EACH * stance.place.shape[0]
    for i in range(d.held.shape[0]):
        most = d.most[i]
        over = faster(d, i, stance.trial) - most
        if d.held[i] != 0 or not over > -BROKEN * max(1.0, abs(most)):
            continue
        if first + i >= stance.bounds.taken.shape[0]:
            continue  # an obstacle of this very moment, for which the next tick has room
        d.held[i] = 1
        for b in range(size):
            stance.row[b] = 0.0
        for k in range(free):
            stance.row[k] = faster(d, i, stance.accelerations[k])
        room = most - faster(d, i, work.joint_acceleration)
        softness = row_softness(work.inertia, d, i)
        if softness == math.inf:
            continue
        if turn >= HANDOVERS:
            softness = hardened(softness)
        stance.bounds.multiplier[count] = 0.0
        count = _two_sided(stance, count, first + i, 0, -math.inf, room, softness, size, rank)
    return count


@jit
def _cone(stance, c, owner, free, size, rank, count):
    """Rows of a cone, and of the largest force."""
    row, first, rows = stance.row, stance.place[c, PLACE_FIRST], stance.place[c, PLACE_ROWS]
    for k in range(stance.edges[c] + 1):
        cut = k == stance.edges[c]
        room = stance.force[c] * stance.most[c] if cut else 0.0
        for b in range(size):
            row[b] = 0.0
        for i in range(rows):
            factor = stance.cone[c, k, i] if not cut else (1.0 if i == NORMAL else 0.0)
            row[free + first + i] = factor * stance.loose[first + i]
            room -= factor * stance.carried[first + i]
        count = _two_sided(stance, count, owner + k, 0, -math.inf, room, HARD, size, rank)
    return count


@jit
def _two_sided(stance, count, owner, other, least, most, softness, size, rank):
    """Append the bounds of one row of y, which is overwritten; the lower one has owner + other."""
    row, bounds = stance.row, stance.bounds
    before, after, at = 0.0, 0.0, 0.0
    for b in range(size):
        before += row[b] * row[b]
    apply_reflectors_transposed(stance.E, BASE_SIZE, size, stance.scale, row)
    for b in range(BASE_SIZE):
        at += row[b] * stance.start[b]
    for i in range(rank, BASE_SIZE):  # what the equations leave of the first six
        total = 0.0
        for b in range(BASE_SIZE):
            total += stance.turned[i, b] * row[b]
        stance.g[i] = total
    for i in range(rank, BASE_SIZE):
        row[i] = stance.g[i]
    for b in range(rank, size):
        after += row[b] * row[b]
    # A bound that nothing can move is not kept by moving.
    if after == 0.0 or math.sqrt(after) <= UNMOVED * math.sqrt(before):
        return count
    after = math.sqrt(after)
    for side in range(2):
        sign = 1.0 if side == 0 else -1.0
        limit = most - at if side == 0 else at - least
        if limit < UNBOUNDED:
            for b in range(rank, size):
                bounds.normal[count, b - rank] = sign * row[b] / after
            bounds.bound[count], bounds.softness[count] = limit / after, softness
            bounds.owner[count], bounds.size[count] = owner + side * other, after
            count += 1
    return count


@jit
def _point(stance, size, rank):
    """Take the point that was found back to the coordinates y, into ``row``."""
    y = stance.row
    for b in range(BASE_SIZE):
        y[b] = stance.start[b]
    for i in range(rank, BASE_SIZE):
        for b in range(BASE_SIZE):
            y[b] += stance.bounds.y[i - rank] * stance.turned[i, b]
    for b in range(BASE_SIZE, size):
        y[b] = stance.bounds.y[b - rank]
    apply_reflectors(stance.E, BASE_SIZE, size, stance.scale, y)


@jit
def _go(work, free):
    """Move motion, torque and forces by the coordinates in ``row``."""
    stance, y, n = work.stance, work.stance.row, work.v.shape[0]
    change = work.change
    for a in range(n):
        change[a] = 0.0
    for k in range(free):
        for a in range(n):
            work.joint_acceleration[a] += y[k] * stance.accelerations[k, a]
            change[a] += y[k] * stance.torques[k, a]
    for a in range(n):
        stance.pull[a] += change[a]
    for a in range(BASE_SIZE):
        stance.given_up[a] = change[a]
    for i in range(stance.rows[0]):
        stance.carried[i] += stance.loose[i] * y[free + i]
