"""What joint limits that act cost in a tick: ``python docs/evidence/limit_ticks.py``.

Ticks of a Panda with orientation above position above posture, at its reference posture and with three
joints a milliradian before their limits, each in turns with ticks without limits in the same state.
"""

import numpy as np

import opspace as osc
from opspace.bench.timing import interleaved

TICKS = 20_000
NEAR = (1, 3, 5)
"""The joints that are brought to their limits."""


def panda(limits):
    """Return the tick of a Panda that holds the tool where it is at the reference posture."""
    robot = osc.load_robot("panda")
    tasks = [osc.OrientationTask(), osc.PositionTask(), osc.PostureTask(robot.q_reference)]
    controller = osc.Controller(robot, osc.Stack(tasks, limits=limits))
    controller.step(0.0, robot.q_reference, np.zeros(7))
    return lambda q, v: controller.step(0.0, q, v)


def main():
    """Print a row for each state and each subject."""
    robot = osc.load_robot("panda")
    near = np.array(robot.q_reference)
    near[list(NEAR)] = robot.q_upper[list(NEAR)] - 1e-3
    print("| joints at limits | | p50 [µs] | p99 [µs] |")
    print("| --- | --- | ---: | ---: |")
    for where, q in (("none", np.array(robot.q_reference)), ("three", near)):
        ticks = {"without limits": panda(None), "with limits": panda(osc.JointLimits())}
        for name, times in interleaved(ticks, q[None], np.zeros((1, 7)), TICKS).items():
            p50, p99 = np.percentile(times, [50, 99])
            print(f"| {where} | {name} | {p50:.1f} | {p99:.1f} |")


if __name__ == "__main__":
    main()
