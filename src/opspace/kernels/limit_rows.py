"""Joint limits of one tick: what each asks for or allows, and the projection that keeps them."""

from __future__ import annotations

import math

from opspace.command import Status
from opspace.kernels.columns import (
    KEEP_TORQUE,
    LIMIT_BOUND,
    LIMIT_BUFFER,
    LIMIT_K1,
    LIMIT_K2,
    LIMIT_KP,
    LIMIT_LAW,
    LIMIT_PROFILE,
    PERIOD,
)
from opspace.kernels.compiled_scalars import (
    allowed_speed,
    last_command,
    limit_command,
    limit_presence,
    position_command,
    stopping_command,
)
from opspace.kernels.distances import approach, will_close
from opspace.kernels.dynamics import evaluate
from opspace.kernels.inertia import acceleration_of, factor, whiten
from opspace.kernels.limit_columns import (
    BRAKE,
    BY_POSITION,
    COMMAND,
    DISTURBANCE,
    HASTE,
    LAST,
    MARGIN,
    POSITION,
    SHIFT,
    SIGN,
    SPEED,
)
from opspace.kernels.projection import nearest_acceleration, task_metric
from opspace.kernels.room_below import leave_room
from opspace.kernels.task_rows import joint_position
from opspace.law.scalars import ADMISSIBLE, BROKEN, LOOKS, LOST, SEEN, UNBOUNDED
from opspace.machine.jit import jit

FILTERED = int(Status.FILTERED)
LIMIT_LOST = int(Status.LIMIT_LOST)
COLLISION = int(Status.COLLISION)
COLLISION_LOST = int(Status.COLLISION_LOST)
SCALED = int(Status.TORQUE_SCALED)


@jit
def begin_limits(work):
    """Evaluate what every limit asks for or allows, rad/s², into its row of ``limit`` (limits, 11)."""
    code = int(work.option[LIMIT_LAW])
    for i in range(work.limit.shape[0]):
        limit = work.limit[i]
        limit[HASTE], limit[LAST], limit[SHIFT] = 0.0, math.inf, 0.0
        d = distance_to_limit(work, i)
        towards = limit[SIGN] * work.v[work.limit_joint[i]]
        allowed, slope = math.inf, 0.0
        if work.option[LIMIT_BOUND] != 0.0:
            allowed, slope = allowed_speed(d, limit[BRAKE], work.option[LIMIT_K1])
        if code == ADMISSIBLE:  # the usual law; both commands from one v_adm, which costs most
            k2 = work.option[LIMIT_K2]
            by_position = position_command(towards, allowed, slope, k2)
            limit[BY_POSITION] = by_position
            limit[COMMAND] = min(by_position, k2 * (limit[SPEED] - towards))
        else:
            limit[BY_POSITION] = _command(work, i, code, d, towards, math.inf)
            limit[COMMAND] = _command(work, i, code, d, towards, limit[SPEED])
        if towards > max(allowed, 0.0):
            _stop(work, i, d, towards)
        limit[COMMAND] -= limit[DISTURBANCE]
        limit[BY_POSITION] -= limit[DISTURBANCE]
        limit[LAST] -= limit[DISTURBANCE]


@jit
def distance_to_limit(work, i):
    """How far the joint of limit i is from it, rad or m; below zero past it."""
    limit = work.limit[i]
    return limit[SIGN] * (limit[POSITION] - joint_position(work, work.limit_joint[i]))


@jit
def _command(work, i, code, d, towards, speed):
    """What limit i asks for or allows by any law, of a joint that may be so fast."""
    option = work.option
    return limit_command(
        code, d, towards, work.limit[i, BRAKE], speed,
        option[LIMIT_K1], option[LIMIT_K2], option[LIMIT_KP], option[LIMIT_BUFFER],
    )  # fmt: skip


@jit
def _stop(work, i, d, towards):
    """Ask more of a joint that is too fast, as much as its motors give while they hold the others."""
    k1, period = work.option[LIMIT_K1], work.option[PERIOD]
    limit, j = work.limit[i], work.limit_joint[i]
    limit[LAST] = last_command(d, towards, limit[BRAKE], k1)
    most = math.inf
    for a in range(work.v.shape[0]):
        if work.M[a, j] != 0.0:
            room = max(work.torque_limit[a] - abs(work.balance[a]), 0.0)
            most = min(most, room / abs(work.M[a, j]))
    command = stopping_command(d, towards, limit[BRAKE], most, k1, period)
    if command < limit[COMMAND]:
        limit[HASTE] = limit[COMMAND] - command
        limit[COMMAND] = command


@jit
def insert_limits(work):
    """Activation of the limits that take part as task sets, into limit_h (limits,).

    Returns:
        Whether there are any.
    """
    any_limit = False
    option = work.option
    for i in range(work.limit.shape[0]):
        limit = work.limit[i]
        work.limit_h[i] = limit_presence(
            int(option[LIMIT_LAW]),
            distance_to_limit(work, i),
            limit[SIGN] * work.v[work.limit_joint[i]],
            limit[BRAKE],
            option[LIMIT_BUFFER],
            int(option[LIMIT_PROFILE]),
        )
        if work.limit_h[i] > 0.0:
            any_limit = True
    return any_limit


@jit
def keep_bounds(work, stacks):
    """Take the nearest torque with which no joint, motor or distance does more than it may.

    Reads and writes tau (n,), N·m, and joint_acceleration (n,), rad/s²; writes limit_h (limits,) of the
    limits that act, and distance_taken (distances,) m/s².

    Args:
        work: `opspace.plan.records.TICK`.
        stacks: Number of stacks that were blended.

    Returns:
        What happened, in the numbers of `opspace.Status`.
    """
    apart = work.distance.shape[0]
    if work.option[LIMIT_BOUND] == 0.0 and work.option[KEEP_TORQUE] == 0.0 and apart == 0:
        return 0
    n = work.v.shape[0]
    x = work.joint_acceleration
    for a in range(n):
        x[a] = work.tau[a] - work.balance[a]
    whiten(work.inertia, x)
    acceleration_of(work.inertia, x)
    for a in range(n):
        work.wanted_acceleration[a], work.wanted_tau[a] = x[a], work.tau[a]
    kept = realise(work, stacks, n)
    if work.option[PERIOD] > 0.0 and work.option[LIMIT_BOUND] != 0.0:
        kept = look_through(work, stacks, n, kept)
    return kept


@jit
def look_through(work, stacks, n, kept):
    """Keep the bounds of the mean acceleration, that of the middle of the tick.

    Args:
        work: `opspace.plan.records.TICK`.
        stacks: Number of stacks that were blended.
        n: Number of joints.
        kept: What happened so far, in the numbers of `opspace.Status`.

    Returns:
        What happened.
    """
    x = work.joint_acceleration
    for _ in range(LOOKS):
        if not _evaluate_middle(work, n) or _same_as_taken_off(work):
            return kept
        for i in range(work.limit.shape[0]):
            work.limit[i, SHIFT] = _more(work, i)
        for a in range(n):
            x[a], work.tau[a] = work.wanted_acceleration[a], work.wanted_tau[a]
        kept = realise(work, stacks, n)
        if kept & FILTERED == 0:
            return kept
    if _evaluate_middle(work, n) and _passes_in_the_middle(work):
        kept |= LIMIT_LOST
    return kept


@jit
def realise(work, stacks, n):
    """Replace a torque and its acceleration by the nearest that the bounds allow.

    Before that the levels below others leave these what is left of a limit; not of a speed, at which
    nothing rests.

    Returns:
        What happened, in the numbers of `opspace.Status`.
    """
    find_bounds(work, n)
    for i in range(work.distance_taken.shape[0]):
        work.distance_taken[i] = 0.0
    gave_way = leave_room(work, stacks, n)
    if gave_way:
        _torque_of_acceleration(work, n)
    outside = _motors_exceeded(work, n) or exceeds(work, n, BROKEN)
    if outside or approach(work) > BROKEN:
        task_metric(work, stacks)
        nearest_acceleration(work.inertia, work.joint_acceleration, work.bounds, work.distances)
        _torque_of_acceleration(work, n)
        for a in range(n):
            if work.option[KEEP_TORQUE] != 0.0:
                work.tau[a] = min(max(work.tau[a], -work.torque_limit[a]), work.torque_limit[a])
    elif gave_way:
        for i in range(work.bounds.taken.shape[0]):
            work.bounds.taken[i] = 0.0
    else:
        return LIMIT_LOST if will_pass(work) else 0
    return _acting(work, n)


@jit
def _torque_of_acceleration(work, n):
    for a in range(n):
        work.tau[a] = work.balance[a]
        for b in range(n):
            work.tau[a] += work.M[a, b] * work.joint_acceleration[b]


@jit
def _acting(work, n):
    """Tell how much each limit acts: what it takes from its joint, as a part of its margin."""
    bits = FILTERED
    taken = work.bounds.taken
    for i in range(work.limit.shape[0]):
        limit, j = work.limit[i], work.limit_joint[i]
        if work.option[LIMIT_BOUND] != 0.0:
            side = j if limit[SIGN] > 0.0 else n + j
            part = taken[side] + work.bounds.gave_way[side]
            work.limit_h[i] = min(part / limit[MARGIN], 1.0)
    for a in range(2 * n, 4 * n):
        if taken[a] > 0.0:
            bits |= SCALED
    for i in range(work.distance_taken.shape[0]):
        work.distance_taken[i] = taken[4 * n + i]
        if taken[4 * n + i] > 0.0:
            bits |= COLLISION
    if will_close(work):
        bits |= COLLISION_LOST
    if exceeds(work, n, LOST) or will_pass(work):
        bits |= LIMIT_LOST
    return bits


@jit
def will_pass(work):
    """Whether a joint that is too fast does not brake enough to stop at its limit."""
    for i in range(work.limit.shape[0]):
        limit = work.limit[i]
        if limit[SIGN] * work.joint_acceleration[work.limit_joint[i]] > limit[LAST] - limit[SHIFT]:
            return True
    return False


@jit
def _motors_exceeded(work, n):
    if work.option[KEEP_TORQUE] == 0.0:
        return False
    for a in range(n):
        if abs(work.tau[a]) > work.torque_limit[a] * (1.0 + BROKEN):
            return True
    return False


@jit
def exceeds(work, n, tolerance):
    """Whether a joint does more than it may by more than a tolerance, see `opspace.law.excess`."""
    x, lower, upper = work.joint_acceleration, work.bounds.lower, work.bounds.upper
    for a in range(n):
        if upper[a] < UNBOUNDED and x[a] - upper[a] > tolerance * max(1.0, abs(upper[a])):
            return True
        if lower[a] > -UNBOUNDED and lower[a] - x[a] > tolerance * max(1.0, abs(lower[a])):
            return True
    return False


@jit
def find_bounds(work, n):
    """Least and largest acceleration, and torque beside the bias, of every joint."""
    bounds = work.bounds
    for a in range(n):
        bounds.lower[a], bounds.upper[a] = -math.inf, math.inf
        bounds.left[a], bounds.left[n + a] = math.inf, math.inf
        bounds.least[a], bounds.most[a] = -math.inf, math.inf
        if work.option[KEEP_TORQUE] != 0.0:
            bounds.least[a] = -work.torque_limit[a] - work.balance[a]
            bounds.most[a] = work.torque_limit[a] - work.balance[a]
    if work.option[LIMIT_BOUND] == 0.0:
        return
    for i in range(work.limit.shape[0]):
        limit, j = work.limit[i], work.limit_joint[i]
        if limit[SIGN] > 0.0:
            bounds.upper[j] = limit[COMMAND] - limit[SHIFT]
            bounds.left[j] = limit[BY_POSITION] - limit[SHIFT]
        else:
            bounds.lower[j] = limit[SHIFT] - limit[COMMAND]
            bounds.left[n + j] = limit[BY_POSITION] - limit[SHIFT]
    for a in range(n):
        if bounds.lower[a] > bounds.upper[a]:
            _let_stop(work)
            return


@jit
def _let_stop(work):
    """Let who must stop at once do so, whatever the speed limit behind it would say.

    What a joint does more towards one limit in the middle of the tick it does less towards the other.
    """
    bounds = work.bounds
    for i in range(work.limit.shape[0]):
        limit, j = work.limit[i], work.limit_joint[i]
        apart = bounds.lower[j] - bounds.upper[j]
        if apart > 0.0 and limit[SIGN] > 0.0:
            bounds.lower[j] -= min(limit[HASTE] + limit[SHIFT], apart)
        elif apart > 0.0:
            bounds.upper[j] += min(limit[HASTE] + limit[SHIFT], apart)


@jit
def _evaluate_middle(work, n):
    """Find by how much accelerations differ in the middle of the tick, while the torque stays.

    Reads joint_acceleration (n,), rad/s², and tau (n,), N·m; writes later and change (n,), rad/s².

    Returns:
        Whether that can be computed here.
    """
    if work.bodies.kind.shape[0] == 0 or work.q.shape[0] != n:
        return False
    half, x, change = 0.5 * work.option[PERIOD], work.joint_acceleration, work.change
    for a in range(n):
        work.later_q[a] = work.q[a] + half * (work.v[a] + 0.5 * half * x[a])
        work.later_v[a] = work.v[a] + half * x[a]
    evaluate(work.bodies, work.later_q, work.later_v, work.later)
    if not factor(work.later.M, work.later_inertia):
        return False
    for a in range(n):
        change[a] = work.tau[a] - work.reaction[a] - work.later.bias[a] + work.torque_middle[a]
    whiten(work.later_inertia, change)
    acceleration_of(work.later_inertia, change)
    for a in range(n):
        change[a] -= x[a]
    return True


@jit
def _more(work, i):
    """What a joint does more towards a limit in the middle of the tick, rad/s²."""
    return max(work.limit[i, SIGN] * work.change[work.limit_joint[i]], 0.0)


@jit
def _same_as_taken_off(work):
    """Whether what joints do more in the middle of the tick is what bounds count with."""
    for i in range(work.limit.shape[0]):
        more = _more(work, i)
        if abs(more - work.limit[i, SHIFT]) > SEEN * max(1.0, more):
            return False
    return True


@jit
def _passes_in_the_middle(work):
    """Whether a joint does more than it may, counted with the middle of the tick."""
    for i in range(work.limit.shape[0]):
        limit, j = work.limit[i], work.limit_joint[i]
        most = limit[COMMAND]
        towards = limit[SIGN] * (work.joint_acceleration[j] + work.change[j])
        if towards - most > LOST * max(1.0, abs(most)):
            return True
    return False
