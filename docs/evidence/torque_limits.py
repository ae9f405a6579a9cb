"""The show-piece on motors that are too weak: levels that give way against a clip.

The motors get what gravity takes anywhere in the workspace plus a part of what the tasks take at most
in the show-piece, both joint by joint. ``python docs/evidence/torque_limits.py`` writes the table of
docs/safety.md.
"""

import re
from pathlib import Path

import numpy as np

from opspace.command import Status
from opspace.loop import StopRule, simulate
from opspace.plots.labels import number
from opspace.robots.sampled_postures import sample_postures
from opspace.scenario.build import build, build_robot
from opspace.scenario.load import load_scenario
from opspace.sim import Plant

SCENARIO = "showpiece-panda"
PAGE = Path(__file__).resolve().parents[1] / "safety.md"
BLOCK = re.compile(r"(<!-- torque-limits -->\n).*?(<!-- /torque-limits -->)", re.DOTALL)
GIVE_UP_SPEED = 20.0  # rad/s


class Watch:
    """What the controller asked for, and how far the most important level was off."""

    def __init__(self, robot):
        self.robot = robot
        self.tau, self.bias, self.error, self.scaled, self.q = [], [], [], 0, []

    def observe(self, q, v, command):
        """See one tick."""
        self.tau.append(np.clip(command.tau, -self.robot.torque_limit, self.robot.torque_limit))
        self.bias.append(self.robot.bias.copy())
        self.q.append(q.copy())
        top = min(n for task in command.tasks.values() for n, _ in task.levels)
        self.error.append(
            max(
                task.error_norm
                for task in command.tasks.values()
                if any(n == top for n, _ in task.levels)
            )
        )
        self.scaled += bool(command.status & Status.TORQUE_SCALED)


def run(limit, mode):
    """Run the show-piece with these torque limits; ``mode`` as the controller has it."""
    built = build(load_scenario(SCENARIO, [f"torque_limits={mode}"]))
    robot, plant = built.robot, built.plant
    if limit is not None:
        # After the controller was built: what joints can brake with stays what it is.
        robot.torque_limit = limit
        plant = Plant(robot, plant.q, dt=built.scenario.dt)
    watch = Watch(robot)
    stop = StopRule(max_joint_speed=GIVE_UP_SPEED)
    outcome = simulate(plant, built.controller, built.scenario.duration, [watch], stop)
    return watch, outcome


def gravity_anywhere():
    """Largest gravity torque of each joint over the workspace, N·m."""
    robot = build_robot(load_scenario(SCENARIO))
    found = np.zeros(robot.nv)
    for q in sample_postures(robot):
        robot.update(q, np.zeros(robot.nv))
        found = np.maximum(found, np.abs(robot.gravity))
    return found


def measured(part):
    """Measure both ways with this part of the tasks' largest torque; None is all of it."""
    free, _ = run(None, "report")
    tau, bias = np.array(free.tau), np.array(free.bias)
    need = np.max(np.abs(tau - bias), axis=0)
    limit = gravity_anywhere() + part * need
    rows = {}
    for name, mode in (("levels give way", "priority"), ("clip", "report")):
        watch, outcome = run(limit, mode)
        error = np.array(watch.error)
        added = np.maximum(error - np.array(free.error)[: error.size], 0.0)
        rows[name] = {
            "ended": "completed" if outcome.completed else f"given up at {outcome.t:.1f} s",
            "torque_step": float(np.max(np.abs(np.diff(watch.tau, axis=0)))),
            "rms_error": float(np.sqrt(np.mean(error**2))),
            "added_error": float(np.sqrt(np.mean(added**2))),
            "ticks_scaled": watch.scaled,
        }
    return rows


def main():
    """Rewrite the table in docs/safety.md."""
    heads = (
        "torque for the tasks", "", "torque step [N·m]", "RMS error of the top level",
        "added to the free run", "run",
    )  # fmt: skip
    lines = [heads, ("---:", "---", "---:", "---:", "---:", "---")]
    for part in (1.0, 0.6, 0.3):
        for name, row in measured(part).items():
            step, error = number(row["torque_step"]), number(row["rms_error"])
            added = number(row["added_error"])
            lines.append((f"{part:.0%}", name, step, error, added, row["ended"]))
    table = "".join(f"| {' | '.join(line)} |\n" for line in lines)
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(BLOCK.sub(lambda m: m[1] + table + m[2], text), encoding="utf-8")
    print(table)


if __name__ == "__main__":
    main()
