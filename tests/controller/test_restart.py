"""After a pause, wherever the robot was moved to and whatever the clock says, nothing jumps."""

from __future__ import annotations

import numpy as np
import pytest

import opspace as osc
from opspace import Status
from opspace.controller import ReferenceController

KINDS = pytest.mark.parametrize("kind", [osc.Controller, ReferenceController])
DT = 1e-3
PAUSES = pytest.mark.parametrize("pause", [3.0, 0.05, -1.0, 1e6])


class Arm:
    """Integrates the model exactly, so that only the controller makes the difference."""

    def __init__(self, name="puma560"):
        self.robot = osc.load_robot(name)
        self.q = self.robot.q_reference.copy()
        self.v = np.zeros(self.robot.nv)

    def drive(self, controller, t, ticks):
        found = []
        for k in range(ticks):
            command = controller.step(t + k * DT, self.q, self.v)
            found.append(command)
            self.robot.update(self.q, self.v)
            a = np.linalg.solve(self.robot.M, command.tau - self.robot.bias)
            self.v = self.v + DT * a
            self.q = self.q + DT * self.v
        return found

    def tool(self):
        self.robot.update(self.q, self.v)
        return self.robot.position(self.robot.frame_id(self.robot.tool)).copy()

    def gravity(self):
        self.robot.update(self.q, 0.0 * self.v)
        return self.robot.gravity.copy()

    def moved_by_hand(self):
        self.q = self.q + np.linspace(0.3, -0.2, self.q.size)
        self.v = 0.0 * self.v


def holding(kind, **options):
    tasks = [osc.OrientationTask(), osc.PositionTask(), osc.PostureTask(kp=25.0)]
    return kind(osc.load_robot("puma560"), osc.Stack(tasks), **options)


@KINDS
@PAUSES
@pytest.mark.parametrize("how", ["restart", "take over", "hold"])
def test_the_robot_is_held_where_it_is_found(kind, pause, how):
    options = {"period": DT, "on_time_jump": "hold"} if how == "hold" else {}
    arm, controller = Arm(), holding(kind, **options)
    arm.drive(controller, 0.0, 60)
    arm.moved_by_hand()
    here, still = arm.tool(), arm.gravity()
    if how == "restart":
        controller.restart()
    elif how == "take over":
        controller.take_over(still, 0.02)
    found = arm.drive(controller, 0.06 + pause, 80)
    if how == "hold":
        assert found[0].status == Status.TIME_JUMP
    tau = np.array([command.tau for command in found])
    np.testing.assert_allclose(tau[0], still, atol=1e-9)
    assert np.abs(np.diff(tau, axis=0)).max() < 1e-2
    assert np.linalg.norm(arm.tool() - here) < 1e-6


@KINDS
def test_without_a_restart_it_would_run_back(kind):
    arm, controller = Arm(), holding(kind)
    arm.drive(controller, 0.0, 20)
    arm.moved_by_hand()
    assert np.abs(arm.drive(controller, 3.0, 1)[0].tau - arm.gravity()).max() > 5.0


@KINDS
@PAUSES
def test_what_was_on_its_way_goes_on_as_if_there_had_been_no_pause(kind, pause):
    """References with and without a start time, ramps, moves, swaps, and what waits for its time."""

    def run(pause):
        robot = osc.load_robot("puma560")
        robot.update(robot.q_reference, np.zeros(6))
        here = robot.position(robot.frame_id(robot.tool)).copy()
        R = robot.rotation(robot.frame_id(robot.tool)).copy()
        there = here + [0.05, 0.1, -0.05]
        hand = osc.PositionTask(target=osc.MinimumJerk(here, there, 0.3))
        turn = osc.OrientationTask(target=osc.Chain((0.0, osc.Constant(R)), start_time=0.0))
        waist = osc.JointTask(
            "joint1", osc.MinimumJerk([0.0], [0.2], 0.2, start_time=0.05), kp=50.0
        )
        stack = osc.Stack([turn, hand, osc.PostureTask(robot.q_reference, kp=25.0)])
        controller = kind(robot, stack, period=DT)
        arm = Arm()
        stack.insert(waist, 0.5, 0.1, start_time=0.0204)
        stack.swap("orientation", "position", 0.1505)
        stack.remove("joint1", 0.1, start_time=0.2003)
        before = arm.drive(controller, 0.0, 80)
        controller.restart()
        after = arm.drive(controller, 0.08 + pause, 250)
        return [*before, *after]

    plain, paused = run(0.0), run(pause)
    # What is a jump in time for the clock is none for what is on its way.
    exact = 1e-9 if abs(pause) < 1e3 else 1e-5
    for one, two in zip(plain, paused, strict=True):
        scale = max(1.0, float(np.abs(one.tau).max()))
        np.testing.assert_allclose(one.tau, two.tau, rtol=0, atol=exact * scale)
        assert one.tasks.keys() == two.tasks.keys()
        assert Status.TIME_JUMP not in two.status


@KINDS
@pytest.mark.parametrize("ticks", [0, 1])
@pytest.mark.parametrize("before", [-5.0, 5.0])
def test_what_is_asked_after_the_pause_is_in_the_new_time(kind, before, ticks):
    arm, controller = Arm(), holding(kind)
    arm.drive(controller, before, 20)
    controller.stack.remove("posture", 0.01, start_time=before + 0.03)  # which waits on
    controller.restart()
    arm.drive(controller, 0.0, ticks)
    guest = osc.JointTask("joint3")
    controller.stack.insert(guest, 0.5, 0.01, start_time=0.005)
    found = arm.drive(controller, DT * ticks, 30)
    present = [guest.name in command.tasks for command in found]
    assert present.index(True) == 5 - ticks
    assert found[-1].tasks[guest.name].activation == 1.0
    going = [command.tasks["posture"].activation < 1.0 for command in found[:15]]
    assert going.index(True) == 12 - ticks  # eleven ticks of waiting, and the one that begins


@KINDS
def test_a_rotation_that_went_the_long_way_takes_the_short_one(kind):
    robot = osc.load_robot("puma560")
    robot.update(robot.q_reference, np.zeros(6))
    R = robot.rotation(robot.frame_id(robot.tool)).copy()
    task = osc.OrientationTask()
    controller = kind(robot, osc.Stack([task, osc.PostureTask()]))

    def error(t, angle):
        c, s = np.cos(angle), np.sin(angle)
        task.target = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]) @ R
        return controller.step(t, robot.q_reference, np.zeros(6)).tasks["orientation"].error[2]

    for k, angle in enumerate(np.arange(3.0, 3.5, 0.02)):
        assert error(k * DT, angle) == pytest.approx(angle)
    controller.restart()
    assert error(1.0, angle) == pytest.approx(angle - 2.0 * np.pi)


@KINDS
def test_a_restart_before_the_first_tick_changes_nothing(kind):
    arm, other = Arm(), Arm()
    plain, restarted = holding(kind, period=DT), holding(kind, period=DT)
    restarted.restart()
    for one, two in zip(arm.drive(plain, 2.0, 5), other.drive(restarted, 2.0, 5), strict=True):
        np.testing.assert_array_equal(one.tau, two.tau)
        assert one.status == two.status


@KINDS
def test_a_task_of_ones_own_is_told(kind):
    told = []

    class Own(osc.JointTask):
        def resume(self, pause):
            told.append(pause)
            super().resume(pause)

    controller = kind(osc.load_robot("puma560"), osc.Stack([Own("joint2"), osc.PostureTask()]))
    arm = Arm()
    arm.drive(controller, 0.0, 3)
    controller.restart()
    arm.drive(controller, 4.0, 3)
    assert told == [pytest.approx(4.0 - 2 * DT)]
