"""Push a standing G1 at random, under this law and under a weighted quadratic program.

``python docs/evidence/pushes.py --pushes 1000`` draws pushes of 4 to 16 N·s from any side, at the
pelvis or at the torso, within 0.05 to 0.2 s, gives each to both and writes ``pushes.csv`` and the table
of docs/safety.md. The weighted program has the limits, cones and contacts of the other, weights of 10
to 1 from level to level in place of priorities, and takes some seconds for a push. A push is its number:
``--first 40 --pushes 1`` is the fortieth again, and what the file has already is not repeated. In the
file the weighted program of the pushes from 472 on was compiled for the purpose, from the same
equations: in 136 that were run both ways, those after which the laws differ among them, everybody
stands or falls alike, errors differ by a thousandth at most and steps by three hundredths.
"""

from __future__ import annotations

import argparse
import sys
from functools import partial
from typing import NamedTuple

import numpy as np
from buffer_document import DOCS, EVIDENCE, number, read_csv, replace_block, write_csv
from buffer_document import table as markdown_table
from g1_on_soles import g1_on_soles

import opspace as osc
from opspace.compare.humanoid import ten_to_one
from opspace.controller.reference import ReferenceController

CSV = EVIDENCE / "pushes.csv"
DOCUMENT = DOCS / "safety.md"
TICK, AT, AFTER = 2e-3, 0.02, 2.5
"""Time of a tick, of the push, and for how long a robot is watched after it, s."""
STOOD, STILL = 4e-3, 0.3
"""Error of the centre of mass and speed of every coordinate below which a push is over, m and 1/s."""
LAWS = {
    "ours": osc.Controller,
    "weighted": partial(ReferenceController, law=ten_to_one),
}
CLASSES = ((4.0, 8.0), (8.0, 12.0), (12.0, 16.0))
"""Impulses of one row of the table, N·s."""


class Found(NamedTuple):
    """What became of a push under both laws.

    ``step`` is the largest torque step after it until the robot stood or fell, N·m per tick; ``com``
    the largest error of the centre of mass, m.
    """

    number: int
    impulse: float
    angle: float
    duration: float
    frame: str
    ours: bool
    weighted: bool
    ours_step: float
    weighted_step: float
    ours_com: float
    weighted_com: float


def draw(which: int) -> tuple[float, float, float, str]:
    """Impulse [N·s], direction [rad], duration [s] and frame of a push."""
    rng = np.random.default_rng([2026, which])
    impulse, angle = rng.uniform(CLASSES[0][0], CLASSES[-1][1]), rng.uniform(-np.pi, np.pi)
    return impulse, angle, rng.uniform(0.05, 0.2), str(rng.choice(["pelvis", "torso_link"]))


def stand_and_be_pushed(which: int, law: str) -> tuple[bool, float, float]:
    """Whether G1 stands afterwards, its largest torque step, and the error of its centre of mass."""
    impulse, angle, duration, frame = draw(which)
    robot, soles, q = g1_on_soles()
    torso = osc.OrientationTask("torso_link", name="torso")
    tasks = [osc.JointLimits(), osc.ComTask(), torso, osc.PostureTask(kp=25.0)]
    stack = osc.Stack(tasks, contacts=soles)
    controller = LAWS[law](robot, stack, torque_limits="priority", falling=osc.FallRule())
    force = impulse / duration * np.array([np.cos(angle), np.sin(angle), 0.0])
    push = osc.sim.Push(AT, duration, force, frame=frame)
    plant = osc.Plant(
        robot,
        q,
        dt=TICK,
        ground=osc.Ground(soles),
        substeps=4,
        disturbances=osc.sim.Disturbances(pushes=[push]),
    )
    return watch(plant, controller, AT + duration)


def watch(
    plant: osc.Plant, controller: ReferenceController, over: float
) -> tuple[bool, float, float]:
    """Run on until the robot stands or falls."""
    before, largest, error, off = None, 0.0, 0.0, np.inf
    while plant.t < over + AFTER:
        command = controller.step(plant.t, plant.q, plant.v)
        off = command.tasks["com"].error_norm
        if osc.Status.FALLING in command.status:
            return False, largest, error
        if plant.t > over + TICK and before is not None:
            largest = max(largest, float(np.abs(command.tau - before).max()))
            if off < STOOD and np.abs(plant.v).max() < STILL:
                break
        before, error = command.tau, max(error, off)
        plant.advance(command.tau)
    return off < 0.01, largest, error


def one_push(which: int) -> Found:
    """Give one push to both."""
    (ours, a_step, a_com), (weighted, b_step, b_com) = (
        stand_and_be_pushed(which, law) for law in LAWS
    )
    return Found(which, *draw(which), ours, weighted, a_step, b_step, a_com, b_com)


def table(rows: list[dict[str, str]]) -> str:
    """Write what became of the pushes, one row of the table for each class of impulses."""
    head = ["impulse [N·s]", "pushes", "both stand", "only opspace", "only weighted"]
    head += ["step, median", "99 %", "weighted, median", "99 %"]
    lines = []
    for low, high in (*CLASSES, (CLASSES[0][0], CLASSES[-1][1])):
        inside = [row for row in rows if low <= float(row["impulse"]) < high]
        stood = [(row["ours"] == "True", row["weighted"] == "True") for row in inside]
        both = [row for row, s in zip(inside, stood, strict=True) if all(s)]
        counts = [stood.count(s) for s in ((True, True), (True, False), (False, True))]
        steps = [
            number(np.quantile([float(row[f"{law}_step"]) for row in both], part)) if both else "–"
            for law in LAWS
            for part in (0.5, 0.99)
        ]
        name = f"{low:.0f} to {high:.0f}"
        lines.append([name, f"{len(inside)}", *(f"{count}" for count in counts), *steps])
    return markdown_table(head, lines)


def main() -> None:
    """Push what has not been pushed yet, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--pushes", type=int, default=1000, help="how many there are to be")
    parser.add_argument("--first", type=int, default=0, help="number of the first")
    parser.add_argument("--draw", action="store_true", help="only write the table anew")
    asked = parser.parse_args()
    rows = read_csv(CSV) if CSV.exists() else []
    known = {int(row["number"]) for row in rows}
    missing = [n for n in range(asked.first, asked.first + asked.pushes) if n not in known]
    for which in [] if asked.draw else missing:
        found = one_push(which)
        print(found, file=sys.stderr, flush=True)
        rows.append(found._asdict())
        write_csv(CSV, rows)
        rows = read_csv(CSV)
    if rows:
        replace_block(DOCUMENT, "pushes", table(rows))


if __name__ == "__main__":
    main()
