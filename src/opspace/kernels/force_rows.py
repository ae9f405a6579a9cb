"""Terms of force tasks, and what they learn of their contacts (`opspace.tasks.force`)."""

from __future__ import annotations

import math

from opspace.command import Status
from opspace.kernels.columns import (
    FIRST_ROW,
    FORCE,
    KIND,
    PRESS,
    ROWS,
    TOUCH,
)
from opspace.kernels.compiled_scalars import (
    approach,
    confidence,
    floor_of,
    integral_after,
    is_fresh,
    lag,
    passed,
)
from opspace.kernels.inertia import whiten
from opspace.kernels.motion import A, P, V, cross_add, measure, move_joints, selected
from opspace.law.press_columns import (
    AHEAD,
    ALONG,
    APPROACH_SPEED,
    BEGUN,
    COMMANDED,
    CONFIDENCE,
    EARLIER,
    EARLIER_AHEAD,
    EARLIER_TRAVEL,
    FLOOR,
    FOLLOWED,
    FORCE_RATE,
    FORCES,
    FRESH,
    FRICTION,
    FROZEN,
    GIVEN,
    GIVEN_AT,
    INTEGRAL,
    KI,
    KP,
    MAX_INTEGRAL,
    MEASURED,
    OFF,
    ON,
    PASSED,
    PUSH,
    SIGMA,
    SLIDING,
    SPEED,
    TRAVEL,
    WANTED,
    WHEN,
    WRENCH,
)
from opspace.law.scalars import FRICTION_FILTER, LEVER, SLIDING_SPEED, WRENCH_FILTER
from opspace.machine.jit import jit

STALE = int(Status.WRENCH_STALE)
HARMLESS = int(Status.OK | Status.DIRECTION_OFF | Status.LATE)
"""What happens without a torque that is other than the tasks asked for."""


@jit
def press(t, work):
    """Learn from the wrenches at t [s], then fill J, drift, error, wanted and torque of force tasks.

    Returns:
        Whether the bodies' velocities are known, see `opspace.kernels.motion.move_joints`.
    """
    moved = False
    for i in range(work.kind.shape[0]):
        if work.kind[i, KIND] == FORCE:
            if not moved:
                move_joints(work)
                moved = True
            measure(work, i)
            row = work.press[work.kind[i, PRESS]]
            _rows(work, i)
            _learn(t, work, i, row)
            _terms(work, i, row)
    return moved


@jit
def touched(work, i):
    """Activation of task i that is no time's: its own, with the confidence of a contact."""
    own, which = work.own[i], work.kind[i, TOUCH]
    if which > 0:
        return own * work.press[which - 1, CONFIDENCE]
    if which < 0:
        return 1.0 - (1.0 - work.press[-which - 1, CONFIDENCE]) * (1.0 - own)
    return own


@jit
def stale(work):
    """Bits of the status that force tasks have something to say about."""
    for p in range(work.press.shape[0]):
        if work.press[p, FRESH] == 0.0:
            return STALE
    return 0


@jit
def freeze(work, bits):
    """Keep integrals where they are in the next tick if this one asked for more than there is."""
    for p in range(work.press.shape[0]):
        work.press[p, FROZEN] = 1.0 if bits & ~HARMLESS != 0 else 0.0


@jit
def _rows(work, i):
    """Rows of task i in world axes (rows, 6), their Jacobian and drift, and their speed in `error`."""
    x, axes = work.motion[0], work.press_axes
    first, rows = work.kind[i, FIRST_ROW], work.kind[i, ROWS]
    for r in range(rows):
        row = first + r
        for a in range(work.v.shape[0]):
            work.J[row, a] = 0.0
        work.drift[row] = work.error[row] = 0.0
        for c in range(6):
            factor = selected(work, i, row, c)
            axes[r, c] = factor
            if factor == 0.0:
                continue
            for a in range(work.v.shape[0]):
                work.J[row, a] += factor * work.motion_J[0, c, a]
            work.drift[row] += factor * x[A + c]
            work.error[row] += factor * x[V + c]


@jit
def _learn(t, work, i, row):
    """Bring what a force task remembers up to time t."""
    dt = _begin(t, work, i, row)
    rows, axes = work.kind[i, ROWS], work.press_axes
    for r in range(rows):
        scale = row[FORCE_RATE] * dt
        if r >= row[FORCES]:
            scale *= LEVER
        away = row[WANTED + r] - row[PUSH + r]
        row[PUSH + r] += min(max(away, -scale), scale)
    fresh = is_fresh(t - row[GIVEN_AT])
    row[FRESH] = 1.0 if fresh else 0.0
    if fresh:
        part = lag(dt, WRENCH_FILTER)
        for c in range(6):
            row[WRENCH + c] += part * (row[GIVEN + c] - row[WRENCH + c])
    for r in range(rows):
        total = 0.0
        for c in range(6):
            total += axes[r, c] * row[WRENCH + c]
        row[MEASURED + r] = total
    if fresh:
        _feel(rows, row, dt)
        _rub(work, rows, row, dt)
    for r in range(rows):
        missing = row[PUSH + r] - row[MEASURED + r]
        row[COMMANDED + r] = row[PUSH + r] + row[KP] * missing + row[INTEGRAL + r]


@jit
def _begin(t, work, i, row):
    """Begin the tick at time t; how long after the one before, s."""
    dt = 0.0
    if row[BEGUN] != 0.0:
        dt = passed(t, row[WHEN])
        row[EARLIER], row[EARLIER_TRAVEL] = row[CONFIDENCE], row[TRAVEL]
        for c in range(3):
            row[EARLIER_AHEAD + c] = row[AHEAD + c]
    else:
        for c in range(EARLIER, GIVEN):
            row[c] = 0.0
        for r in range(work.kind[i, ROWS]):
            row[INTEGRAL + r], row[PUSH + r] = 0.0, row[WANTED + r]
        for c in range(6):
            row[WRENCH + c] = row[GIVEN + c]
        for c in range(3):
            row[ALONG + c], row[SLIDING + c] = 0.0, 0.0
        row[BEGUN] = 1.0
    row[WHEN], row[PASSED] = t, dt
    return dt


@jit
def _size(row):
    """Length of the force, N."""
    total = 0.0
    for r in range(int(row[FORCES])):
        total += row[PUSH + r] * row[PUSH + r]
    return math.sqrt(total)


@jit
def _direction(row, size, r):
    """Entry r of where the task presses."""
    if size == 0.0 or r >= row[FORCES]:
        return 0.0
    return row[PUSH + r] / size


@jit
def _feel(rows, row, dt):
    """Learn confidence and integral from the filtered wrench."""
    size, pressed = _size(row), 0.0
    for r in range(rows):
        pressed += _direction(row, size, r) * row[MEASURED + r]
    c = confidence(row[CONFIDENCE], pressed, row[OFF], row[ON], dt)
    row[CONFIDENCE] = c
    if row[FROZEN] != 0.0:
        return
    for r in range(rows):
        bound = row[MAX_INTEGRAL]
        if r >= row[FORCES]:
            bound *= LEVER
        force = row[PUSH + r]
        missing = force - row[MEASURED + r]
        row[INTEGRAL + r] = integral_after(row[INTEGRAL + r], missing, force, bound, row[KI], c, dt)


@jit
def _rub(work, rows, row, dt):
    """Learn the force along the surface, which turns with the direction of sliding."""
    x = work.motion[0]
    before = row[SLIDING], row[SLIDING + 1], row[SLIDING + 2]
    total = SLIDING_SPEED * SLIDING_SPEED
    for k in range(3):
        row[SLIDING + k] = _tangential(work, rows, x, V, k)
        total += row[SLIDING + k] * row[SLIDING + k]
    size = math.sqrt(total)
    for k in range(3):
        row[SLIDING + k] /= size
    if dt > 0.0:
        a, b, c = before
        x1, x2, x3 = row[SLIDING], row[SLIDING + 1], row[SLIDING + 2]
        t1, t2, t3 = b * x3 - c * x2, c * x1 - a * x3, a * x2 - b * x1
        fx, fy, fz = row[ALONG], row[ALONG + 1], row[ALONG + 2]
        cross_add(row, ALONG, t1, t2, t3, fx, fy, fz)
    part = lag(dt, FRICTION_FILTER)
    for k in range(3):
        now = _tangential(work, rows, row, WRENCH, k)
        row[ALONG + k] += part * (now - row[ALONG + k])


@jit
def _tangential(work, rows, x, at, k):
    """Entry k of the vector x[at:at + 3] along the surface: (1 − Nᵀ N) x with the linear rows N."""
    axes, found = work.press_axes, x[at + k]
    for r in range(rows):
        along = 0.0
        for j in range(3):
            along += axes[r, j] * x[at + j]
        found -= axes[r, k] * along
    return found


@jit
def _terms(work, i, row):
    """Balanced torque, commanded acceleration and error; the speed of the rows is in `error`."""
    first, rows, n = work.kind[i, FIRST_ROW], work.kind[i, ROWS], work.v.shape[0]
    c, size = row[CONFIDENCE], _size(row)
    _approach(work, i, row, size)
    for a in range(n):
        total = 0.0
        for r in range(rows):
            total += work.J[first + r, a] * row[COMMANDED + r]
        if row[FRICTION] != 0.0:
            for k in range(3):
                total += work.motion_J[0, k, a] * row[ALONG + k]
        work.torque[i, a] = c * total
    for r in range(rows):
        ahead = (1.0 - c) * row[SPEED] * _direction(row, size, r)
        work.wanted[first + r] = work.kv[first + r] * (ahead - work.error[first + r])
        work.error[first + r] = row[PUSH + r] - row[MEASURED + r]


@jit
def _approach(work, i, row, size):
    """Find how fast the tool may come, and how far."""
    first, rows, n = work.kind[i, FIRST_ROW], work.kind[i, ROWS], work.v.shape[0]
    least, most = work.kv[first], work.kv[first]
    for k in range(3):
        row[AHEAD + k] = 0.0
    # The row along the force; whitened, its square is σ.
    for a in range(n):
        work.Jw[first, a] = 0.0
    for r in range(rows):
        least, most = min(least, work.kv[first + r]), max(most, work.kv[first + r])
        part = _direction(row, size, r)
        for k in range(3):
            row[AHEAD + k] += part * work.press_axes[r, k]
        for a in range(n):
            work.Jw[first, a] += part * work.J[first + r, a]
    whiten(work.inertia, work.Jw[first])
    sigma, travel = 0.0, 0.0
    for a in range(n):
        sigma += work.Jw[first, a] * work.Jw[first, a]
    for k in range(3):
        travel += row[AHEAD + k] * work.motion[0, P + k]
    fastest, slope = min(row[APPROACH_SPEED], sigma * size / most), 0.25 * least
    row[SIGMA], row[TRAVEL] = sigma, travel
    row[FLOOR] = floor_of(row[FLOOR], travel, row[CONFIDENCE], fastest / slope, row[PASSED])
    row[SPEED] = approach(row[FLOOR], row[FOLLOWED], travel, fastest, slope)
