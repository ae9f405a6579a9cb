"""Targets that are approached on ways (`max_acceleration`), of one robot, in the language of kernels.

What `opspace.tasks.tracking` does, and `opspace.kernels.led_goals` for one robot: here a target is
another one where its numbers are others, and turns are quaternions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from opspace.kernels import led_goals
from opspace.kernels.columns import (
    FIRST_ROW,
    JOINTS,
    KIND,
    MOTION,
    ORIENTATION,
    POSE,
    POSITION,
    QUANTITY,
    ROWS,
)
from opspace.kernels.dynamics import evaluate
from opspace.kernels.motion import P, R, measure, move_joints
from opspace.kernels.swift_way import follow_way, plan_way, rates_of_turn
from opspace.kernels.task_rows import _quaternion
from opspace.law.way_columns import ACCELERATION, AWAY, BEGAN, SPEED

TOLD, RATE, CURVATURE = 0, 7, 13
"""Where what a task of motion is told is kept: position and quaternion, their rate, its rate."""
TOLD_SIZE = 19


def forget_way(work, robot, i):
    """Begin anew with task i."""
    ways = work.ways
    ways.known[i] = 0
    ways.led[i] = 0


def lead(work, robot):
    """Put what tasks follow on their ways where their targets have been told."""
    ways = work.ways
    for i in range(work.kind.shape[0]):
        ways.begins[i] = 0
        if ways.pace[i, 0] == 0.0:
            continue
        if work.kind[i, KIND] == MOTION:
            _lead_motion(work, robot, i)
        elif work.kind[i, KIND] == JOINTS:
            _lead_joints(work, robot, i)


def _lead_motion(work, robot, i):
    """Lead a task of motion."""
    ways = work.ways
    told, goal, size = ways.told[i], ways.goal[i], _size(work, i)
    usable, same, other, moving = _listen(work, robot, i, size)
    if not usable:
        forget_way(work, robot, i)
        return
    if ways.known[i] == 0 or other:
        if robot.found[i] != 0 or moving:
            ways.led[i] = 0
        elif ways.known[i] == 0 or ways.led[i] == 0 or not same:
            _begin_motion(work, robot, i, size)
        for c in range(TOLD_SIZE):
            told[c] = goal[c]
        ways.known[i] = 1
    if ways.led[i] != 0:
        _follow_motion(work, robot, i, ways.age[i])


def _listen(work, robot, i, size):
    """Take what a task of motion is told, and compare it with what it was told last.

    Returns:
        Whether it is finite, whether the target is the same, whether anything is not, and whether the
        target has a rate.
    """
    ways = work.ways
    told, goal, first, end = ways.told[i], ways.goal[i], 0, 7
    if work.kind[i, QUANTITY] == POSITION:
        end = 3
    elif work.kind[i, QUANTITY] == ORIENTATION:
        first = 3
    for c in range(TOLD_SIZE):
        goal[c] = told[c]
    for c in range(first, end):
        goal[TOLD + c] = robot.target[i, c]
    for c in range(size):
        goal[RATE + c], goal[CURVATURE + c] = robot.velocity[i, c], robot.acceleration[i, c]
    usable, same, other, moving = True, True, False, False
    for c in range(TOLD_SIZE):
        if not math.isfinite(goal[c]):
            usable = False
        if goal[c] != told[c]:
            other = True
            if c < RATE:
                same = False
        if RATE <= c < CURVATURE and goal[c] != 0.0:
            moving = True
    return usable, same, other, moving


def _size(work, i):
    """Length of the rate of a task of motion."""
    return 6 if work.kind[i, QUANTITY] == POSE else 3


def _begin_motion(work, robot, i, size):
    """Begin the way of a task of motion, from what it has followed or else from what it finds."""
    ways = work.ways
    way, turn, goal, first = ways.parts[i], ways.turned[i], ways.goal[i], 0
    if work.kind[i, QUANTITY] == ORIENTATION:
        first = 3
    for c in range(7):
        robot.target[i, c] = ways.told[i, TOLD + c]
    for c in range(size):
        robot.velocity[i, c] = ways.told[i, RATE + c]
        robot.acceleration[i, c] = ways.told[i, CURVATURE + c]
    if ways.known[i] == 0:
        _find_motion(work, robot, i, size)
    elif ways.led[i] != 0:
        _follow_motion(work, robot, i, ways.age[i])
    for c in range(3):
        way[c, BEGAN] = robot.target[i, c]
        way[c, AWAY] = goal[c] - way[c, BEGAN]
    for c in range(4):
        turn[c] = robot.target[i, 3 + c]
    for c in range(size):
        way[first + c, SPEED] = robot.velocity[i, c]
        way[first + c, ACCELERATION] = robot.acceleration[i, c]
    if first == 0:
        plan_way(way, 0, 3, ways.pace[i, 0], ways.pace[i, 1])
    if first == 3 or size == 6:
        _plan_turn(work, i, first)
    ways.led[i], ways.begins[i], ways.age[i] = 1, 1, 0.0


def look_at_robot(work):
    """See where bodies are and how joints move; a tick does that after it has been told its targets."""
    evaluate(work.bodies, work.q, work.v, work.dynamics)
    move_joints(work)


def _find_motion(work, robot, i, size):
    """Follow, from now on, what the robot has."""
    look_at_robot(work)
    measure(work, i)
    x, target = work.motion[0], robot.target[i]
    E = (
        x[R], x[R + 1], x[R + 2], x[R + 3], x[R + 4], x[R + 5], x[R + 6], x[R + 7], x[R + 8],
    )  # fmt: skip
    target[3], target[4], target[5], target[6] = _quaternion(E)
    for c in range(3):
        target[c] = x[P + c]
    for c in range(size):
        robot.velocity[i, c], robot.acceleration[i, c] = 0.0, 0.0


def _plan_turn(work, i, first):
    """Plan the turn to a goal the short way; of a pose, its pace comes after that of the position."""
    ways = work.ways
    way, pace = ways.parts[i], 2
    if first == 3:
        pace = 0
    w, a, b, c = between(ways.turned[i], ways.goal[i], 3)
    sine = math.sqrt(a * a + b * b + c * c)
    scale = 2.0 * math.atan2(sine, w) / sine if sine > 1e-150 else 2.0 / w
    way[3, AWAY], way[4, AWAY], way[5, AWAY] = scale * a, scale * b, scale * c
    plan_way(way, 3, 3, ways.pace[i, pace], ways.pace[i, pace + 1])


def between(turn, goal, at):
    """Quaternion wxyz, w >= 0, of the turn from a quaternion to another one, which begins at a place."""
    w, a, b, c = goal[at], goal[at + 1], goal[at + 2], goal[at + 3]
    u, x, y, z = turn[0], -turn[1], -turn[2], -turn[3]
    s = w * u - a * x - b * y - c * z
    d = w * x + a * u + b * z - c * y
    e = w * y + b * u + c * x - a * z
    f = w * z + c * u + a * y - b * x
    scale = 1.0 / math.sqrt(s * s + d * d + e * e + f * f)  # nobody writes quaternions of length 1
    if s < 0.0:
        scale = -scale
    return scale * s, scale * d, scale * e, scale * f


def _follow_motion(work, robot, i, age):
    """Put target, velocity and acceleration where the way is after a time."""
    ways = work.ways
    way, pace, target, place = ways.parts[i], ways.pace[i], robot.target[i], ways.place[i]
    turning = 0
    if work.kind[i, QUANTITY] != ORIENTATION:
        follow_way(way, place, 0, 3, age, pace[1])
        for c in range(3):
            target[c] = way[c, BEGAN] + place[c, 0]
            robot.velocity[i, c], robot.acceleration[i, c] = place[c, 1], place[c, 2]
        turning = 3
    if work.kind[i, QUANTITY] == POSE:
        follow_way(way, place, 3, 3, age, pace[3])
    elif work.kind[i, QUANTITY] == ORIENTATION:
        follow_way(way, place, 3, 3, age, pace[1])
    else:
        return
    a, b, c = place[3, 0], place[4, 0], place[5, 0]
    angle = math.sqrt(a * a + b * b + c * c)
    scale = math.sin(0.5 * angle) / angle if angle > 1e-150 else 0.5
    w, a, b, c = math.cos(0.5 * angle), scale * a, scale * b, scale * c
    turn = ways.turned[i]
    u, x, y, z = turn[0], turn[1], turn[2], turn[3]
    target[3] = w * u - a * x - b * y - c * z
    target[4] = w * x + a * u + b * z - c * y
    target[5] = w * y + b * u + c * x - a * z
    target[6] = w * z + c * u + a * y - b * x
    rates_of_turn(place, 3)
    for k in range(3):
        robot.velocity[i, turning + k] = place[3 + k, 1]
        robot.acceleration[i, turning + k] = place[3 + k, 2]


def _lead_joints(work, robot, i):
    """Lead a task of joints."""
    ways = work.ways
    first, end = work.kind[i, FIRST_ROW], work.kind[i, FIRST_ROW] + work.kind[i, ROWS]
    told = ways.joint_told
    usable, same, other, moving = True, True, False, False
    for row in range(first, end):
        x, v, a = robot.joint_target[row], robot.joint_velocity[row], robot.joint_acceleration[row]
        if not (math.isfinite(x) and math.isfinite(v) and math.isfinite(a)):
            usable = False
        if told[row, 0] != x:
            same = False
        if told[row, 1] != v or told[row, 2] != a:
            other = True
        if v != 0.0:
            moving = True
    if not usable:
        forget_way(work, robot, i)
        return
    if ways.known[i] == 0 or other or not same:
        if robot.found[i] != 0 or moving:
            ways.led[i] = 0
        elif ways.known[i] == 0 or ways.led[i] == 0 or not same:
            _begin_joints(work, robot, i, first, end)
        for row in range(first, end):
            told[row, 0], told[row, 1] = robot.joint_target[row], robot.joint_velocity[row]
            told[row, 2] = robot.joint_acceleration[row]
        ways.known[i] = 1
    if ways.led[i] != 0:
        way, place = ways.joint_parts, ways.joint_place
        follow_way(way, place, first, end - first, ways.age[i], ways.pace[i, 1])
        for row in range(first, end):
            robot.joint_target[row] = way[row, BEGAN] + place[row, 0]
            robot.joint_velocity[row] = place[row, 1]
            robot.joint_acceleration[row] = place[row, 2]


def _begin_joints(work, robot, i, first, end):
    """Begin the way of a task of joints, from what it has followed or else from what it finds."""
    ways = work.ways
    told, way, place = ways.joint_told, ways.joint_parts, ways.joint_place
    if ways.known[i] != 0 and ways.led[i] != 0:
        follow_way(way, place, first, end - first, ways.age[i], ways.pace[i, 1])
    for row in range(first, end):
        if ways.known[i] == 0:
            way[row, BEGAN] = work.q[work.coordinate[row]]
            way[row, SPEED], way[row, ACCELERATION] = 0.0, 0.0
        elif ways.led[i] != 0:
            way[row, BEGAN] += place[row, 0]
            way[row, SPEED], way[row, ACCELERATION] = place[row, 1], place[row, 2]
        else:
            way[row, BEGAN] = told[row, 0]
            way[row, SPEED], way[row, ACCELERATION] = told[row, 1], told[row, 2]
        away = robot.joint_target[row] - way[row, BEGAN]
        if work.endless[row] != 0:
            away -= 2.0 * math.pi * math.ceil(away / (2.0 * math.pi) - 0.5)
        way[row, AWAY] = away
    plan_way(way, first, end - first, ways.pace[i, 0], ways.pace[i, 1])
    ways.led[i], ways.begins[i], ways.age[i] = 1, 1, 0.0


def forget_no_way(work, robot, i):
    """Be on no way."""


def lead_nowhere(work, robot):
    """Be on no way."""


def led_already(t, work):
    """Have targets where their ways are."""


WITHOUT_WAYS: Mapping[Callable[..., Any], Callable[..., Any]] = {
    forget_way: forget_no_way,
    lead: lead_nowhere,
}
"""What is called where no task has a max_acceleration, by what is called otherwise."""

IN_TICK: Mapping[Callable[..., Any], Callable[..., Any]] = {led_goals.lead: led_already}
"""The same of the tick, before which a fleet has led its tasks."""
