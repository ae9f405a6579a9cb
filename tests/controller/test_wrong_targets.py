"""A target that is no number brakes the robot, whether or not its task has anything to move."""

import numpy as np
import pytest

import opspace as osc
from opspace.controller import ReferenceController
from opspace.tasks.tracking import Target

PLACES = ["free", "nothing left", "on its way out", "activated by nothing"]


@pytest.mark.parametrize("kind", [osc.Controller, ReferenceController])
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("quantity", ["position", "orientation", "joint"])
def test_a_target_that_is_no_number_is_a_fault(kind, place, quantity):
    robot = osc.load_robot("puma560")
    q, still = robot.q_reference, np.zeros(6)
    robot.update(q, still)
    wrong = {
        "position": osc.PositionTask(target=robot.position(robot.tool), name="wrong"),
        "orientation": osc.OrientationTask(target=robot.rotation(robot.tool).copy(), name="wrong"),
        "joint": osc.JointTask("joint3", target=float(q[2]), name="wrong"),
    }[quantity]
    if place == "activated by nothing":
        wrong.activation = lambda robot, t: 0.0
    posture = osc.PostureTask(q)
    stack = osc.Stack([posture, wrong] if place == "nothing left" else [wrong, posture])
    controller = kind(robot, stack)
    assert controller.step(0.0, q, still).status == osc.Status.OK
    if place == "on its way out":
        stack.remove(wrong, duration=0.1)
        controller.step(1e-3, q, still)
    right = wrong._target
    none = np.full(np.shape(right.goal), np.nan)
    wrong._target = Target(none, right.velocity, right.acceleration)  # past all checks
    command = controller.step(2e-3, q, still)
    assert osc.Status.FAULT in command.status
    np.testing.assert_allclose(command.tau, robot.gravity, atol=1e-9)
    wrong._target = right
    assert osc.Status.FAULT not in controller.step(3e-3, q, still).status
