"""Arms with a spherical shoulder, an elbow and a spherical wrist, by their published lengths and masses.

No robot file of these two makers comes with a package; links are rods here.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import opspace as osc

AXES = ("0 0 1", "0 1 0", "0 0 1", "0 -1 0", "0 0 1", "0 1 0", "0 0 1")
RADIUS = 0.05
"""Of every link, m."""


class Arm(NamedTuple):
    """What a file needs to know.

    Attributes:
        lengths: Base to shoulder, to elbow, to wrist, to flange, m.
        masses: Of the seven links, kg.
        limits: Largest angle of each joint to both sides, rad.
        torques: What each motor gives, N·m.
        home: Reference posture, rad.
    """

    lengths: tuple[float, float, float, float]
    masses: tuple[float, ...]
    limits: tuple[float, ...]
    torques: tuple[float, ...]
    home: tuple[float, ...]


ARMS = {
    "iiwa14-like": Arm(
        (0.36, 0.42, 0.4, 0.126),
        (5.76, 6.35, 3.5, 3.5, 3.5, 1.8, 1.2),
        (2.97, 2.09, 2.97, 2.09, 2.97, 2.09, 3.05),
        (320.0, 320.0, 176.0, 176.0, 110.0, 40.0, 40.0),
        (0.0, 0.5, 0.0, 1.4, 0.0, 0.9, 0.0),
    ),
    "gen3-like": Arm(
        (0.2848, 0.4208, 0.3143, 0.1674),
        (1.38, 1.16, 1.16, 0.93, 0.68, 0.68, 0.5),
        (6.2, 2.24, 6.2, 2.57, 6.2, 2.09, 6.2),
        (39.0, 39.0, 39.0, 39.0, 13.0, 13.0, 13.0),
        (0.0, 0.26, 0.0, 2.27, 0.0, -0.96, 1.57),
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
    half = [length / 2 for length in arm.lengths]
    ahead = [half[0], half[1], half[1], half[2], half[2], half[3], half[3]]
    before = [half[0], half[0], half[1], half[1], half[2], half[2], half[3]]
    bodies = "".join(
        f'<body name="link{k}" pos="0 0 {before[k - 1]}">'
        f'<joint name="joint{k}" axis="{AXES[k - 1]}" range="{-limit} {limit}" armature="0.1"/>'
        + _rod(mass, ahead[k - 1])
        for k, (mass, limit) in enumerate(zip(arm.masses, arm.limits, strict=True), 1)
    )
    motors = "".join(
        f'<motor joint="joint{k}" ctrllimited="true" ctrlrange="{-torque} {torque}"/>'
        for k, torque in enumerate(arm.torques, 1)
    )
    return (
        f'<mujoco model="{name}"><compiler angle="radian" autolimits="true"/><worldbody>{bodies}'
        f'<site name="tool" pos="0 0 {half[3]}"/>{"</body>" * 7}</worldbody>'
        f"<actuator>{motors}</actuator>"
        f'<keyframe><key name="home" qpos="{" ".join(map(str, arm.home))}"/></keyframe></mujoco>'
    )


def _rod(mass: float, length: float) -> str:
    across = mass * (3.0 * RADIUS**2 + length**2) / 12.0
    along = mass * RADIUS**2 / 2.0
    return (
        f'<inertial pos="0 0 {length / 2}" mass="{mass}" diaginertia="{across} {across} {along}"/>'
    )
