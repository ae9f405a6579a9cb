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
from opspace.kernels.inertia import acceleration_of, whiten
from opspace.kernels.projection import nearest_acceleration
from opspace.kernels.scalars import limit_command, limit_presence, rises
from opspace.law.scalars import BROKEN, LOST
from opspace.machine.jit import jit

FILTERED = int(Status.FILTERED)
LIMIT_LOST = int(Status.LIMIT_LOST)

# Columns of Tick.limit.
SIGN, POSITION, BRAKE, MARGIN, COMMAND, SPEED, DISTURBANCE = range(7)


@jit
def begin_limits(k):
    """Evaluate what every limit asks for; nothing is known yet about how much it takes part."""
    option = k.option
    for i in range(k.limit.shape[0]):
        limit = k.limit[i]
        j = k.limit_joint[i]
        k.limit_h[i] = 0.0
        k.limit_wanted[i] = -math.inf
        limit[COMMAND] = limit_command(
            int(option[LIMIT_LAW]),
            limit[SIGN] * (limit[POSITION] - k.q[j]),
            limit[SIGN] * k.v[j],
            limit[BRAKE],
            limit[SPEED],
            option[LIMIT_K1],
            option[LIMIT_K2],
            option[LIMIT_KP],
            option[LIMIT_BUFFER],
        )
        limit[COMMAND] -= limit[DISTURBANCE]


@jit
def insert_limits(k):
    """Find which limits take part for the accelerations found, at least as much as before.

    Returns:
        Whether anything changed.
    """
    changed = False
    option = k.option
    for i in range(k.limit.shape[0]):
        limit = k.limit[i]
        j = k.limit_joint[i]
        h, wanted = limit_presence(
            int(option[LIMIT_LAW]),
            limit[SIGN] * (limit[POSITION] - k.q[j]),
            limit[SIGN] * k.v[j],
            limit[BRAKE],
            option[LIMIT_BUFFER],
            limit[SIGN] * k.joint_acceleration[j],
            limit[COMMAND],
            limit[MARGIN],
            int(option[LIMIT_PROFILE]),
        )
        h, wanted = max(h, k.limit_h[i]), max(wanted, k.limit_wanted[i])
        if h <= 0.0:
            continue
        if rises(h, k.limit_h[i]) or rises(wanted, k.limit_wanted[i]):
            changed = True
            k.limit_h[i], k.limit_wanted[i] = h, wanted
    return changed


@jit
def keep_bounds(k):
    """Replace the torque by the nearest one with which no joint accelerates more than it may.

    Returns:
        What happened, in the numbers of `opspace.Status`.
    """
    if k.option[LIMIT_BOUND] == 0.0:
        return 0
    n = k.v.shape[0]
    x = k.joint_acceleration
    for a in range(n):
        x[a] = k.tau[a] - k.bias[a]
    whiten(k.inertia, x)
    acceleration_of(k.inertia, x)
    if not _excess(k) > BROKEN:
        return 0
    _bounds(k, n)
    nearest_acceleration(k.inertia, x, k.bounds)
    for a in range(n):
        k.tau[a] = k.bias[a]
        for b in range(n):
            k.tau[a] += k.M[a, b] * x[b]
        if k.option[KEEP_TORQUE] != 0.0:
            k.tau[a] = min(max(k.tau[a], -k.torque_limit[a]), k.torque_limit[a])
    return FILTERED | LIMIT_LOST if _excess(k) > LOST else FILTERED


@jit
def _excess(k):
    """The largest excess over what a joint may do, see `opspace.law.excess`."""
    most = -math.inf
    for i in range(k.limit.shape[0]):
        limit = k.limit[i]
        over = limit[SIGN] * k.joint_acceleration[k.limit_joint[i]] - limit[COMMAND]
        most = max(most, over / max(1.0, abs(limit[COMMAND])))
    return most


@jit
def _bounds(k, n):
    """Least and largest acceleration, and torque beside the bias, of every joint."""
    b = k.bounds
    for a in range(n):
        b.lower[a], b.upper[a] = -math.inf, math.inf
        b.least[a], b.most[a] = -math.inf, math.inf
        if k.option[KEEP_TORQUE] != 0.0:
            b.least[a] = -k.torque_limit[a] - k.bias[a]
            b.most[a] = k.torque_limit[a] - k.bias[a]
    for i in range(k.limit.shape[0]):
        limit, j = k.limit[i], k.limit_joint[i]
        if limit[SIGN] > 0.0:
            b.upper[j] = limit[COMMAND]
        else:
            b.lower[j] = -limit[COMMAND]
