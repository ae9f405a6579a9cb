"""Terms of the built-in tasks: rows J q̈ = f̃ with f̃ = f* − J̇ q̇ (Eq. 3, 24)."""

from __future__ import annotations

import math

from opspace.kernels.columns import (
    FIRST_ROW,
    GOAL_ACCELERATION,
    GOAL_POSITION,
    GOAL_ROTATION,
    GOAL_VELOCITY,
    JOINTS,
    KIND,
    MAX_SPEED,
    MOMENTUM,
    MOTION,
    ORIENTATION,
    POSE,
    POSITION,
    QUANTITY,
    REMEMBERS,
    ROWS,
    SPEED_LIMITED,
    SPRING,
    TURN,
)
from opspace.kernels.compiled_scalars import (
    error_length,
    goes_on,
    speed_scale,
    without_turns,
)
from opspace.kernels.momentum_rows import momentum_task
from opspace.kernels.motion import A, P, R, V, measure, move_joints, selected
from opspace.kernels.spring_rows import add_spring
from opspace.kernels.whole_vectors import add, fill, put, whole
from opspace.law.scalars import SIGNS
from opspace.machine.jit import jit


@jit
def evaluate_tasks(work, moved):
    """Fill J (rows, n), drift, error and wanted (rows,), rad or m and s, of every built-in task.

    Args:
        work: `TICK`; those of force tasks are there already.
        moved: Whether the bodies' velocities are known.
    """
    for i in range(work.kind.shape[0]):
        if work.kind[i, KIND] == MOTION:
            if not moved:
                move_joints(work)
                moved = True
            measure(work, i)
            _motion_task(work, i)
        elif work.kind[i, KIND] == JOINTS:
            _joint_task(work, i)
        elif work.kind[i, KIND] == MOMENTUM:
            momentum_task(work, i)


@jit
def joint_position(work, j):
    """Position of the joint with velocity coordinate j; before it is a quaternion of one number more."""
    return work.q[j + work.q.shape[0] - work.v.shape[0]]


@jit
def _joint_task(work, i):
    """f* = a_d + kv (v_d − v) + kp (q_d − q) of the chosen joints."""
    first, rows = work.kind[i, FIRST_ROW], work.kind[i, ROWS]
    for row in range(first, first + rows):
        work.error[row] = work.goal[row, 0] - joint_position(work, work.coordinate[row])
        work.drift[row] = 0.0
    _leave_out_turns(work, i, first, rows)
    scale = 1.0
    if work.kind[i, SPEED_LIMITED] != 0:
        scale = _within_speed(work, first, first + rows, work.numbers[i, MAX_SPEED])
    for row in range(first, first + rows):
        rate = work.goal[row, 1] - work.v[work.coordinate[row]]
        work.wanted[row] = (
            work.goal[row, 2] + work.kv[row] * rate + work.kp[row] * (work.error[row] * scale)
        )


@jit
def _leave_out_turns(work, i, first, rows):
    """Leave whole turns out of the errors of joints without end (`opspace.tasks.way_round`)."""
    number, known = work.numbers[i], work.kind[i, REMEMBERS] != 0
    before, now = 0, 0
    for k in range(rows):
        if k % SIGNS == 0:
            before, now = int(number[TURN + k // SIGNS]), 0
        row, sign = first + k, 1 << (k % SIGNS)
        if work.endless[row] != 0:
            error = without_turns(work.error[row], known, before & sign != 0)
            work.error[row] = error
            if error < 0.0:
                now |= sign
        number[TURN + k // SIGNS] = now
    work.kind[i, REMEMBERS] = 1


@jit
def _motion_task(work, i):
    kind, number, x, e = work.kind[i], work.numbers[i], work.motion[0], work.motion_error
    block, size = 0, 3
    if kind[QUANTITY] == ORIENTATION:
        block = 3
    elif kind[QUANTITY] == POSE:
        size = 6
    if kind[QUANTITY] != ORIENTATION:
        for c in range(3):
            e[c] = number[GOAL_POSITION + c] - x[P + c]
    if kind[QUANTITY] != POSITION:
        _rotation_error(kind, number, x, e, size - 3)
    first, rows = kind[FIRST_ROW], kind[ROWS]
    for row in range(first, first + rows):
        _project(work, i, row, block, size, x, e)
    _accelerations(work, i, first, rows, size)
    if kind[SPRING] != 0:
        add_spring(work, i, size)


@jit
def _project(work, i, row, block, size, x, e):
    """One task row: the selected combination of the motion's rows, in world or tool axes."""
    number = work.numbers[i]
    J, end = work.J[row], whole(work.v.shape[0])
    empty = True
    error, drift, rate, ahead = 0.0, 0.0, 0.0, 0.0
    for c in range(size):
        factor = selected(work, i, row, c)
        if factor == 0.0:
            continue
        source = block + c
        if empty:
            put(factor, work.motion_J[0, source], J, 0, end)
            empty = False
        else:
            add(factor, work.motion_J[0, source], J, 0, end)
        # Tool axes turn with the tool, which takes ω × ẋ from the drift and from the desired
        # acceleration alike: it cancels in f* − J̇ q̇ and is left out of both.
        drift += factor * x[A + source]
        error += factor * e[c]
        rate += factor * (number[GOAL_VELOCITY + c] - x[V + source])
        ahead += factor * number[GOAL_ACCELERATION + c]
    if empty:
        fill(0.0, J, 0, end)
    work.error[row] = error
    work.drift[row] = drift
    work.wanted[row] = ahead + work.kv[row] * rate


@jit
def _accelerations(work, i, first, rows, size):
    """Add kp (x_d − x), within the speed that it may ask for."""
    limited = work.kind[i, SPEED_LIMITED] != 0
    group = 3 if size == 6 else rows
    for start in range(first, first + rows, max(group, 1)):
        scale = 1.0
        if limited:
            which = (start - first) // group
            scale = _within_speed(work, start, start + group, work.numbers[i, MAX_SPEED + which])
        for row in range(start, start + group):
            work.wanted[row] += work.kp[row] * (work.error[row] * scale)


@jit
def _within_speed(k, first, end, limit):
    """Factor on the error with which kp/kv · error is no faster than the limit (Khatib 1987)."""
    total = 0.0
    for row in range(first, end):
        if k.kp[row] > 0.0:
            asked = k.kp[row] / k.kv[row] * k.error[row]
            total += asked * asked
    return speed_scale(math.sqrt(total), limit)


@jit
def _rotation_error(kind, number, x, e, at):
    """Rotation vector of R_d Rᵀ, continuous past half a turn (`opspace.tasks.rotation_error`)."""
    E = (
        _row(number, x, 0, 0), _row(number, x, 0, 1), _row(number, x, 0, 2),
        _row(number, x, 1, 0), _row(number, x, 1, 1), _row(number, x, 1, 2),
        _row(number, x, 2, 0), _row(number, x, 2, 1), _row(number, x, 2, 2),
    )  # fmt: skip
    w, a, b, c = _quaternion(E)
    if kind[REMEMBERS] != 0:
        agreement = (
            w * number[TURN] + a * number[TURN + 1] + b * number[TURN + 2] + c * number[TURN + 3]
        )
        if goes_on(agreement, w):
            w, a, b, c = -w, -a, -b, -c
    kind[REMEMBERS] = 1
    number[TURN], number[TURN + 1], number[TURN + 2], number[TURN + 3] = w, a, b, c
    sine = math.sqrt(a * a + b * b + c * c)
    scale = error_length(2.0 * math.atan2(sine, w)) / sine if sine > 1e-150 else 2.0 / w
    e[at], e[at + 1], e[at + 2] = scale * a, scale * b, scale * c


@jit
def _row(number, x, i, j):
    """Entry (i, j) of R_d Rᵀ."""
    total = 0.0
    for c in range(3):
        total += number[GOAL_ROTATION + 3 * i + c] * x[R + 3 * j + c]
    return total


@jit
def _quaternion(E):
    """Unit quaternion wxyz of a rotation, w >= 0 (Shepperd 1978)."""
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = E
    trace = r00 + r11 + r22
    if trace >= r00 and trace >= r11 and trace >= r22:
        w, x, y, z = 1.0 + trace, r21 - r12, r02 - r20, r10 - r01
    elif r00 >= r11 and r00 >= r22:
        w, x, y, z = r21 - r12, 1.0 + r00 - r11 - r22, r01 + r10, r02 + r20
    elif r11 >= r22:
        w, x, y, z = r02 - r20, r01 + r10, 1.0 - r00 + r11 - r22, r12 + r21
    else:
        w, x, y, z = r10 - r01, r02 + r20, r12 + r21, 1.0 - r00 - r11 + r22
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    if w < 0.0:
        norm = -norm
    return w / norm, x / norm, y / norm, z / norm
