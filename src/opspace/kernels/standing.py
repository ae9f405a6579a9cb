"""Who carries what, and the nearest motion with forces that exist; see `opspace.law.contact_forces`."""

from __future__ import annotations

import math

from opspace.command import Status
from opspace.kernels.algebra import cholesky, solve_lower, solve_lower_transposed
from opspace.kernels.columns import LIMIT_BOUND
from opspace.kernels.contact_projection import nearest_with_forces
from opspace.kernels.contact_rows import component_of, take_rows
from opspace.kernels.distances import approach, will_close
from opspace.kernels.inertia import acceleration_of, torque_of
from opspace.kernels.limit_columns import MARGIN, SIGN
from opspace.kernels.limit_rows import exceeds, find_bounds, will_pass
from opspace.kernels.stance_columns import BASE_SIZE, EACH, NORMAL, PLACE_FIRST, PLACE_ROWS
from opspace.law.scalars import (
    BARELY,
    BROKEN,
    FALLING,
    LEAST_REGULAR,
    LEVER,
    LOST,
    MAY_GIVE_UP,
    NOTICED,
    REFINEMENTS,
)
from opspace.machine.jit import jit

FILTERED = int(Status.FILTERED)
SCALED = int(Status.TORQUE_SCALED)
COLLISION = int(Status.COLLISION)
COLLISION_LOST = int(Status.COLLISION_LOST)
LIMIT_LOST = int(Status.LIMIT_LOST)
GIVEN_UP = int(Status.GIVEN_UP)
NOT_BALANCED = int(Status.NOT_BALANCED)


@jit
def stand(work, stacks, closings):
    """Share the forces for what the law wants, and take the nearest motion that forces allow.

    Reads u (n,) √J/s; writes tau (n,) N·m, joint_acceleration (n,) rad/s², limit_h of the limits that
    act, distance_taken (distances,) m/s², contact_force, contact_use and hindrance.

    Args:
        work: `opspace.plan.records.TICK`.
        stacks: Number of stacks that were blended.
        closings: Number of corners in which contacts close.

    Returns:
        What happened, in the numbers of `opspace.Status`.
    """
    stance, n = work.stance, work.v.shape[0]
    find_bounds(work, n)
    for a in range(n):
        work.joint_acceleration[a] = work.u[a]
    acceleration_of(work.inertia, work.joint_acceleration)
    torque_of(work.inertia, work.u, stance.pull)
    for a in range(n):
        stance.pull[a] += work.balance[a]
    share_forces(work)
    for i in range(stance.rows[0]):
        stance.carried[i] = stance.asked[i]
    torque_with(work)
    for a in range(BASE_SIZE):
        stance.given_up[a] = 0.0
    for i in range(work.distance_taken.shape[0]):
        work.distance_taken[i] = 0.0
    bits = 0
    if not (_balanced(work) and _kept(work)):
        bits = FILTERED
        nearest_with_forces(work, stacks, closings)
        torque_with(work)
        for a in range(n):
            work.tau[a] = min(max(work.tau[a], -stance.room[a]), stance.room[a])
        bits |= _acting(work)
    for a in range(BASE_SIZE):
        work.tau[a] = 0.0
    if exceeds(work, n, LOST) or will_pass(work):
        bits |= LIMIT_LOST
    for c in range(stance.count[0]):
        _tell(work, c)
    return bits | _lost(work)


@jit
def torque_with(work):
    """M q̈ + b − Jᵀ λ, into tau (n,) N·m; what is left at the base is missing there."""
    stance, n = work.stance, work.v.shape[0]
    for a in range(n):
        work.tau[a] = stance.pull[a]
    for i in range(stance.rows[0]):
        force = stance.carried[i]
        for a in range(n):
            work.tau[a] -= force * stance.J[i, a]


@jit
def share_forces(work):
    """λ* = Σ_T w_T λ(T), all subsets T of the contacts that are on their way, into asked."""
    stance = work.stance
    for i in range(stance.rows[0]):
        stance.asked[i] = 0.0
    moving = 0
    for c in range(stance.count[0]):
        h = stance.force[c]
        stance.on[c] = 1 if h >= 1.0 else 0
        if 0.0 < h < 1.0:
            stance.moving[moving] = c
            moving += 1
    for corner in range(1 << moving):
        weight = 1.0
        for k in range(moving):
            c = stance.moving[k]
            stance.on[c] = corner >> k & 1
            h = stance.force[c]
            weight *= h if stance.on[c] != 0 else 1.0 - h
        if weight > 0.0:
            _share(work, weight)


@jit
def _share(work, weight):
    """Add what the contacts that are on carry: nearest to what is wanted of them, for the wrench."""
    stance, rows = work.stance, work.stance.listed
    count = 0
    for c in range(stance.count[0]):
        if stance.on[c] != 0:
            count = take_rows(stance, c, count, rows)
    if not _products(stance, count):
        return  # nobody is there
    for k in range(count):
        stance.share[rows[k]] = stance.reference[rows[k]]
    for _ in range(1 + REFINEMENTS):
        for a in range(BASE_SIZE):
            stance.g[a] = stance.pull[a]
        for k in range(count):
            for a in range(BASE_SIZE):
                stance.g[a] -= stance.J[rows[k], a] * stance.share[rows[k]]
        solve_lower(stance.L, BASE_SIZE, stance.g)
        solve_lower_transposed(stance.L, BASE_SIZE, stance.g)
        for k in range(count):
            more = 0.0
            for a in range(BASE_SIZE):
                more += stance.J[rows[k], a] * stance.g[a]
            stance.share[rows[k]] += more / stance.metric[rows[k]]
    for k in range(count):
        stance.asked[rows[k]] += weight * stance.share[rows[k]]


@jit
def _products(stance, count):
    """Factor G R⁻¹ Gᵀ of the rows that are listed, without deciding on a rank.

    Returns:
        Whether there is anything.
    """
    G, rows = stance.G, stance.listed
    for a in range(BASE_SIZE):
        for b in range(a + 1):
            G[a, b] = 0.0
    for k in range(count):
        J = stance.J[rows[k]]
        for a in range(BASE_SIZE):
            factor = J[a] / stance.metric[rows[k]]
            for b in range(a + 1):
                G[a, b] += factor * J[b]
    trace = 0.0
    for a in range(BASE_SIZE):
        trace += G[a, a]
    for a in range(BASE_SIZE):
        G[a, a] += LEAST_REGULAR * trace
    return cholesky(G, BASE_SIZE, 0.0, stance.L)


@jit
def _balanced(work):
    """Whether the forces give the base what it needs."""
    most = 0.0
    for a in range(work.v.shape[0]):
        most = max(most, abs(work.stance.pull[a]))
    for a in range(BASE_SIZE):
        if not abs(work.tau[a]) <= BROKEN * (1.0 + most):
            return False
    return True


@jit
def _kept(work):
    """Whether joints, motors, distances and cones are kept."""
    stance, n = work.stance, work.v.shape[0]
    x, lower, upper = work.joint_acceleration, work.bounds.lower, work.bounds.upper
    if approach(work) > BROKEN:
        return False
    for a in range(n):
        above = x[a] <= upper[a] + BROKEN * max(1.0, abs(upper[a]))
        if not (above and x[a] >= lower[a] - BROKEN * max(1.0, abs(lower[a]))):
            return False
        most = stance.room[a]
        if a >= BASE_SIZE and not abs(work.tau[a]) <= most + BROKEN * max(1.0, most):
            return False
    for c in range(stance.count[0]):
        if stance.force[c] > 0.0:
            most = stance.force[c] * stance.most[c]
            pressed = stance.carried[stance.place[c, PLACE_FIRST] + NORMAL]
            if not pressed <= most + BROKEN * max(1.0, most):
                return False
            for k in range(stance.edges[c]):
                if not edge(stance, c, k) <= BROKEN:
                    return False
    return True


@jit
def edge(stance, c, k):
    """Row k of the cone of a contact, times its force."""
    total, first = 0.0, stance.place[c, PLACE_FIRST]
    for i in range(stance.place[c, PLACE_ROWS]):
        total += stance.cone[c, k, i] * stance.carried[first + i]
    return total


@jit
def _acting(work):
    """Tell how much joint limits and distances act, and whether a motor does."""
    taken, n, bits = work.stance.bounds.taken, work.v.shape[0], 0
    for i in range(work.limit.shape[0]):
        j = work.limit_joint[i]
        if work.option[LIMIT_BOUND] != 0.0:
            part = taken[j] if work.limit[i, SIGN] > 0.0 else taken[n + j]
            if part > 0.0:
                work.limit_h[i] = min(part / work.limit[i, MARGIN], 1.0)
    for a in range(2 * n, 4 * n):
        if taken[a] > 0.0:
            bits |= SCALED
    first = 4 * n + EACH * work.stance.place.shape[0]
    for i in range(work.distance_taken.shape[0]):
        if first + i < taken.shape[0]:
            work.distance_taken[i] = taken[first + i]
            if taken[first + i] > 0.0:
                bits |= COLLISION
    if will_close(work):
        bits |= COLLISION_LOST
    return bits


@jit
def _tell(work, c):
    """Force of a contact in its own axes (6,) N and N·m, and the part of its cone that this uses."""
    stance, force = work.stance, work.contact_force[c]
    first, rows = stance.place[c, PLACE_FIRST], stance.place[c, PLACE_ROWS]
    there = stance.force[c] > 0.0
    for i in range(force.shape[0]):
        force[i] = 0.0
    for i in range(rows):
        force[component_of(rows, i)] = stance.carried[first + i] if there else 0.0
    work.contact_use[c] = 0.0
    if not (there and force[NORMAL] > BARELY * stance.most[c]):
        return
    use = -math.inf
    for k in range(stance.edges[c]):
        use = max(use, 1.0 + edge(stance, c, k) / (-stance.cone[c, k, NORMAL] * force[NORMAL]))
    work.contact_use[c] = use


@jit
def _lost(work):
    """Compare what was given up with the weight; fills hindrance."""
    stance, bodies = work.stance, work.bodies
    force, moment, weight = 0.0, 0.0, 0.0
    for a in range(3):
        force += stance.given_up[a] * stance.given_up[a]
        moment += stance.given_up[3 + a] * stance.given_up[3 + a]
        weight += bodies.gravity[a] * bodies.gravity[a]
    mass = 0.0
    for i in range(bodies.mass.shape[0]):
        mass += bodies.mass[i] - bodies.carried[i]
    weight = math.sqrt(weight) * mass
    lost = max(math.sqrt(force), math.sqrt(moment) / LEVER)
    if lost > 0.0:
        lost = lost / weight if weight > 0.0 else math.inf
    stance.hindrance[0] = lost / MAY_GIVE_UP
    bits = 0
    if lost > NOTICED:
        bits |= GIVEN_UP
    if lost > FALLING:
        bits |= NOT_BALANCED
    return bits
