"""The fastest motion of one coordinate to rest, within limits of speed, acceleration and jerk.

Scalars only, as `opspace.law.scalars`: ways to new targets call these functions as they are, and a fleet
translates them for many robots. A motion from (0, v, a) to rest at d has these parts, each of which may
take no time: the push goes on until the acceleration is ``push``; the speed goes to ``top``, where it
stays for a time; then it goes to zero. A change of speed is as fast as it can be.
"""

# pyright: strict
from __future__ import annotations

import math

JERK_SHARE = 10.0
"""Jerk over acceleration of ways, 1/s: they reach their largest acceleration in 0.1 s."""
ROOT_STEPS = 200
"""A root is found to the last digits in a dozen steps; no more than these are taken."""
ROUNDING, TINIEST = 4e-16, 1e-300
"""Part of a root, and size of it, that no number tells apart."""


def driven(x: float, v: float, a: float, j: float, t: float) -> tuple[float, float, float]:
    """Return position, speed and acceleration after a time t of constant jerk j."""
    return (
        x + t * (v + t * (0.5 * a + t * j / 6.0)),
        v + t * (a + 0.5 * t * j),
        a + t * j,
    )


def change_of_speed(
    v: float, a: float, w: float, most: float, jerk: float
) -> tuple[float, float, float, float, float]:
    """Plan the fastest way from speed v and acceleration a to speed w and none.

    Returns:
        Jerk and duration of the first part, duration of the one without jerk, jerk and duration of the
        last.
    """
    side = 1.0 if w >= v + 0.5 * a * abs(a) / jerk else -1.0
    first, change = side * a, side * (w - v)
    top = math.sqrt(max(jerk * change + 0.5 * first * first, 0.0))
    held = 0.0
    if top > most:
        # What the first part and the last do of the change; the first only lets go where a is above.
        ends = 0.5 * first * first / jerk
        if first <= most:
            ends = (most * most - 0.5 * first * first) / jerk
        held = (change - ends) / most
        top = most
    rising = 1.0 if top >= first else -1.0
    return side * rising * jerk, rising * (top - first) / jerk, held, -side * jerk, top / jerk


def changed(v: float, a: float, w: float, most: float, jerk: float) -> tuple[float, float]:
    """Return how far and for how long `change_of_speed` goes."""
    j, rise, held, back, fall = change_of_speed(v, a, w, most, jerk)
    x, u, b = driven(0.0, v, a, j, rise)
    x, u, b = driven(x, u, b, 0.0, held)
    x, u, b = driven(x, u, b, back, fall)
    return x, rise + held + fall


def far_with(push: float, top: float, v: float, a: float, most: float, jerk: float) -> float:
    """Return how far a motion goes that has these parts and never stays at its top speed."""
    x = 0.0
    if push != a:
        x, v, a = driven(0.0, v, a, jerk if push > a else -jerk, abs(push - a) / jerk)
    there, _ = changed(v, a, top, most, jerk)
    return x + there + 0.5 * top * time_to_rest(top, most, jerk)


def time_to_rest(top: float, most: float, jerk: float) -> float:
    """Return how long it takes from a speed to none, with no acceleration at either end."""
    size = abs(top)
    if size * jerk > most * most:
        return size / most + most / jerk
    return 2.0 * math.sqrt(size / jerk)


def part_that_reaches(
    d: float, low: float, high: float, pushed: bool, v: float, a: float, most: float, jerk: float
) -> float:
    """Find the push, or else the top speed, between two with which a motion goes as far as d.

    Inverse quadratic interpolation where it can be trusted, halving elsewhere (Chandrupatla 1997).
    """
    p, q, r = high, low, low
    f = far_with(p if pushed else a, 0.0 if pushed else p, v, a, most, jerk) - d
    g = far_with(q if pushed else a, 0.0 if pushed else q, v, a, most, jerk) - d
    h, part = g, 0.5
    for _ in range(ROOT_STEPS):
        x = p + part * (q - p)
        y = far_with(x if pushed else a, 0.0 if pushed else x, v, a, most, jerk) - d
        if (y > 0.0) == (f > 0.0):
            r, h = p, f
        else:
            r, h = q, g
            q, g = p, f
        p, f = x, y
        width = abs(q - p)
        closest = p if abs(f) < abs(g) else q
        least = 0.5 * (ROUNDING * abs(closest) + TINIEST) / width if width > 0.0 else 1.0
        if f == 0.0 or g == 0.0 or not least <= 0.5:
            break
        part = 0.5
        along, across = (p - q) / (r - q), (f - g) / (h - g)
        if across * across < along and (1.0 - across) * (1.0 - across) < 1.0 - along:
            part = f / (g - f) * h / (g - h) + (r - p) / (q - p) * f / (h - f) * g / (h - g)
        part = min(max(part, least), 1.0 - least)
    return p if abs(f) < abs(g) else q


def swift_motion(
    d: float, v: float, a: float, speed: float, most: float, jerk: float
) -> tuple[float, float, float]:
    """Plan the fastest motion from (0, v, a) to rest at d.

    Args:
        d: Where it goes.
        v: Speed at its beginning; above the limit it goes back to it.
        a: Acceleration at its beginning; the same.
        speed: Largest speed, above 0.
        most: Largest acceleration, above 0.
        jerk: Largest jerk, above 0.

    Returns:
        The acceleration at which the push ends, the top speed, and how long it stays there.
    """
    stop, _ = changed(v, a, 0.0, most, jerk)
    if d == stop:
        return a, 0.0, 0.0
    side = 1.0 if d >= stop else -1.0
    d, v, a = side * d, side * v, side * a
    eased = v + 0.5 * a * abs(a) / jerk
    away = far_with(a, speed, v, a, most, jerk)
    if away <= d:
        return side * a, side * speed, (d - away) / speed
    if eased > 0.0 and a < 0.0 and far_with(a, eased, v, a, most, jerk) > d:
        # It brakes already, and has only to let go of that for a while.
        return side * part_that_reaches(d, a, 0.0, True, v, a, most, jerk), 0.0, 0.0
    top = part_that_reaches(d, max(eased, 0.0), speed, False, v, a, most, jerk)
    return side * a, side * top, 0.0


def swift_time(
    push: float, top: float, stay: float, v: float, a: float, most: float, jerk: float
) -> float:
    """Return how long a motion takes that `swift_motion` has planned."""
    t = abs(push - a) / jerk
    _, u, b = driven(0.0, v, a, jerk if push > a else -jerk, t)
    _, there = changed(u, b, top, most, jerk)
    return t + there + stay + time_to_rest(top, most, jerk)


def swift_at(
    t: float, push: float, top: float, stay: float, v: float, a: float, most: float, jerk: float
) -> tuple[float, float, float]:
    """Return where a motion is at time t from its beginning, its speed and its acceleration.

    Args:
        t: Time since its beginning, from 0 to `swift_time`.
        push: As `swift_motion` returns it.
        top: The same.
        stay: The same.
        v: As `swift_motion` was given it.
        a: The same.
        most: The same.
        jerk: The same.
    """
    whole = abs(push - a) / jerk
    x, u, b = driven(0.0, v, a, jerk if push > a else -jerk, min(t, whole))
    if t <= whole:
        return x, u, b
    t -= whole
    x, u, b, t = speed_changed(t, x, u, b, top, most, jerk)
    part = min(t, stay)
    x, u, b = driven(x, u, b, 0.0, part)
    x, u, b, t = speed_changed(t - part, x, u, b, 0.0, most, jerk)
    return x, u, b


def speed_changed(
    t: float, x: float, v: float, a: float, w: float, most: float, jerk: float
) -> tuple[float, float, float, float]:
    """Follow `change_of_speed` for a time t or to its end; return what is left of t as well."""
    if t <= 0.0:
        return x, v, a, 0.0
    j, rise, held, back, fall = change_of_speed(v, a, w, most, jerk)
    part = min(t, rise)
    x, v, a = driven(x, v, a, j, part)
    t -= part
    part = min(t, held)
    x, v, a = driven(x, v, a, 0.0, part)
    t -= part
    part = min(t, fall)
    x, v, a = driven(x, v, a, back, part)
    t -= part
    if t > 0.0:  # rounding must not go on with it
        v, a = w, 0.0
    return x, v, a, t
