"""Whoever is killed beside a loop, the robot brakes and the loop ends as it should."""

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest

import opspace as osc
from opspace.drivers.shared_memory import SharedMemoryDriver
from tests.drivers.test_robot_apart import FACTS, N, arm, robot_apart

BRIDGE = """
import sys
import numpy as np
import opspace as osc
from opspace.drivers.shared_memory import SharedRobotSide
from opspace.drivers.udp import UdpDriver
from opspace.loop.driver import DriverFacts, RobotState
facts = DriverFacts(period=1e-3, gravity="robot", torque_rate=1000.0)
robot = UdpDriver("127.0.0.1", int(sys.argv[2]), nq=6, n=6, facts=facts)
loop = SharedRobotSide(sys.argv[1], 6, 6)
robot.start()
print("there", flush=True)
tau = np.zeros(6)
while True:
    state = robot.read(5.0)
    assert state is not None
    loop.tell(state if state.tau is not None else state._replace(tau=np.zeros(6)))
    while (asked := loop.commands()) is None and loop.braked:
        robot.write(tau)
        loop.tell(robot.read(5.0)._replace(tau=tau))
    tau = tau if asked is None else asked
    robot.write(tau)
"""


@contextmanager
def with_a_driver_apart(folder, port):
    """A driver in a process of its own: UDP towards the robot, shared memory towards the loop."""
    command = [sys.executable, "-c", BRIDGE, str(folder / "driver"), port]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as driver:
        try:
            yield driver
        finally:
            driver.kill()


def kill_a_driver(folder):
    folder.mkdir()
    with robot_apart("udp", folder) as (port, account):
        with with_a_driver_apart(folder, port) as driver:
            assert driver.stdout.readline() == "there\n"
            # On a busy computer states are lost between the two processes.
            robot = osc.load_robot("puma560")
            stack = osc.Stack([osc.PositionTask(kp=50.0, max_speed=0.25), osc.PostureTask(kp=16.0)])
            controller = osc.Controller(
                robot, stack, gravity="robot", period=1e-3, on_time_jump="hold"
            )
            memory = SharedMemoryDriver(folder / "driver", nq=N, n=N, facts=FACTS)
            loop = osc.Loop(controller, memory, patience=4000, handover=0.1)
            with loop:
                while loop.report.counts.cycles < 500:
                    assert loop.wait(0.01)
                driver.kill()
                while loop.wait(0.05):
                    pass
        time.sleep(3.0)
    assert "no new state came from the robot" in loop.report.reason
    assert not loop.report.completed
    # The loop has nobody to tell any more; the robot notices and brakes.
    assert account["silences"] == 1
    assert account["fastest"] < 0.02


@pytest.mark.slow
def test_twenty_drivers_in_processes_of_their_own_are_killed(tmp_path):
    for k in range(20):
        kill_a_driver(tmp_path / str(k))


@pytest.mark.slow
def test_twenty_pages_are_killed_and_the_loop_goes_on(tmp_path):
    pytest.importorskip("viser", reason="needs the extra view")
    with robot_apart("memory", tmp_path) as (where, account):
        for k in range(20):
            controller, _ = arm()
            driver = SharedMemoryDriver(where, nq=N, n=N, facts=FACTS)
            viewer = osc.Viewer(
                controller, tmp_path / f"run{k}", speed=None, opened=lambda address: None
            )
            with viewer:
                loop = osc.Loop(controller, driver, observers=[viewer], patience=5000, handover=0.1)
                with loop:
                    cycles = loop.report.counts.cycles
                    while loop.report.counts.cycles < cycles + 200:
                        assert loop.wait(0.01)
                    os.kill(viewer._page._process.pid, signal.SIGKILL)
                    cycles = loop.report.counts.cycles
                    while loop.report.counts.cycles < cycles + 200:
                        assert loop.wait(0.01)
            assert loop.report.completed, loop.report.reason
            assert loop.report.standstill
            recording = osc.load(tmp_path / f"run{k}")
            assert len(recording.t) >= 400
    assert account["reflexes"] == account["silences"] == 0
    assert account["fastest"] < 0.02
