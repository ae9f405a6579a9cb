"""A scenario for a robot that nobody has written one for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from opspace.errors import UnknownNameError, unknown_name
from opspace.robots import available_robots
from opspace.robots.loading import SUFFIXES
from opspace.scenario.load import load_scenario, scenario_from, shipped_scenarios
from opspace.scenario.schema import Scenario

DURATION = 10.0
"""How long it takes where nobody ends it, s."""


def scenario_or_robot(source: str, overrides: Sequence[str] = ()) -> Scenario:
    """Read a scenario, or make one that holds a robot where its reference posture is.

    Args:
        source: What `load_scenario` takes, or what `opspace.load_robot` takes.
        overrides: Single values to change, each ``key=value``.

    Returns:
        The scenario. That of a robot holds its tool and its posture, with targets to drag.

    Raises:
        UnknownNameError: There is neither a scenario nor a robot of this name.
        ScenarioError: The scenario cannot be used.
    """
    robots = [robot.name for robot in available_robots()]
    if Path(source).suffix in SUFFIXES:
        return _holding(str(Path(source).expanduser().absolute()), overrides)
    if source in robots and source not in shipped_scenarios():
        return _holding(source, overrides)
    try:
        return load_scenario(source, overrides)
    except UnknownNameError:
        choices = [*shipped_scenarios(), *robots]
        raise unknown_name("scenario or robot", source, choices) from None


def _holding(robot: str, overrides: Sequence[str]) -> Scenario:
    data = {
        "description": "holds the robot where it is",
        "robot": robot,
        "duration": DURATION,
        "tasks": {
            "orientation": {"type": "orientation", "level": 0, "max_speed": 1.0},
            "position": {"type": "position", "level": 1, "max_speed": 0.5},
            "posture": {"type": "posture", "level": 2},
        },
    }
    return scenario_from(data, overrides)
