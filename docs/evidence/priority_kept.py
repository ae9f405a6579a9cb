"""How often motors that are too weak give the most important task all the same.

Random states and targets; a linear program says how much of what the task asks for can be had at all.
``python docs/evidence/priority_kept.py`` writes the table of docs/safety.md.
"""

import re
from pathlib import Path

import numpy as np
from scipy.optimize import linprog

import opspace as osc

ARMS = ("panda", "xarm7", "ur5", "puma560")
STATES = 400
SPEED = 0.3  # rad/s
FAR = (0.05, 0.6)  # m, from the tool to its target
ROOM = 0.9  # part of a limit that the bias may take
KEPT = 1e-6
PAGE = Path(__file__).resolve().parents[1] / "safety.md"
BLOCK = re.compile(r"(<!-- priority-kept -->\n).*?(<!-- /priority-kept -->)", re.DOTALL)


def could_be_had(A, wanted, bias, limit):
    """Largest part of an acceleration that torques within limits give."""
    program = linprog(
        np.append(np.zeros(len(bias)), -1.0),
        A_eq=np.column_stack([A, -wanted]),
        b_eq=A @ bias,
        bounds=[(-x, x) for x in limit] + [(0.0, None)],
        method="highs",
    )
    return -program.fun if program.status == 0 else np.inf


def measured(name):
    """Part of the task that could be had, and that was given, in every state that counts."""
    rng = np.random.default_rng(1)
    robot = osc.load_robot(name)
    hand = osc.PositionTask(kp=400.0, kv=40.0)
    posture = osc.PostureTask(robot.q_reference, kp=100.0)
    controller = osc.Controller(
        robot, osc.Stack([hand, posture]), torque_limits="priority", singularity=None
    )
    lower, upper = (
        np.where(np.isfinite(q), q, end) for q, end in ((robot.q_lower, -3.0), (robot.q_upper, 3.0))
    )
    found = []
    for _ in range(STATES):
        q, v = rng.uniform(lower, upper), SPEED * rng.normal(size=robot.nv)
        robot.update(q, v)
        away = rng.normal(size=3)
        hand.target = robot.position(robot.tool) + away / np.linalg.norm(away) * rng.uniform(*FAR)
        tau = controller.step(0.0, q, v).tau
        if np.any(np.abs(robot.bias) > ROOM * robot.torque_limit):
            continue
        terms = hand.evaluate(robot, 0.0)
        A, wanted = terms.J @ np.linalg.inv(robot.M), terms.acceleration - terms.drift
        could = could_be_had(A, wanted, robot.bias, robot.torque_limit)
        got = A @ (tau - robot.bias)
        found.append((could, np.linalg.norm(got - wanted) / np.linalg.norm(wanted)))
    return np.array(found).T


def table():
    """The rows of the table."""
    rows = ["| arm | states | could be had | given in full | missed else, median | largest |"]
    rows.append("| --- | ---: | ---: | ---: | ---: | ---: |")
    for name in ARMS:
        could, missed = measured(name)
        full = could >= 1.0
        kept = missed[full] < KEPT
        rest = missed[full][~kept]
        rows.append(
            f"| {name} | {could.size} | {full.sum()} | {kept.sum()} | "
            f"{np.median(rest):.1%} | {rest.max():.1%} |"
        )
    return "\n".join(rows) + "\n"


def main():
    """Write the table into the page."""
    rows = table()
    print(rows)
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(BLOCK.sub(lambda m: m[1] + rows + m[2], text), encoding="utf-8")


if __name__ == "__main__":
    main()
