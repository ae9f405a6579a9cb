"""Unitree's messages and driver, against the library's own bytes and a simulated robot behind DDS."""

import contextlib
import json
import os
import signal
import subprocess
import sys
from types import SimpleNamespace as Fields

import numpy as np
import pytest

import opspace as osc

pytest.importorskip("cyclonedds", reason="needs the extra unitree")

from opspace.drivers.unitree import G1_MOTORS, UnitreeDriver
from opspace.drivers.unitree_messages import (
    HEAD,
    MOTORS,
    CommandBytes,
    StateBytes,
    messages,
)

ARM = ("left_hip_pitch_joint", "left_hip_roll_joint", "left_hip_yaw_joint")
PUMA = G1_MOTORS[:6]
DOMAIN = 60 + os.getpid() % 100
CHANCE = np.random.default_rng(0)


def floats(size=None):
    return np.float32(CHANCE.normal(size=size)).tolist()


def motor_command_fields(mode):
    numbers = {name: floats() for name in ("q", "dq", "tau", "kp", "kd")}
    return Fields(mode=mode, **numbers, reserve=0)


def motor_state_fields():
    numbers = {name: floats() for name in ("q", "dq", "tau_est")}
    rest = {"temperature": [0, 0], "vol": 0.0, "sensor": [0, 0], "motorstate": 0}
    return Fields(mode=0, **numbers, ddq=0.0, **rest, reserve=[0] * 4)


def command_fields():
    return Fields(
        mode_pr=0,
        mode_machine=5,
        motor_cmd=[motor_command_fields(int(k < 29)) for k in range(MOTORS)],
        reserve=[0] * 4,
        crc=0,
    )


def state_fields():
    imu = Fields(
        quaternion=[0.0] * 4,
        gyroscope=[0.0] * 3,
        accelerometer=[0.0] * 3,
        rpy=[0.0] * 3,
        temperature=0,
    )
    return Fields(
        version=[0, 0],
        mode_pr=0,
        mode_machine=7,
        tick=2**32 - 3,
        imu_state=imu,
        motor_state=[motor_state_fields() for _ in range(MOTORS)],
        wireless_remote=[0] * 40,
        reserve=[0] * 4,
        crc=0,
    )


def test_bytes_are_those_that_the_library_writes_field_by_field():
    fields, ours = command_fields(), CommandBytes()
    for name in ("q", "dq", "tau", "kp", "kd"):
        ours.motors[name] = [getattr(motor, name) for motor in fields.motor_cmd]
    ours.enable(np.arange(29), 5)
    theirs = messages().command.__idl__.serialize(fields)
    assert messages().command(ours.body.tobytes()).serialize() == theirs
    assert np.array_equal(CommandBytes(theirs[HEAD:]).enabled, np.arange(MOTORS) < 29)
    assert CommandBytes(theirs[HEAD:]).mode_machine == 5

    fields, ours = state_fields(), StateBytes()
    for name in ("q", "dq", "tau_est"):
        ours.motors[name] = [getattr(motor, name) for motor in fields.motor_state]
    ours.tick, ours.mode_machine = fields.tick, fields.mode_machine
    theirs = messages().state.__idl__.serialize(fields)
    assert messages().state(ours.body.tobytes()).serialize() == theirs
    found = StateBytes(messages().state.deserialize(theirs).body)
    assert (found.tick, found.mode_machine) == (2**32 - 3, 7)


def checksum_bit_by_bit(words):
    """CRC-32/MPEG-2 as its polynomial says."""
    rest = 0xFFFFFFFF
    for word in words:
        for k in range(31, -1, -1):
            out = (rest >> 31) ^ (word >> k) & 1
            rest = (rest << 1) & 0xFFFFFFFF ^ (0x04C11DB7 if out else 0)
    return rest


def test_the_checksum_is_that_of_the_robots_structure():
    command = CommandBytes()
    command.motors["tau"] = floats(MOTORS)
    command.enable(np.arange(29), 5)
    structure = np.zeros(1004, np.uint8)  # as a compiler lays it out
    structure[1] = 5
    motors = structure[4 : 4 + 28 * MOTORS].reshape(MOTORS, 28)
    motors[:29, 0] = 1
    motors[:, 12:16] = command.motors["tau"].copy().view(np.uint8).reshape(MOTORS, 4)
    command.sign()
    assert command.whole
    assert command.checksum() == checksum_bit_by_bit(structure[:-4].view("<u4").tolist())
    command.motors["kp"][3] = 1.0
    assert not command.whole
    assert checksum_bit_by_bit([0]) == 0xC704DD7B


def test_what_cannot_be_driven_is_refused_by_name():
    with pytest.raises(osc.UnknownNameError, match="left_ear"):
        UnitreeDriver(G1_MOTORS, ["left_ear"])
    with pytest.raises(osc.InputError, match="once"):
        UnitreeDriver(G1_MOTORS, [ARM[0], ARM[0]])
    with pytest.raises(osc.InputError, match="35"):
        UnitreeDriver([f"m{k}" for k in range(36)], ["m1"])
    with pytest.raises(osc.InputError, match="brake"):
        UnitreeDriver(G1_MOTORS, ARM, brake=float("nan"))
    with pytest.raises(osc.InputError, match="stiffness"):
        UnitreeDriver(G1_MOTORS, ARM, hold=(-1.0, 1.0))
    assert len(G1_MOTORS) == 29
    assert osc.load_robot("g1").joint_names[6:] == G1_MOTORS


class WireOfOurs:
    """What a driver sends and is sent, without a network."""

    def __init__(self):
        self.states, self.sent = [], []

    def newest(self, timeout):
        return self.states.pop(0) if self.states else None

    def send(self, body):
        self.sent.append(CommandBytes(body))

    def close(self):
        pass


def test_joints_that_are_not_driven_are_held_where_they_were():
    driver = UnitreeDriver(G1_MOTORS, ARM[::-1], hold=(50.0, 1.5), brake=6.0)
    wire = driver._wire = WireOfOurs()
    state = StateBytes()
    state.mode_machine = 3
    state.motors["q"] = at = np.arange(MOTORS) / 8
    for tick in (2**32 - 2, 0, 2):
        state.tick = tick
        wire.states.append(state.body.tobytes())
    first = driver.read(0.1)
    assert np.array_equal(first.q, at[[2, 1, 0]])
    state.motors["q"] += 1.0
    times = [first.t, driver.read(0.1).t, driver.read(0.1).t]
    assert np.allclose(np.diff(times), 2e-3)
    driver.write(np.array([1.0, 2.0, 3.0]))
    command = wire.sent[-1]
    assert command.whole
    assert command.mode_machine == 3
    assert np.array_equal(np.flatnonzero(command.enabled), np.arange(29))
    assert command.motors["tau"][:3].tolist() == [3.0, 2.0, 1.0]
    assert not command.motors["tau"][3:].any()
    assert not command.motors["kp"][:3].any()
    assert not command.motors["kd"][:3].any()
    assert (command.motors["kp"][3:29] == 50.0).all()
    assert np.array_equal(command.motors["q"][3:29], at[3:29])
    assert driver.read(0.0) is None
    driver.stop()
    driver.stop()
    last = wire.sent[-1].motors[:29]
    assert (last["kd"] == 6.0).all()
    assert not last["tau"].any()
    assert not last["kp"].any()


@contextlib.contextmanager
def robot_behind_dds(*options):
    words = ["puma560", "--unitree", str(DOMAIN), "--interface", "lo", "--period", "0.002"]
    command = [sys.executable, "-m", "opspace.drivers.simulated_robot", *words, *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    account = {}
    try:
        assert process.stdout.readline()
        yield account
    finally:
        process.send_signal(signal.SIGTERM)
        rest, _ = process.communicate(timeout=60)
        account.update(json.loads(rest))


def driver():
    return UnitreeDriver(G1_MOTORS, PUMA, interface="lo", domain=DOMAIN)


@pytest.mark.slow
def test_a_robot_behind_dds_goes_to_a_target_and_nobody_else_may_drive_it():
    with robot_behind_dds("--lockstep") as account:
        robot = osc.load_robot("puma560")
        hand = osc.PositionTask(kp=50.0, max_speed=0.25)
        stack = osc.Stack([hand, osc.PostureTask(kp=16.0)])
        controller = osc.Controller(robot, stack, period=2e-3)
        loop = osc.Loop(controller, driver(), patience=3000, handover=0.1)
        with loop:
            hand.target = goal = robot.position("tool") + [0.0, 0.1, 0.0]
            with pytest.raises(osc.RobotStoppedError, match="somebody else"):
                driver().start()
            while loop.report.t < 2.0 and loop.wait(0.05):
                pass
        assert loop.report.completed, loop.report.reason
        robot.update(loop.history.q[-1], np.zeros(6))
        assert np.abs(robot.position("tool") - goal).max() < 5e-3
        again = osc.Loop(controller, driver(), patience=3000, handover=0.1).run(0.2)
        assert again.completed, again.reason
    assert account["reflexes"] == account["silences"] == 0
    assert account["fastest"] < 0.02
