"""What kept distances cost in a tick: ``python docs/evidence/distance_ticks.py``.

Ticks of a Panda with the rows of one ball and of nine, first far away, then where two pairs act, take
turns with ticks of the same tasks without distances in the same state, so that all see the same machine.
"""

import numpy as np

import opspace as osc
from opspace.bench.timing import interleaved

TICKS = 20_000
IGNORED = ["panda_link1", "panda_link2"]
"""Links that no ball can reach here."""


def panda(balls):
    """Give a controller that holds the tool, with balls to stay away from or without any distance."""
    guard = osc.CollisionAvoidance(*balls, pairs="none") if balls else None
    tasks = [osc.OrientationTask(), osc.PositionTask(), osc.PostureTask()]
    stack = osc.Stack([osc.JointLimits(), *tasks])
    robot = osc.load_robot("panda")
    found = osc.Controller(robot, stack, torque_limits="priority", collisions=guard)
    found.step(0.0, robot.q_reference, np.zeros(7))
    return found


def balls(count, near):
    """Give balls that are far away, all but one that is near if there is a place for it."""
    places = [(2.0 + 0.3 * k, 2.0, 0.5) for k in range(count)]
    if near is not None:
        places[0] = near
    speed = (0.0, 0.0, 0.0) if near is None else (0.0, 0.3, 0.0)
    return [
        osc.Ball(
            0.08, place, name=str(k), ignore=IGNORED, velocity=speed if k == 0 else (0.0, 0.0, 0.0)
        )
        for k, place in enumerate(places)
    ]


def acting(wanted):
    """Let a ball come from the side until so many pairs act; tell where it is, and the state."""
    kept = panda(balls(1, (0.25, -0.6, 0.65)))
    model, ball = osc.load_robot("panda"), kept.collisions["0"]
    q, v = np.array(model.q_reference), np.zeros(7)
    for k in range(4000):
        t = 1e-3 * k
        ball.place((0.25, -0.6 + 0.3 * t, 0.65), velocity=(0.0, 0.3, 0.0))
        command = kept.step(t, q, v)
        if sum(pair.taken > 0.0 for pair in command.distances.values()) == wanted:
            return ball.position, q, v
        model.update(q, v)
        a = np.linalg.solve(model.M, command.tau - model.bias)
        q, v = q + 1e-3 * v + 0.5e-6 * a, v + 1e-3 * a
    raise SystemExit(f"never do {wanted} pairs act")


def measure(near, q, v):
    """Time ticks at one state, and write a row for each number of balls."""
    subjects = {0: panda([]), 1: panda(balls(1, near)), 9: panda(balls(9, near))}
    ticks = {
        str(count): (lambda q, v, step=found.step: step(0.0, q, v))
        for count, found in subjects.items()
    }
    times = interleaved(ticks, q[None], v[None], TICKS)
    alone = times["0"]
    for count, found in subjects.items():
        rows = 0 if found.collisions is None else len(found.collisions.layout().rows)
        state = "none" if not count else ("far" if near is None else "two pairs act")
        p50, p99 = np.quantile(times[str(count)], (0.5, 0.99))
        ratio = times[str(count)] / np.median(alone)
        r50, r99 = np.quantile(ratio, (0.5, 0.99))
        more = p50 - np.median(alone)
        print(f"| {rows} | {state} | {p50:.1f} | {p99:.1f} | {r50:.2f} | {r99:.2f} | {more:.1f} |")


def main():
    """Write the table."""
    print("| rows | | p50 [µs] | p99 [µs] | p50, times | p99, times | more at p50 [µs] |")
    print("| ---: | --- | ---: | ---: | ---: | ---: | ---: |")
    reference = np.array(osc.load_robot("panda").q_reference)
    measure(None, reference, np.zeros(7))
    measure(*acting(2))


if __name__ == "__main__":
    main()
