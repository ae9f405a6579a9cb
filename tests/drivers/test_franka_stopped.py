"""A Franka arm that has stopped by itself is asked nothing more: its client would wait for ever."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest

import opspace as osc
from opspace.drivers.franka import FrankaDriver


class Client:
    """The manufacturer's client, of an arm that stands and whose motion ends with a reflex."""

    FrankaException = type("FrankaException", (Exception,), {})
    RealtimeConfig = SimpleNamespace(kEnforce=0, kIgnore=1)

    def __init__(self, q, cycles):
        self.q, self.cycles, self.time, self.calls = q, cycles, 0.0, []
        self.last = np.zeros(q.size)

    def Robot(self, host, config):
        return self

    def start_torque_control(self):
        return self

    def Torques(self, tau):
        return SimpleNamespace(tau=tau)

    def stop(self):
        self.calls.append("stop")

    def readOnce(self):
        self.calls.append("read")
        self.time += 1e-3
        if self.time > 1e-3 * self.cycles:
            assert self.calls.count("reflex") == 0, "the client waits for ever"
            self.calls.append("reflex")
            raise self.FrankaException('["joint_velocity_violation"]')
        state = SimpleNamespace(
            time=SimpleNamespace(to_sec=lambda: self.time),
            q=self.q.tolist(),
            dq=[0.0] * self.q.size,
            tau_J_d=self.last.tolist(),
        )
        return state, None

    def writeOnce(self, torques):
        self.calls.append("write")
        assert self.calls.count("reflex") == 0, "the client waits for ever"
        self.last = np.array(torques.tau)


def test_a_reflex_ends_the_loop_with_its_name_and_nothing_is_asked_afterwards(monkeypatch):
    robot = osc.load_robot("panda")
    client = Client(robot.q_reference, 300)
    monkeypatch.setitem(sys.modules, "pylibfranka", client)
    stack = osc.Stack([osc.PostureTask(robot.q_reference)])
    controller = osc.Controller(robot, stack, gravity="robot", period=1e-3)
    driver = FrankaDriver("arm")
    loop = osc.Loop(controller, driver, hold_check=0.0)
    with pytest.raises(osc.RobotStoppedError, match=r"arm: .*joint_velocity_violation"):
        loop.run(1.0)
    assert client.calls[-3:] == ["read", "reflex", "stop"]
    with pytest.raises(osc.RobotStoppedError, match="joint_velocity_violation"):
        driver.read(1.0)
    client.time, client.calls = 0.0, []  # recovered, and begun again
    driver.start()
    assert driver.read(1.0).t == pytest.approx(1e-3)
    driver.write(np.zeros(7))
    driver.stop()
    assert client.calls == ["read", "write", "write", "stop"]
