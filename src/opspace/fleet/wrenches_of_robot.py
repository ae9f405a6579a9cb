"""Wrenches of one robot of a fleet on their way to its force tasks, in the language of kernels.

Times that a force task remembers count from the tick: what was at it is at 0.
"""

from __future__ import annotations

import math

from opspace.command import Status
from opspace.kernels.columns import FIRST_ROW, FORCE, KIND, PRESS, ROWS
from opspace.law.press_columns import (
    BEGUN,
    CONFIDENCE,
    FLOOR,
    FORCES,
    FRESH,
    GIVEN,
    GIVEN_AT,
    KI,
    KP,
    OFF,
    ON,
    TRAVEL,
    WANTED,
    WHEN,
)

OFF_PART, ON_PART = 0.1, 0.4
"""Parts of the force between which confidence rises, as `opspace.tasks.contact.checked_thresholds`."""
STALE = int(Status.WRENCH_STALE)


def forget_touch(work, i):
    """Begin without contact; what was measured stays measured."""
    if work.kind[i, KIND] == FORCE:
        row = work.press[work.kind[i, PRESS]]
        row[BEGUN], row[CONFIDENCE], row[FLOOR] = 0.0, 0.0, math.inf


def take_wrenches(work, robot):
    """Hand out the wrenches that have been measured since the tick before."""
    since = robot.since[0]
    if not since > 0.0:
        since = 0.0
    for i in range(work.kind.shape[0]):
        if work.kind[i, KIND] != FORCE:
            continue
        row = work.press[work.kind[i, PRESS]]
        size = force_size(row)
        row[OFF], row[ON] = robot.contact[i, 0], robot.contact[i, 1]
        if row[ON] == 0.0:
            row[OFF], row[ON] = OFF_PART * size, ON_PART * size
        row[WHEN] -= since
        row[GIVEN_AT] -= since
        if robot.fresh[i] == 0 or not finite_wrench(robot, i):
            continue
        for c in range(6):
            row[GIVEN + c] = robot.wrench[i, c]
        row[GIVEN_AT] = 0.0


def finite_wrench(robot, i):
    """Whether all numbers of a wrench are some."""
    none = 0.0
    for c in range(6):
        none += 0.0 * robot.wrench[i, c]
    return none == 0.0


def force_size(row):
    """Length of the force that is wanted, N."""
    total = 0.0
    for r in range(int(row[FORCES])):
        total += row[WANTED + r] * row[WANTED + r]
    return math.sqrt(total)


def press_usable(work, robot, i):
    """Whether what a force task is told is what `opspace.ForceTask` takes."""
    row, first = work.press[work.kind[i, PRESS]], work.kind[i, FIRST_ROW]
    if robot.fresh[i] != 0 and not finite_wrench(robot, i):
        return False
    least, none = work.kv[first], 0.0
    for r in range(work.kind[i, ROWS]):
        least = min(least, work.kv[first + r])
        none += 0.0 * row[WANTED + r]
    size = force_size(row)
    if none != 0.0 or not size > 0.0 or not size >= row[ON] or not least > 0.0:
        return False
    return row[KP] >= 0.0 and 0.0 <= row[KI] <= 0.5 * least * (1.0 + row[KP])


def is_stale(work, i):
    """Whether a force task has had no new wrench for too long."""
    return work.kind[i, KIND] == FORCE and work.press[work.kind[i, PRESS], FRESH] == 0.0


def forget_no_number(work):
    """Begin anew with what a fault has left no number of."""
    for i in range(work.kind.shape[0]):
        if work.kind[i, KIND] != FORCE:
            continue
        if not math.isfinite(work.press[work.kind[i, PRESS], TRAVEL]):
            forget_touch(work, i)
