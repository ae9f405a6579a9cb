"""A report says what the controller sees, and warns where a user should look."""

import json

import numpy as np
import pytest

from opspace.controller import Controller
from opspace.plan.scales import Singularity
from opspace.robots import load_robot
from opspace.robots.sampled_postures import sample_postures
from opspace.runs.check import check_robot, rounded, to_plain
from opspace.stack import Stack
from opspace.tasks import PositionTask
from tests.robots.serial_arms import serial_arm

ARM = """<mujoco model="arm"><worldbody><body name="upper"><joint name="lift" axis="0 1 0"
 range="-90 90" {limit}/><geom size="0.05" mass="1" fromto="0 0 0 0.5 0 0" type="capsule"/>
<body name="lower" pos="0.5 0 0"><joint name="bend" axis="0 1 0"/>
<geom size="0.05" mass="1" fromto="0 0 0 0.5 0 0" type="capsule"/>
<site name="tool" pos="0.5 0 0"/></body></body></worldbody>
<keyframe><key name="home" qpos="{q}"/></keyframe></mujoco>"""


def report(tmp_path, limit="", q="0 1"):
    path = tmp_path / "arm.xml"
    path.write_text(ARM.format(limit=limit, q=q))
    return check_robot(load_robot(path))


def warned(found, words):
    return any(words in warning for warning in found.warnings)


def test_the_report_is_what_a_controller_says():
    robot = load_robot("puma560")
    found = check_robot(robot)
    controller = Controller(robot, Stack([PositionTask()]))
    command = controller.step(0.0, robot.q_reference, np.zeros(robot.nv))
    assert found.sigma["position"] == tuple(command.levels[0].sigma)
    assert [joint.brake for joint in found.joints] == controller.calibration.brake.tolist()
    assert found.buffer == (Singularity().lower, Singularity().upper)
    assert json.loads(json.dumps(to_plain(found), allow_nan=False))["dof"] == 6
    assert found.warnings == ()


def test_what_is_not_known_is_said(tmp_path):
    found = report(tmp_path)
    lift, bend = found.joints
    assert (lift.max_torque, bend.lower, bend.upper) == (None, None, None)
    assert np.isclose(lift.upper, np.pi / 2)
    assert warned(found, "no torque limit is known for lift, bend")
    # Two joints in a plane leave one direction of three.
    assert warned(found, "1 of 3 directions of the position cannot be moved")
    known = report(tmp_path, 'actuatorfrcrange="-80 80"')
    assert known.joints[0].max_torque == 80
    assert warned(known, "no torque limit is known for bend;")


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (2000.0, "2000"), (999.6, "1000"), (-4321.4, "-4321"), (1.2e7, "1.2e+07"), (999.4, "999"),
        (0.0123456, "0.0123"), (-1e-14, "0"), (87.0, "87"), (np.inf, "inf"),
    ],
)  # fmt: skip
def test_numbers_are_written_for_people(number, text):
    assert rounded(number) == text


@pytest.mark.parametrize(("q", "near"), [("1.5 1", True), ("1.4 1", False)])
def test_a_reference_near_a_limit_is_reported(tmp_path, q, near):
    assert warned(report(tmp_path, q=q), "within 0.1 of a limit of lift") == near


@pytest.mark.parametrize(("torque", "weak"), [(14.0, True), (15.0, False)])
def test_a_posture_that_cannot_be_held_is_reported(tmp_path, torque, weak):
    """Stretched out, 2 kg hang 0.5 m away: 1 kg at 0.25 m and 1 kg at 0.75 m."""
    found = report(tmp_path, f'actuatorfrcrange="-{torque} {torque}"', q="0 1.5707963")
    assert np.isclose(abs(found.joints[0].gravity), 9.81 * (0.25 + 0.5), rtol=1e-3)
    assert not warned(found, "cannot be held")
    found = report(tmp_path, f'actuatorfrcrange="-{torque - 5} {torque - 5}"', q="0 0")
    assert np.isclose(abs(found.joints[0].gravity), 9.81, rtol=1e-3)
    assert warned(found, "cannot be held: its torque is above the limit of lift") == weak


@pytest.mark.parametrize(
    ("axes", "turns", "moves"),
    [("xyy", 2, 3), ("yyy", 1, 2), ("zz", 1, 0), ("zyy", 2, 3), ("zyyzyz", 3, 3), ("y", 1, 0)],
)
@pytest.mark.parametrize("bend", [0.0, 0.7])
def test_only_what_another_posture_has_is_called_singular(tmp_path, axes, turns, moves, bend):
    path = serial_arm(tmp_path / "arm.urdf", axes)
    robot = load_robot(path, reference=np.full(len(axes), bend))
    found = check_robot(robot)
    for name, rows, count in (
        ("orientation", slice(3, 6), turns),
        ("position", slice(0, 3), moves),
    ):
        missing = f"{3 - count} of 3 directions of the {name} cannot be moved at all"
        assert warned(found, missing) == (count < 3)
        if warned(found, f"near a singularity of the {name}"):
            here, *others = (
                weakest(robot, q, rows, count) for q in [robot.q_reference, *sample_postures(robot)]
            )
            assert max(others) > 1.1 * here


def weakest(robot, q, rows, count):
    """Return the last of the eigenvalues of J M⁻¹ Jᵀ that there are, strongest first."""
    robot.update(q, np.zeros(robot.nv))
    J = robot.jacobian(robot.tool)[rows]
    return np.linalg.eigvalsh(J @ np.linalg.solve(robot.M, J.T))[3 - count]
