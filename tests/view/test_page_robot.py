"""The page loads the robot that was recorded, however it was loaded."""

from __future__ import annotations

import pytest

import opspace as osc
from opspace.record.subject import subject_of
from opspace.robots.catalogue import CATALOGUE, locate
from opspace.view.page import _robot as robot_of_page


@pytest.mark.filterwarnings("ignore::opspace.ModelWarning")
@pytest.mark.parametrize("by", ["name", "file", "file, hand held"])
@pytest.mark.parametrize("name", ["panda", "z1", "so101", "ur5", "go2"])
def test_the_page_has_the_joints_of_the_recording(name: str, by: str) -> None:
    entry = CATALOGUE[name]
    path = locate(entry)
    if path is None:
        pytest.skip(f"{entry.package} is not installed")
    if by == "name" and not entry.floating_base:
        robot = osc.load_robot(name)
    else:
        robot = osc.load_robot(path, locked=entry.locked_joints if "held" in by else ())
    robot.add_frame("grip", placement=[0.0, 0.0, 0.05])
    about = subject_of(osc.Controller(robot, osc.Stack([osc.PostureTask()])))["robot"]
    shown = robot_of_page(about)
    assert shown.joint_names == robot.joint_names
    assert shown.tool == robot.tool
    assert shown.frame_names == robot.frame_names
