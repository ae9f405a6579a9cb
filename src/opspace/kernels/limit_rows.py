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

# Columns of Tick.limit: side, rad, rad/s², rad/s², rad/s², rad/s, rad/s².
SIGN, POSITION, BRAKE, MARGIN, COMMAND, SPEED, DISTURBANCE = range(7)


@jit
def begin_limits(work):
    """Evaluate what every limit asks for, rad/s², into its row of ``limit`` (limits, 7)."""
    for i in range(work.limit.shape[0]):
        limit = work.limit[i]
        j = work.limit_joint[i]
        distance = limit[SIGN] * (limit[POSITION] - work.q[j])
        towards = limit[SIGN] * work.v[j]
        work.limit_h[i] = 0.0
        work.limit_wanted[i] = -math.inf
        if work.option[LIMIT_MODE] == BUFFER:
            kp, buffer = work.option[LIMIT_KP], work.option[LIMIT_BUFFER]
            limit[COMMAND] = kp * (distance - buffer) - 2.0 * math.sqrt(kp) * towards
        else:
            allowed, slope = _allowed_speed(work.option, distance, limit[BRAKE])
            k2 = work.option[LIMIT_K2]
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
def insert_limits(work):
    """Find which limits take part for the accelerations found, at least as much as before.

    Reads joint_acceleration (n,) and limit; writes limit_h and limit_wanted (limits,), rad/s².

    Returns:
        Whether anything changed.
    """
    changed = False
    shape = int(work.option[LIMIT_PROFILE])
    for i in range(work.limit.shape[0]):
        limit = work.limit[i]
        j = work.limit_joint[i]
        if work.option[LIMIT_MODE] == BUFFER:
            h, wanted = _by_position(work, limit, work.q[j], work.v[j], shape), limit[COMMAND]
        else:
            other = limit[SIGN] * work.joint_acceleration[j]
            command, margin = limit[COMMAND], limit[MARGIN]
            h = profile(shape, (other - (command - margin)) / margin)
            h = max(h, work.limit_h[i])
            wanted = max(min(other, command), work.limit_wanted[i])
        if h <= 0.0:
            continue
        if rises(h, work.limit_h[i]) or rises(wanted, work.limit_wanted[i]):
            changed = True
            work.limit_h[i], work.limit_wanted[i] = h, wanted
    return changed


@jit
def _by_position(work, limit, q, v, shape):
    towards = max(limit[SIGN] * v, 0.0)
    inner = work.option[LIMIT_BUFFER] + towards * towards / (2.0 * limit[BRAKE])
    distance = limit[SIGN] * (limit[POSITION] - q)
    return profile(shape, (distance - inner) / (0.0 - inner))


@jit
def keep_bounds(work):
    """Replace the torque by the nearest one with which no joint accelerates more than it may.

    Reads and writes tau (n,), N·m, and joint_acceleration (n,), rad/s².

    Returns:
        What happened, in the numbers of `opspace.Status`.
    """
    if work.option[LIMIT_MODE] == BUFFER:
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
