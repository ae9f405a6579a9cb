"""In what a joint's position, speed and torque are measured: hinges turn, slides move."""

from __future__ import annotations

from opspace.robots.protocol import Robot

BASE_PLACE, BASE_SPEEDS, BASE_NUMBERS = 3, 6, 7
"""Numbers of a floating base: of its position, of its velocity, of its configuration."""


def joint_units(robot: Robot) -> tuple[str, ...]:
    """Return the unit of each coordinate's position, (nv,) "rad" or "m".

    A robot of one's own that does not say it has hinges.
    """
    return tuple(getattr(robot, "joint_units", ("rad",) * len(robot.joint_names)))


def coordinates(robot: Robot) -> tuple[tuple[str, str], ...]:
    """Name every number of a configuration, with its unit, (nq,).

    Those of a joint with one coordinate have its name. A floating base has seven, a position and a
    quaternion wxyz, where a velocity has six; other joints of several coordinates have only numbers.
    """
    names, units = robot.joint_names, joint_units(robot)
    if robot.nq == robot.nv:
        return tuple(zip(names, units, strict=True))
    if robot.floating_base and robot.nq == robot.nv + 1:
        base = [(f"floating_base/{i}", "m" if i < BASE_PLACE else "1") for i in range(BASE_NUMBERS)]
        return (*base, *zip(names[BASE_SPEEDS:], units[BASE_SPEEDS:], strict=True))
    return tuple((f"coordinate/{i}", "1") for i in range(robot.nq))


def effort_unit(unit: str) -> str:
    """Return what drives a joint whose position has this unit: a torque or a force."""
    return "N" if unit == "m" else "N·m"
