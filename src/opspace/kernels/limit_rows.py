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
)
from opspace.kernels.compiled_scalars import limit_command, limit_presence
from opspace.kernels.inertia import acceleration_of, whiten
from opspace.kernels.limit_columns import (
    BRAKE,
    COMMAND,
    DISTURBANCE,
    MARGIN,
    POSITION,
    SIGN,
    SPEED,
)
from opspace.kernels.projection import nearest_acceleration, task_metric
from opspace.law.scalars import BROKEN, LOST, UNBOUNDED
from opspace.machine.jit import jit

FILTERED = int(Status.FILTERED)
LIMIT_LOST = int(Status.LIMIT_LOST)
SCALED = int(Status.TORQUE_SCALED)


@jit
def begin_limits(work):
    """Evaluate what every limit asks for or allows, rad/s², into its row of ``limit`` (limits, 7)."""
    option = work.option
    for i in range(work.limit.shape[0]):
        limit = work.limit[i]
        j = work.limit_joint[i]
        limit[COMMAND] = limit_command(
            int(option[LIMIT_LAW]),
            limit[SIGN] * (limit[POSITION] - work.q[j]),
            limit[SIGN] * work.v[j],
            limit[BRAKE],
            limit[SPEED],
            option[LIMIT_K1],
            option[LIMIT_K2],
            option[LIMIT_KP],
            option[LIMIT_BUFFER],
        )
        limit[COMMAND] -= limit[DISTURBANCE]


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
        j = work.limit_joint[i]
        work.limit_h[i] = limit_presence(
            int(option[LIMIT_LAW]),
            limit[SIGN] * (limit[POSITION] - work.q[j]),
            limit[SIGN] * work.v[j],
            limit[BRAKE],
            option[LIMIT_BUFFER],
            int(option[LIMIT_PROFILE]),
        )
        if work.limit_h[i] > 0.0:
            any_limit = True
    return any_limit


@jit
def keep_bounds(work, stacks):
    """Take the nearest torque with which no joint and no motor does more than it may.

    Reads and writes tau (n,), N·m, and joint_acceleration (n,), rad/s²; writes limit_h (limits,) of the
    limits that act.

    Args:
        work: `opspace.plan.records.TICK`.
        stacks: Number of stacks that were blended.

    Returns:
        What happened, in the numbers of `opspace.Status`.
    """
    if work.option[LIMIT_BOUND] == 0.0 and work.option[KEEP_TORQUE] == 0.0:
        return 0
    n = work.v.shape[0]
    x = work.joint_acceleration
    for a in range(n):
        x[a] = work.tau[a] - work.bias[a]
    whiten(work.inertia, x)
    acceleration_of(work.inertia, x)
    _bounds(work, n)
    if not (_motors_exceeded(work, n) or _excess(work, n) > BROKEN):
        return 0
    task_metric(work, stacks)
    nearest_acceleration(work.inertia, x, work.bounds)
    for a in range(n):
        work.tau[a] = work.bias[a]
        for b in range(n):
            work.tau[a] += work.M[a, b] * x[b]
        if work.option[KEEP_TORQUE] != 0.0:
            work.tau[a] = min(max(work.tau[a], -work.torque_limit[a]), work.torque_limit[a])
    return _acting(work, n)


@jit
def _acting(work, n):
    """Tell how much each limit acts: what it takes from its joint, as a part of its margin."""
    bits = FILTERED
    taken = work.bounds.taken
    for i in range(work.limit.shape[0]):
        limit, j = work.limit[i], work.limit_joint[i]
        if work.option[LIMIT_BOUND] != 0.0:
            part = taken[j] if limit[SIGN] > 0.0 else taken[n + j]
            work.limit_h[i] = min(part / limit[MARGIN], 1.0)
    for a in range(2 * n, 4 * n):
        if taken[a] > 0.0:
            bits |= SCALED
    if _excess(work, n) > LOST:
        bits |= LIMIT_LOST
    return bits


@jit
def _motors_exceeded(work, n):
    if work.option[KEEP_TORQUE] == 0.0:
        return False
    for a in range(n):
        if abs(work.tau[a]) > work.torque_limit[a] * (1.0 + BROKEN):
            return True
    return False


@jit
def _excess(work, n):
    """The largest excess over what a joint may do, see `opspace.law.excess`."""
    most = -math.inf
    x, lower, upper = work.joint_acceleration, work.bounds.lower, work.bounds.upper
    for a in range(n):
        if upper[a] < UNBOUNDED:
            most = max(most, (x[a] - upper[a]) / max(1.0, abs(upper[a])))
        if lower[a] > -UNBOUNDED:
            most = max(most, (lower[a] - x[a]) / max(1.0, abs(lower[a])))
    return most


@jit
def _bounds(work, n):
    """Least and largest acceleration, and torque beside the bias, of every joint."""
    bounds = work.bounds
    for a in range(n):
        bounds.lower[a], bounds.upper[a] = -math.inf, math.inf
        bounds.least[a], bounds.most[a] = -math.inf, math.inf
        if work.option[KEEP_TORQUE] != 0.0:
            bounds.least[a] = -work.torque_limit[a] - work.bias[a]
            bounds.most[a] = work.torque_limit[a] - work.bias[a]
    if work.option[LIMIT_BOUND] == 0.0:
        return
    for i in range(work.limit.shape[0]):
        limit, j = work.limit[i], work.limit_joint[i]
        if limit[SIGN] > 0.0:
            bounds.upper[j] = limit[COMMAND]
        else:
            bounds.lower[j] = -limit[COMMAND]
