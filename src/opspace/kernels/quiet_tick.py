"""A tick in which nothing has happened but that the robot has moved."""

from __future__ import annotations

import math

from opspace.kernels.quiet_columns import LAST, LONGEST, LOOK_FIRST, NEXT, NOW, SHORTEST
from opspace.kernels.tick import finite, tick
from opspace.machine.jit import jit


@jit
def quiet_tick(t, q, v, quiet, work):
    """Compute the torque for a state, where nothing is to be looked at first.

    Where the answer is below zero, the watchdog has not seen the tick, which is then done once more.

    Args:
        t: Time, s.
        q: (nq,) configuration without quaternions; one of another size is refused.
        v: (n,) velocity, rad/s.
        quiet: `opspace.plan.quiet_records.QUIET`.
        work: `opspace.plan.records.TICK` of a robot that it computes itself.

    Returns:
        ``LOOK_FIRST``, or what `opspace.kernels.tick.tick` answers.
    """
    if q.shape[0] != work.q.shape[0] or v.shape[0] != work.v.shape[0]:
        return LOOK_FIRST
    if not math.isfinite(t) or not finite(q) or not finite(v) or not t < quiet.times[NEXT]:
        return LOOK_FIRST
    if quiet.watch.shape[0] > 0 and not _in_time_and_new(t, q, v, quiet):
        return LOOK_FIRST
    quiet.times[NOW] = t
    _copy(q, work.q)
    _copy(v, work.v)
    quiet.behind[0] = 1
    answer = tick(t, work)
    if answer >= 0 and quiet.watch.shape[0] > 0:
        quiet.watch[LAST] = t
        _copy(q, quiet.last_q)
        _copy(v, quiet.last_v)
    return answer


@jit
def _in_time_and_new(t, q, v, quiet):
    """Tell whether neither this time nor this state is worth a word of the watchdog's."""
    passed = t - quiet.watch[LAST]
    if not quiet.watch[SHORTEST] < passed <= quiet.watch[LONGEST]:
        return False
    same, moves = True, False
    for a in range(q.shape[0]):
        same &= q[a] == quiet.last_q[a]
    for a in range(v.shape[0]):
        same &= v[a] == quiet.last_v[a]
        moves |= v[a] != 0.0
    return not (same and moves)


@jit
def _copy(source, to):
    for i in range(to.shape[0]):
        to[i] = source[i]
