"""The tool that nobody chose is a frame of the arm's end: no finger, no camera."""

from __future__ import annotations

from pathlib import Path

import pytest

from opspace import load_robot
from opspace.robots.tool_choice import senses
from tests.robots.hands_and_scenes import arm_on_a_table
from tests.robots.samples import BACKENDS
from tests.robots.serial_arms import fixed, hinge, part, serial_arm

CAMERA = (
    fixed("l6", "wrist_camera_link")
    + fixed("wrist_camera_link", "wrist_camera_color_frame")
    + fixed("wrist_camera_color_frame", "wrist_camera_color_optical_frame")
)
GRIP = fixed("l6", "flange") + fixed("flange", "grip_base", link=part("grip_base", 0.3))
FOLLOWS = '<mimic joint="left_knuckle"/>'
TWO_FINGERS = (
    part("left", 0.1)
    + part("right", 0.1)
    + hinge("left_knuckle", "grip_base", "left")
    + hinge("right_knuckle", "grip_base", "right", more=FOLLOWS)
)
FIVE_FINGERS = "".join(
    part(f"{finger}{k}", 0.05)
    + hinge(f"{finger}_joint{k}", "grip_base" if k == 1 else f"{finger}{k - 1}", f"{finger}{k}")
    for finger in ("thumb", "index", "middle", "ring", "little")
    for k in range(1, 4)
)
ARMS_ON_A_TRUNK = "".join(
    part(f"{side}{k}", 0.5)
    + hinge(f"{side}_joint{k}", "l2" if k == 1 else f"{side}{k - 1}", f"{side}{k}", "xyz"[k % 3])
    for side in ("left", "right")
    for k in range(1, 7)
)
CASES = {
    "bare arm": ("zyyzyz", (), "l6"),
    "flange": ("zyyzyz", (fixed("l6", "flange"),), "flange"),
    "camera beside a flange": ("zyyzyz", (fixed("l6", "flange"), CAMERA), "flange"),
    "camera alone": ("zyyzyz", (CAMERA,), "l6"),
    "gripper": ("zyyzyz", (GRIP, TWO_FINGERS), "grip_base"),
    "gripper and camera": ("zyyzyz", (CAMERA, GRIP, TWO_FINGERS), "grip_base"),
    "gripper with a tool centre point": (
        "zyyzyz", (GRIP, TWO_FINGERS, fixed("grip_base", "tcp")), "tcp",
    ),
    "stiff fingers beside an end effector": (
        "zyyzyz",
        (fixed("l6", "finger") + fixed("finger", "finger_tip") + fixed("l6", "arm_end_effector"),),
        "arm_end_effector",
    ),
    "five fingers of three joints": ("zyyzyz", (GRIP, FIVE_FINGERS, CAMERA), "grip_base"),
    "arms on a trunk": ("zy", (ARMS_ON_A_TRUNK,), "left6"),
}  # fmt: skip


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("what", CASES)
def test_the_tool_is_the_end_of_the_arm(tmp_path: Path, what: str, backend: str) -> None:
    axes, parts, tool = CASES[what]
    assert load_robot(serial_arm(tmp_path / "arm.urdf", axes, *parts), backend=backend).tool == tool


@pytest.mark.parametrize(
    ("hand", "tool"),
    [
        ("", "wrist"),
        ('<site name="hand_camera" pos=".3 0 0"/>', "wrist"),
        ('<site name="imu"/><site name="grip" pos=".35 0 0"/>', "grip"),
    ],
    ids=["site", "camera", "imu"],
)
def test_sites_of_sensors_are_no_tools(tmp_path: Path, hand: str, tool: str) -> None:
    assert load_robot(arm_on_a_table(tmp_path / "arm.xml", hand=hand)).tool == tool


def test_names_of_sensors() -> None:
    sensors = ("camera_link", "head_IMU_link", "imu", "color_optical_frame", "front_lidar")
    assert all(map(senses, sensors))
    assert not any(map(senses, ("tool0", "simulated_tip", "ee_link", "maximum", "flange")))
