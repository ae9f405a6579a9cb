"""Push a standing G1 at random, under this law and under a weighted quadratic program.

``python docs/evidence/pushes.py --pushes 1000`` draws pushes of 4 to 16 N·s from any side, at the
pelvis or at the torso, within 0.05 to 0.2 s, gives each to both and writes ``pushes.csv`` and the table
of docs/safety.md. The weighted program has the limits, cones and contacts of the other, weights of 10
to 1 from level to level in place of priorities, and takes some seconds for a push. So it gets those
that this law has lost first, then the others, from the one that moved the centre of mass furthest;
``--beside 160`` stops after so many. A push is its number: ``--first 40 --pushes 1`` is the fortieth
again, and what the file has already is not repeated.
"""

from __future__ import annotations

import argparse
import sys
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

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


FOUND = ("{}", "{}_step", "{}_com")
"""Columns of a law: whether the robot stands, its largest torque step after the push until it stood or
fell [N·m per tick], and the largest error of its centre of mass [m]. Empty where it was not run."""
COLUMNS = ("number", "impulse", "angle", "duration", "frame")


class Push(NamedTuple):
    """Impulse [N·s], direction [rad], duration [s] and frame of a push."""

    impulse: float
    angle: float
    duration: float
    frame: str


def draw(which: int) -> Push:
    """Draw the push with this number."""
    rng = np.random.default_rng([2026, which])
    impulse, angle = rng.uniform(CLASSES[0][0], CLASSES[-1][1]), rng.uniform(-np.pi, np.pi)
    return Push(impulse, angle, rng.uniform(0.05, 0.2), str(rng.choice(["pelvis", "torso_link"])))


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


Rows = dict[int, dict[str, Any]]
"""What is known of every push, by its number."""


def known(path: Path) -> Rows:
    """Read what was found."""
    return {int(row["number"]): dict(row) for row in read_csv(path)} if path.exists() else {}


def find(rows: Rows, which: int, law: str) -> None:
    """Give a push to a law, unless it has had it, and write what came of it."""
    if which not in rows:
        empty = [name.format(law) for name in FOUND for law in LAWS]
        rows[which] = {
            **dict(zip(COLUMNS, (which, *draw(which)), strict=True)),
            **dict.fromkeys(empty, ""),
        }
    row = rows[which]
    if row[law]:
        return
    found = stand_and_be_pushed(which, law)
    row.update(zip((name.format(law) for name in FOUND), (str(found[0]), *found[1:]), strict=True))
    print(which, law, found, file=sys.stderr, flush=True)
    write_csv(CSV, [rows[n] for n in sorted(rows)])


def stood(row: dict[str, Any], law: str) -> bool:
    """Tell whether the robot stands after a push."""
    return row[law] == "True"


def table(rows: Rows) -> str:
    """Write what became of the pushes, one row of the table for each class of impulses.

    Whatever the weighted program has not been given counts as taken back by it: those that only it takes
    back are all there are, and those that only this law takes back at least so many.
    """
    head = ["impulse [N·s]", "pushes", "opspace stands", "only weighted", "only opspace, at least"]
    head += ["step, median", "99 %", "centre of mass, median [mm]"]
    lines = []
    for low, high in (*CLASSES, (CLASSES[0][0], CLASSES[-1][1])):
        inside = [row for row in rows.values() if low <= float(row["impulse"]) < high]
        stand = [row for row in inside if stood(row, "ours")]
        steps = [float(row["ours_step"]) for row in stand]
        ways = [1e3 * float(row["ours_com"]) for row in stand]
        counts = [
            len(inside),
            len(stand),
            sum(stood(row, "weighted") and not stood(row, "ours") for row in inside),
            sum(row["weighted"] == "False" for row in stand),
        ]
        measured = [np.median(steps), np.quantile(steps, 0.99), np.median(ways)]
        name = f"{low:.0f} to {high:.0f}"
        lines.append([name, *(f"{count}" for count in counts), *map(number, measured)])
    return markdown_table(head, lines)


def main() -> None:
    """Push what has not been pushed yet, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--pushes", type=int, default=1000, help="how many there are to be")
    parser.add_argument("--first", type=int, default=0, help="number of the first")
    parser.add_argument("--beside", type=int, help="how many of the hardest both laws are given")
    parser.add_argument("--draw", action="store_true", help="only write the table anew")
    asked = parser.parse_args()
    rows = known(CSV)
    numbers = [] if asked.draw else range(asked.first, asked.first + asked.pushes)
    for which in numbers:
        find(rows, which, "ours")
    for which in numbers:
        if not stood(rows[which], "ours"):
            find(rows, which, "weighted")
    hardest = sorted(numbers, key=lambda n: -float(rows[n]["ours_com"]))
    for which in hardest[: asked.beside]:
        find(rows, which, "weighted")
    if rows:
        replace_block(DOCUMENT, "pushes", table(known(CSV)))


if __name__ == "__main__":
    main()
