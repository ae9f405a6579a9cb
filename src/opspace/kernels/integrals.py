"""Integral action of tasks, as `opspace.controller.integral`."""

from __future__ import annotations

from opspace.command import Status
from opspace.kernels.algebra import singular_values
from opspace.kernels.columns import (
    FIRST_ROW,
    GOAL_ACCELERATION,
    JOINTS,
    KIND,
    MAX_SPEED,
    MOTION,
    POSE,
    QUANTITY,
    RELEASE_UPPER,
    REST_LOWER,
    REST_RELEASE,
    ROWS,
    SIGMA_LOWER,
    SIGMA_PROFILE,
    SINGULAR,
    SPEED_LIMITED,
    TOOL_AXES,
)
from opspace.kernels.compiled_scalars import fade
from opspace.kernels.motion import measure, selected
from opspace.kernels.walk import slot_bit
from opspace.law.scalars import LONGEST_LESSON
from opspace.machine.jit import jit

LEARNS = int(Status.OK | Status.DIRECTION_OFF | Status.LATE)
"""With anything else in its status a robot has not done what was asked, which teaches nothing."""
DIRECTION_OFF = int(Status.DIRECTION_OFF)


@jit
def forget_sum(work, sums, i):
    """Begin anew with task i."""
    for c in range(6):
        sums.integral[i, c] = 0.0
    for row in range(work.kind[i, FIRST_ROW], work.kind[i, FIRST_ROW] + work.kind[i, ROWS]):
        sums.joint_integral[row] = 0.0


@jit
def push(work, sums):
    """Add the integrals to what tasks are told to accelerate."""
    for i in range(work.kind.shape[0]):
        if sums.ki[i] == 0.0:
            continue
        first, rows = work.kind[i, FIRST_ROW], work.kind[i, ROWS]
        if work.kind[i, KIND] == MOTION:
            for c in range(6):
                work.numbers[i, GOAL_ACCELERATION + c] += sums.integral[i, c]
        elif work.kind[i, KIND] == JOINTS:
            for row in range(first, first + rows):
                work.goal[row, 2] += sums.joint_integral[row]


@jit
def learn(work, sums, status):
    """Add the errors of a tick, as far as the robot could do something about them.

    Args:
        work: `opspace.plan.records.TICK` after a tick.
        sums: `opspace.plan.integral_records.INTEGRALS`, or a record that has its fields.
        status: What happened, in the numbers of `opspace.Status`.
    """
    if not 0.0 < sums.since[0] <= LONGEST_LESSON or status | LEARNS != LEARNS:
        return
    for i in range(work.kind.shape[0]):
        if sums.ki[i] == 0.0 or work.h[i] < 1.0 or _asks_too_much(work, i):
            continue
        s = _only_place(work, i)
        if s < 0 or not _choose(work, sums, i, s, status):
            continue
        if work.kind[i, KIND] == JOINTS:
            _add_joints(work, sums, i)
        else:
            if work.kind[i, TOOL_AXES] != 0:
                measure(work, i)
            _add_motion(work, sums, i)


@jit
def _asks_too_much(work, i):
    """Whether an error asks for more than its speed, as in `opspace.kernels.task_rows`."""
    if work.kind[i, SPEED_LIMITED] == 0:
        return False
    first, rows = work.kind[i, FIRST_ROW], work.kind[i, ROWS]
    group = rows
    if work.kind[i, KIND] == MOTION and work.kind[i, QUANTITY] == POSE:
        group = 3
    for start in range(first, first + rows, max(group, 1)):
        total = 0.0
        for row in range(start, start + group):
            if work.kp[row] > 0.0:
                asked = work.kp[row] / work.kv[row] * work.error[row]
                total += asked * asked
        limit = work.numbers[i, MAX_SPEED + (start - first) // group]
        if total > limit * limit:
            return True
    return False


@jit
def _only_place(work, i):
    """Slot of the only level where task i is, −1 for none or several."""
    found = -1
    for s in range(work.slots.shape[0]):
        if work.slots[s, 1] != work.kind[i, FIRST_ROW] or not work.share[s] > 0.0:
            continue
        if found >= 0 and work.slots[found, 0] != work.slots[s, 0]:
            return -1
        if found < 0:
            found = s
    return found


@jit
def _choose(work, sums, i, s, status):
    """Take the errors of task i, in the directions that are on.

    Returns:
        Whether anything of its level is solved.
    """
    space, depth = work.space, work.slots[s, 0]
    first, rows = work.kind[i, FIRST_ROW], work.kind[i, ROWS]
    highest = depth
    for k in range(work.slots.shape[0]):
        if work.share[k] > 0.0:
            highest = min(highest, work.slots[k, 0])
    count, before = 0, -1
    for k in range(work.slots.shape[0]):
        if work.slots[k, 0] == depth and space.chosen[depth] & slot_bit(k) != 0:
            if work.slots[k, 1] == first and before < 0:
                before = count
            count += work.slots[k, 2]
    solved = space.top[depth] > 0.0
    if status & DIRECTION_OFF == 0 and depth == highest and (before >= 0 or not solved):
        for row in range(first, first + rows):
            sums.learned[row] = work.error[row]
        return True
    if before < 0 or not solved or space.width[depth] == 0:
        return False
    _project(work, sums, i, depth, count, before)
    return True


@jit
def _project(work, sums, i, depth, m, before):
    """Take what directions that are on have of the errors of task i.

    Args:
        work: `opspace.plan.records.TICK`.
        sums: `opspace.plan.integral_records.INTEGRALS`, or a record that has its fields.
        i: Number of the task.
        depth: Its level.
        m: Rows of the level.
        before: Where among them those of the task begin.
    """
    space, option = work.space, work.option
    B, C, Y, sigma = space.kept, space.C, space.Y, space.sigma
    start, free = space.first_kept[depth], space.width[depth]
    wide = m <= free
    for a in range(m):
        for b in range(free):
            if wide:
                C[a, b] = B[start + a, b]
            else:
                C[b, a] = B[start + a, b]
    k = min(m, free)
    singular_values(C, k, max(m, free), Y, sigma)
    first, rows = work.kind[i, FIRST_ROW], work.kind[i, ROWS]
    for r in range(rows):
        sums.learned[first + r] = 0.0
    for j in range(k):
        if sigma[j] == 0.0:
            continue
        if option[SINGULAR] != 0.0:
            here = fade(
                int(option[SIGMA_PROFILE]), sigma[j] * sigma[j], option[SIGMA_LOWER],
                option[RELEASE_UPPER], option[REST_LOWER], option[REST_RELEASE],
                space.unrest_there[depth],
            )  # fmt: skip
            if here < 1.0 - 1e-9:
                continue
        along = 0.0
        for r in range(rows):
            entry = Y[j, before + r] if wide else C[j, before + r] / sigma[j]
            along += entry * work.row_weight[first + r] * work.error[first + r]
        for r in range(rows):
            entry = Y[j, before + r] if wide else C[j, before + r] / sigma[j]
            sums.learned[first + r] += entry * along / work.row_weight[first + r]


@jit
def _add_joints(work, sums, i):
    """Add to the integrals of a task of joints: z ← clip(z + k_i Δt e, ± k_p e_max)."""
    first, rows = work.kind[i, FIRST_ROW], work.kind[i, ROWS]
    gain = sums.ki[i] * sums.since[0]
    for row in range(first, first + rows):
        most = sums.max_integral[i] * work.kp[row]
        moved = sums.joint_integral[row] + gain * sums.learned[row]
        sums.joint_integral[row] = min(max(moved, -most), most)


@jit
def _add_motion(work, sums, i):
    """Add to those of a task of motion, in the coordinates of that."""
    first, rows = work.kind[i, FIRST_ROW], work.kind[i, ROWS]
    gain, size = sums.ki[i] * sums.since[0], 3
    if work.kind[i, QUANTITY] == POSE:
        size = 6
    for c in range(size):
        moved, most = sums.integral[i, c], 0.0
        for row in range(first, first + rows):
            factor = selected(work, i, row, c)
            moved += gain * factor * sums.learned[row]
            most += abs(factor) * sums.max_integral[i] * work.kp[row]
        sums.integral[i, c] = min(max(moved, -most), most)
