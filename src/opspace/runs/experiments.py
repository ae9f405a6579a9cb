"""The two experiments of the paper as scenarios: shipped for one arm, derived for every other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from opspace.robots import load_robot
from opspace.robots.protocol import Robot
from opspace.runs.geometry import Axis, first_axis, reach
from opspace.scenario.load import load_scenario, scenario_from, to_dict
from opspace.scenario.schema import Scenario

VARIANTS: Mapping[str, str] = MappingProxyType(
    {"without": "none", "switch": "switch", "transition": "transition"}
)
"""Method of a scenario by the name of the variant."""

SHIPPED_ROBOT = "puma560"

BEYOND = 0.25
"""How far outside the workspace the target is, m."""
OUT_SPEED = 0.2
"""Mean speed of the way out and of the way back, m/s."""
JOINT_RANGE = 0.75
"""Limit of the first joint on both sides of its start, rad."""
OVERSHOOT = 0.35
"""How far past the limit the tool is asked to swing, rad."""

STOP_SPEED = 20.0
"""A run is given up when a joint is faster, rad/s."""
STOP_TORQUE = 10.0
"""A run is given up when it asks for so many times the torque of the strongest joint."""

SPEEDS = (1.0, 2.0, 3.0)


@dataclass(frozen=True)
class Experiment:
    """One experiment on one robot.

    Attributes:
        name: ``singularity`` or ``joint-limit``.
        title: Its title in figures.
        runs: Scenario by variant.
    """

    name: str
    title: str
    runs: Mapping[str, Scenario]


def singularity(robot: str) -> Experiment:
    """The tool is led out of the workspace, waits and comes back (Fig. 2-5).

    Args:
        robot: Name or absolute path of the robot.

    Returns:
        The experiment without handling, with a hard switch and with transitions.
    """
    shipped = robot == SHIPPED_ROBOT
    scenario = load_scenario("singularity") if shipped else _singularity(load_robot(robot), robot)
    return Experiment("singularity", "out of reach and back", _variants(scenario))


def joint_limit(robot: str) -> Experiment:
    """The tool swings past the range of the first joint and comes back (Fig. 6-7).

    Args:
        robot: Name or absolute path of the robot.

    Returns:
        The experiment without handling, with a hard switch and with transitions, the limit active
        within a buffer on the position as in the paper.
    """
    return Experiment("joint-limit", "past a joint limit and back", _variants(_limit_base(robot)))


def fast_approaches(robot: str) -> Experiment:
    """The swing of `joint_limit` at several speeds, the limit active on the admissible acceleration.

    Args:
        robot: Name or absolute path of the robot.

    Returns:
        The experiment; its variants are ``x1``, ``x2`` and ``x3``.
    """
    base = _limit_base(robot)
    runs = {f"x{speed:g}": faster(base, speed) for speed in SPEEDS}
    return Experiment("joint-limit-fast", "approaches of different speed", runs)


def faster(scenario: Scenario, factor: float) -> Scenario:
    """The same motion in less time, the limit active on the admissible acceleration.

    Args:
        scenario: A scenario whose targets go out and come back.
        factor: How many times as fast.

    Returns:
        The scenario.
    """
    data = to_dict(scenario)
    for task in data["tasks"].values():
        target = task["target"]
        if isinstance(target, dict) and "out_duration" in target:
            target["out_duration"] /= factor
            target["back_duration"] /= factor
            # The return begins when it always did.
            saved = target["out_duration"] * (factor - 1.0)
            target["hold_duration"] += saved
    return scenario_from({**data, "joint_limits": {**data["joint_limits"], "mode": "admissible"}})


def _variants(scenario: Scenario) -> dict[str, Scenario]:
    return {
        name: scenario.model_copy(update={"method": method}) for name, method in VARIANTS.items()
    }


def _limit_base(robot: str) -> Scenario:
    if robot == SHIPPED_ROBOT:
        return load_scenario("joint-limit")
    return _joint_limit(load_robot(robot), robot)


def _singularity(robot: Robot, name: str) -> Scenario:
    axis = _axis_at_start(robot)
    length = float(np.linalg.norm(axis.arm))
    way = reach(robot) + BEYOND - length
    outward = way / length * axis.arm
    duration = max(round(way / OUT_SPEED, 1), 1.0)
    target = {
        "type": "out_and_back",
        "offset": outward.tolist(),
        "out_duration": duration,
        "hold_duration": 2.0,
        "back_duration": duration,
        "start_time": 0.5,
    }
    return scenario_from(
        {
            "description": "The tool is led out of the workspace and back",
            "robot": name,
            "duration": 4.5 + 2.0 * duration,
            "tasks": _tasks({"type": "hold"}, target, "reference"),
            # How fast joints become near a singularity is what is measured.
            "joint_limits": {"speeds": None},
            "stop": _stop(robot),
        }
    )


def _joint_limit(robot: Robot, name: str) -> Scenario:
    axis = _axis_at_start(robot)
    start = float(robot.q_reference[0])
    lower = max(start - JOINT_RANGE, float(robot.q_lower[0]))
    upper = min(start + JOINT_RANGE, float(robot.q_upper[0]))
    angle = upper - start + OVERSHOOT
    times = {"out_duration": 1.5, "hold_duration": 1.0, "back_duration": 1.5, "start_time": 0.5}
    # The tool turns with the arc, so that the motion that is asked for is one of the first joint
    # alone, and nothing but its limit is in the way.
    turn = {"type": "out_and_back", "offset": (angle * axis.direction).tolist(), **times}
    # The posture too: an arm with seven joints would otherwise reach round with the other six.
    joints = [angle if i == 0 else 0.0 for i in range(robot.nv)]
    follow = {"type": "out_and_back", "offset": joints, **times}
    swing = {
        "type": "swing",
        "angle": angle,
        "center": axis.center.tolist(),
        "axis": axis.direction.tolist(),
        **times,
    }
    return scenario_from(
        {
            "description": "The tool swings past the range of the first joint and returns",
            "robot": name,
            "duration": 6.0,
            "tasks": _tasks(turn, swing, follow),
            "joint_limits": {
                "mode": "buffer",
                "joints": {robot.joint_names[0]: [lower, upper]},
                "speeds": None,
            },
            "stop": _stop(robot),
        }
    )


def _axis_at_start(robot: Robot) -> Axis:
    robot.update(robot.q_reference, np.zeros(robot.nv))
    return first_axis(robot)


def _tasks(
    orientation: dict[str, Any], position: dict[str, Any], posture: dict[str, Any] | str
) -> dict[str, Any]:
    return {
        "orientation": {"type": "orientation", "level": 0, "target": orientation},
        "position": {"type": "position", "level": 1, "target": position},
        "posture": {"type": "posture", "level": 2, "kp": 25.0, "target": posture},
    }


def _stop(robot: Robot) -> dict[str, Any]:
    known = robot.torque_limit[np.isfinite(robot.torque_limit)]
    torque = STOP_TORQUE * float(known.max()) if known.size else None
    return {"max_joint_speed": STOP_SPEED, "max_torque": torque}
