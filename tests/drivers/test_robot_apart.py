"""A robot in another process is driven through UDP and shared memory, whatever happens on the way."""

import json
import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager

import numpy as np
import pytest

import opspace as osc
from opspace.drivers.shared_memory import SharedBlock, SharedMemoryDriver, SharedRobotSide
from opspace.drivers.udp import HEAD, STATE, UdpDriver, UdpRobotSide, newer
from opspace.loop.driver import DriverFacts, RobotState

N = 6
FACTS = DriverFacts(period=1e-3, gravity="robot", torque_rate=1000.0)


@contextmanager
def robot_apart(way, folder, *options):
    """Have a robot in another process; gives how to drive it, then what has happened to it."""
    how = ["--udp", "0"] if way == "udp" else ["--memory", str(folder / "arm")]
    words = ["puma560", *how, "--gravity", "robot", "--torque-rate", "1000", "--lockstep", *options]
    command = [sys.executable, "-m", "opspace.drivers.simulated_robot", *words]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    account = {}
    try:
        line = process.stdout.readline().split()
        yield line[-1], account
    finally:
        process.send_signal(signal.SIGTERM)
        rest, _ = process.communicate(timeout=60)
        account.update(json.loads(rest))


def driver_of(way, where, facts=FACTS):
    if way == "udp":
        return UdpDriver("127.0.0.1", int(where), nq=N, n=N, facts=facts)
    return SharedMemoryDriver(where, nq=N, n=N, facts=facts)


def arm(gravity="robot"):
    robot = osc.load_robot("puma560")
    hand = osc.PositionTask(kp=50.0, max_speed=0.25)
    stack = osc.Stack([hand, osc.PostureTask(kp=16.0)])
    return osc.Controller(robot, stack, gravity=gravity, period=1e-3), hand


class Jump:
    """Sends the tool elsewhere at once, 0.3 s after the controller has the robot."""

    def __init__(self, controller, hand):
        self.controller, self.hand, self.ticks = controller, hand, 0

    def observe(self, q, v, command):
        self.ticks += 1
        if self.ticks == 300:
            self.hand.target = self.controller.robot.position("tool") + [0.0, 0.1, 0.0]


@pytest.mark.parametrize("way", ["udp", pytest.param("memory", marks=pytest.mark.slow)])
def test_a_robot_apart_goes_to_a_target_over_a_bad_wire(way, tmp_path):
    trouble = ["--loss", "0.05", "--delay", "1", "--reorder", "0.05"]
    with robot_apart(way, tmp_path, *trouble) as (where, account):
        controller, hand = arm()
        loop = osc.Loop(
            controller,
            driver_of(way, where),
            observers=[Jump(controller, hand)],
            handover=0.1,
            patience=3000,  # a computer that is busy is not what is tested
        )
        report = loop.run(1.5)
        robot = controller.robot
        robot.update(loop.history.q[-1], np.zeros(N))
        assert np.abs(robot.position("tool") - hand.target).max() < 5e-3
    assert report.completed, report.reason
    assert report.standstill
    assert report.counts.limited > 0
    assert account["reflexes"] == account["silences"] == 0
    assert account["steepest"] <= 1000.0
    assert account["fastest"] < 0.02


CLIENT = """
import sys
from tests.drivers.test_robot_apart import Jump, arm, driver_of
import opspace as osc
controller, hand = arm()
loop = osc.Loop(controller, driver_of(*sys.argv[1:]), observers=[Jump(controller, hand)], patience=3000)
with loop:
    while loop.report.counts.cycles < 1200:
        loop.wait(0.01)
    print("moving", flush=True)
    loop.wait()
"""


def killed_while_it_drives(way, folder, where):
    command = [sys.executable, "-c", CLIENT, way, where]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as client:
        assert client.stdout.readline() == "moving\n"
        client.kill()


@pytest.mark.slow
@pytest.mark.parametrize("way", ["udp", "memory"])
def test_a_robot_whose_driver_is_killed_brakes_and_can_be_driven_again(way, tmp_path):
    with robot_apart(way, tmp_path) as (where, account):
        killed_while_it_drives(way, tmp_path, where)
        controller, _ = arm()
        # The robot notices in its own time; before that it is somebody else's.
        for _ in range(100):
            try:
                report = osc.Loop(controller, driver_of(way, where), patience=3000).run(0.2)
                break
            except osc.OpspaceError:
                time.sleep(0.1)
        assert report.completed, report.reason
    assert account["silences"] == 1
    assert account["fastest"] < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("way", ["udp", "memory"])
def test_twenty_drivers_are_killed(way, tmp_path):
    for _ in range(20):
        with robot_apart(way, tmp_path) as (where, account):
            killed_while_it_drives(way, tmp_path, where)
            time.sleep(8.0)
        assert account["silences"] == 1
        assert account["fastest"] < 0.02


def test_packets_carry_what_they_are_to_and_the_end_of_a_robot_is_silence():
    side = UdpRobotSide(0, N)
    driver = UdpDriver("127.0.0.1", side.port, nq=N, n=N, facts=FACTS)
    driver.start()
    state = RobotState(0.0, np.arange(6.0), -np.arange(6.0), np.ones(6))
    side.commands()
    side.tell(state)
    found = driver.read(1.0)
    assert found.t == 0.0
    assert np.array_equal(found.q, state.q)
    assert np.array_equal(found.v, state.v)
    driver.write(np.full(6, 2.0))
    time.sleep(0.01)
    assert np.array_equal(side.commands(), np.full(6, 2.0))
    side.give_up()
    side.tell(state)
    with pytest.raises(osc.RobotStoppedError):
        driver.read(1.0)
    side.close()
    driver.write(np.zeros(6))
    assert driver.read(0.02) is None
    driver.stop()
    driver.stop()


def test_of_several_states_the_newest_is_read_and_others_are_refused():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as robot:
        robot.bind(("127.0.0.1", 0))
        driver = UdpDriver("127.0.0.1", robot.getsockname()[1], nq=1, n=1, facts=FACTS)
        driver.start()
        _, peer = robot.recvfrom(100)
        for number in (2**32 - 1, 1, 0):
            robot.sendto(HEAD.pack(STATE, number) + np.full(4, float(number)).tobytes(), peer)
        time.sleep(0.01)
        assert driver.read(1.0).t == 1.0
        robot.sendto(b"x", peer)
        assert driver.read(0.0) is None
        robot.sendto(HEAD.pack(STATE, 2) + bytes(8), peer)
        with pytest.raises(osc.InputError, match="40"):
            driver.read(1.0)
        driver.stop()
    assert newer(0, 2**32 - 1)
    assert not newer(5, 5)


def test_memory_is_read_whole_or_not_at_all(tmp_path):
    side = SharedRobotSide(tmp_path / "arm", 2, 2)
    for nq, n in ((3, 2), (2, 3), (3, 1)):
        with pytest.raises(osc.InputError, match="robot of"):
            SharedBlock(tmp_path / "arm", nq, n)
    other = tmp_path / "other"
    other.write_text("a letter of mine")
    with pytest.raises(osc.InputError, match="already"):
        SharedRobotSide(other, 2, 2)
    block = SharedBlock(tmp_path / "arm", 2, 2)
    side.tell(RobotState(1.0, np.ones(2), np.zeros(2), np.zeros(2)))
    assert block.state()[0] == 1.0
    for word in range(4, 4 + 2 + 7):  # somebody is writing, or his words are not all there yet
        whole = block.words.copy()
        block.words[word] += np.uint64(1)
        assert block.state() is None
        block.words[:] = whole
    assert block.state()[0] == 1.0
    # Who was killed while he wrote does not keep the next one from it.
    block._command[0] = 7
    block.put_command(np.ones(2))
    assert np.array_equal(side.commands(), np.ones(2))
    assert side.commands() is None
    block.close()
    side.close()
    assert not (tmp_path / "arm").exists()
