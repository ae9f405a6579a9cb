"""Lead a PUMA 560 through each of its singularities, and show what a posture and a speed limit do.

``python docs/evidence/buffer_singularities.py`` runs everything (about two minutes), writes
``buffer_*.csv`` and the tables of docs/singularities.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from buffer_document import DOCS, EVIDENCE, number, read_csv, replace_block, table, write_csv
from buffer_motions import DEFAULT, START, Reach, Run, out_and_back, run, tasks

import opspace as osc

DOCUMENT = DOCS / "singularities.md"
VARIANTS: Mapping[str, osc.Singularity | None] = {
    "without": None,
    "switch": osc.Singularity(profile="step", near=0.0),
    "transition": DEFAULT,
}
RECOVERED = 1e-3
"""An arm that is back within so many metres and radians has recovered."""


def elbow(
    singularity: osc.Singularity | None, *, name: str = "puma560", posture: bool = True
) -> Run:
    """Lead the tool 0.25 m out of the workspace and back: the elbow straightens."""
    reach = Reach.of(name)
    way = reach.way + 0.25
    reference, back = reach.out_and_back(way, way / 0.2, 1.5)
    stack = tasks(reference, with_posture=posture)
    duration = back + way / 0.2 + 1.0
    return run(reach.robot, stack, duration, singularity=singularity, back=back)


def wrist(singularity: osc.Singularity | None, *, goal: float = 0.8) -> Run:
    """Tilt the tool past the forearm's axis, 0.03 rad beside it, and back: joint 5 changes sign."""
    robot = osc.load_robot("puma560")
    start, end = robot.q_reference.copy(), robot.q_reference.copy()
    start[4], end[4], end[3] = -0.8, goal, 0.15
    here, there = _rotation(robot, start), _rotation(robot, end)
    back = START + 3.0
    tilt = osc.Chain(
        (0.0, osc.OrientationMinimumJerk(here, there, 2.0, start_time=START)),
        (back, osc.OrientationMinimumJerk(there, here, 2.0, start_time=back)),
    )
    stack = tasks(None, orientation=tilt, posture=start)
    return run(robot, stack, back + 3.0, singularity=singularity, q=start, back=back)


def shoulder(singularity: osc.Singularity | None) -> Run:
    """Lead the wrist over the first joint's axis and back, closer to it than the shoulder is wide."""
    robot = osc.load_robot("puma560")
    # Wrist 0.35 m before the axis and 0.48 m above the shoulder, the tool across the arm's plane.
    q = np.array([0.0, 1.7546, -3.154, np.pi / 2, np.pi / 2, 0.0])
    robot.update(q, np.zeros(robot.nv))
    start = robot.position(robot.frame_id(robot.tool)).copy()
    reference, back = out_and_back(start, start + [-0.7, 0.15, 0.0], 3.0, 1.0)
    stack = tasks(reference, posture=q)
    return run(robot, stack, back + 4.0, singularity=singularity, q=q, back=back)


ARMS = ("puma560", "ur3", "ur5", "ur10", "panda", "kinova", "xarm7", "z1")

CASES: Mapping[str, Callable[[osc.Singularity | None], Run]] = {
    "elbow": elbow,
    "wrist": wrist,
    "shoulder": shoulder,
}


def _rotation(robot: osc.Robot, q: np.ndarray) -> np.ndarray:
    robot.update(q, np.zeros(robot.nv))
    return robot.rotation(robot.frame_id(robot.tool)).copy()


def measured(done: Run) -> dict[str, str | float]:
    """Return the columns that the tables have in common."""
    completed = done.outcome.completed
    back_home = completed and max(done.final("orientation"), done.final("position")) < RECOVERED
    return {
        "completed": "yes" if completed else f"no, {done.outcome.t:.2f} s",
        "torque_step": done.torque_step,
        "joint_speed": done.joint_speed,
        "orientation_error": done.largest("orientation"),
        "position_error": done.largest("position"),
        "recovered": "yes" if back_home else "no",
    }


def singularities() -> list[dict[str, str | float]]:
    """Run every case with every variant."""
    return [
        {"case": case, "variant": variant, **measured(lead(option))}
        for case, lead in CASES.items()
        for variant, option in VARIANTS.items()
    ]


def stops() -> list[dict[str, str | float]]:
    """Stop the tool nearer and nearer to the wrist singularity and see how far it is off at rest."""
    rows: list[dict[str, str | float]] = []
    for goal in (-0.7, -0.6, -0.5, -0.4, -0.2, 0.0):
        done = wrist(osc.Singularity(), goal=goal)
        at = int(np.searchsorted(done.t, done.back)) - 1
        rows.append(
            {
                "joint5": f"{goal:g}",
                "sigma": done.seen.sigma[at],
                "response": done.seen.response[at],
                "activation": done.seen.activation[at],
                "stop_error": 1e3 * done.seen.errors["orientation"][at],
            }
        )
    return rows


def postures() -> list[dict[str, str | float]]:
    """Run the elbow with and without a posture task at the end of the stack."""
    rows: list[dict[str, str | float]] = []
    for name, joint in (("puma560", 2), ("ur5", 2)):
        for last, present in (("posture", True), ("damping", False)):
            done = elbow(DEFAULT, name=name, posture=present)
            q = np.array(done.seen.q)
            rows.append(
                {
                    "robot": name,
                    "last level": last,
                    "torque_step": done.torque_step,
                    "joint_speed": done.joint_speed,
                    "rest_speed": done.rest_speed,
                    "least_sigma": float(np.min(done.seen.sigma)),
                    "final_error": done.final("position"),
                    "elbow": f"{q[0, joint]:.2f} → {q[-1, joint]:.2f}",
                }
            )
    return rows


def speeds() -> list[dict[str, str | float]]:
    """Ask for a point out of reach at once, with several limits of the speed, and by a reference."""
    rows: list[dict[str, str | float]] = []
    robot = osc.load_robot("puma560")
    robot.update(robot.q_reference, np.zeros(robot.nv))
    start = robot.position(robot.frame_id(robot.tool)).copy()
    goal = start + [0.6, 0.0, 0.0]
    led = osc.MinimumJerk(start, goal, 2.0)
    asked: dict[str, tuple[osc.Reference | np.ndarray, float | None]] = {
        "target set at once": (goal, None),
        **{f"max_speed={limit:g} m/s": (goal, limit) for limit in (1.0, 0.5, 0.25)},
        "minimum jerk over 2 s": (led, None),
    }
    for name, (target, limit) in asked.items():
        done = run(robot, tasks(target, max_speed=limit), 4.0, back=3.9)
        tau = np.abs(np.array(done.seen.tau))
        rows.append(
            {
                "reference": name,
                "jump": float(np.abs(done.seen.tau[0] - _holding_torque(robot)).max()),
                "load": float((tau / robot.torque_limit).max()),
                "torque_step": done.torque_step,
                "joint_speed": done.joint_speed,
                "rest_speed": done.rest_speed,
            }
        )
    return rows


def _holding_torque(robot: osc.Robot) -> np.ndarray:
    """Return the torque (n,) that holds the reference posture, N·m."""
    robot.update(robot.q_reference, np.zeros(robot.nv))
    return robot.gravity.copy()


def scales() -> list[dict[str, str | float]]:
    """Find each arm's typical σ, and the paper's buffer as multiples of it."""
    rows: list[dict[str, str | float]] = []
    for name in ARMS:
        robot = osc.load_robot(name)
        stack = osc.Stack([osc.OrientationTask(), osc.PositionTask()])
        found = osc.Controller(robot, stack).calibration.references
        position, orientation = (float(found[task][0]) for task in ("position", "orientation"))
        paper = f"{number(0.01 / position)} to {number(0.02 / position)}"
        rows.append(
            {"robot": name, "position": position, "orientation": orientation, "paper": paper}
        )
    return rows


TABLES: Mapping[str, Callable[[], list[dict[str, str | float]]]] = {
    "scales": scales,
    "singularities": singularities,
    "stops": stops,
    "postures": postures,
    "speeds": speeds,
}
HEADS: Mapping[str, str] = {
    "torque_step": "torque step [N·m]",
    "joint_speed": "joint speed [rad/s]",
    "orientation_error": "orientation error [rad]",
    "position_error": "position error [m]",
    "rest_speed": "speed at rest [rad/s]",
    "least_sigma": "smallest σ",
    "final_error": "position error at the end [m]",
    "elbow": "elbow, start → end [rad]",
    "jump": "torque jump at the start [N·m]",
    "load": "largest torque / motor's",
    "joint5": "joint 5 asked for [rad]",
    "sigma": "σ",
    "stop_error": "orientation error [mrad]",
    "position": "position [1/kg]",
    "orientation": "orientation [1/(kg·m²)]",
    "paper": "0.01 to 0.02 1/kg is relative",
}
"""Heads of the columns that are not named by their key."""


def written(rows: list[dict[str, str]]) -> str:
    """Write rows of a CSV file as a table."""
    heads = [HEADS.get(key, key) for key in rows[0]]
    return table(heads, [[_cell(value) for value in row.values()] for row in rows])


def _cell(value: str) -> str:
    try:
        return number(float(value))
    except ValueError:
        return value


def main() -> None:
    """Run everything and write it down."""
    for name, rows in TABLES.items():
        path = EVIDENCE / f"buffer_{name}.csv"
        write_csv(path, rows())
        replace_block(DOCUMENT, name, written(read_csv(path)))


if __name__ == "__main__":
    main()
