"""docs/robots.md holds: its tables are those of the CSV file, which is what runs give."""

import importlib
import json
import subprocess
import sys
from pathlib import Path

import pytest
from tests.another_python import python

EVIDENCE = Path(__file__).parents[2] / "docs" / "evidence"
SURE = (
    "max_torque_step",
    "max_joint_speed",
    "min_sigma",
    "max_joint_position",
)
"""What is far above rounding in every run with continuous transitions."""


@pytest.fixture
def robots_table(monkeypatch):
    """Import the script for one test."""
    monkeypatch.syspath_prepend(EVIDENCE)
    yield importlib.import_module("robots_table")
    for path in EVIDENCE.glob("*.py"):
        sys.modules.pop(path.stem, None)


def run_again(robot, experiment, variants):
    """Run an experiment in a process of its own; shape checks would make it slower here."""
    program = (
        "import json, robots_table as r\n"
        f"rows = r.experiment_rows({robot!r}, r.EXPERIMENTS[{experiment!r}]({robot!r}), {variants})"
        "\nprint(json.dumps(rows))"
    )
    done = subprocess.run(
        python("-c", program),
        capture_output=True,
        encoding="utf-8",
        check=True,
        cwd=EVIDENCE,
    )
    return json.loads(done.stdout.splitlines()[-1])


def assert_close(row, written):
    assert row["completed"] == written["completed"]
    for key in SURE:
        if written[key]:
            assert row[key] == pytest.approx(float(written[key]), rel=0.05), key
    for key in ("rest_speed", "final_position_error", "max_orientation_error"):
        assert float(row[key]) < 2.0 * float(written[key]) + 1e-5, key


def test_the_tables_are_those_of_the_csv_file(robots_table):
    rows = robots_table.read_csv(robots_table.CSV)
    assert len(rows) == 9 * len(robots_table.ROBOTS)
    for name, text in robots_table.tables(rows).items():
        assert importlib.import_module("buffer_document").block(robots_table.DOCUMENT, name) == text


def test_every_arm_with_a_name_is_there(robots_table):
    from opspace import available_robots

    arms = {robot.name for robot in available_robots() if robot.kind == "arm" and robot.dof >= 6}
    assert arms == set(robots_table.ROBOTS)


def test_only_two_arms_turn_their_tools_on_the_way(robots_table):
    rows = robots_table.read_csv(robots_table.CSV)
    verdicts = robots_table.verdicts(rows).splitlines()[2:]
    missed = {line.split("|")[1].strip(): line.split("|")[4].strip() for line in verdicts}
    assert {robot for robot, goals in missed.items() if goals != "none"} == {"kinova", "z1"}
    assert missed["z1"] == "orientation error below 1e-3 rad"
    assert missed["kinova"] == f"{missed['z1']}; switch 20 times rougher"


def test_a_goal_that_is_missed_is_named(robots_table):
    rows = [row for row in robots_table.read_csv(robots_table.CSV) if row["robot"] == "ur3"]
    for row in rows:
        row["max_joint_position"] = "0.76"
        row["rest_speed"] = "0.02"
    verdict = robots_table.verdicts(rows)
    assert "at rest below 0.01 rad/s; within the limit" in verdict


def test_the_ur3_still_does_what_is_printed(robots_table):
    written = [
        row
        for row in robots_table.read_csv(robots_table.CSV)
        if (row["robot"], row["experiment"], row["variant"]) == ("ur3", "singularity", "transition")
    ]
    for row, old in zip(run_again("ur3", "singularity", ["transition"]), written, strict=True):
        assert_close(row, old)


@pytest.mark.slow
@pytest.mark.parametrize("experiment", ["singularity", "joint-limit", "joint-limit-fast"])
def test_all_robots_still_do_what_is_printed(robots_table, experiment):
    written = robots_table.read_csv(robots_table.CSV)
    for robot in robots_table.ROBOTS:
        smooth = ["x1", "x2", "x3"] if experiment == "joint-limit-fast" else ["transition"]
        old = [
            row
            for row in written
            if (row["robot"], row["experiment"]) == (robot, experiment) and row["variant"] in smooth
        ]
        for row, was in zip(run_again(robot, experiment, smooth), old, strict=True):
            assert_close(row, was)
