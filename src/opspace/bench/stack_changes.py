"""How long the ticks take in which the stack changes, beside the ticks around them."""

from __future__ import annotations

import gc
from time import perf_counter_ns, sleep

import numpy as np

from opspace.bench.scenes import PANDA_HOME
from opspace.controller import Controller
from opspace.errors import InputError
from opspace.robots import load_robot
from opspace.stack import Stack
from opspace.tasks import JointLimits, OrientationTask, PositionTask, PostureTask

HEADS = ("change of the stack", "loop", "p50 [µs]", "p99 [µs]", "max [µs]", "around", "ratio")
PERIOD = 2.0**-10
"""Time between two ticks, s: sums of it are exact, so that ramps end in the tick that is meant."""
CHANGES = {
    "an insertion begins": 0,
    "a move begins on the way": 6,
    "the insertion ends": 12,
    "the move ends": 18,
    "a removal begins": 24,
    "the removal ends": 36,
}
"""Ticks of a round in which something happens."""
ROUND = 44
AROUND = 3
"""Ticks before a change, and after it, that are compared with it."""


def stack_changes(count: int, *, paced: bool) -> dict[str, dict[str, float]]:
    """Time begins, middles and ends of transitions of a Panda, and the ticks around them.

    A task comes, moves to another level on the way, and leaves, again and again.

    Args:
        count: How often.
        paced: Sleep between two ticks like a real loop, which leaves the caches to others.

    Returns:
        By change: ``p50``, ``p99`` and ``max`` of its ticks in µs, ``around``, the mean of the
        medians before and after it in µs, and ``ratio``, that of ``p50`` to it.

    Raises:
        InputError: Fewer than one round.
    """
    if count < 1:
        raise InputError(f"a change is timed at least once, got {count}")
    robot = load_robot("panda")
    hand = PositionTask(name="hand", target=[0.5, 0.1, 0.4])
    coming = OrientationTask(name="coming", target=np.diag([1.0, -1.0, -1.0]))
    stack = Stack([hand, PostureTask()], limits=JointLimits())
    controller = Controller(robot, stack)
    controller.warm_up()
    q, v = np.array(PANDA_HOME), np.zeros(robot.nv)
    requests = {
        CHANGES["an insertion begins"]: lambda: stack.insert(coming, 0.5, 12 * PERIOD),
        CHANGES["a move begins on the way"]: lambda: stack.move(coming, 1.5, 12 * PERIOD),
        CHANGES["a removal begins"]: lambda: stack.remove(coming, 12 * PERIOD),
    }
    ticks = np.zeros((count + 1, ROUND))  # the first round is not counted
    gc.collect()
    for k in range(ticks.size):
        if k % ROUND in requests:
            requests[k % ROUND]()
        if paced:
            sleep(PERIOD)
        start = perf_counter_ns()
        controller.step(k * PERIOD, q, v)
        ticks.flat[k] = (perf_counter_ns() - start) * 1e-3
    return {name: _summary(ticks.ravel(), at) for name, at in CHANGES.items()}


def changes_table(count: int) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Time changes in a loop without pauses and in a paced one; heads and rows for a person."""
    rows: list[tuple[str, ...]] = []
    for loop in ("hot", "paced"):
        for name, times in stack_changes(count, paced=loop == "paced").items():
            numbers = (f"{times[key]:.3g}" for key in ("p50", "p99", "max", "around"))
            rows.append((name, loop, *numbers, f"{times['ratio']:.2f}"))
    return HEADS, rows


def _summary(ticks: np.ndarray, at: int) -> dict[str, float]:
    """Sum up the ticks of one change and those around it, all but the first round's."""
    here = np.arange(ROUND + at, ticks.size, ROUND)
    near = np.arange(1, AROUND + 1)[:, None]
    p50, p99 = np.percentile(ticks[here], (50, 99)).tolist()
    around = 0.5 * float(np.median(ticks[here - near]) + np.median(ticks[here + near]))
    most = float(ticks[here].max())
    return {"p50": p50, "p99": p99, "max": most, "around": around, "ratio": p50 / around}
