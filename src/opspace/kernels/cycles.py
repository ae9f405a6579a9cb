"""Cycle after cycle with a robot behind shared memory, without Python."""

from __future__ import annotations

import math

from opspace.command import Status
from opspace.kernels.columns import (
    FIRST_ROW,
    GOAL_ACCELERATION,
    GOAL_POSITION,
    GOAL_ROTATION,
    GOAL_VELOCITY,
    MAX_SPEED,
    REMEMBERS,
    ROWS,
    SOLVE,
    SPEED_LIMITED,
)
from opspace.kernels.cycle_columns import (
    ADDS,
    ASKED,
    BRAKED,
    CLOCK,
    CYCLES,
    ENDS,
    FAULT,
    FROZEN,
    FROZEN_FOR,
    HEARD,
    JUMP_AFTER,
    JUMPED,
    JUMPS,
    LAST,
    LATE,
    LATE_AFTER,
    LIMITED,
    MISSED,
    NAP,
    OLD,
    OVER,
    OVERRUNS,
    PATIENCE,
    PERIOD,
    RING,
    SEEN,
    SENT,
    SILENT,
    STALE,
    STATUSES,
    STOP_ON,
    STOPPED,
    WOKE,
)
from opspace.kernels.gravity import gravity
from opspace.kernels.led_columns import GOAL_SIZE
from opspace.kernels.many_states import brake
from opspace.kernels.tick import tick
from opspace.machine.jit import jit
from opspace.machine.system_calls import clock_gettime, nanosleep

IN_FAULT = int(Status.FAULT)
COMES_LATE = int(Status.LATE)
IS_STALE = int(Status.STALE)


@jit
def cycles(work, loop):
    """Read, tick, keep within the torque rate, write and remember, until something needs Python.

    Args:
        work: `TICK` of a robot that it computes itself.
        loop: `CYCLES`.

    Returns:
        Why it ends, see `opspace.kernels.cycle_columns`.
    """
    whole, number = loop.whole, loop.number
    while True:
        ended = wait(loop)
        if ended != 0:
            return ended
        status = take_state(work, loop)
        if loop.frozen_for_too_long[0] != 0:
            return FROZEN
        if loop.mail[0] != loop.mail[1]:
            take_mail(work, loop)
        status |= command(work, loop)
        write(loop)
        remember(loop, status)
        if status & whole[STOP_ON] != 0:
            return STOPPED
        if number[LAST] >= number[ENDS]:
            return OVER


@jit
def now(loop):
    """Time of this computer, s."""
    clock_gettime(loop.whole[CLOCK], loop.address[0])
    return loop.time[0] + 1e-9 * loop.time[1]


@jit
def wait(loop):
    """Wait for a state that is newer than the last one, and read it.

    Returns:
        0, or why there is none.
    """
    whole, number, count, state = loop.whole, loop.number, loop.count, loop.state
    late_at = number[HEARD] + number[LATE_AFTER]
    while True:
        if loop.asked[0] != 0:
            return ASKED
        if loop.wanted[0] == whole[FAULT]:
            return BRAKED
        first = state[0]
        if first % 2 == 0 and first != whole[SEEN]:
            total = copy_words(loop)
            here = now(loop)
            if state[0] == first and total == state[state.shape[0] - 1]:
                whole[SEEN] = first
                passed = loop.read[0] - number[LAST]
                if passed <= 0.0 and passed >= -number[JUMP_AFTER]:
                    count[OLD] += 1
                elif passed <= 0.0 or passed > number[JUMP_AFTER]:
                    count[JUMPS] += 1
                    return JUMPED
                else:
                    number[HEARD] = here
                    return 0
        here = now(loop)
        if here > late_at:
            count[MISSED] += 1
            late_at += number[LATE_AFTER]
        if here - number[HEARD] > number[PATIENCE]:
            return SILENT
        if whole[NAP] > 0:
            loop.time[2], loop.time[3] = 0, whole[NAP]
            nanosleep(loop.address[1], 0)


@jit
def copy_words(loop):
    """Copy the words of a state; return their sum."""
    total = 0
    for i in range(loop.read_words.shape[0]):
        word = loop.state[i + 1]
        loop.read_words[i] = word
        total += word
    return total


@jit
def take_state(work, loop):
    """Give the robot's state to the tick; tell whether it is late, or the same as before."""
    number, whole, read, status = loop.number, loop.whole, loop.read, 0
    nq, n = work.q.shape[0], work.v.shape[0]
    if read[0] - number[LAST] > number[LATE_AFTER]:
        status |= COMES_LATE
        loop.count[LATE] += 1
    same, moves = True, False
    for a in range(nq):
        same &= work.q[a] == read[1 + a]
        work.q[a] = read[1 + a]
    for a in range(n):
        same &= work.v[a] == read[1 + nq + a]
        moves |= read[1 + nq + a] != 0.0
        work.v[a] = read[1 + nq + a]
    number[LAST] = read[0]
    whole[FROZEN_FOR] = whole[FROZEN_FOR] + 1 if same and moves else 0
    if same and moves:
        status |= IS_STALE
        loop.count[STALE] += 1
    too_long = whole[FROZEN_FOR] * number[PERIOD] > number[PATIENCE]
    loop.frozen_for_too_long[0] = 1 if too_long else 0
    return status


@jit
def take_mail(work, loop):
    """Take targets and gains that have been sent, all at once."""
    for r in range(work.kp.shape[0]):
        work.kp[r], work.kv[r] = loop.kp[r], loop.kv[r]
    for i in range(work.kind.shape[0]):
        copy_columns(work.numbers, loop.numbers, i, MAX_SPEED, 2)
        work.kind[i, SPEED_LIMITED] = loop.kind[i, SPEED_LIMITED]
        if i < work.led.pace.shape[0] and loop.pace[i, 0] != 0.0:
            ask_way(work, loop, i)
        else:
            take_goal(work, loop, i)
        if loop.forgets[i] != 0:
            work.kind[i, REMEMBERS] = 0
    loop.mail[1] = loop.mail[0]


@jit
def take_goal(work, loop, i):
    """Desire what has been sent."""
    for r in range(work.kind[i, FIRST_ROW], work.kind[i, FIRST_ROW] + work.kind[i, ROWS]):
        for c in range(3):
            work.goal[r, c] = loop.goal[r, c]
    copy_columns(work.numbers, loop.numbers, i, GOAL_ROTATION, 9)
    copy_columns(work.numbers, loop.numbers, i, GOAL_POSITION, 3)
    copy_columns(work.numbers, loop.numbers, i, GOAL_VELOCITY, 6)
    copy_columns(work.numbers, loop.numbers, i, GOAL_ACCELERATION, 6)


@jit
def ask_way(work, loop, i):
    """Have a way begin where one has been asked for; what is desired stays what it is until then."""
    led = work.led
    copy_columns(led.pace, loop.pace, i, 0, 4)
    if loop.asked_way[i] != 0:
        copy_columns(led.asked_goal, loop.way_goal, i, 0, GOAL_SIZE)
        for r in range(work.kind[i, FIRST_ROW], work.kind[i, FIRST_ROW] + work.kind[i, ROWS]):
            led.joint_asked[r] = loop.joint_way_goal[r]
        led.asked[i] = loop.asked_way[i]


@jit
def copy_columns(to, source, i, first, count):
    """Copy some numbers of a task."""
    for c in range(first, first + count):
        to[i, c] = source[i, c]


@jit
def command(work, loop):
    """Compute the torque that is commanded, within what the robot takes; tell its status."""
    tau, n = loop.tau, work.v.shape[0]
    answer = tick(loop.number[LAST], work)
    status = IN_FAULT if answer < 0 else answer % SOLVE
    if answer < 0:
        brake(work, tau)
    else:
        for a in range(n):
            tau[a] = work.tau[a]
    if loop.whole[ADDS] != 0:
        gravity(work)
        for a in range(n):
            if math.isfinite(work.gravity[a]):
                tau[a] -= work.gravity[a]
    limited = False
    first = 1 + work.q.shape[0] + n
    for a in range(n):
        accepted = loop.read[first + a]
        if math.isnan(accepted):  # the robot does not say
            accepted = loop.before[a]
        wanted = tau[a]
        tau[a] = min(max(wanted, accepted - loop.step[a]), accepted + loop.step[a])
        limited |= tau[a] != wanted
        loop.before[a] = tau[a]
    if limited:
        loop.count[LIMITED] += 1
    return status


@jit
def write(loop):
    """Leave the command for the robot, with an odd first word as long as it is not whole."""
    part, n = loop.command, loop.tau.shape[0]
    begun = part[0] + part[0] % 2
    part[0] = begun + 1
    now(loop)
    total = 0
    for a in range(n):
        part[1 + a] = loop.tau_words[a]
        total += loop.tau_words[a]
    part[n + 1] = total
    now(loop)
    part[0] = begun + 2
    loop.whole[SENT] = begun + 2


@jit
def remember(loop, status):
    """Write a row of the ring, and count."""
    whole, number, read, n = loop.whole, loop.number, loop.read, loop.tau.shape[0]
    passed = now(loop) - number[HEARD]
    row = loop.ring[whole[RING] % loop.ring.shape[0]]
    m = read.shape[0] - n
    for a in range(m):
        row[a] = read[a]
    for a in range(n):
        row[m + a] = loop.tau[a]
    row[m + n], row[m + n + 1] = status, passed
    whole[RING] += 1
    whole[STATUSES] |= status
    loop.count[CYCLES] += 1
    if passed > number[PERIOD]:
        loop.count[OVERRUNS] += 1
    number[WOKE] = number[HEARD]
