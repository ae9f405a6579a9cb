"""The driver of Universal Robots, against a stand-in with the names of the library."""

import numpy as np
import pytest

import opspace as osc
from opspace.drivers import universal_robots
from opspace.drivers.universal_robots import UrDriver


class Arm:
    """A simulated arm, seen through the two interfaces of the library; time passes when it is read."""

    def __init__(self, fail_at=None):
        self.robot = osc.load_robot("ur5")
        self.plant = osc.Plant(self.robot, self.robot.q_reference, dt=2e-3, adds_gravity=True)
        self.tau = np.zeros(6)
        self.said, self.looks, self.fail_at, self.states = [], 0, fail_at, 0

    def control(self, host, frequency):
        if host != "arm":
            raise RuntimeError("no route to host")
        assert frequency == 500.0
        self.said.append("control")
        return self

    def receive(self, host, frequency):
        if host != "arm":
            raise RuntimeError("no route to host")
        self.said.append("receive")
        return self

    def getTimestamp(self):
        self.looks += 1
        if (
            self.looks % 2 and not self.isProtectiveStopped()
        ):  # a state comes with every second look
            self.plant.advance(self.tau)
            self.states += 1
        return self.states * 2e-3

    def getActualQ(self):
        return self.plant.q.tolist()

    def getActualQd(self):
        return self.plant.v.tolist()

    def directTorque(self, torque, viscous_scale, coulomb_scale):
        assert len(viscous_scale) == len(coulomb_scale) == 6
        self.tau = np.array(torque)
        return "stopScript" not in self.said

    def isProtectiveStopped(self):
        return self.fail_at is not None and self.states >= self.fail_at

    def isEmergencyStopped(self):
        return False

    def isConnected(self):
        return True

    def stopScript(self):
        self.said.append("stopScript")

    def disconnect(self):
        self.said.append("disconnect")


@pytest.fixture
def arm(monkeypatch):
    arm = Arm()
    monkeypatch.setattr(universal_robots, "_import_ur_rtde", lambda: (arm.control, arm.receive))
    return arm


def loop_of(host="arm", goal=None):
    hand = osc.PositionTask(kp=50.0, max_speed=0.25)
    stack = osc.Stack([hand, osc.PostureTask(kp=16.0)])
    robot = osc.load_robot("ur5")
    controller = osc.Controller(robot, stack, gravity="robot", period=2e-3)
    observers = [] if goal is None else [Goal(hand, goal)]
    return osc.Loop(controller, UrDriver(host), handover=0.1, observers=observers)


class Goal:
    """Moves the target once, when the controller has the robot."""

    def __init__(self, hand, to):
        self.hand, self.to, self.ticks = hand, to, 0

    def observe(self, q, v, command):
        self.ticks += 1
        if self.ticks == 20:
            self.hand.target = self.to


def test_an_arm_goes_to_a_target_and_is_left_in_its_own_hands(arm):
    goal = np.array(arm.robot.position("tool0")) + [0.0, 0.05, 0.0]
    report = loop_of(goal=goal).run(2.0)
    assert report.completed, report.reason
    assert report.standstill
    arm.robot.update(arm.plant.q, np.zeros(6))
    assert np.abs(arm.robot.position("tool0") - goal).max() < 5e-3
    assert arm.said == ["receive", "control", "stopScript", "disconnect", "disconnect"]


def test_a_protective_stop_ends_the_loop_and_is_named(arm):
    arm.fail_at = 300
    with pytest.raises(osc.RobotStoppedError, match="protective stop"):
        loop_of().run(2.0)
    assert "stopScript" in arm.said


def test_what_cannot_be_is_refused(arm):
    with pytest.raises(osc.RobotStoppedError, match="nowhere: no route"):
        loop_of("nowhere").run(1.0)
    for parts in ([0.5] * 5, [1.1] * 6, [np.nan] * 6):
        with pytest.raises(osc.InputError, match="six parts"):
            UrDriver("arm", viscous=parts)
    assert UrDriver("arm", viscous=[0.0] * 6, coulomb=[0.0] * 6).facts.friction == "nobody"
    driver = UrDriver("arm")
    driver.start()
    driver.stop()
    driver.stop()
    arm.said.append("stopScript")
    driver.start()
    with pytest.raises(osc.RobotStoppedError, match="any more"):
        driver.write(np.zeros(6))


def test_the_library_has_what_is_used_of_it():
    pytest.importorskip("rtde_control", reason="needs the extra ur")
    control, receive = universal_robots._import_ur_rtde()
    used = {
        control: ("directTorque", "stopScript", "disconnect"),
        receive: (
            *("getTimestamp", "getActualQ", "getActualQd", "isConnected", "disconnect"),
            *("isEmergencyStopped", "isProtectiveStopped"),
        ),
    }
    for kind, names in used.items():
        assert all(hasattr(kind, name) for name in names)
    assert "viscous_scale" in control.directTorque.__doc__
