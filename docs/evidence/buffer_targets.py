"""Send arms to random targets that they reach, and count those at which they rest with an error.

``python docs/evidence/buffer_targets.py`` runs everything (some fifteen minutes), writes
``buffer_targets.csv`` and its table in docs/singularities.md.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
from buffer_document import DOCS, EVIDENCE, number, read_csv, replace_block, table, write_csv
from seven_joint_arms import load_arm

import opspace as osc

CSV = EVIDENCE / "buffer_targets.csv"
DOCUMENT = DOCS / "singularities.md"
ARMS = ("panda", "fr3-like", "iiwa14-like", "xarm7", "gen3-like", "ur5", "ur10", "puma560")
VARIANTS = {
    "one": osc.Singularity(0.1, 0.6, release=1.0),
    "two": osc.Singularity(near=0.0),
    "rest": osc.Singularity(),
}
TARGETS = 38
DISTANCE, ANGLE = 0.3, 1.0
"""Targets lie within so many metres and radians of the home posture."""
TIME, LATE = 6.0, 20.0
"""After so long an arm has arrived, and after so long it has or does not, s."""
ARRIVED = 1e-4
"""Errors in metres and radians below which a target is reached."""


def targets(robot: osc.Robot) -> list[tuple[np.ndarray, np.ndarray]]:
    """Draw positions and orientations around those of the reference posture."""
    rng = np.random.default_rng(7)
    robot.update(robot.q_reference, np.zeros(robot.nv))
    tool = robot.frame_id(robot.tool)
    here, turned = robot.position(tool).copy(), robot.rotation(tool).copy()
    found = []
    for _ in range(TARGETS):
        aside, axis = rng.normal(size=(2, 3))
        reach = DISTANCE * rng.random() ** (1.0 / 3.0)
        rotation = _rotation(axis / np.linalg.norm(axis), ANGLE * rng.random())
        found.append((here + reach * aside / np.linalg.norm(aside), rotation @ turned))
    return found


def errors(
    robot: osc.Robot,
    target: tuple[np.ndarray, np.ndarray],
    option: osc.Singularity | None,
    time: float = TIME,
) -> tuple[float, float]:
    """Return the errors of position and orientation at the end, m and rad; inf for a run given up."""
    hand = osc.PositionTask(target=target[0], max_speed=0.5)
    turn = osc.OrientationTask(target=target[1], max_speed=1.0)
    stack = osc.Stack([osc.JointLimits(), turn, hand, osc.PostureTask(robot.q_reference)])
    controller = osc.Controller(robot, stack, singularity=option)
    plant = osc.Plant(robot, robot.q_reference)
    outcome = osc.simulate(plant, controller, time)
    if not outcome.completed:
        return float("inf"), float("inf")
    command = controller.step(plant.t, plant.q, plant.v)
    return tuple(command.tasks[name].error_norm for name in ("position", "orientation"))


def measured(robot: osc.Robot) -> dict[str, float | str]:
    """Count the targets that are reached without any handling, and what rests elsewhere with it."""
    reached = [one for one in targets(robot) if max(errors(robot, one, None)) < ARRIVED]
    row: dict[str, float | str] = {"reached without handling": str(len(reached))}
    for name, option in VARIANTS.items():
        found = [(one, errors(robot, one, option)) for one in reached]
        missed = {id(one): one for one, away in found if max(away) >= ARRIVED}
        worst = max((1e3 * away[0] for one, away in found if id(one) in missed), default=0.0)
        row |= {f"{name}_missed": str(len(missed)), f"{name}_worst": worst}
    late = [errors(robot, one, VARIANTS["rest"], LATE) for one in missed.values()]
    row["rest_late"] = str(sum(max(away) >= ARRIVED for away in late))
    return row


def _rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    K = np.cross(np.eye(3), -axis)
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K


def everything() -> list[dict[str, float | str]]:
    """Measure every arm."""
    rows: list[dict[str, float | str]] = []
    with tempfile.TemporaryDirectory() as folder:
        for name in ARMS:
            rows.append({"robot": name, **measured(load_arm(name, Path(folder)))})
            print(rows[-1], flush=True)
    return rows


def written(rows: list[dict[str, str]]) -> str:
    """Write one line per arm."""
    heads = ["robot", "reached without handling", "one buffer: miss", "by at most [mm]"]
    heads += ["two buffers, `near=0`: miss", "by at most [mm]"]
    heads += ["default: miss", "by at most [mm]", "after 20 s"]
    keys = ("one_missed", "one_worst", "two_missed", "two_worst")
    keys += ("rest_missed", "rest_worst", "rest_late")
    cells = [
        [row[key] if not key.endswith("worst") else number(float(row[key])) for key in keys]
        for row in rows
    ]
    names = [[row["robot"], row["reached without handling"]] for row in rows]
    return table(heads, [name + cell for name, cell in zip(names, cells, strict=True)])


def main() -> None:
    """Measure and write the table."""
    if "--draw" not in sys.argv:
        write_csv(CSV, everything())
    replace_block(DOCUMENT, "targets", written(read_csv(CSV)))


if __name__ == "__main__":
    main()
