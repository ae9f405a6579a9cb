"""Ways of vectors and of turns: each coordinate, along the way or across it, as fast as it may be.

`opspace.tasks.ways` has the readable form. A coordinate is a row of `opspace.law.way_columns`.
"""

from __future__ import annotations

import math

import opspace.law.swift_motion as motions
from opspace.kernels.compiled_scalars import compiled
from opspace.law.swift_motion import JERK_SHARE
from opspace.law.way_columns import (
    ACCELERATION,
    AWAY,
    END,
    MIRROR,
    NO_MIRROR,
    PUSH,
    SPEED,
    STAY,
    TOP,
)
from opspace.machine.jit import jit

SERIES_BELOW = 1e-2
"""Angle in rad below which series are more accurate than differences of near numbers."""

_COMPILED = compiled(motions)

swift_motion = _COMPILED["swift_motion"]
swift_time = _COMPILED["swift_time"]
swift_at = _COMPILED["swift_at"]


@jit
def plan_way(way, first, size, speed, most):
    """Plan the way of some coordinates from AWAY, SPEED and ACCELERATION, all in the task's axes."""
    length = 0.0
    for k in range(first, first + size):
        length += way[k, AWAY] * way[k, AWAY]
    length = math.sqrt(length)
    square = 0.0
    for k in range(first, first + size):
        way[k, MIRROR] = way[k, AWAY] / length if length > 0.0 else 0.0
        if k == first and length > 0.0:
            way[k, MIRROR] -= 1.0
        square += way[k, MIRROR] * way[k, MIRROR]
    for k in range(first, first + size):
        way[k, MIRROR] = way[k, MIRROR] * math.sqrt(2.0 / square) if square >= NO_MIRROR else 0.0
    for column in (SPEED, ACCELERATION, AWAY):
        mirror(way, way, first, size, column)
        if size > 1 and square >= NO_MIRROR:
            way[first + size - 1, column] *= -1.0
    jerk = JERK_SHARE * most
    for k in range(first, first + size):
        v, a = way[k, SPEED], way[k, ACCELERATION]
        way[k, PUSH], way[k, TOP], way[k, STAY] = swift_motion(
            way[k, AWAY], v, a, speed, most, jerk
        )
        way[k, END] = swift_time(way[k, PUSH], way[k, TOP], way[k, STAY], v, a, most, jerk)


@jit
def mirror(way, x, first, size, column):
    """Mirror a column of x at the plane that lies between the first axis and the way."""
    along = 0.0
    for k in range(first, first + size):
        along += way[k, MIRROR] * x[k, column]
    for k in range(first, first + size):
        x[k, column] -= along * way[k, MIRROR]


@jit
def follow_way(way, place, first, size, age, most):
    """Put position, speed and acceleration in the task's axes into the columns of place."""
    mirrored = False
    for k in range(first, first + size):
        if way[k, MIRROR] != 0.0:
            mirrored = True
        x, v, a = way[k, AWAY], 0.0, 0.0
        if age < way[k, END]:
            x, v, a = swift_at(
                age, way[k, PUSH], way[k, TOP], way[k, STAY], way[k, SPEED], way[k, ACCELERATION],
                most, JERK_SHARE * most,
            )  # fmt: skip
        place[k, 0], place[k, 1], place[k, 2] = x, v, a
    for column in range(3):
        if mirrored and size > 1:
            place[first + size - 1, column] *= -1.0
        mirror(way, place, first, size, column)


@jit
def rates_of_turn(place, first):
    """Put ω = V φ̇ and ω̇ = V φ̈ + V̇ φ̇ in the places of φ̇ and φ̈, three rows from first on.

    `opspace.tasks.rotation.turning_rates` has the readable form.
    """
    f = (place[first, 0], place[first + 1, 0], place[first + 2, 0])
    g = (place[first, 1], place[first + 1, 1], place[first + 2, 1])
    h = (place[first, 2], place[first + 1, 2], place[first + 2, 2])
    square, growth = inner(f, f), inner(f, g)
    angle = math.sqrt(square)
    a, b = 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    a_rate = growth * (-1.0 / 12.0 + square / 180.0)
    b_rate = growth * (-1.0 / 60.0 + square / 1260.0)
    if angle >= SERIES_BELOW:
        sine, cosine = math.sin(angle), math.cos(angle)
        a, b = (1.0 - cosine) / square, (angle - sine) / (square * angle)
        a_rate = growth * (sine / angle - 2.0 * a) / square
        b_rate = growth * (a - 3.0 * b) / square
    once = outer(f, g)
    bent = outer(f, h)
    twice = outer(f, once)
    far = outer(f, bent)
    round_ = outer(g, once)
    g0, g1, g2 = g
    o0, o1, o2 = once
    t0, t1, t2 = twice
    h0, h1, h2 = h
    n0, n1, n2 = bent
    r0, r1, r2 = far
    s0, s1, s2 = round_
    place[first, 1] = g0 + a * o0 + b * t0
    place[first + 1, 1] = g1 + a * o1 + b * t1
    place[first + 2, 1] = g2 + a * o2 + b * t2
    place[first, 2] = h0 + a * n0 + b * r0 + a_rate * o0 + b_rate * t0 + b * s0
    place[first + 1, 2] = h1 + a * n1 + b * r1 + a_rate * o1 + b_rate * t1 + b * s1
    place[first + 2, 2] = h2 + a * n2 + b * r2 + a_rate * o2 + b_rate * t2 + b * s2


@jit
def inner(f, g):
    """Product of two vectors."""
    f0, f1, f2 = f
    g0, g1, g2 = g
    return f0 * g0 + f1 * g1 + f2 * g2


@jit
def outer(f, g):
    """Cross product of two vectors."""
    f0, f1, f2 = f
    g0, g1, g2 = g
    return f1 * g2 - f2 * g1, f2 * g0 - f0 * g2, f0 * g1 - f1 * g0
