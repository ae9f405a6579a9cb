"""Repeat both experiments on every arm that has a name, and write the tables of docs/robots.md.

``python docs/evidence/robots_table.py`` runs everything (about a quarter of an hour), writes
``robots_table.csv`` and the tables; with names of robots only those are run again, with ``--tables``
none.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from buffer_document import DOCS, EVIDENCE, number, read_csv, replace_block, table, write_csv

from opspace.runs.experiments import Experiment, fast_approaches, joint_limit, singularity
from opspace.runs.metrics import UNITS
from opspace.runs.run import limited_joint, run_scenario

CSV = EVIDENCE / "robots_table.csv"
DOCUMENT = DOCS / "robots.md"
ROBOTS = ("puma560", "ur3", "ur5", "ur10", "panda", "kinova", "xarm7", "z1")
"""Every arm of six or seven joints."""
EXPERIMENTS = {
    "singularity": singularity,
    "joint-limit": joint_limit,
    "joint-limit-fast": fast_approaches,
}

VARIANTS = {
    "singularity": ("transition", "switch", "without"),
    "joint-limit": ("transition", "switch", "without"),
    "joint-limit-fast": ("x1", "x2", "x3"),
}
KEYS = (*UNITS, "upper_limit", "reason")
JOINT = ("max_joint_position", "min_joint_position", "upper_limit")
"""Positions of the limited joint, of which more than two digits matter."""
WITHIN = 1e-4
"""Overshoot that counts as none, rad: the CSV file keeps four digits."""

Row = dict[str, str]


def experiment_rows(
    robot: str, experiment: Experiment, variants: Sequence[str] = ()
) -> list[dict[str, str | float]]:
    """Run an experiment on a robot.

    Args:
        robot: Name of the robot.
        experiment: What to run.
        variants: Variants to run; none for all.

    Returns:
        One row per variant: the metrics, and the range of the limited joint.
    """
    rows: list[dict[str, str | float]] = []
    for variant in variants or experiment.runs:
        scenario = experiment.runs[variant]
        with tempfile.TemporaryDirectory() as out:
            result = run_scenario(scenario, Path(out) / "run")
            metrics = json.loads((Path(out) / "run" / "metrics.json").read_text(encoding="utf-8"))
        joint = limited_joint(scenario)
        limits = scenario.joint_limits
        lower, upper = limits.joints[joint] if joint and limits else ("", "")
        rows.append(
            {
                "robot": robot,
                "experiment": experiment.name,
                "variant": variant,
                **{key: _plain(metrics[key]) for key in UNITS},
                "lower_limit": lower,
                "upper_limit": upper,
                "reason": result.outcome.reason,
            }
        )
        print(robot, experiment.name, variant, json.dumps(rows[-1]), flush=True)
    return rows


def _plain(value: bool | float | None) -> str | float:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "" if value is None else value


def variant_table(rows: list[Row], experiment: str, variant: str) -> str:
    """Write one variant of an experiment for all robots; columns that nobody fills are left out."""
    chosen = _chosen(rows, experiment, variant)
    kept = [key for key in KEYS if any(row[key] for row in chosen)]
    cells = [[row["robot"], *(_cell(key, row[key]) for key in kept)] for row in chosen]
    return table(["robot", *map(_head, kept)], cells)


def _chosen(rows: list[Row], experiment: str, variant: str) -> list[Row]:
    return [r for r in rows if (r["experiment"], r["variant"]) == (experiment, variant)]


def verdicts(rows: list[Row]) -> str:
    """Write per robot how much larger the switch's torque step is, and which goals were missed."""
    lines = []
    for robot in dict.fromkeys(row["robot"] for row in rows):
        own = [row for row in rows if row["robot"] == robot]
        ratios = [_ratio(own, experiment) for experiment in ("singularity", "joint-limit")]
        missed = "; ".join(_missed(own)) or "none"
        lines.append([robot, *(number(ratio) for ratio in ratios), missed])
    heads = ["robot", "switch / transition, singularity", "joint limit", "goals missed"]
    return table(heads, lines)


def _ratio(own: list[Row], experiment: str) -> float:
    """Return how many times larger the torque step of the hard switch is."""
    steps = [
        float(_chosen(own, experiment, variant)[0]["max_torque_step"])
        for variant in ("switch", "transition")
    ]
    return steps[0] / steps[1]


def _missed(own: list[Row]) -> list[str]:
    """Name the goals that a robot misses with continuous transitions."""
    (lost,), (limited,) = (
        _chosen(own, experiment, "transition") for experiment in ("singularity", "joint-limit")
    )
    fast = [_chosen(own, "joint-limit-fast", variant)[0] for variant in ("x1", "x2", "x3")]
    goals = {
        "completes": all(row["completed"] == "yes" for row in (lost, limited, *fast)),
        "orientation error below 1e-3 rad": float(lost["max_orientation_error"]) < 1e-3,
        "at rest below 0.01 rad/s": float(lost["rest_speed"]) < 1e-2,
        "back within 1 mm": all(
            float(row["final_position_error"]) < 1e-3 for row in (lost, limited, *fast)
        ),
        "switch 20 times rougher": min(_ratio(own, "singularity"), _ratio(own, "joint-limit")) > 20,
        "within the limit": all(
            float(row["max_joint_position"]) < float(row["upper_limit"]) + WITHIN
            for row in (limited, *fast)
        ),
        "uses the range": all(
            float(row["max_joint_position"]) > float(row["upper_limit"]) - 1e-3 for row in fast
        ),
    }
    return [goal for goal, met in goals.items() if not met]


def _head(key: str) -> str:
    if key == "reason":
        return "stopped because"
    unit = UNITS.get(key, "rad")
    return key.replace("_", " ") + ("" if unit == "1" else f" [{unit}]")


def _cell(key: str, value: str) -> str:
    if not value or key in ("completed", "reason"):
        return value or "–"
    x = float(value)
    if key in JOINT:
        return f"{x:.3f}".replace("-0.000", "0.000")
    return number(x)


def tables(rows: list[Row]) -> dict[str, str]:
    """Return every generated block of docs/robots.md by name."""
    blocks = {
        f"{experiment} {variant}": variant_table(rows, experiment, variant)
        for experiment, variants in VARIANTS.items()
        for variant in variants
    }
    return {"verdicts": verdicts(rows), **blocks}


def main(names: Sequence[str]) -> None:
    """Run the robots of these names, all by default, and write the tables."""
    known = read_csv(CSV) if CSV.is_file() else []
    again = [name for name in names if name != "--tables"] or ([] if names else list(ROBOTS))
    for robot in again:
        new = [row for make in EXPERIMENTS.values() for row in experiment_rows(robot, make(robot))]
        known = [row for row in known if row["robot"] != robot]
        write_csv(CSV, sorted([*known, *new], key=lambda row: ROBOTS.index(str(row["robot"]))))
        known = read_csv(CSV)
    for name, text in tables(known).items():
        replace_block(DOCUMENT, name, text)


if __name__ == "__main__":
    main(sys.argv[1:])
