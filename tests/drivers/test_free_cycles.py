"""Cycles that need no interpreter do what those of Python do, beside threads that hold it."""

import ctypes
import threading

import numpy as np
import pytest

import opspace as osc
from opspace.drivers.udp import UdpDriver
from tests.drivers.test_robot_apart import FACTS, N, arm, driver_of, robot_apart


class Hog:
    """Holds the interpreter's lock again and again."""

    def __init__(self, seconds):
        self.seconds, self.over, self.times = seconds, threading.Event(), 0
        self.hold = ctypes.PyDLL(None).usleep

    def __enter__(self):
        self.thread = threading.Thread(target=self.work)
        self.thread.start()
        return self

    def work(self):
        while not self.over.wait(0.02):
            self.hold(int(1e6 * self.seconds))
            self.times += 1

    def __exit__(self, *_):
        self.over.set()
        self.thread.join()


def at_the_reference():
    """An arm whose posture does not depend on where it is found."""
    controller, hand = arm()
    *_, posture = controller.stack
    posture.target = controller.robot.q_reference
    return controller, hand


def until(loop, condition):
    while not condition():
        assert loop.wait(0.01), loop.report


def test_compiled_cycles_give_the_torque_of_python_and_wait_for_nobody(tmp_path):
    with robot_apart("memory", tmp_path) as (where, account):
        controller, hand = at_the_reference()
        guest = osc.JointTask("joint3", target=-2.5, max_speed=0.5)
        controller.stack.prepare(guest)
        driver = driver_of("memory", where)
        loop = osc.Loop(
            controller, driver, tasks=[guest], patience=5000, handover=0.1, compiled=True
        )
        with loop:
            until(loop, lambda: loop._free._runs)
            first = loop._history.seen
            hand.target = [0.35, -0.2, 0.85]
            with Hog(0.1) as hog:
                until(loop, lambda: loop._history.seen > first + 600)
            assert hog.times > 0
            assert loop._free._runs
            told = loop.report.t
            until(loop, lambda: loop.report.t > told)
            last = loop._history.seen
            controller.stack.insert(guest, level=-1, duration=0.1)
            until(loop, lambda: guest in list(controller.stack) and controller.stack.settled)
            until(loop, lambda: loop._free._runs)
            until(loop, lambda: loop._history.seen > last + 600)
            loop.ask(osc.RunRequest("gain", ("position",), kp=70.0, duration=0.1))
            until(loop, lambda: hand.kp == 70.0 and loop._free._runs)
            cycles = loop.history
    report = loop.report
    assert report.completed, report.reason
    assert report.standstill
    assert account["reflexes"] == account["silences"] == 0
    # Whoever steps the same states in Python gives the same torque, where none was held back.
    other, again = at_the_reference()
    again.target = [0.35, -0.2, 0.85]
    same = 0
    for k in range(first + 100, last - 10):
        command = other.step(cycles.t[k], cycles.q[k], cycles.v[k])
        step = np.abs(cycles.tau[k] - cycles.tau[k - 1]).max()
        if step < 0.98:
            same += 1
            assert np.array_equal(cycles.tau[k], command.tau)
    assert same > 300


def test_what_needs_python_at_every_tick_is_refused_by_name():
    controller, hand = arm()
    driver = driver_of("memory", "nowhere")
    with pytest.raises(osc.InputError, match="shared memory; UdpDriver is none"):
        osc.Loop(controller, UdpDriver("localhost", 1, nq=N, n=N, facts=FACTS), compiled=True)
    with pytest.raises(osc.InputError, match="observers"):
        osc.Loop(controller, driver, observers=[Hog(0.1)], compiled=True)
    hand.max_acceleration = 1.0
    with pytest.raises(osc.InputError, match="max_acceleration"):
        osc.Loop(controller, driver, compiled=True)
    robot = controller.robot
    stack = osc.Stack([osc.PositionTask(ki=10.0), osc.PostureTask()])
    tired = osc.Controller(robot, stack, gravity="robot", period=1e-3)
    with pytest.raises(osc.InputError, match="ki"):
        osc.Loop(tired, driver, compiled=True)
