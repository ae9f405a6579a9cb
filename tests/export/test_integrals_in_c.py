"""Integral action in a program in C, to the last bit."""

import numpy as np
import pytest

import opspace as osc
from tests.export.in_c import InC, with_cc
from tests.export.test_c_library import states


def learning(name, axes_frame):
    """A controller with integral action of the hand, of its turn, and of a posture below them."""
    robot = osc.load_robot(name)
    robot.update(robot.q_reference, np.zeros(robot.nv))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = robot.rotation(robot.tool), robot.position(robot.tool) + 0.01
    gains = {"kp": 100.0, "ki": 300.0, "max_integral": 2e-3, "axes_frame": axes_frame}
    if robot.nv > 6:
        tasks = [osc.PoseTask(target=pose, name="hand", **gains)]
    else:
        turn = osc.OrientationTask(target=pose[:3, :3], axes="y", **gains)
        tasks = [turn, osc.PositionTask(target=pose[:3, 3], name="hand", **gains)]
    posture = osc.PostureTask(robot.q_reference + 0.02, kp=20.0, ki=50.0)
    stack = osc.Stack([*tasks, posture], limits=osc.JointLimits())
    return osc.Controller(robot, stack, period=1e-3), (tasks[-1], posture)


@with_cc
@pytest.mark.parametrize(
    ("name", "axes_frame"), [("puma560", "tool"), ("panda", "world"), ("ur5", "tool")]
)
def test_integrals_are_learned_pushed_and_forgotten_alike(name, axes_frame, tmp_path):
    controller, (hand, guest) = learning(name, axes_frame)
    stack, other = controller.stack, InC(tmp_path, controller)
    level = stack.members[-1].level
    ahead = np.full(hand.rows, 0.2)
    gains = np.full(hand.rows, 150.0), np.full(hand.rows, 30.0)
    seen = set()
    T, Q, V = states(controller.robot, 240, 2e-3)
    for k, (t, q, v) in enumerate(zip(T.tolist(), Q, V, strict=True)):
        if k == 40:
            goal = hand.target.copy()
            goal[..., -1] -= 0.005 * (goal[..., -1] != 1.0)
            hand.set_target(goal, acceleration=ahead)
            flat = goal if goal.ndim == 1 else np.concatenate([goal[:3, 3], goal[:3, :3].ravel()])
            assert other.set("target", hand, flat, None, ahead) == 0
        if k == 60:
            stack.remove(guest, duration=0.02)
            assert other.set("presence", guest, 0, t, 0.02) == 0
        if k == 70:  # on its way out: it has forgotten nothing
            stack.insert(guest, level, duration=0.01)
            assert other.set("presence", guest, 1, t, 0.01) == 0
        if k == 100:
            stack.remove(guest, duration=0.01)
            assert other.set("presence", guest, 0, t, 0.01) == 0
        if k == 120:
            before = guest.integral.copy()
            stack.insert(guest, level, duration=0.01)
            assert other.set("presence", guest, 1, t, 0.01) == 0
        if k == 160:
            hand.kp, hand.kv = gains
            assert other.set("gains", hand, *gains) == 0
        if k == 180:
            controller.restart()
            other.restart()
        pause = 3.0 if k >= 180 else 0.0
        command = controller.step(t + pause, q, v)
        status, tau = other.step(t + pause, q, v)
        np.testing.assert_array_equal(tau, command.tau, err_msg=f"tick {k}")
        assert status == command.status
        seen.add(status)
    assert before.any()
    assert 0 in seen
    for task in (hand, guest):
        assert np.abs(task.integral).max() > 1e-3


@with_cc
def test_stretched_out_it_learns_what_the_directions_that_are_on_teach(tmp_path):
    """Stretched, the upper arm has no way further out: its level is projected."""
    robot = osc.load_robot("puma560")
    q = robot.q_reference.copy()
    q[2] = -1.6
    robot.update(q, np.zeros(6))
    hand = osc.PositionTask(target=robot.position(robot.tool) + [0.01, 0.02, 0.03], ki=500.0)
    turn = osc.OrientationTask(target=robot.rotation(robot.tool).copy())
    stack = osc.Stack([turn, hand, osc.PostureTask(robot.q_reference)])
    controller = osc.Controller(robot, stack)
    other = InC(tmp_path, controller)
    seen = set()
    for k, elbow in enumerate(np.linspace(-2.6, -1.4, 120)):
        q[2] = elbow
        command = controller.step(1e-3 * k, q, np.zeros(6))
        status, tau = other.step(1e-3 * k, q, np.zeros(6))
        np.testing.assert_array_equal(tau, command.tau)
        seen.add(bool(status & osc.Status.DIRECTION_OFF))
    assert seen == {True, False}
    assert np.linalg.norm(hand.integral) > 1e-3


@with_cc
def test_gains_that_diverge_are_refused(tmp_path):
    controller, (hand, _) = learning("puma560", "world")
    other = InC(tmp_path, controller)
    assert other.set("gains", hand, np.full(3, 30.0), np.full(3, 10.0)) == -3
    assert other.set("gains", hand, np.full(3, 30.1), np.full(3, 10.0)) == 0
    assert other.set("gains", hand, np.full(3, 30.1), np.array([10.0, 9.0, 10.0])) == -3
