"""In what a joint's position, speed and torque are measured: hinges turn, slides move."""

from __future__ import annotations

from opspace.robots.protocol import Robot


def joint_units(robot: Robot) -> tuple[str, ...]:
    """Return the unit of each coordinate's position, (nv,) "rad" or "m".

    A robot of one's own that does not say it has hinges.
    """
    return tuple(getattr(robot, "joint_units", ("rad",) * len(robot.joint_names)))


def effort_unit(unit: str) -> str:
    """Return what drives a joint whose position has this unit: a torque or a force."""
    return "N" if unit == "m" else "N·m"
