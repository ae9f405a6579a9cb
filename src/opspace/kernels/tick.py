"""One tick from the robot's arrays to the torque; `opspace.controller.reference` has its equations."""

from __future__ import annotations

import math

from opspace.command import Status
from opspace.kernels.balance import balance
from opspace.kernels.columns import (
    BASE,
    COVERS_ALL,
    DAMPING,
    FIRST_ROW,
    FORCE,
    JOINT,
    JOINTS,
    KEEP_TORQUE,
    KIND,
    LIMIT_WEIGHT,
    MOTION,
    NOT_FINITE,
    NOT_POSITIVE_DEFINITE,
    PROFILE,
    REACH,
    ROOM,
    ROWS,
    SINGULAR,
    SOLVE,
    SOURCE,
    STATE_NOT_FINITE,
    TASK_BIAS,
    WORLD,
)
from opspace.kernels.compiled_scalars import leaning, ramp, remembered_unrest, unrest_of
from opspace.kernels.contact_rows import close_contacts, contact_corners, evaluate_contacts
from opspace.kernels.corners import corners, insert, sort_corners
from opspace.kernels.distances import measure_distances
from opspace.kernels.dynamics import evaluate
from opspace.kernels.force_rows import freeze, press, stale, touched
from opspace.kernels.inertia import (
    factor,
    torque_of,
    unit_row,
    whiten,
    whiten_row,
    whiten_rows,
    whitened_of,
)
from opspace.kernels.led_goals import lead
from opspace.kernels.level import project, solve_level, take_alternative
from opspace.kernels.limit_columns import COMMAND, SIGN
from opspace.kernels.limit_rows import begin_limits, insert_limits, keep_bounds
from opspace.kernels.standing import stand
from opspace.kernels.task_rows import evaluate_tasks
from opspace.kernels.walk import begin, keep_inside, pass_on, slot_bit, start_at, walk
from opspace.kernels.whole_vectors import dot, put, whole
from opspace.law.scalars import CHAINED, EXACT, MOST_UNREST, NO_GROUP
from opspace.law.scalars import SCALED as GIVEN_WAY
from opspace.machine.jit import jit

FADED = int(Status.DIRECTION_OFF)
LIMITED = int(Status.JOINT_LIMIT)
ABOVE = int(Status.ABOVE_TORQUE_LIMIT)
SCALED = int(Status.TORQUE_SCALED)


@jit
def tick(t, work):
    """Compute the torque for the state that the robot's arrays hold.

    Args:
        t: Time, s.
        work: `opspace.plan.records.TICK`; tau (n,) N·m is written, and all that is reported.

    Returns:
        One of the answers in `opspace.kernels.columns`, negative; or what happened in the numbers
        of `opspace.Status` plus ``SOLVE`` times the number of hard torques.
    """
    if not finite(work.q) or not finite(work.v):
        return STATE_NOT_FINITE
    if work.bodies.kind.shape[0] > 0:
        evaluate(work.bodies, work.q, work.v, work.dynamics)
    if not factor(work.M, work.inertia):
        return NOT_POSITIVE_DEFINITE
    lead(t, work)
    moved = press(t, work)
    activations(t, work)
    evaluate_tasks(work, moved)
    balance(work)
    stacks = blend(work)
    if not whiten_tasks(work):
        return NOT_FINITE
    limit_stacks = 0
    if work.limit.shape[0] > 0:
        begin_limits(work)
        if insert_limits(work):
            limit_stacks = limit_corners(work)
    evaluate_contacts(work)
    closings = law(t, work, stacks, limit_stacks)
    measure_distances(work)
    if work.option[BASE] != 0.0:
        kept = stand(work, stacks, closings)
    else:
        torque(work)
        kept = keep_bounds(work, stacks)
    if not finite(work.tau):
        return NOT_FINITE
    bits = status(work) | kept | stale(work)
    freeze(work, bits)
    for a in range(work.tau.shape[0]):
        work.tau[a] += work.torque_middle[a]
    return bits + SOLVE * closings * stacks * max(limit_stacks, 1)


@jit
def finite(x):
    """Whether every one of numbers (n,) is finite."""
    for i in range(x.shape[0]):
        if not math.isfinite(x[i]):
            return False
    return True


@jit
def activations(t, work):
    """Activation of every task and change of place at t [s], and who belongs to which group.

    Reads variable and own, writes value (variables,), h (tasks,), group, low and width (variables,).
    """
    tasks = work.kind.shape[0]
    for i in range(work.variable.shape[0]):
        x = work.variable[i]
        h = ramp(t, int(x[PROFILE]), x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8])
        if i < tasks:
            h *= touched(work, i)
            work.h[i] = h
        work.value[i] = h
    exact = 0
    for i in range(work.value.shape[0]):
        if not 0.0 < work.value[i] < 1.0:
            work.group[i] = NO_GROUP
        elif work.group[i] == EXACT:
            exact += 1
    for i in range(work.value.shape[0]):
        h = work.value[i]
        if not 0.0 < h < 1.0:
            continue
        if work.group[i] == NO_GROUP:
            if exact < work.option[ROOM]:
                work.group[i] = EXACT
                exact += 1
            else:
                work.group[i] = _free_rank(work.group)
        if work.group[i] >= CHAINED:
            side = leaning(h, work.group[i] - CHAINED, work.option[REACH])
            work.low[i], work.width[i] = h - side, 2.0 * side


@jit
def _free_rank(group):
    """Number of the chain that no activation has."""
    found = CHAINED
    while True:
        taken = False
        for i in range(group.shape[0]):
            if group[i] == found:
                taken = True
        if not taken:
            return found
        found += 1


@jit
def blend(work):
    """Hard stacks between which the tasks are on their way (`opspace.stack.mixture`).

    Reads value, group and the slots, writes share (slots,), corner_on and corner_weight (2 corners,).

    Returns:
        Number of different stacks.
    """
    slots = work.slots.shape[0]
    count = corners(work, work.corner_on, work.corner_weight)
    for s in range(slots):
        work.share[s] = 0.0
    for c in range(count):
        on = work.corner_on[c]
        mask = 0
        for s in range(slots):
            if on & work.slot_off[s] != 0 or on & work.slot_place[s] != work.slot_place[s]:
                continue
            work.share[s] += work.corner_weight[c]
            if on & work.slot_on[s] == work.slot_on[s]:
                mask |= slot_bit(s)
        work.corner_on[c] = mask
    return sort_corners(work.corner_on, work.corner_weight, count)


@jit
def whiten_tasks(work):
    """Rows Ĵ = W J U⁻ᵀ and f̂ = W f̃ of every task, and what damps the rest.

    Reads J (rows, n), wanted and drift (rows,); writes Jw (rows, n), fw (rows,) [√J/s], rest (n + 1,).

    Returns:
        Whether all f̂ are finite: a level without motions would pass over one that is not.
    """
    n = work.v.shape[0]
    if work.option[TASK_BIAS] != 0.0:
        # Eq. 3-4: f̃ = f* + η + ζ, the bias as an acceleration of each task.
        for a in range(n):
            work.drop[a] = work.balance[a] + work.torque_middle[a]
        whiten(work.inertia, work.drop)
    covered = False
    for i in range(work.kind.shape[0]):
        whiten_task(work, i, n)
        if work.kind[i, COVERS_ALL] != 0 and work.h[i] == 1.0:
            covered = True
    work.rest[n] = 0.0
    if not covered and work.option[DAMPING] != 0.0:
        damp_rest(work, n)
    none = 0.0
    for row in range(work.error.shape[0]):
        none += 0.0 * work.fw[row]
    return none == 0.0


@jit
def whiten_task(work, i, n):
    """Whiten the rows of task i."""
    J, Jw, fw, weight = work.J, work.Jw, work.fw, work.row_weight
    first = work.kind[i, FIRST_ROW]
    end = first + work.kind[i, ROWS]
    if work.kind[i, KIND] == JOINTS:
        for row in range(first, end):
            put(weight[row], work.inertia.white[work.coordinate[row]], Jw[row], 0, whole(n))
    else:
        of_frame = work.kind[i, KIND] == MOTION or work.kind[i, KIND] == FORCE
        if of_frame and work.kind[i, SOURCE] == WORLD:
            whiten_rows(work.inertia, work.kind[i, JOINT], first, end, J, Jw)
        else:
            for row in range(first, end):
                whiten_row(work.inertia, J[row], Jw[row])
        for row in range(first, end):
            put(weight[row], Jw[row], Jw[row], 0, whole(n))
    for row in range(first, end):
        fw[row] = weight[row] * (work.wanted[row] - work.drift[row])
    if work.option[TASK_BIAS] != 0.0:
        for row in range(first, end):
            fw[row] += dot(Jw[row], work.drop, 0, whole(n))


@jit
def damp_rest(work, n):
    """q̈ = −d v of what is left, weighed by the inertia: its momentum decays at the rate d."""
    work.rest[n] = 1.0
    whitened_of(work.inertia, work.v, work.rest)
    for a in range(n):
        work.rest[a] *= -work.option[DAMPING]
        if work.option[TASK_BIAS] != 0.0:
            work.rest[a] += work.drop[a]


@jit
def unrest_of_rows(t, work, n):
    """How far every row has lately been from rest at its target, squared, into space.unrest.

    A task that is absent has not been at rest. Reads and writes row_unrest (rows,) and unrest_at.
    """
    speed = 0.0
    for a in range(n):
        speed += work.space.motion[a] * work.space.motion[a]
    speed = math.sqrt(speed)
    passed = t - work.unrest_at[0]
    work.unrest_at[0] = t
    for i in range(work.kind.shape[0]):
        first = work.kind[i, FIRST_ROW]
        for row in range(first, first + work.kind[i, ROWS]):
            unrest = 1.0
            if work.row_near[row] > 0.0:
                unrest = MOST_UNREST
                if work.h[i] > 0.0:
                    now = unrest_of(
                        work.row_near[row], work.error[row], speed, work.row_reference[row]
                    )
                    unrest = remembered_unrest(work.row_unrest[row], math.sqrt(now), passed)
                work.row_unrest[row] = unrest
            work.space.unrest[row] = unrest * unrest
    for row in range(work.error.shape[0], work.space.unrest.shape[0]):
        work.space.unrest[row] = 1.0


@jit
def law(t, work, stacks, limit_stacks):
    """û = Σ_T w_T H(T; f̃) of the stacks, under the joint limits that take part (Eq. 20, Eq. 23).

    Reads Jw, fw, the corners and rest; writes u (n,), √J/s, and what `SPACE` keeps for the report.
    What a robot stands on is above the limits.

    Returns:
        Number of corners in which contacts close, 1 without any.
    """
    n = work.v.shape[0]
    space = work.space
    levels = space.u.shape[0] - 1
    if work.option[KEEP_TORQUE] != 0.0:
        start_inside(work, n)
    if work.option[SINGULAR] != 0.0:
        whitened_of(work.inertia, work.v, space.motion)
        unrest_of_rows(t, work, n)
    for a in range(n):
        work.u[a] = 0.0
    begin(levels, space)
    if work.option[BASE] == 0.0:
        start_at(0 if limit_stacks > 0 else 1, n, space)
        _above_tasks(work, 1.0, stacks, limit_stacks, levels)
        return 1
    closings = contact_corners(work)
    for c in range(closings):
        close_contacts(work, work.stance.corner_links[c])
        _above_tasks(work, work.stance.corner_weight[c], stacks, limit_stacks, levels)
    return closings


@jit
def _above_tasks(work, weight, stacks, limit_stacks, levels):
    """Add the stacks below the joint limits that take part, with some weight."""
    space = work.space
    if limit_stacks == 0:
        if work.option[BASE] != 0.0:
            pass_on(0, work.v.shape[0], space)
        space.path[1] = weight
        _walk(work, stacks, levels)
        return
    for c in range(limit_stacks):
        _under_limits(work, c, weight * work.limit_weight[c], stacks, levels)


@jit
def _walk(work, stacks, levels):
    n = work.v.shape[0]
    walk(
        1, levels, n, work.slots, work.Jw, work.fw, work.corner_on, work.corner_weight, stacks,
        work.rest, work.option, work.space, work.u,
    )  # fmt: skip


@jit
def _under_limits(work, c, weight, stacks, levels):
    """Add the stacks below one corner of the joint limits, with its weight."""
    n = work.v.shape[0]
    space = work.space
    first = work.Jw.shape[0] - work.limit.shape[0]
    count = 0
    for i in range(work.limit.shape[0]):
        if work.limit_on[c, i] != 0:
            space.rows[count] = first + i
            count += 1
    if count == 0:
        pass_on(0, n, space)
        space.path[1] = weight
        _walk(work, stacks, levels)
        return
    project(0, count, n, work.Jw, work.fw, space)
    alternatives = solve_level(0, count, n, work.Jw, False, work.option, space)
    if alternatives == 1:
        keep_inside(0, n, weight, space)
    for i in range(alternatives):
        share = 1.0
        if alternatives > 1:
            share = space.share[0, i]
            if share <= 0.0:
                continue
            take_alternative(0, i, n, space)
            keep_inside(0, n, weight * share, space)
        space.path[1] = weight * share
        _walk(work, stacks, levels)


@jit
def limit_corners(work):
    """Rows of the joint limits that take part, and the corners of their chain.

    Reads limit_h; writes limit_on (corners, limits), limit_weight (corners,).

    Returns:
        Number of corners.
    """
    n, count = work.v.shape[0], work.limit.shape[0]
    first = work.Jw.shape[0] - count
    links = 0
    order, h, on, weight = work.limit_order, work.limit_h, work.limit_on, work.limit_weight
    for i in range(count):
        on[0, i] = 1 if h[i] >= 1.0 else 0
        if h[i] > 0.0:
            limit_row(work, i, first + i, n)
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
def limit_row(work, i, row, n):
    """Task set e_jᵀ q̈ = ± command of a joint limit."""
    weight = work.option[LIMIT_WEIGHT]
    unit_row(work.inertia, work.limit_joint[i], weight, work.Jw[row])
    work.fw[row] = weight * work.limit[i, SIGN] * work.limit[i, COMMAND]
    if work.option[TASK_BIAS] != 0.0:
        for a in range(n):
            work.fw[row] += work.Jw[row, a] * work.drop[a]


@jit
def torque(work):
    """Γ = U û, (n,) N·m, with the bias where it is compensated at every joint."""
    torque_of(work.inertia, work.u, work.tau)
    for a in range(work.v.shape[0]):
        if work.option[KEEP_TORQUE] != 0.0:
            work.tau[a] += work.space.start[a]
        elif work.option[TASK_BIAS] == 0.0:
            work.tau[a] += work.balance[a]
        else:
            work.tau[a] -= work.torque_middle[a]


@jit
def start_inside(work, n):
    """Begin with the bias where it is compensated at every joint, cut at the limits, (n,) N·m."""
    work.space.motors[0] = 1
    for a in range(n):
        bias = work.balance[a] if work.option[TASK_BIAS] == 0.0 else -work.torque_middle[a]
        work.space.start[a] = min(max(bias, -work.torque_limit[a]), work.torque_limit[a])


@jit
def status(work):
    """What happened, in the numbers of `opspace.Status`; fills scale (levels + 2,)."""
    bits = 0
    if work.option[SINGULAR] != 0.0:
        for d in range(1, work.space.u.shape[0] - 1):
            if work.space.top[d] > 0.0 and work.space.off[d] != 0:
                bits |= FADED
    for i in range(work.limit.shape[0]):
        if work.limit_h[i] > 0.0:
            bits |= LIMITED
    for a in range(work.tau.shape[0]):
        if abs(work.tau[a]) > work.torque_limit[a]:
            bits |= ABOVE
    if work.reaction_part[0] < 1.0 - GIVEN_WAY:
        bits |= SCALED
    for d in range(work.scale.shape[0]):
        work.scale[d] = 1.0
        if work.option[KEEP_TORQUE] != 0.0 and work.space.got[d, 1] > 0.0:
            work.scale[d] = min(work.space.got[d, 0] / work.space.got[d, 1], 1.0)
            if work.scale[d] < 1.0 - GIVEN_WAY:
                bits |= SCALED
    return bits
