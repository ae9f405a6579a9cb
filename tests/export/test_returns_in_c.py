"""What comes anew begins anew in C as in Python, and so does what is told after a long time."""

import math

import numpy as np
import pytest

import opspace as osc
from tests.export.in_c import InC, with_cc

DT = 1e-3
WRENCH = np.array([0.0, 0.0, 6.0, 0.0, 0.0, 0.0])


class Pressing:
    """An arm that presses, in Python and in C."""

    def __init__(self, folder, period=None, **options):
        robot = osc.load_robot("puma560")
        self.q, self.t, self.dt = robot.q_reference.copy(), 0.0, DT
        self.press = osc.ForceTask(None, 10.0, axes_frame="world", name="press", **options)
        rest = osc.PostureTask(target=self.q, name="rest")
        self.python = osc.Controller(robot, osc.Stack([self.press, rest]), period=period)
        self.c = InC(folder, self.python)

    def step(self, wrench=WRENCH, v=None):
        """Step both; they answer the same, to the last bit."""
        self.t += self.dt
        v = np.zeros(6) if v is None else v
        command = self.python.step(self.t, self.q, v, wrenches={self.python.robot.tool: wrench})
        if wrench is not None:
            assert self.c.set("wrench", self.press, self.t, wrench) == 0
        status, tau = self.c.step(self.t, self.q, v)
        np.testing.assert_array_equal(tau, command.tau)
        assert status == command.status
        return command

    def ask(self, present, duration):
        stack, at = self.python.stack, self.t + DT
        if present:
            stack.insert(self.press, 0.0, duration=duration, start_time=at)
        else:
            stack.remove(self.press, duration=duration, start_time=at)
        assert self.c.set("presence", self.press, int(present), at, duration) == 0


@with_cc
def test_a_force_task_that_comes_anew_begins_without_contact(tmp_path):
    both = Pressing(tmp_path)
    for _ in range(500):
        both.step()
    assert both.press.touch.confidence > 0.5
    both.ask(False, 0.0)
    for _ in range(300):
        both.step()
    both.ask(True, 0.05)
    both.step()
    assert both.press.touch.confidence < 0.5
    for _ in range(200):
        both.step()


@with_cc
@pytest.mark.parametrize("what", ["stale state", "jump in time"])
def test_integrals_of_forces_are_frozen_for_a_tick_that_came_amiss(tmp_path, what):
    both, rng = Pressing(tmp_path, period=DT), np.random.default_rng(0)
    seen = osc.Status(0)
    for k in range(60):
        stale = what == "stale state" and 40 <= k < 45
        if not stale:
            v = 1e-3 * rng.normal(size=6)
        both.dt = 0.5 if what != "stale state" and k == 40 else DT
        seen |= both.step(v=v).status
    assert seen & (osc.Status.STALE | osc.Status.TIME_JUMP)


@with_cc
def test_another_force_has_other_thresholds_unless_they_were_given(tmp_path):
    both = Pressing(tmp_path / "graded")
    given = Pressing(tmp_path / "given", contact=(1.0, 4.0))
    for k in range(150):
        if k in (50, 100):  # the last one is less than what the first was sure of
            force = np.array([20.0 if k == 50 else 4.0])
            for one in (both, given):
                one.press.force = force
                assert one.c.set("force", one.press, force) == 0
        both.step()
        given.step()
    assert both.press.thresholds == (0.1 * 4.0, 0.4 * 4.0)
    assert given.press.thresholds == (1.0, 4.0)
    assert both.c.set("force", both.press, np.zeros(1)) == -3
    assert given.c.set("force", given.press, np.array([3.9])) == -3


@with_cc
@pytest.mark.parametrize("clock", [5.0, -5.0])
@pytest.mark.parametrize("heard", [True, False])
def test_a_restart_is_no_time_for_a_force_task(tmp_path, clock, heard):
    both = Pressing(tmp_path)
    for _ in range(300):
        both.step()
    both.python.restart()
    both.c.restart()
    both.t += clock
    stale = osc.Status.WRENCH_STALE
    both.step(WRENCH if heard else None)
    answers = [both.step(WRENCH if heard else None).status for _ in range(60)]
    assert bool(answers[-1] & stale) != heard


@with_cc
def test_a_turn_that_comes_anew_takes_the_short_way(tmp_path):
    robot = osc.load_robot("puma560")
    q, v = robot.q_reference.copy(), np.zeros(6)
    robot.update(q, v)
    turn = osc.OrientationTask(target=robot.rotation(robot.tool).copy(), name="turn")
    controller = osc.Controller(robot, osc.Stack([turn, osc.PostureTask(target=q)]))
    c, t = InC(tmp_path, controller), 0.0

    def step():
        command = controller.step(t, q, v)
        np.testing.assert_array_equal(c.step(t, q, v)[1], command.tau)
        return command

    step()
    t += DT
    controller.stack.remove(turn, duration=0.0, start_time=t)
    assert c.set("presence", turn, 0, t, 0.0) == 0
    step()
    for _ in range(70):  # half a turn and a bit, while nobody looks
        t += DT
        q[5] += 0.05
        step()
    t += DT
    controller.stack.insert(turn, 0.0, duration=0.0, start_time=t)
    assert c.set("presence", turn, 1, t, 0.0) == 0
    assert step().tasks["turn"].error_norm < math.pi
