"""Random starts of arms among obstacles, and of two arms beside each other.

``python docs/evidence/collision_campaign.py --starts 10000 --processes 8`` draws 2 to 6 obstacles, a
posture clear of them, a target anywhere, a stiffness and a swap of levels on the way, with joint, speed
and torque limits on, and says how near anything came before a tick said ``COLLISION_LOST``. A start is
its number: ``--first 40 --starts 1`` is the fortieth again. ``--minutes 30`` ends it early and says how
many there were. Progress goes to the standard error.
"""

import argparse
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from time import perf_counter
from typing import NamedTuple

import numpy as np

import opspace as osc
from opspace.scenario.obstacle_entries import ObstacleEntry
from opspace.sweep.random_obstacles import random_obstacle

ARMS = ("panda", "ur5", "xarm7", "puma560")
TWO = "two-ur5"
KINDS = (*ARMS, TWO)
SECONDS = 0.8
TRIES = 200
BESIDE = 0.7
"""Distance of the bases of two arms, m."""


class Found(NamedTuple):
    """What became of a start; without ticks there was no posture clear of everything.

    ``least`` is the least distance before any tick was lost, ``after`` that of the whole run, m.
    """

    kind: str
    seed: int
    ticks: int
    least: float
    after: float
    lost: bool
    why: str


@cache
def shapes_and_pairs(name):
    """Shapes and pairs of an arm, found once."""
    guard = osc.CollisionAvoidance()
    guard.bind(osc.load_robot(name))
    return {"shapes": guard.shapes, "pairs": guard.pairs}


def random_obstacles(rng):
    """Balls, boxes and capsules anywhere around a base."""
    for i in range(rng.integers(2, 7)):
        place = rng.uniform((-0.8, -0.8, 0.1), (0.8, 0.8, 1.0))
        yield ObstacleEntry(**random_obstacle(rng, place)).build(str(i))


@cache
def watch_of(name, which):
    """A controller of its own for each arm that looks at distances, and its guard."""
    guard = osc.CollisionAvoidance(**shapes_and_pairs(name))
    stack = osc.Stack([osc.PostureTask()])
    return osc.Controller(osc.load_robot(name), stack, collisions=guard), guard


def arm(name, rng, obstacles, which=0):
    """A controller with a random target and stiffness that swaps two tasks on the way.

    Also one that looks at distances, for the arm of this number.
    """
    robot = osc.load_robot(name)
    guard = osc.CollisionAvoidance(*obstacles, **shapes_and_pairs(name))
    kp = float(rng.uniform(50.0, 400.0))
    position = osc.PositionTask(target=rng.uniform((-0.7, -0.7, 0.0), (0.7, 0.7, 0.9)), kp=kp)
    stack = osc.Stack([osc.JointLimits(), osc.OrientationTask(), position, osc.PostureTask()])
    controller = osc.Controller(robot, stack, torque_limits="priority", collisions=guard)
    stack.swap(position, stack["orientation"], duration=0.5, start_time=0.2)
    watch, probe = watch_of(name, which)
    probe.remove(*[obstacle.name for obstacle in probe.obstacles])
    probe.add(*obstacles)
    return controller, watch


def nearest(command):
    """Name and distance of the nearest pair of a tick, m."""
    pair, there = next(iter(command.distances.items()), ("", osc.Distance(np.inf, 0.0)))
    return pair, there.distance


def clear_posture(rng, robots, watches, follow):
    """Draw a posture of every arm until all are clear of everything; None where there is none."""
    for k in range(TRIES):
        drawn = []
        for robot in robots:
            low = np.maximum(robot.q_lower, -np.pi) + 0.05
            high = np.minimum(robot.q_upper, np.pi) - 0.05
            drawn.append((rng.uniform(low, high), np.zeros(robot.nv)))
        follow(drawn)
        seen = [w.step(1e-3 * k, *s) for w, s in zip(watches, drawn, strict=True)]
        if all(nearest(command)[1] > 0.01 for command in seen):
            return drawn
    return None


def move(model, tau, q, v):
    """State a millisecond later, at a constant acceleration."""
    model.update(q, v)
    a = np.linalg.solve(model.M, tau - model.bias)
    return q + 1e-3 * v + 0.5e-6 * a, v + 1e-3 * a


def one_start(kind, seed):
    """Run one start to its end."""
    rng = np.random.default_rng([KINDS.index(kind), seed])
    others = []
    if kind == TWO:
        aside = np.array([0.0, BESIDE, 0.0])
        shapes = shapes_and_pairs("ur5")["shapes"]
        others = [
            osc.OtherRobot(osc.load_robot("ur5"), sign * aside, shapes=shapes, share=0.5)
            for sign in (1.0, -1.0)
        ]
        made = [arm("ur5", rng, other.obstacles, i) for i, other in enumerate(others)]
    else:
        made = [arm(kind, rng, list(random_obstacles(rng)))]

    def follow(states):
        for i, other in enumerate(others):
            other.follow(*states[1 - i])

    controllers, watches = zip(*made, strict=True)
    models = [controller.robot.fresh() for controller in controllers]
    states = clear_posture(rng, models, watches, follow)
    if states is None:
        return Found(kind, seed, 0, np.inf, np.inf, False, "")
    least, after, why, ticks = np.inf, np.inf, "", round(1e3 * SECONDS)
    for k in range(ticks):
        follow(states)
        commands = [c.step(1e-3 * k, *s) for c, s in zip(controllers, states, strict=True)]
        for command in commands:
            pair, distance = nearest(command)
            if osc.Status.COLLISION_LOST in command.status and not why:
                why = f"at {k} ms, {1e3 * distance:.0f} mm apart, {pair}, {command.status}"
            after = min(after, distance)
            least = least if why else after
        moved = zip(models, commands, states, strict=True)
        states = [move(model, command.tau, *state) for model, command, state in moved]
    return Found(kind, seed, ticks, least, after, bool(why), why)


def summary(found):
    """Write a table of what was found, and every start that was lost."""
    print(
        "| | starts | least distance before a loss [mm] | with a loss | least of these, after it [mm] |"
    )
    print("| --- | ---: | ---: | ---: | ---: |")
    for kind in KINDS:
        runs = [run for run in found if run.kind == kind and run.ticks]
        if runs:
            least = 1e3 * min(run.least for run in runs)
            lost = [1e3 * run.after for run in runs if run.lost]
            worst = f"{min(lost):.1f}" if lost else ""
            print(f"| {kind} | {len(runs)} | {least:.2f} | {len(lost)} | {worst} |")
    for run in found:
        if run.lost:
            print(f"{run.kind} {run.seed}: {1e3 * run.after:.1f} mm in the end; lost {run.why}")
    print(dict(Counter(run.kind for run in found if not run.ticks)), "without a clear posture")


def main():
    """Read the command line, run the starts and write what was found."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--starts", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=np.inf)
    told = parser.parse_args()
    numbers = range(told.first, told.first + told.starts)
    work = [(told.kinds[i % len(told.kinds)], i) for i in numbers]
    found = []
    end, each = perf_counter() + 60.0 * told.minutes, 10 * told.processes
    with ProcessPoolExecutor(told.processes) as pool:
        while len(found) < len(work) and perf_counter() < end:
            next_ones = work[len(found) : len(found) + each]
            found.extend(pool.map(one_start, *zip(*next_ones, strict=True)))
            print(f"{len(found)} of {len(work)}", file=sys.stderr, flush=True)
    summary(found)


if __name__ == "__main__":
    main()
