"""Robots that add the torque against gravity themselves: it is added once, and limits count all."""

import numpy as np
import pytest

import opspace as osc
from opspace.controller.reference import ReferenceController
from opspace.errors import InputError, UnknownNameError
from opspace.record.black_box import BlackBox

FORMS = (osc.Controller, ReferenceController)
ROBOTS = ("puma560", "panda", "ur5", "z1", "so101")


def stack():
    return osc.Stack([osc.PositionTask(), osc.PostureTask()])


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", ROBOTS)
def test_the_tool_is_held_where_the_robot_carries_itself(name, form):
    robot = osc.load_robot(name)
    plant = osc.Plant(robot, robot.q_reference, adds_gravity=True)
    controller = form(robot, stack(), gravity="robot", torque_limits="priority")
    robot.update(plant.q, plant.v)
    tool = robot.frame_id(robot.tool)
    before = robot.position(tool).copy()
    assert osc.simulate(plant, controller, 0.05).completed
    robot.update(plant.q, plant.v)
    assert np.linalg.norm(robot.position(tool) - before) < 1e-6


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("bias", ["joint", "task"])
@pytest.mark.parametrize("limits", ["report", "priority"])
def test_only_gravity_is_left_out(form, bias, limits):
    one, other = (
        form(osc.load_robot("panda"), stack(), bias=bias, gravity=g, torque_limits=limits)
        for g in ("controller", "robot")
    )
    rng = np.random.default_rng(1)
    # Fast and far away, so that motors are at their limits in some of them.
    for k in range(20):
        q = one.robot.q_reference + rng.uniform(-0.3, 0.3, 7)
        v = rng.uniform(-2, 2, 7)
        whole, rest = one.step(1e-3 * k, q, v), other.step(1e-3 * k, q, v)
        one.robot.update(q, v)
        np.testing.assert_allclose(rest.tau + one.robot.gravity, whole.tau, rtol=0, atol=1e-9)
        assert rest.status == whole.status


def test_a_batch_leaves_it_out_as_well():
    robot = osc.load_robot("ur5")
    controller = osc.Controller(robot, stack(), gravity="robot")
    rng = np.random.default_rng(2)
    Q, V = robot.q_reference + rng.uniform(-0.3, 0.3, (6, 6)), rng.uniform(-1, 1, (6, 6))
    controller.step(0.0, robot.q_reference, np.zeros(6))
    found = controller.torque_batch(Q, V)
    for q, v, tau in zip(Q, V, found, strict=True):
        np.testing.assert_allclose(controller.step(0.0, q, v).tau, tau, rtol=0, atol=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_a_handover_begins_and_ends_without_gravity(form):
    robot = osc.load_robot("panda")
    plant = osc.Plant(robot, robot.q_reference, adds_gravity=True)
    controller = form(robot, stack(), gravity="robot")
    controller.take_over(np.zeros(7), duration=0.02)
    first = controller.step(0.0, plant.q, plant.v)
    np.testing.assert_allclose(first.tau, 0.0, atol=1e-12)
    assert osc.Status.HANDOVER in first.status
    osc.simulate(plant, controller, 0.04)
    controller.hand_back(np.zeros(7), duration=0.02)
    osc.simulate(plant, controller, 0.04)
    last = controller.step(plant.t, plant.q, plant.v)
    np.testing.assert_allclose(last.tau, 0.0, atol=1e-12)
    assert np.abs(plant.q - robot.q_reference).max() < 1e-5


@pytest.mark.parametrize("form", FORMS)
def test_a_tick_that_brakes_leaves_it_out(form):
    robot = osc.load_robot("panda")
    controller = form(robot, stack(), gravity="robot", period=1e-3, on_time_jump="hold")
    still = np.zeros(7)
    controller.step(0.0, robot.q_reference, still)
    jumped = controller.step(5.0, robot.q_reference, still)
    assert osc.Status.TIME_JUMP in jumped.status
    np.testing.assert_allclose(jumped.tau, 0.0, atol=1e-9)


def test_two_that_add_it_or_none_are_refused(tmp_path):
    robot = osc.load_robot("puma560")
    left, own = (
        osc.Controller(robot, osc.Stack([osc.PostureTask()]), gravity=g)
        for g in ("robot", "controller")
    )
    carrying = osc.Plant(robot, robot.q_reference, adds_gravity=True)
    plain = osc.Plant(robot, robot.q_reference)
    with pytest.raises(InputError, match=r"Plant adds .* built with gravity='robot', not 'contr"):
        osc.simulate(carrying, own, 0.01)
    with pytest.raises(InputError, match=r"does not add .* with gravity='controller', not 'robot'"):
        osc.simulate(plain, left, 0.01)
    with pytest.raises(InputError, match="does not add"):
        osc.simulate(plain, BlackBox(left, tmp_path), 0.01)
    assert osc.simulate(carrying, left, 0.01).completed
    assert osc.simulate(plain, own, 0.01).completed
    with pytest.raises(UnknownNameError, match="controller"):
        osc.Controller(robot, osc.Stack([osc.PostureTask()]), gravity="franka")
