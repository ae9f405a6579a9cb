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


def on_ways():
    """An arm whose tasks go to new targets on ways."""
    controller, hand = at_the_reference()
    *_, posture = controller.stack
    robot = controller.robot
    robot.update(robot.q_reference, np.zeros(N))
    hand.target = robot.position("tool")
    hand.max_acceleration, posture.max_speed, posture.max_acceleration = 1.0, 1.0, 2.0
    return controller, hand, posture


def test_compiled_cycles_go_to_new_targets_on_ways_as_python_does(tmp_path):
    with robot_apart("memory", tmp_path) as (where, account):
        controller, hand, posture = on_ways()
        home = controller.robot.q_reference
        driver = driver_of("memory", where)
        loop = osc.Loop(controller, driver, patience=5000, handover=0.1, compiled=True)
        ways = []

        def asked(task, target, seconds):
            """Ask for a target, let cycles go on for so long, and have Python look at the way."""
            task.target = target
            first = loop.history.t[-1]
            until(loop, lambda: loop.report.t > first + seconds)
            assert loop._free._runs
            loop._free.ask()
            until(loop, lambda: task.way is not None and task.way.begin > first)
            until(loop, lambda: loop._free._runs)
            ways.append((task, target, task.way))

        with loop:
            until(loop, lambda: loop._free._runs)
            first = loop._history.seen
            until(loop, lambda: loop._history.seen > first + 500)
            asked(hand, [0.35, -0.2, 0.85], 0.3)
            asked(hand, [0.4, -0.1, 0.8], 0.1)  # turns round on its way
            asked(posture, home + 0.2, 0.1)
            end = loop.history.t[-1]
            hand.target = [0.4, -0.1, 0.8]  # the same way
            hand.kp = 60.0
            asked(posture, home, 0.3)
            cycles = loop.history
    assert loop.report.completed, loop.report.reason
    assert account["reflexes"] == account["silences"] == 0
    assert account["steepest"] <= 1000.0
    assert hand.way.begin == ways[1][2].begin
    # Whoever asks for the same ways at the same times in Python gets the same torque.
    other, *again = on_ways()
    begins = [np.searchsorted(cycles.t, way.begin) for *_, way in ways]
    same = 0
    for k in range(begins[0] - 400, np.searchsorted(cycles.t, end)):
        for (task, target, _), begin in zip(ways, begins, strict=True):
            if k == begin:
                again[task is posture].target = target
        command = other.step(cycles.t[k], cycles.q[k], cycles.v[k])
        if k > begins[0] and np.abs(cycles.tau[k] - cycles.tau[k - 1]).max() < 0.98:
            same += 1
            assert np.array_equal(cycles.tau[k], command.tau)
    assert same > 300


def test_what_needs_python_at_every_tick_is_refused_by_name():
    controller, _ = arm()
    driver = driver_of("memory", "nowhere")
    with pytest.raises(osc.InputError, match="shared memory; UdpDriver is none"):
        osc.Loop(controller, UdpDriver("localhost", 1, nq=N, n=N, facts=FACTS), compiled=True)
    with pytest.raises(osc.InputError, match="observers"):
        osc.Loop(controller, driver, observers=[Hog(0.1)], compiled=True)
    robot = controller.robot
    stack = osc.Stack([osc.PositionTask(ki=10.0), osc.PostureTask()])
    tired = osc.Controller(robot, stack, gravity="robot", period=1e-3)
    with pytest.raises(osc.InputError, match="ki"):
        osc.Loop(tired, driver, compiled=True)
