"""What lower buffers at rest cost where a target lies out of reach: the table of docs/singularities.md.

``python docs/evidence/rest_beyond_reach.py`` (about a minute).
"""

from __future__ import annotations

from buffer_motions import Reach, run, tasks

import opspace as osc

ARMS = ("puma560", "ur5", "panda")
BEYOND = (0.02, 0.1, 0.25, 0.4)
SPEED = 0.2
"""Led out and back so fast, m/s."""


def torque_step(name: str, beyond: float, near: float) -> float:
    """Largest torque step of an arm that is led so far out of its workspace and back, N·m per ms."""
    reach = Reach.of(name)
    way = reach.way + beyond
    reference, back = reach.out_and_back(way, way / SPEED, 1.5)
    stack = tasks(reference, with_posture=True)
    option = osc.Singularity(near=near)
    return run(
        reach.robot, stack, back + way / SPEED + 1.0, singularity=option, back=back
    ).torque_step


def main() -> None:
    """Measure and print."""
    for beyond in BEYOND:
        steps = [[torque_step(name, beyond, near) for near in (0.0, 0.3)] for name in ARMS]
        cells = [f"{without:.2g} → {lower:.2g}" for without, lower in steps]
        print(f"| {beyond:.2f} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
