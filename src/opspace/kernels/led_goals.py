"""Leads tasks to their targets on ways, as `opspace.tasks.tracking` and `opspace.tasks.ways` do."""

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
    ORIENTATION,
    POSE,
    POSITION,
    QUANTITY,
    REMEMBERS,
    ROWS,
)
from opspace.kernels.led_columns import FROM_FOUND, GOAL_PLACE, GOAL_SIZE
from opspace.kernels.motion import P, R, measure
from opspace.kernels.swift_way import follow_way, plan_way, rates_of_turn
from opspace.kernels.task_rows import _quaternion, joint_position
from opspace.law.scalars import LARGEST_STEP
from opspace.law.way_columns import ACCELERATION, AWAY, BEGAN, END, SPEED
from opspace.machine.jit import jit

SAME_TARGET = math.cos(LARGEST_STEP)


@jit
def lead(t, work):
    """Put targets, their velocities and accelerations where ways are at time t [s], and begin ways.

    Reads and writes ``led``, writes goal, and of numbers what is desired. Where a task is not on a way
    what is desired stays what it is.

    Args:
        t: Time, s.
        work: `opspace.plan.records.TICK`, with the placements of this state.
    """
    led = work.led
    for i in range(led.pace.shape[0]):
        if led.pace[i, 0] == 0.0:
            continue
        if work.kind[i, KIND] == JOINTS:
            _lead_joints(t, work, i)
        else:
            _lead_motion(t, work, i)


@jit
def _lead_motion(t, work, i):
    """Lead a task of motion."""
    led, number, size = work.led, work.numbers[i], 3
    if work.kind[i, QUANTITY] == POSE:
        size = 6
    if led.asked[i] != 0:
        if led.asked[i] == FROM_FOUND:
            _find_motion(work, i)
        elif led.on[i] != 0:
            _follow_motion(t, work, i)
        _begin_motion(t, work, i)
        led.begun[i], led.on[i], led.asked[i] = t, 1, 0
    if led.on[i] != 0:
        _follow_motion(t, work, i)
        for c in range(size):
            number[GOAL_ACCELERATION + c] += led.more[i, c]


@jit
def _find_motion(work, i):
    """Desire what the robot has, at rest."""
    measure(work, i)
    x, number = work.motion[0], work.numbers[i]
    for c in range(9):
        number[GOAL_ROTATION + c] = x[R + c]
    for c in range(3):
        number[GOAL_POSITION + c] = x[P + c]
    for c in range(6):
        number[GOAL_VELOCITY + c], number[GOAL_ACCELERATION + c] = 0.0, 0.0
    work.kind[i, REMEMBERS] = 0


@jit
def _begin_motion(t, work, i):
    """Plan the way of a task of motion from what is desired."""
    led, number, turn = work.led, work.numbers[i], 0
    way, pace = led.parts[i], led.pace[i]
    for c in range(GOAL_SIZE):
        led.goal[i, c] = led.asked_goal[i, c]
    if work.kind[i, QUANTITY] != ORIENTATION:
        for c in range(3):
            way[c, BEGAN] = number[GOAL_POSITION + c]
            way[c, AWAY] = led.goal[i, GOAL_PLACE + c] - way[c, BEGAN]
            way[c, SPEED] = number[GOAL_VELOCITY + c]
            way[c, ACCELERATION] = number[GOAL_ACCELERATION + c]
        plan_way(way, 0, 3, pace[0], pace[1])
        led.most[i, 0], led.ends[i, 0] = pace[1], t + _longest(way, 0, 3)
        turn = 1
    if work.kind[i, QUANTITY] != POSITION:
        for c in range(9):
            led.start[i, c] = number[GOAL_ROTATION + c]
        _turn_to(way, led.start[i], led.goal[i])
        for c in range(3):
            way[3 + c, BEGAN] = 0.0
            way[3 + c, SPEED] = number[GOAL_VELOCITY + 3 * turn + c]
            way[3 + c, ACCELERATION] = number[GOAL_ACCELERATION + 3 * turn + c]
        plan_way(way, 3, 3, pace[2 * turn], pace[2 * turn + 1])
        led.most[i, turn], led.ends[i, turn] = pace[2 * turn + 1], t + _longest(way, 3, 3)


@jit
def _turn_to(way, start, goal):
    """Put the rotation vector of the short way from one orientation to another into AWAY."""
    E = (
        _row(goal, start, 0, 0), _row(goal, start, 0, 1), _row(goal, start, 0, 2),
        _row(goal, start, 1, 0), _row(goal, start, 1, 1), _row(goal, start, 1, 2),
        _row(goal, start, 2, 0), _row(goal, start, 2, 1), _row(goal, start, 2, 2),
    )  # fmt: skip
    w, a, b, c = _quaternion(E)
    sine = math.sqrt(a * a + b * b + c * c)
    scale = 2.0 * math.atan2(sine, w) / sine if sine > 1e-150 else 2.0 / w
    way[3, AWAY], way[4, AWAY], way[5, AWAY] = scale * a, scale * b, scale * c


@jit
def _row(goal, start, i, j):
    """Entry (i, j) of R_goal R_startᵀ."""
    total = 0.0
    for c in range(3):
        total += goal[3 * i + c] * start[3 * j + c]
    return total


@jit
def _longest(way, first, size):
    """Duration of the coordinate that arrives last."""
    found = 0.0
    for k in range(first, first + size):
        found = max(found, way[k, END])
    return found


@jit
def _follow_motion(t, work, i):
    """Desire where the way of a task of motion is."""
    turn = 0
    if work.kind[i, QUANTITY] != ORIENTATION:
        _follow_place(t, work, i)
        turn = 1
    if work.kind[i, QUANTITY] != POSITION:
        _follow_turn(t, work, i, turn)


@jit
def _follow_place(t, work, i):
    """Desire where the way of a position is; exactly its target from its end on."""
    led, number, place = work.led, work.numbers[i], work.led.place
    if t >= led.ends[i, 0]:
        for c in range(3):
            number[GOAL_POSITION + c] = led.goal[i, GOAL_PLACE + c]
            number[GOAL_VELOCITY + c], number[GOAL_ACCELERATION + c] = 0.0, 0.0
        return
    follow_way(led.parts[i], place, 0, 3, t - led.begun[i], led.most[i, 0])
    for c in range(3):
        number[GOAL_POSITION + c] = led.parts[i, c, BEGAN] + place[c, 0]
        number[GOAL_VELOCITY + c] = place[c, 1]
        number[GOAL_ACCELERATION + c] = place[c, 2]


@jit
def _follow_turn(t, work, i, turn):
    """Desire where the way of an orientation is, which of a pose comes after the position."""
    led, number, place = work.led, work.numbers[i], work.led.place
    trace, rate = 0.0, GOAL_VELOCITY + 3 * turn
    if t >= led.ends[i, turn]:
        for c in range(9):
            trace += number[GOAL_ROTATION + c] * led.goal[i, c]
            number[GOAL_ROTATION + c] = led.goal[i, c]
        for c in range(3):
            number[rate + c], number[rate + c + 6] = 0.0, 0.0
    else:
        follow_way(led.parts[i], place, 3, 3, t - led.begun[i], led.most[i, turn])
        trace = _turned(number, place, led.start[i])
        rates_of_turn(place, 3)
        for c in range(3):
            number[rate + c], number[rate + c + 6] = place[3 + c, 1], place[3 + c, 2]
    if 0.5 * (trace - 1.0) < SAME_TARGET:
        work.kind[i, REMEMBERS] = 0


@jit
def _turned(number, place, start):
    """Desire the orientation exp([φ]×) R_start; return the trace of it and the one desired before."""
    a, b, c = place[3, 0], place[4, 0], place[5, 0]
    angle = math.sqrt(a * a + b * b + c * c)
    sine, cosine = math.sin(0.5 * angle), math.cos(0.5 * angle)
    scale = sine / angle if angle > 1e-150 else 0.5
    w, a, b, c = cosine, scale * a, scale * b, scale * c
    T = (
        1.0 - 2.0 * (b * b + c * c), 2.0 * (a * b - w * c), 2.0 * (a * c + w * b),
        2.0 * (a * b + w * c), 1.0 - 2.0 * (a * a + c * c), 2.0 * (b * c - w * a),
        2.0 * (a * c - w * b), 2.0 * (b * c + w * a), 1.0 - 2.0 * (a * a + b * b),
    )  # fmt: skip
    trace = 0.0
    for i in range(3):
        for j in range(3):
            entry = 0.0
            for k in range(3):
                entry += T[3 * i + k] * start[3 * k + j]
            trace += number[GOAL_ROTATION + 3 * i + j] * entry
            number[GOAL_ROTATION + 3 * i + j] = entry
    return trace


@jit
def _lead_joints(t, work, i):
    """Lead a task of joints."""
    led, first, rows = work.led, work.kind[i, FIRST_ROW], work.kind[i, ROWS]
    if led.asked[i] != 0:
        if led.asked[i] == FROM_FOUND:
            for row in range(first, first + rows):
                work.goal[row, 0] = joint_position(work, work.coordinate[row])
                work.goal[row, 1], work.goal[row, 2] = 0.0, 0.0
            work.kind[i, REMEMBERS] = 0
        elif led.on[i] != 0:
            _follow_joints(t, work, i, first, rows)
        _begin_joints(t, work, i, first, rows)
        led.begun[i], led.on[i], led.asked[i] = t, 1, 0
    if led.on[i] != 0:
        _follow_joints(t, work, i, first, rows)
        for row in range(first, first + rows):
            work.goal[row, 2] += led.joint_more[row]


@jit
def _begin_joints(t, work, i, first, rows):
    """Plan the way of a task of joints from what is desired; those without end go the short way."""
    led, way, pace = work.led, work.led.joint_parts, work.led.pace[i]
    for row in range(first, first + rows):
        way[row, BEGAN] = work.goal[row, 0]
        led.joint_goal[row] = led.joint_asked[row]
        away = led.joint_goal[row] - way[row, BEGAN]
        if work.endless[row] != 0:
            away -= 2.0 * math.pi * math.ceil(away / (2.0 * math.pi) - 0.5)
            led.joint_goal[row] = way[row, BEGAN] + away
        way[row, AWAY] = away
        way[row, SPEED], way[row, ACCELERATION] = work.goal[row, 1], work.goal[row, 2]
    plan_way(way, first, rows, pace[0], pace[1])
    led.most[i, 0], led.ends[i, 0] = pace[1], t + _longest(way, first, rows)


@jit
def _follow_joints(t, work, i, first, rows):
    """Desire where the way of a task of joints is."""
    led, way, place = work.led, work.led.joint_parts, work.led.joint_place
    there = t >= led.ends[i, 0]
    if not there:
        follow_way(way, place, first, rows, t - led.begun[i], led.most[i, 0])
    for row in range(first, first + rows):
        x, v, a = led.joint_goal[row], 0.0, 0.0
        if not there:
            x, v, a = way[row, BEGAN] + place[row, 0], place[row, 1], place[row, 2]
        moved = x - work.goal[row, 0]
        moved -= 2.0 * math.pi * math.ceil(moved / (2.0 * math.pi) - 0.5)
        if work.endless[row] != 0 and abs(moved) > LARGEST_STEP:
            work.kind[i, REMEMBERS] = 0
        work.goal[row, 0], work.goal[row, 1], work.goal[row, 2] = x, v, a
