"""What lower buffers at rest cost where a target lies out of reach: the table of docs/singularities.md.

``python docs/evidence/rest_beyond_reach.py`` (about five minutes) prints it, how fast the arms still are
at the end of the wait, and what lower buffers cost on the way to random targets.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from buffer_motions import Reach, Run, Watch, run, tasks
from buffer_targets import ARMS as REACHING
from buffer_targets import targets
from seven_joint_arms import load_arm

import opspace as osc

ARMS = ("puma560", "ur5", "panda")
BEYOND = (0.02, 0.1, 0.25, 0.4)
SPEED = 0.2
"""Led out and back so fast, m/s."""
WAIT = 8.0
"""How long it waits there, s: long enough to be at rest."""


def led_out(name: str, beyond: float, near: float) -> Run:
    """Lead an arm so far out of its workspace, let it wait, and lead it back."""
    reach = Reach.of(name)
    way = reach.way + beyond
    reference, back = reach.out_and_back(way, way / SPEED, WAIT)
    stack = tasks(reference, with_posture=True)
    option = osc.Singularity(near=near)
    return run(reach.robot, stack, back + way / SPEED + 1.0, singularity=option, back=back)


def steps_to_targets(robot: osc.Robot, near: float) -> list[float]:
    """Largest torque step on the way to each of 16 targets within 4 s, N·m per ms."""
    found = []
    for position, rotation in targets(robot)[:16]:
        turn = osc.OrientationTask(target=rotation, max_speed=1.0)
        hand = osc.PositionTask(target=position, max_speed=0.5)
        stack = osc.Stack([osc.JointLimits(), turn, hand, osc.PostureTask(robot.q_reference)])
        controller = osc.Controller(robot, stack, singularity=osc.Singularity(near=near))
        seen = Watch()
        osc.simulate(osc.Plant(robot, robot.q_reference), controller, 4.0, [seen])
        found.append(float(np.abs(np.diff(seen.tau, axis=0)).max()))
    return found


def main() -> None:
    """Measure and print."""
    for beyond in BEYOND:
        runs = [[led_out(name, beyond, near) for near in (0.0, 0.3)] for name in ARMS]
        cells = [f"{a.torque_step:.2g} → {b.torque_step:.2g}" for a, b in runs]
        slowest = max(b.rest_speed for _, b in runs)
        print(f"| {beyond:.2f} | {' | '.join(cells)} | at rest: {slowest:.1g} rad/s", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for name in REACHING:
            robot = load_arm(name, Path(folder))
            for near in (0.0, 0.3):
                steps = steps_to_targets(robot, near)
                print(f"{name}, near={near}: median {np.median(steps):.2g}, most {max(steps):.2g}")


if __name__ == "__main__":
    main()
