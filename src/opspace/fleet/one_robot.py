"""One robot of a fleet in one tick, in the language of kernels: what it is told, tick, answer."""

from __future__ import annotations

import math

from opspace.command import Status
from opspace.fleet.led_targets import forget_way, lead, look_at_robot
from opspace.fleet.wrenches_of_robot import (
    STALE,
    forget_no_number,
    forget_touch,
    is_stale,
    press_usable,
    take_wrenches,
)
from opspace.kernels.columns import (
    FIRST_ROW,
    FORCE,
    GOAL_ACCELERATION,
    GOAL_POSITION,
    GOAL_ROTATION,
    GOAL_VELOCITY,
    JOINTS,
    KIND,
    MOTION,
    POSITION,
    PROFILE,
    QUANTITY,
    RAMP,
    REMEMBERS,
    ROWS,
    SOLVE,
    SPRING,
    TURN,
)
from opspace.kernels.compiled_scalars import ramp
from opspace.kernels.integrals import forget_sum, learn, push
from opspace.kernels.many_states import brake
from opspace.kernels.motion import P, R, measure
from opspace.kernels.task_rows import _quaternion
from opspace.kernels.tick import tick
from opspace.law.scalars import LARGEST_STEP, MOST_UNREST

FAULT = int(Status.FAULT)
SAME_TARGET = math.cos(LARGEST_STEP)


def robot_tick(work, robot):
    """Compute the torque of one robot, at a time from which its activations count.

    Args:
        work: `opspace.plan.records.TICK`, with q, v and the activations in time.
        robot: `opspace.fleet.robot_record.ROBOT`.
    """
    _begin(work, robot)
    _find(work, robot)
    lead(work, robot)
    for i in range(work.kind.shape[0]):
        if work.kind[i, KIND] == MOTION:
            _take_motion(work, robot, i)
            if work.kind[i, SPRING] != 0:
                _take_spring(work, robot, i)
        elif work.kind[i, KIND] == JOINTS:
            _take_joints(work, robot, i)
    push(work, robot)
    take_wrenches(work, robot)
    for i in range(work.kind.shape[0]):
        if _absent(work, i):
            _rest(work, i)
    since = robot.since[0]
    work.unrest_at[0] = -since if since > 0.0 else 0.0
    answer = tick(0.0, work)
    if answer < 0 or not _gains_usable(work, robot) or not _wishes_usable(work, robot):
        brake(work, work.tau)
        forget_no_number(work)
        robot.status[0], robot.solves[0] = FAULT, 0
    else:
        robot.status[0], robot.solves[0] = answer % SOLVE, answer // SOLVE
        if robot.status[0] & STALE != 0 and not _any_stale(work):
            robot.status[0] -= STALE
    learn(work, robot, robot.status[0])
    for i in range(work.kind.shape[0]):
        robot.remembers[i] = work.kind[i, REMEMBERS]
        for c in range(4):
            robot.turn[i, c] = work.numbers[i, TURN + c]


def _absent(work, i):
    """Whether task i is not in this robot's stack, so that nothing about it matters."""
    x = work.variable[i]
    value = ramp(0.0, int(x[PROFILE]), x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8])
    return x[RAMP] == 0.0 and value == 0.0


def _rest(work, i):
    """Let task i ask for something that is finite."""
    number = work.numbers[i]
    for c in range(GOAL_ROTATION, GOAL_ACCELERATION + 6):
        if not math.isfinite(number[c]):
            number[c] = 0.0
    for row in range(work.kind[i, FIRST_ROW], work.kind[i, FIRST_ROW] + work.kind[i, ROWS]):
        for c in range(3):
            if not math.isfinite(work.goal[row, c]):
                work.goal[row, c] = 0.0


def _any_stale(work):
    """Whether a force task in this robot's stack has had no new wrench for too long."""
    stale = False
    for i in range(work.kind.shape[0]):
        if is_stale(work, i) and not _absent(work, i):
            stale = True
    return stale


def _wishes_usable(work, robot):
    """Whether all that tasks ask for is finite; where nothing is left to them, no torque shows that."""
    for i in range(work.kind.shape[0]):
        if _absent(work, i):
            continue
        if work.kind[i, KIND] == FORCE and not press_usable(work, robot, i):
            return False
        for row in range(work.kind[i, FIRST_ROW], work.kind[i, FIRST_ROW] + work.kind[i, ROWS]):
            if not math.isfinite(work.fw[row]):
                return False
    return True


def _gains_usable(work, robot):
    """Whether no gain is negative or none; they are in arrays that anybody writes."""
    for i in range(work.kind.shape[0]):
        first, rows = work.kind[i, FIRST_ROW], work.kind[i, ROWS]
        spring = work.kind[i, KIND] == MOTION and work.kind[i, SPRING] != 0
        if spring and not robot.damping_ratio[i] >= 0.0:
            return False
        for row in range(first, first + rows):
            if spring and not robot.stiffness[row] >= 0.0:
                return False
            if not spring and not (work.kp[row] >= 0.0 and work.kv[row] >= 0.0):
                return False
    return True


def _begin(work, robot):
    """Forget of every task that has begun anew which way round it went."""
    for i in range(work.kind.shape[0]):
        robot.found[i] = 0
        if robot.epoch[i] != robot.seen[i]:
            robot.remembers[i] = 0
            forget_sum(work, robot, i)
            forget_way(work, robot, i)
            forget_touch(work, i)
            _forget_rest(work, i)
            robot.found[i] = robot.holds[i]
            robot.seen[i] = robot.epoch[i]
        work.kind[i, REMEMBERS] = robot.remembers[i]
        for c in range(4):
            work.numbers[i, TURN + c] = robot.turn[i, c]


def _forget_rest(work, i):
    """Let task i not have been at rest."""
    for row in range(work.kind[i, FIRST_ROW], work.kind[i, FIRST_ROW] + work.kind[i, ROWS]):
        work.row_unrest[row] = MOST_UNREST


def _find(work, robot):
    """Let the tasks that hold what they find have it as their target."""
    any_task = False
    for i in range(work.kind.shape[0]):
        if robot.found[i] != 0:
            any_task = True
    if not any_task:
        return
    look_at_robot(work)
    for i in range(work.kind.shape[0]):
        if robot.found[i] == 0:
            continue
        first, rows = work.kind[i, FIRST_ROW], work.kind[i, ROWS]
        if work.kind[i, KIND] == JOINTS:
            for row in range(first, first + rows):
                robot.joint_target[row] = work.q[work.coordinate[row]]
            continue
        measure(work, i)
        x, target = work.motion[0], robot.target[i]
        for c in range(3):
            target[c] = x[P + c]
        E = (
            x[R], x[R + 1], x[R + 2], x[R + 3], x[R + 4], x[R + 5], x[R + 6], x[R + 7], x[R + 8],
        )  # fmt: skip
        target[3], target[4], target[5], target[6] = _quaternion(E)


def _take_motion(work, robot, i):
    """Take over target, velocity and acceleration of a task of motion."""
    number, target = work.numbers[i], robot.target[i]
    for c in range(3):
        number[GOAL_POSITION + c] = target[c]
    for c in range(6):
        number[GOAL_VELOCITY + c] = robot.velocity[i, c]
        number[GOAL_ACCELERATION + c] = robot.acceleration[i, c]
    if work.kind[i, QUANTITY] == POSITION:
        return
    w, a, b, c = target[3], target[4], target[5], target[6]
    scale = 1.0 / math.sqrt(w * w + a * a + b * b + c * c)
    w, a, b, c = scale * w, scale * a, scale * b, scale * c
    number[GOAL_ROTATION] = 1.0 - 2.0 * (b * b + c * c)
    number[GOAL_ROTATION + 1] = 2.0 * (a * b - w * c)
    number[GOAL_ROTATION + 2] = 2.0 * (a * c + w * b)
    number[GOAL_ROTATION + 3] = 2.0 * (a * b + w * c)
    number[GOAL_ROTATION + 4] = 1.0 - 2.0 * (a * a + c * c)
    number[GOAL_ROTATION + 5] = 2.0 * (b * c - w * a)
    number[GOAL_ROTATION + 6] = 2.0 * (a * c - w * b)
    number[GOAL_ROTATION + 7] = 2.0 * (b * c + w * a)
    number[GOAL_ROTATION + 8] = 1.0 - 2.0 * (a * a + b * b)
    before = robot.before[i]
    agreement = w * before[0] + a * before[1] + b * before[2] + c * before[3]
    if 2.0 * agreement * agreement - 1.0 < SAME_TARGET:
        work.kind[i, REMEMBERS] = 0
    before[0], before[1], before[2], before[3] = w, a, b, c


def _take_spring(work, robot, i):
    """Take over stiffness, damping and force of a task that is a spring."""
    first, rows = work.kind[i, FIRST_ROW], work.kind[i, ROWS]
    for row in range(first, first + rows):
        stiffness = robot.stiffness[row]
        work.spring[row, 0] = stiffness
        work.spring[row, 1] = 2.0 * robot.damping_ratio[i] * math.sqrt(stiffness)
        work.spring[row, 2] = robot.spring_force[row]


def _take_joints(work, robot, i):
    """Take over target, velocity and acceleration of a task of joints."""
    first, rows = work.kind[i, FIRST_ROW], work.kind[i, ROWS]
    for row in range(first, first + rows):
        work.goal[row, 0] = robot.joint_target[row]
        work.goal[row, 1] = robot.joint_velocity[row]
        work.goal[row, 2] = robot.joint_acceleration[row]
        moved = robot.joint_target[row] - robot.joint_before[row]
        moved -= 2.0 * math.pi * math.ceil(moved / (2.0 * math.pi) - 0.5)
        if abs(moved) > LARGEST_STEP:
            work.kind[i, REMEMBERS] = 0
        robot.joint_before[row] = robot.joint_target[row]
