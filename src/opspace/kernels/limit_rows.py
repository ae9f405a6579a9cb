"""Joint limits of one tick, as `opspace.controller.limit_task_sets` finds them, and what keeps them."""

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
from opspace.kernels.compiled_scalars import limit_command, limit_presence, rises
from opspace.kernels.inertia import acceleration_of, whiten
from opspace.kernels.projection import nearest_acceleration
from opspace.law.scalars import BROKEN, LOST
from opspace.machine.jit import jit

FILTERED = int(Status.FILTERED)
LIMIT_LOST = int(Status.LIMIT_LOST)

# Columns of Tick.limit: side, rad, rad/s², rad/s², rad/s², rad/s, rad/s².
SIGN, POSITION, BRAKE, MARGIN, COMMAND, SPEED, DISTURBANCE = range(7)


@jit
def begin_limits(work):
    """Evaluate what every limit asks for, rad/s², into its row of ``limit`` (limits, 7)."""
    option = work.option
    for i in range(work.limit.shape[0]):
        limit = work.limit[i]
        j = work.limit_joint[i]
        work.limit_h[i] = 0.0
        work.limit_wanted[i] = -math.inf
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
    """Find which limits take part for the accelerations found, at least as much as before.

    Reads joint_acceleration (n,) and limit; writes limit_h and limit_wanted (limits,), rad/s².

    Returns:
        Whether anything changed.
    """
    changed = False
    option = work.option
    for i in range(work.limit.shape[0]):
        limit = work.limit[i]
        j = work.limit_joint[i]
        h, wanted = limit_presence(
            int(option[LIMIT_LAW]),
            limit[SIGN] * (limit[POSITION] - work.q[j]),
            limit[SIGN] * work.v[j],
            limit[BRAKE],
            option[LIMIT_BUFFER],
            limit[SIGN] * work.joint_acceleration[j],
            limit[COMMAND],
            limit[MARGIN],
            int(option[LIMIT_PROFILE]),
        )
        h, wanted = max(h, work.limit_h[i]), max(wanted, work.limit_wanted[i])
        if h <= 0.0:
            continue
        if rises(h, work.limit_h[i]) or rises(wanted, work.limit_wanted[i]):
            changed = True
            work.limit_h[i], work.limit_wanted[i] = h, wanted
    return changed


@jit
def keep_bounds(work):
    """Replace the torque by the nearest one with which no joint accelerates more than it may.

    Reads and writes tau (n,), N·m, and joint_acceleration (n,), rad/s².

    Returns:
        What happened, in the numbers of `opspace.Status`.
    """
    if work.option[LIMIT_BOUND] == 0.0:
        return 0
    n = work.v.shape[0]
    x = work.joint_acceleration
    for a in range(n):
        x[a] = work.tau[a] - work.bias[a]
    whiten(work.inertia, x)
    acceleration_of(work.inertia, x)
    if not _excess(work) > BROKEN:
        return 0
    _bounds(work, n)
    nearest_acceleration(work.inertia, x, work.bounds)
    for a in range(n):
        work.tau[a] = work.bias[a]
        for b in range(n):
            work.tau[a] += work.M[a, b] * x[b]
        if work.option[KEEP_TORQUE] != 0.0:
            work.tau[a] = min(max(work.tau[a], -work.torque_limit[a]), work.torque_limit[a])
    return FILTERED | LIMIT_LOST if _excess(work) > LOST else FILTERED


@jit
def _excess(work):
    """The largest excess over what a joint may do, see `opspace.law.excess`."""
    most = -math.inf
    for i in range(work.limit.shape[0]):
        limit = work.limit[i]
        over = limit[SIGN] * work.joint_acceleration[work.limit_joint[i]] - limit[COMMAND]
        most = max(most, over / max(1.0, abs(limit[COMMAND])))
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
    for i in range(work.limit.shape[0]):
        limit, j = work.limit[i], work.limit_joint[i]
        if limit[SIGN] > 0.0:
            bounds.upper[j] = limit[COMMAND]
        else:
            bounds.lower[j] = -limit[COMMAND]
