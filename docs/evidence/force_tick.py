"""Time a tick with a force task beside the same tick with a position task, in turns.

``taskset -c 1 python docs/evidence/force_tick.py`` prints the median and the 99 % of both, µs; what is
more is the check of the wrench, in Python.
"""

from time import perf_counter_ns

import numpy as np

import opspace as osc

TURNS, TICKS = 60, 1000
PERIOD = 1e-3


def controller(task):
    """Turning and a posture below a task along one axis, with joint limits."""
    robot = osc.load_robot("panda")
    levels = [task, osc.OrientationTask(), osc.PostureTask()]
    return osc.Controller(robot, osc.Stack(levels, limits=osc.JointLimits()))


def main():
    """Measure in turns, the first of them for nothing."""
    moved = controller(osc.PositionTask(axes="z"))
    pressed = controller(osc.ForceTask(axes="z", force=10.0))
    robot = moved.robot
    q, v = np.array(robot.q_reference), np.zeros(robot.nv)
    felt = {robot.tool: np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])}
    taken = np.zeros((TURNS, 2, TICKS))
    t = 0.0
    for position, force in taken:
        for k in range(TICKS):
            t += PERIOD
            start = perf_counter_ns()
            moved.step(t, q, v)
            position[k] = 1e-3 * (perf_counter_ns() - start)
        for k in range(TICKS):
            t += PERIOD
            start = perf_counter_ns()
            pressed.step(t, q, v, wrenches=felt)
            force[k] = 1e-3 * (perf_counter_ns() - start)
    for name, part in (("p50", 50), ("p99", 99)):
        position, force = np.percentile(taken[2:], part, axis=(0, 2))
        print(f"{name}: position {position:.2f} µs, force {force:.2f}, {force - position:.2f} more")


if __name__ == "__main__":
    main()
