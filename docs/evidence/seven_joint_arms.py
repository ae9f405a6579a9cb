"""Arms with a shoulder, an elbow and a wrist of three axes, by their published lengths and masses.

No file of these robots comes with a package; links are rods here.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

import opspace as osc

SPHERICAL = ("0 0 1", "0 1 0", "0 0 1", "0 -1 0", "0 0 1", "0 1 0", "0 0 1")
WITH_OFFSETS = ("0 0 1", "0 1 0", "0 0 1", "0 -1 0", "0 0 1", "0 -1 0", "0 0 -1")
RADIUS = 0.05
"""Of every link, m."""


class Arm(NamedTuple):
    """What a file needs to know, of the arm that stands upright.

    Attributes:
        places: Where the joints are, and the flange at last: ahead and up, m.
        axes: Of the joints.
        masses: Of the seven links, kg.
        limits: Angles between which each joint moves, rad.
        torques: What each motor gives, N·m.
        home: Reference posture, rad.
    """

    places: tuple[tuple[float, float], ...]
    axes: tuple[str, ...]
    masses: tuple[float, ...]
    limits: tuple[tuple[float, float], ...]
    torques: tuple[float, ...]
    home: tuple[float, ...]


def straight(
    shoulder: float, elbow: float, wrist: float, flange: float
) -> tuple[tuple[float, float], ...]:
    """Place joints on one line, every second one half-way between its neighbours."""
    heights, reached = [], 0.0
    for length in (shoulder, elbow, wrist, flange):
        heights += [reached + length / 2, reached + length]
        reached += length
    return tuple((0.0, height) for height in heights)


def both_ways(*angles: float) -> tuple[tuple[float, float], ...]:
    """Let joints turn as far to one side as to the other."""
    return tuple((-angle, angle) for angle in angles)


ARMS = {
    "iiwa14-like": Arm(
        straight(0.36, 0.42, 0.4, 0.126),
        SPHERICAL,
        (5.76, 6.35, 3.5, 3.5, 3.5, 1.8, 1.2),
        both_ways(2.97, 2.09, 2.97, 2.09, 2.97, 2.09, 3.05),
        (320.0, 320.0, 176.0, 176.0, 110.0, 40.0, 40.0),
        (0.0, 0.5, 0.0, 1.4, 0.0, 0.9, 0.0),
    ),
    "gen3-like": Arm(
        straight(0.2848, 0.4208, 0.3143, 0.1674),
        SPHERICAL,
        (1.38, 1.16, 1.16, 0.93, 0.68, 0.68, 0.5),
        both_ways(6.2, 2.24, 6.2, 2.57, 6.2, 2.09, 6.2),
        (39.0, 39.0, 39.0, 39.0, 13.0, 13.0, 13.0),
        (0.0, 0.26, 0.0, 2.27, 0.0, -0.96, 1.57),
    ),
    "fr3-like": Arm(
        (
            (0.0, 0.1665),
            (0.0, 0.333),
            (0.0, 0.491),
            (0.0825, 0.649),
            (0.0, 0.841),
            (0.0, 1.033),
            (0.088, 1.033),
            (0.088, 0.926),
        ),
        WITH_OFFSETS,
        (2.93, 2.94, 2.24, 2.62, 2.33, 1.82, 0.63),
        (
            (-2.74, 2.74),
            (-1.78, 1.78),
            (-2.9, 2.9),
            (-3.04, -0.15),
            (-2.81, 2.81),
            (0.54, 4.52),
            (-3.02, 3.02),
        ),
        (87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0),
        (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785),
    ),
}


def load_arm(name: str, folder: Path) -> osc.Robot:
    """Write an arm into a file and load it; any other name is one of the catalogue's."""
    if name not in ARMS:
        return osc.load_robot(name)
    path = folder / f"{name}.xml"
    path.write_text(mjcf(name, ARMS[name]), encoding="utf-8")
    return osc.load_robot(path)


def mjcf(name: str, arm: Arm) -> str:
    """Return the model file of an arm."""
    x, z = np.array(arm.places).T
    ahead, up = np.diff(x), np.diff(z)
    places = [(x[0], z[0]), *zip(ahead[:6], up[:6], strict=True)]
    bodies = "".join(
        f'<body name="link{k + 1}" pos="{places[k][0]} 0 {places[k][1]}">'
        f'<joint name="joint{k + 1}" axis="{arm.axes[k]}" range="{low} {high}" armature="0.1"/>'
        + _rod(arm.masses[k], ahead[k], up[k])
        for k, (low, high) in enumerate(arm.limits)
    )
    motors = "".join(
        f'<motor joint="joint{k}" ctrllimited="true" ctrlrange="{-torque} {torque}"/>'
        for k, torque in enumerate(arm.torques, 1)
    )
    return (
        f'<mujoco model="{name}"><compiler angle="radian" autolimits="true"/><worldbody>{bodies}'
        f'<site name="tool" pos="{ahead[6]} 0 {up[6]}"/>{"</body>" * 7}</worldbody>'
        f"<actuator>{motors}</actuator>"
        f'<keyframe><key name="home" qpos="{" ".join(map(str, arm.home))}"/></keyframe></mujoco>'
    )


def _rod(mass: float, ahead: float, up: float) -> str:
    """Write the inertia of a rod from a joint to the next."""
    across = mass * (3.0 * RADIUS**2 + ahead**2 + up**2) / 12.0
    along = mass * RADIUS**2 / 2.0
    return (
        f'<inertial pos="{ahead / 2} 0 {up / 2}" zaxis="{ahead} 0 {up}" mass="{mass}" '
        f'diaginertia="{across} {across} {along}"/>'
    )
