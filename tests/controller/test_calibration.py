"""What is usual for a task is measured by what the arm can do at all."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from opspace.controller import Controller
from opspace.loop import simulate
from opspace.plan.calibration import KNOWN, Workspace
from opspace.robots import load_robot
from opspace.sim import Plant
from opspace.stack import Stack
from opspace.tasks import MinimumJerk, PoseTask, PositionTask, PostureTask
from tests.budget import examples

LINK = (
    '<inertial><origin xyz="0.2 0 0"/><mass value="2"/>'
    '<inertia ixx="0.01" iyy="0.04" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial>'
)
JOINT = (
    '<joint name="j{0}" type="revolute"><parent link="l{0}"/><child link="l{1}"/>'
    '<origin xyz="{2} 0 0"/><axis xyz="0 0 1"/>'
    '<limit lower="-2.6" upper="2.6" effort="60" velocity="9"/></joint>'
)


@pytest.fixture
def planar(tmp_path):
    """Three joints about one axis: the tip never leaves its plane."""
    links = "".join(f'<link name="l{k}">{LINK if k else ""}</link>' for k in range(4))
    joints = "".join(JOINT.format(k, k + 1, 0.4 if k else 0.0) for k in range(3))
    tip = (
        '<link name="tip"/><joint name="end" type="fixed"><parent link="l3"/><child link="tip"/>'
        '<origin xyz="0.3 0 0"/></joint>'
    )
    path = tmp_path / "planar.urdf"
    path.write_text(f'<robot name="planar">{links}{joints}{tip}</robot>')
    return load_robot(path)


def led_out(robot, **options):
    """Lead the tip to twice its distance and back; largest torque step and last position."""
    hand = PositionTask("tip", kp=100.0, name="hand", **options)
    controller = Controller(robot, Stack([hand, PostureTask(kp=25.0)]))
    start = np.array([0.2, 1.2, 0.3])
    plant = Plant(robot, start)
    robot.update(start, np.zeros(3))
    here = robot.position(robot.frame_id("tip")).copy()
    hand.target = MinimumJerk(here, 2.0 * here, duration=2.0)
    taken = []

    class Torques:
        def observe(self, q, v, command):
            taken.append(command.tau)

    simulate(plant, controller, 3.0, [Torques()])
    return np.abs(np.diff(taken, axis=0)).max(), plant.q, controller._scales.reference(hand)


def test_a_direction_that_an_arm_never_has_does_not_hide_the_others(planar):
    step, q, reference = led_out(planar, axes="xy")
    plain_step, plain_q, plain_reference = led_out(planar)
    np.testing.assert_allclose(plain_reference[:2], reference, rtol=1e-9)
    np.testing.assert_allclose(plain_q, q, atol=1e-6)
    assert plain_step == pytest.approx(step, rel=1e-3)
    assert step < 1.0


def test_a_frame_that_nothing_moves_is_no_division_by_zero():
    robot = load_robot("ur5")
    stack = Stack([PoseTask(robot.frame_names[0]), PostureTask()])
    tau = Controller(robot, stack).step(0.0, robot.q_reference, np.zeros(6)).tau
    assert np.all(np.isfinite(tau))


@given(st.floats(-0.3, 0.3), st.sampled_from(["world", "tool"]))
@examples(6)
def test_what_is_known_of_a_robot_is_what_another_one_like_it_finds(offset, axes_frame):
    """Also where the point is another one, which has another reference."""
    tasks = [
        PositionTask(target=np.zeros(3), offset=(0.0, 0.0, z), axes="xz", axes_frame=axes_frame)
        for z in (offset, offset + 0.01, offset)
    ]
    found = [Workspace(load_robot("ur5")).reference(task) for task in tasks]
    assert np.array_equal(found[0], found[2])
    assert not np.array_equal(found[0], found[1])
    KNOWN.clear()
    assert np.array_equal(found[1], Workspace(load_robot("ur5")).reference(tasks[1]))
