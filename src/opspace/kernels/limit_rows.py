"""Joint limits of one tick, as `opspace.controller.limit_task_sets` finds them, and what keeps them."""

from __future__ import annotations

import math

from opspace.command import Status
from opspace.kernels.columns import (
    BUFFER,
    KEEP_TORQUE,
    LIMIT_BUFFER,
    LIMIT_K1,
    LIMIT_K2,
    LIMIT_KP,
    LIMIT_MODE,
    LIMIT_PROFILE,
    LIMIT_RETURN_SPEED,
)
from opspace.kernels.inertia import acceleration_of, whiten
from opspace.kernels.profiles import profile
from opspace.kernels.projection import nearest_acceleration
from opspace.kernels.scalars import rises
from opspace.law.nearest import BROKEN, LOST
from opspace.machine.jit import jit

FILTERED = int(Status.FILTERED)
LIMIT_LOST = int(Status.LIMIT_LOST)

# Columns of Tick.limit.
SIGN, POSITION, BRAKE, MARGIN, COMMAND, SPEED, DISTURBANCE = range(7)


@jit
def begin_limits(k):
    """Evaluate what every limit asks for; in mode ``buffer`` also how much it takes part."""
    for i in range(k.limit.shape[0]):
        limit = k.limit[i]
        j = k.limit_joint[i]
        distance = limit[SIGN] * (limit[POSITION] - k.q[j])
        towards = limit[SIGN] * k.v[j]
        k.limit_h[i] = 0.0
        k.limit_wanted[i] = -math.inf
        if k.option[LIMIT_MODE] == BUFFER:
            kp, buffer = k.option[LIMIT_KP], k.option[LIMIT_BUFFER]
            limit[COMMAND] = kp * (distance - buffer) - 2.0 * math.sqrt(kp) * towards
        else:
            allowed, slope = _allowed_speed(k.option, distance, limit[BRAKE])
            k2 = k.option[LIMIT_K2]
            stopping = -towards * slope + k2 * (allowed - towards)
            limit[COMMAND] = min(stopping, k2 * (limit[SPEED] - towards)) - limit[DISTURBANCE]


@jit
def _allowed_speed(option, d, a):
    """v_adm(d) and its slope, see `opspace.JointLimits`."""
    k1 = option[LIMIT_K1]
    if d < 0.0:
        most = option[LIMIT_RETURN_SPEED]
        x = k1 * d / most
        return most * math.tanh(x), k1 / math.cosh(min(-x, 300.0)) ** 2
    knee = a / (k1 * k1)
    if d <= knee:
        return k1 * d, k1
    v = math.sqrt(2.0 * a * (d - 0.5 * knee))
    return v, a / v


@jit
def insert_limits(k):
    """Find which limits take part for the accelerations found, at least as much as before.

    Returns:
        Whether anything changed.
    """
    changed = False
    shape = int(k.option[LIMIT_PROFILE])
    for i in range(k.limit.shape[0]):
        limit = k.limit[i]
        j = k.limit_joint[i]
        if k.option[LIMIT_MODE] == BUFFER:
            h, wanted = _by_position(k, limit, k.q[j], k.v[j], shape), limit[COMMAND]
        else:
            other = limit[SIGN] * k.joint_acceleration[j]
            command, margin = limit[COMMAND], limit[MARGIN]
            h = profile(shape, (other - (command - margin)) / margin)
            h = max(h, k.limit_h[i])
            wanted = max(min(other, command), k.limit_wanted[i])
        if h <= 0.0:
            continue
        if rises(h, k.limit_h[i]) or rises(wanted, k.limit_wanted[i]):
            changed = True
            k.limit_h[i], k.limit_wanted[i] = h, wanted
    return changed


@jit
def _by_position(k, limit, q, v, shape):
    towards = max(limit[SIGN] * v, 0.0)
    inner = k.option[LIMIT_BUFFER] + towards * towards / (2.0 * limit[BRAKE])
    distance = limit[SIGN] * (limit[POSITION] - q)
    return profile(shape, (distance - inner) / (0.0 - inner))


@jit
def keep_bounds(k):
    """Replace the torque by the nearest one with which no joint accelerates more than it may.

    Returns:
        What happened, in the numbers of `opspace.Status`.
    """
    if k.option[LIMIT_MODE] == BUFFER:
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
