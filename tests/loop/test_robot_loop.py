"""A loop holds, ticks and brakes; whatever the robot does, it ends with a driver that was stopped."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from tests.loop.fake_robot import FakeRobot


def arm(gravity="controller", **options):
    robot = osc.load_robot("puma560")
    hand = osc.PositionTask(kp=50.0, max_speed=0.25, max_acceleration=1.0)
    stack = osc.Stack([hand, osc.PostureTask(kp=16.0)])
    options = {"period": 1e-3, **options}
    return osc.Controller(robot, stack, gravity=gravity, **options), hand


def stood(driver):
    return np.abs(driver.plant.v).max() < 0.01


@pytest.mark.parametrize("gravity", ["controller", "robot"])
def test_goes_to_a_target_and_stands_at_the_end(gravity):
    controller, hand = arm(gravity)
    driver = FakeRobot(controller.robot, gravity=gravity)
    seen = []
    loop = osc.Loop(controller, driver, observers=[Watcher(seen)], handover=0.1)
    robot = controller.robot
    robot.update(robot.q_reference, np.zeros(robot.nv))
    goal = robot.position(robot.frame_id("tool")) + [0.0, 0.05, 0.0]
    hand.target = goal
    report = loop.run(1.5)
    assert report.completed, report.reason
    assert report.standstill
    assert driver.calls == ["start", "stop"]
    assert stood(driver)
    robot.update(driver.plant.q, driver.plant.v)
    assert np.abs(robot.position(robot.frame_id("tool")) - goal).max() < 2e-3
    assert report.counts.missed == report.counts.old == report.counts.stale == 0
    # What observers saw is what was written.
    cycles = loop.history
    moving = np.isin(cycles.t, [t for t, _ in seen])
    assert np.array_equal(cycles.tau[moving], [tau for _, tau in seen])


class Watcher:
    def __init__(self, seen):
        self.seen = seen

    def observe(self, q, v, command):
        self.seen.append((command.t, command.tau))


@pytest.mark.parametrize("torque_rate", [None, 1000.0])
@pytest.mark.parametrize("gravity", ["controller", "robot"])
def test_refuses_a_robot_that_holds_its_weight_the_other_way(gravity, torque_rate):
    controller, _ = arm(gravity)
    driver = FakeRobot(
        controller.robot,
        gravity=gravity,
        adds_gravity=gravity == "controller",
        torque_rate=torque_rate,
    )
    other = {"controller": "robot", "robot": "controller"}[gravity]
    with pytest.raises(osc.InputError, match=f"declare gravity='{other}'"):
        osc.Loop(controller, driver).run(1.0)
    assert driver.calls == ["start", "stop"]
    assert np.abs(driver.plant.v).max() < 0.2  # found while it hardly moves


def test_refuses_what_does_not_go_with_the_controller():
    controller, _ = arm()
    robot = controller.robot
    with pytest.raises(osc.InputError, match="must be built with that"):
        osc.Loop(controller, FakeRobot(robot, gravity="robot"))
    with pytest.raises(osc.InputError, match=r"coriolis='robot'"):
        osc.Loop(controller, FakeRobot(robot, coriolis="robot"))
    with pytest.raises(osc.InputError, match=r"period=0\.002"):
        osc.Loop(controller, FakeRobot(robot, period=2e-3))
    with pytest.raises(osc.InputError, match="one rate per joint"):
        osc.Loop(controller, FakeRobot(robot, torque_rate=(1.0, 2.0)))
    with pytest.raises(osc.UnknownNameError, match="gravity"):
        FakeRobot(robot, gravity="nobody", adds_gravity=False)
    for rate in (0.0, -1.0, float("nan")):
        with pytest.raises(osc.InputError, match="torque rate"):
            FakeRobot(robot, torque_rate=rate)


@settings(max_examples=3, deadline=None)
@given(lost=st.lists(st.integers(400, 1000), max_size=8), burst=st.integers(1, 19))
def test_what_the_robot_accepts_never_steps_further_than_it_may(lost, burst):
    controller, hand = arm("robot")
    hand.max_acceleration = None  # a target that jumps steps what is asked for
    trouble = {k + i: "lost" for k in lost for i in range(burst)}
    driver = FakeRobot(controller.robot, gravity="robot", torque_rate=1000.0, trouble=trouble)

    def jump(tick):
        if tick == 300:
            hand.target = controller.robot.position("tool") + [0.0, 0.3, 0.0]

    report = osc.Loop(controller, driver, handover=0.1, observers=[AtTicks(jump)]).run(1.0)
    assert report.completed, report.reason
    assert report.counts.limited > 0
    assert max(driver.steps) <= 1.0
    assert report.standstill
    assert stood(driver)


class AtTicks:
    def __init__(self, do):
        self.do, self.ticks = do, 0

    def observe(self, q, v, command):
        self.ticks += 1
        self.do(self.ticks)


@pytest.mark.parametrize(
    ("trouble", "count"),
    [({500: "again", 501: "again"}, "old"), ({500: "silent", 502: "silent"}, "missed")],
)
def test_goes_on_after_a_state_that_is_old_or_lost(trouble, count):
    controller, _ = arm()
    report = osc.Loop(controller, FakeRobot(controller.robot, trouble=trouble)).run(0.5)
    assert report.completed, report.reason
    assert getattr(report.counts, count) == 2


def slow(seconds):
    import time

    time.sleep(seconds)


def test_a_robot_that_is_silent_is_left_to_its_driver():
    controller, _ = arm()

    class Silent(FakeRobot):
        def read(self, timeout):
            if self.reads >= 500:
                slow(timeout)
                return None
            return super().read(timeout)

    driver = Silent(controller.robot)
    report = osc.Loop(controller, driver).run(5.0)
    assert not report.completed
    assert "no new state" in report.reason
    assert not report.standstill
    assert driver.calls == ["start", "stop"]


def test_a_robot_that_tells_the_same_again_and_again_is_left_to_its_driver():
    controller, hand = arm()
    hand.target = [0.3, 0.3, 0.5]

    class Frozen(FakeRobot):
        def read(self, timeout):
            state = super().read(timeout)
            if self.reads > 600:
                return state._replace(q=self.last.q, v=self.last.v)
            self.last = state
            return state

    driver = Frozen(controller.robot)
    report = osc.Loop(controller, driver).run(5.0)
    assert "the same state" in report.reason
    assert report.counts.stale == 6
    assert driver.calls == ["start", "stop"]


@pytest.mark.parametrize("jump", [0.5, -0.5])
def test_a_clock_that_jumps_ends_in_standstill_or_is_held(jump):
    for policy in ("report", "hold"):
        controller, hand = arm(on_time_jump=policy)
        hand.target = [0.3, 0.3, 0.5]
        driver = FakeRobot(controller.robot, trouble={600: jump})
        loop = osc.Loop(controller, driver)
        report = loop.run(0.7)
        assert report.counts.jumps == 1
        assert report.completed == (policy == "hold"), report.reason
        assert report.standstill
        assert stood(driver)


def test_errors_of_all_sorts_end_in_a_robot_that_stands_and_are_raised():
    for what in ("read", "observer", "state"):
        controller, hand = arm()
        hand.target = [0.3, 0.3, 0.5]
        error = RuntimeError("the cable is out")

        def fail(tick, what=what, error=error):
            if what == "observer" and tick == 400:
                raise error

        class Broken(FakeRobot):
            def read(self, timeout, what=what):
                state = super().read(timeout)
                if what == "state" and self.reads == 600:
                    return state._replace(q=state.q * np.nan)
                return state

        trouble = {600: error} if what == "read" else None
        driver = Broken(controller.robot, trouble=trouble)
        loop = osc.Loop(controller, driver, observers=[AtTicks(fail)])
        with pytest.raises((RuntimeError, osc.InputError), match=r"cable|not finite"):
            loop.run(5.0)
        assert driver.calls == ["start", "stop"]
        assert loop.report.standstill
        assert not loop.report.completed
        assert stood(driver)


def test_ctrl_c_brakes_before_it_is_raised():
    controller, hand = arm()
    hand.target = [0.3, 0.3, 0.5]
    driver = FakeRobot(controller.robot)
    loop = osc.Loop(controller, driver)
    loop.wait = lambda: (_ for _ in ()).throw(KeyboardInterrupt)
    with pytest.raises(KeyboardInterrupt):
        loop.run()
    assert driver.calls == ["start", "stop"]
    assert loop.report.standstill
    assert not loop.running
    with pytest.raises(osc.InputError, match="runs once"):
        loop.start()


def test_tasks_targets_and_gains_change_from_another_thread():
    controller, hand = arm()
    guest = osc.JointTask("joint3", max_speed=0.5, max_acceleration=1.0)
    controller.stack.prepare(guest)
    driver = FakeRobot(controller.robot)
    with osc.Loop(controller, driver, tasks=[guest]) as loop:
        controller.stack.insert(guest, level=-1, duration=0.2)
        hand.target = [0.3, 0.3, 0.5]
        loop.ask(osc.RunRequest("gain", ("position",), kp=80.0, duration=0.2))
        t = loop.report.t
        while loop.wait(0.01) and loop.report.t < t + 1.0:
            pass
        assert loop.running
        loop.stop()
    assert loop.report.completed
    assert hand.kp == 80.0
    assert guest in list(controller.stack)
    assert loop.report.standstill


def test_a_robot_that_moves_at_the_start_is_refused():
    controller, _ = arm()
    driver = FakeRobot(controller.robot)
    driver.plant = osc.Plant(
        controller.robot, controller.robot.q_reference, v=np.full(6, 0.3), dt=1e-3
    )
    with pytest.raises(osc.InputError, match="stands still"):
        osc.Loop(controller, driver).run(1.0)
    assert driver.calls == ["start", "stop"]


def test_braking_torque_holds_at_rest_and_opposes_motion():
    for gravity in ("controller", "robot"):
        controller, _ = arm(gravity)
        robot = controller.robot
        q, v = robot.q_reference, np.array([0.1, -0.2, 0.3, 0.1, 0.2, -0.3])
        for _ in range(2):
            rest = controller.braking(q, np.zeros(6))
            robot.update(q, np.zeros(6))
            held = robot.gravity if gravity == "controller" else np.zeros(6)
            np.testing.assert_allclose(rest, held, atol=1e-9)
            robot.update(q, v)
            bias, damped = robot.bias.copy(), controller.damping * robot.M.diagonal() * v
            added = robot.gravity if gravity == "robot" else 0.0
            np.testing.assert_allclose(controller.braking(q, v), bias - damped - added, atol=1e-9)
            controller.step(0.0, q + 0.1, v)  # whatever the last tick left
