"""One tick from the robot's arrays to the torque; `opspace.controller.reference` has its equations."""

from __future__ import annotations

import math

from opspace.command import Status
from opspace.kernels.columns import (
    COVERS_ALL,
    DAMPING,
    FIRST_ROW,
    JOINT,
    JOINTS,
    KEEP_TORQUE,
    KIND,
    LIMIT_WEIGHT,
    MOTION,
    NOT_FINITE,
    NOT_POSITIVE_DEFINITE,
    PROFILE,
    ROOM,
    ROWS,
    SINGULAR,
    SOLVE,
    SOURCE,
    STATE_NOT_FINITE,
    TASK_BIAS,
    WORLD,
)
from opspace.kernels.corners import corners, insert, sort_corners
from opspace.kernels.dynamics import evaluate
from opspace.kernels.inertia import (
    acceleration_of,
    factor,
    torque_of,
    unit_row,
    whiten,
    whiten_rows,
    whitened_of,
)
from opspace.kernels.level import project, solve_level, take_alternative
from opspace.kernels.limit_rows import SIGN, begin_limits, insert_limits, keep_bounds
from opspace.kernels.scalars import ramp
from opspace.kernels.task_rows import evaluate_tasks
from opspace.kernels.walk import begin, keep_inside, pass_on, slot_bit, walk
from opspace.law.scalars import LIMIT_PASSES
from opspace.law.scalars import SCALED as GIVEN_WAY
from opspace.machine.jit import jit

NO_GROUP, EXACT, CHAINED = range(3)
FADED = int(Status.DIRECTION_OFF)
LIMITED = int(Status.JOINT_LIMIT)
ABOVE = int(Status.ABOVE_TORQUE_LIMIT)
SCALED = int(Status.TORQUE_SCALED)


@jit
def tick(t, k):
    """Compute the torque for the state that the robot's arrays hold.

    Args:
        t: Time, s.
        k: Handle of a `opspace.kernels.columns.Tick`.

    Returns:
        One of the answers in ``layout``, negative; or what happened in the numbers of
        `opspace.Status` plus ``layout.SOLVE`` times the number of hard torques.
    """
    if not _finite(k.q) or not _finite(k.v):
        return STATE_NOT_FINITE
    if k.bodies.kind.shape[0] > 0:
        evaluate(k.bodies, k.q, k.v, k.dynamics)
    activations(t, k)
    evaluate_tasks(k)
    if not factor(k.M, k.inertia):
        return NOT_POSITIVE_DEFINITE
    stacks = blend(k)
    whiten_tasks(k)
    law(k, stacks, 0)
    solves = stacks
    if k.limit.shape[0] > 0:
        begin_limits(k)
        for _ in range(LIMIT_PASSES):
            accelerations(k)
            if not insert_limits(k):
                break
            limit_stacks = limit_corners(k)
            law(k, stacks, limit_stacks)
            solves = stacks * limit_stacks
    torque(k)
    kept = keep_bounds(k) if k.limit.shape[0] > 0 else 0
    if not _finite(k.tau):
        return NOT_FINITE
    return (status(k) | kept) + SOLVE * solves


@jit
def _finite(x):
    for i in range(x.shape[0]):
        if not math.isfinite(x[i]):
            return False
    return True


@jit
def activations(t, k):
    """Activation of every task and every change of place, and who belongs to which group."""
    tasks = k.kind.shape[0]
    for i in range(k.variable.shape[0]):
        x = k.variable[i]
        h = ramp(t, int(x[PROFILE]), x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8])
        if i < tasks:
            h *= k.own[i]
            k.h[i] = h
        k.value[i] = h
    exact = 0
    for i in range(k.value.shape[0]):
        if not 0.0 < k.value[i] < 1.0:
            k.group[i] = NO_GROUP
        elif k.group[i] == EXACT:
            exact += 1
    for i in range(k.value.shape[0]):
        if 0.0 < k.value[i] < 1.0 and k.group[i] == NO_GROUP:
            if exact < k.option[ROOM]:
                k.group[i] = EXACT
                exact += 1
            else:
                k.group[i] = CHAINED
        k.chained[i] = 1 if k.group[i] == CHAINED else 0


@jit
def blend(k):
    """Hard stacks between which the tasks are on their way (`opspace.stack.mixture`).

    Returns:
        Number of different stacks.
    """
    slots = k.slots.shape[0]
    count = corners(k.value, k.value.shape[0], k.chained, k.corner_on, k.corner_weight, k.order)
    for s in range(slots):
        k.share[s] = 0.0
    for c in range(count):
        on = k.corner_on[c]
        mask = 0
        for s in range(slots):
            if on & k.slot_off[s] != 0 or on & k.slot_place[s] != k.slot_place[s]:
                continue
            k.share[s] += k.corner_weight[c]
            if on & k.slot_on[s] == k.slot_on[s]:
                mask |= slot_bit(s)
        k.corner_on[c] = mask
    return sort_corners(k.corner_on, k.corner_weight, count)


@jit
def whiten_tasks(k):
    """Rows Ĵ = W J U⁻ᵀ and f̂ = W f̃ of every task, and what damps the rest."""
    n = k.v.shape[0]
    if k.option[TASK_BIAS] != 0.0:
        # Eq. 3-4: f̃ = f* + η + ζ, the bias as an acceleration of each task.
        for a in range(n):
            k.drop[a] = k.bias[a]
        whiten(k.inertia, k.drop)
    covered = False
    for i in range(k.kind.shape[0]):
        whiten_task(k, i, n)
        if k.kind[i, COVERS_ALL] != 0 and k.h[i] == 1.0:
            covered = True
    k.rest[n] = 0.0
    if not covered and k.option[DAMPING] != 0.0:
        damp_rest(k, n)


@jit
def whiten_task(k, i, n):
    """Whiten the rows of task i."""
    J, Jw, fw, weight = k.J, k.Jw, k.fw, k.row_weight
    first = k.kind[i, FIRST_ROW]
    end = first + k.kind[i, ROWS]
    of_frame = k.kind[i, KIND] == MOTION and k.kind[i, SOURCE] == WORLD
    for row in range(first, end):
        if k.kind[i, KIND] == JOINTS:
            unit_row(k.inertia, k.coordinate[row], weight[row], Jw[row])
            continue
        for a in range(n):
            Jw[row, a] = weight[row] * J[row, a]
        if not of_frame:
            whiten(k.inertia, Jw[row])
    if of_frame:
        whiten_rows(k.inertia, k.kind[i, JOINT], first, end, Jw)
    for row in range(first, end):
        fw[row] = weight[row] * (k.wanted[row] - k.drift[row])
        if k.option[TASK_BIAS] != 0.0:
            for a in range(n):
                fw[row] += Jw[row, a] * k.drop[a]


@jit
def damp_rest(k, n):
    """q̈ = −d v of what is left, weighed by the inertia: its momentum decays at the rate d."""
    k.rest[n] = 1.0
    whitened_of(k.inertia, k.v, k.rest)
    for a in range(n):
        k.rest[a] *= -k.option[DAMPING]
        if k.option[TASK_BIAS] != 0.0:
            k.rest[a] += k.drop[a]


@jit
def law(k, stacks, limit_stacks):
    """û = Σ_T w_T H(T; f̃) of the stacks, under the joint limits that take part (Eq. 19-23)."""
    n = k.v.shape[0]
    s = k.space
    levels = s.u.shape[0] - 1
    if k.option[KEEP_TORQUE] != 0.0:
        start_inside(k, n)
    for a in range(n):
        k.u[a] = 0.0
    begin(n, levels, s)
    if limit_stacks == 0:
        pass_on(0, n, s)
        s.path[1] = 1.0
        _walk(k, stacks, levels)
        return
    for c in range(limit_stacks):
        _under_limits(k, c, stacks, levels)


@jit
def _walk(k, stacks, levels):
    n = k.v.shape[0]
    walk(
        1, levels, n, k.slots, k.Jw, k.fw, k.corner_on, k.corner_weight, stacks,
        k.rest, k.option, k.space, k.u,
    )  # fmt: skip


@jit
def _under_limits(k, c, stacks, levels):
    """Add the stacks below one corner of the joint limits."""
    n = k.v.shape[0]
    s = k.space
    first = k.Jw.shape[0] - k.limit.shape[0]
    count = 0
    for i in range(k.limit.shape[0]):
        if k.limit_on[c, i] != 0:
            s.rows[count] = first + i
            count += 1
    if count == 0:
        pass_on(0, n, s)
        s.path[1] = k.limit_weight[c]
        _walk(k, stacks, levels)
        return
    project(0, count, n, k.Jw, k.fw, s)
    alternatives = solve_level(0, count, n, k.Jw, False, k.option, s)
    if alternatives == 1:
        keep_inside(0, n, k.limit_weight[c], s)
    for i in range(alternatives):
        share = 1.0
        if alternatives > 1:
            share = s.share[0, i]
            if share <= 0.0:
                continue
            take_alternative(0, i, n, s)
            keep_inside(0, n, k.limit_weight[c] * share, s)
        s.path[1] = k.limit_weight[c] * share
        _walk(k, stacks, levels)


@jit
def limit_corners(k):
    """Rows of the joint limits that take part, and the corners of their chain.

    Returns:
        Number of corners.
    """
    n, count = k.v.shape[0], k.limit.shape[0]
    first = k.Jw.shape[0] - count
    links = 0
    order, h, on, weight = k.limit_order, k.limit_h, k.limit_on, k.limit_weight
    for i in range(count):
        on[0, i] = 1 if h[i] >= 1.0 else 0
        if h[i] > 0.0:
            limit_row(k, i, first + i, n)
            if h[i] < 1.0:
                links = insert(i, h, order, links)
    total = 0
    before = 1.0
    for link in range(links + 1):
        after = h[order[link]] if link < links else 0.0
        if before > after:
            weight[total] = before - after
            total += 1
        if link < links:
            if before > after:
                for i in range(count):
                    on[total, i] = on[total - 1, i]
            on[total, order[link]] = 1
            before = after
    return total


@jit
def limit_row(k, i, row, n):
    """Task set e_jᵀ q̈ = ± acceleration of a joint limit."""
    weight = k.option[LIMIT_WEIGHT]
    unit_row(k.inertia, k.limit_joint[i], weight, k.Jw[row])
    k.fw[row] = weight * k.limit[i, SIGN] * k.limit_wanted[i]
    if k.option[TASK_BIAS] != 0.0:
        for a in range(n):
            k.fw[row] += k.Jw[row, a] * k.drop[a]


@jit
def accelerations(k):
    """q̈ = A⁻¹ (Γ − b − g) (Eq. 1), from û = U⁻¹ Γ."""
    n = k.v.shape[0]
    for a in range(n):
        k.joint_acceleration[a] = k.u[a]
        if k.option[TASK_BIAS] != 0.0:
            k.joint_acceleration[a] -= k.drop[a]
    acceleration_of(k.inertia, k.joint_acceleration)


@jit
def torque(k):
    """Γ = U û, with the bias where it is compensated at every joint."""
    torque_of(k.inertia, k.u, k.tau)
    for a in range(k.v.shape[0]):
        if k.option[KEEP_TORQUE] != 0.0:
            k.tau[a] += k.space.start[a]
        elif k.option[TASK_BIAS] == 0.0:
            k.tau[a] += k.bias[a]


@jit
def start_inside(k, n):
    """Begin with the bias where it is compensated at every joint, cut at the limits."""
    k.space.motors[0] = 1
    for a in range(n):
        bias = k.bias[a] if k.option[TASK_BIAS] == 0.0 else 0.0
        k.space.start[a] = min(max(bias, -k.torque_limit[a]), k.torque_limit[a])


@jit
def status(k):
    """What happened, in the numbers of `opspace.Status`."""
    bits = 0
    if k.option[SINGULAR] != 0.0:
        for d in range(1, k.space.u.shape[0] - 1):
            if k.space.top[d] > 0.0 and k.space.off[d] != 0:
                bits |= FADED
    for i in range(k.limit.shape[0]):
        if k.limit_h[i] > 0.0:
            bits |= LIMITED
    for a in range(k.tau.shape[0]):
        if abs(k.tau[a]) > k.torque_limit[a]:
            bits |= ABOVE
    for d in range(k.scale.shape[0]):
        k.scale[d] = 1.0
        if k.option[KEEP_TORQUE] != 0.0 and k.space.got[d, 1] > 0.0:
            k.scale[d] = min(k.space.got[d, 0] / k.space.got[d, 1], 1.0)
            if k.scale[d] < 1.0 - GIVEN_WAY:
                bits |= SCALED
    return bits
