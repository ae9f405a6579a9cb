"""The robots that have a name: where their files lie and how they are used."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

SHIPPED = "opspace"
PACKAGE = "example-robot-data"


@dataclass(frozen=True)
class CatalogueEntry:
    """A robot by name.

    Attributes:
        file: Path below the package's directory of robots.
        dof: Number of velocity coordinates.
        description: One line about the robot.
        tool: Default tool frame; empty for the file's own.
        posture: Joint angles in rad of the reference posture; joints not named are at zero.
        height: Height in m of a floating base in the reference posture, feet on the floor.
        locked_joints: Joints held at zero, such as those of a gripper.
        armature: Inertia of the motors at the joints, which URDF has no word for, kg·m².
        kind: "arm", "humanoid" or "quadruped".
        package: Package that the file comes from.
    """

    file: str
    dof: int
    description: str
    tool: str = ""
    posture: Mapping[str, float] = field(default_factory=dict)
    height: float = 0.0
    locked_joints: tuple[str, ...] = ()
    armature: float = 0.0
    kind: str = "arm"
    package: str = PACKAGE

    @property
    def floating_base(self) -> bool:
        """Whether the root link moves freely."""
        return self.kind != "arm"


def locate(entry: CatalogueEntry) -> Path | None:
    """Find a robot's file without importing anything.

    Args:
        entry: The robot.

    Returns:
        The path, or None where the package is not installed.
    """
    if entry.package == SHIPPED:
        directories = [Path(__file__).parent / "models"]
    else:
        # Wherever Python finds packages: an environment's own, a user's, the system's, PYTHONPATH.
        roots = [entry for entry in sys.path if isinstance(entry, str)]
        below = Path("cmeel.prefix", "share", PACKAGE, "robots")
        directories = [Path(root) / below for root in roots]
    paths = (directory / entry.file for directory in directories)
    return next((path for path in paths if path.is_file()), None)


def _numbered(prefix: str, *angles: float, suffix: str = "") -> dict[str, float]:
    return {f"{prefix}{i}{suffix}": angle for i, angle in enumerate(angles, start=1)}


def _both_sides(
    pattern: str, left: Mapping[str, float], mirrored: tuple[str, ...]
) -> dict[str, float]:
    """Repeat a left side's angles on the right, those of the mirrored joints with opposite sign."""
    angles = {}
    for joint, angle in left.items():
        angles[pattern.format(side="left", joint=joint)] = angle
        sign = -1.0 if joint in mirrored else 1.0
        angles[pattern.format(side="right", joint=joint)] = sign * angle
    return angles


_UR_POSTURE = {
    "shoulder_pan_joint": 0.0,
    "shoulder_lift_joint": -1.4,
    "elbow_joint": 1.6,
    "wrist_1_joint": -1.77,
    "wrist_2_joint": -1.57,
}
_TALOS_ARM = {"1_joint": 0.25847, "2_joint": 0.173046, "3_joint": -0.0002, "4_joint": -1.2}
_TALOS_LEG = {"3_joint": -0.411354, "4_joint": 0.859395, "5_joint": -0.448041}
_G1_SIDE = {
    "hip_pitch": -0.3,
    "knee": 0.6,
    "ankle_pitch": -0.3,
    "shoulder_pitch": 0.2,
    "shoulder_roll": 0.25,
    "elbow": 0.7,
}

CATALOGUE: dict[str, CatalogueEntry] = {
    "puma560": CatalogueEntry(
        "puma560.xml", 6, "Unimation PUMA 560, published parameters, own MJCF", package=SHIPPED
    ),
    "ur3": CatalogueEntry(
        "ur_description/urdf/ur3_robot.urdf", 6, "Universal Robots UR3", "tool0", _UR_POSTURE
    ),
    "ur5": CatalogueEntry(
        "ur_description/urdf/ur5_robot.urdf", 6, "Universal Robots UR5", "tool0", _UR_POSTURE
    ),
    "ur10": CatalogueEntry(
        "ur_description/urdf/ur10_robot.urdf", 6, "Universal Robots UR10", "tool0", _UR_POSTURE
    ),
    "panda": CatalogueEntry(
        "panda_description/urdf/panda.urdf",
        7,
        "Franka Emika Panda, fingers closed",
        "panda_hand_tcp",
        _numbered("panda_joint", 0.0, -0.785398, 0.0, -2.35619, 0.0, 1.5707, 0.785398),
        locked_joints=("panda_finger_joint1", "panda_finger_joint2"),
    ),
    "kinova": CatalogueEntry(
        "kinova_description/robots/kinova.urdf",
        6,
        "Kinova Jaco 2 (j2s6s200), fingers fixed",
        "j2s6s200_end_effector",
        _numbered("j2s6s200_joint_", 1.5707, 2.618, -1.5707 + 2 * 3.14159265, 3.1415, 2.618, 0.0),
    ),
    "xarm7": CatalogueEntry(
        "xarm_description/urdf/xarm7.urdf",
        7,
        "UFACTORY xArm 7",
        "link_eef",
        _numbered("joint", 0.0, -0.3, 0.0, 1.2, 0.0, 1.5, 0.0),
    ),
    "z1": CatalogueEntry(
        "z1_description/urdf/z1.urdf",
        6,
        "Unitree Z1, gripper closed",
        "gripperStator",
        _numbered("joint", 0.0, 1.3, -1.4, 0.6, 0.6, 0.0),
        locked_joints=("jointGripper",),
    ),
    "so101": CatalogueEntry(
        "so_arm_description/urdf/so101.urdf",
        5,
        "SO-101 hobby arm, jaw fixed",
        "gripper_frame_link",
        {"shoulder_lift": -0.4, "elbow_flex": 0.6, "wrist_flex": 0.8},
        locked_joints=("gripper",),
    ),
    "talos": CatalogueEntry(
        "talos_data/robots/talos_reduced.urdf",
        36,
        "PAL Robotics Talos humanoid, grippers closed",
        "wrist_right_ft_tool_link",
        _both_sides("arm_{side}_{joint}", _TALOS_ARM, ("1_joint", "2_joint", "3_joint"))
        | _both_sides("leg_{side}_{joint}", _TALOS_LEG, ()),
        1.01927,
        locked_joints=("gripper_left_joint", "gripper_right_joint"),
        armature=0.01,
        kind="humanoid",
    ),
    "g1": CatalogueEntry(
        "g1_description/urdf/g1_29dof_rev_1_0.urdf",
        35,
        "Unitree G1 humanoid",
        "right_rubber_hand",
        _both_sides("{side}_{joint}_joint", _G1_SIDE, ("shoulder_roll",)),
        0.763,
        armature=0.01,
        kind="humanoid",
    ),
    "go2": CatalogueEntry(
        "go2_description/urdf/go2.urdf",
        18,
        "Unitree Go2 quadruped",
        "FL_foot",
        {f"{leg}_thigh_joint": 0.785 for leg in ("FL", "FR", "RL", "RR")}
        | {f"{leg}_calf_joint": -1.44 for leg in ("FL", "FR", "RL", "RR")},
        0.335,
        kind="quadruped",
    ),
    "solo12": CatalogueEntry(
        "solo_description/robots/solo12.urdf",
        18,
        "Open Dynamic Robot Initiative Solo-12 quadruped",
        "FL_FOOT",
        {f"{leg}_HFE": 0.8 for leg in ("FL", "FR")}
        | {f"{leg}_HFE": -0.8 for leg in ("HL", "HR")}
        | {f"{leg}_KFE": -1.6 for leg in ("FL", "FR")}
        | {f"{leg}_KFE": 1.6 for leg in ("HL", "HR")},
        0.235,
        kind="quadruped",
    ),
}
