"""A sensor before a tool: neither weight nor motion of the tool is a force on the world."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from opspace.errors import InputError, UnknownNameError

ROBOT = osc.load_robot("puma560")
WRIST = ROBOT.add_frame("wrist", ROBOT.tool, (0.0, 0.0, -0.05)) or "wrist"
MASS, COM = 0.76, np.array([0.01, -0.02, 0.06])


def moving(seed):
    rng = np.random.default_rng(seed)
    q = ROBOT.q_reference + rng.uniform(-0.5, 0.5, 6)
    return q, rng.uniform(-1.0, 1.0, 6), rng.uniform(-5.0, 5.0, 6), rng


def reading(q, v, a, pressed):
    """What the robot exerts on the tool: what its joints need more because the tool hangs there."""
    bare, laden = ROBOT.fresh(), osc.load_robot("puma560")
    laden.add_frame("wrist", laden.tool, (0.0, 0.0, -0.05))
    laden.payload = osc.Payload(MASS, COM, frame="wrist")
    needed = []
    for robot in (bare, laden):
        robot.update(q, v)
        needed.append(robot.M @ a + robot.bias)
    frame = bare.frame_id("wrist")
    on_tool = np.linalg.solve(bare.jacobian(frame).T, needed[1] - needed[0])
    arm = bare.position(bare.frame_id(bare.tool)) - bare.position(frame)
    on_tool += np.concatenate([pressed[:3], pressed[3:] + np.cross(arm, pressed[:3])])
    R = bare.rotation(frame)
    return bare, np.concatenate([R.T @ on_tool[:3], R.T @ on_tool[3:]])


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_what_is_left_is_the_wrench_on_the_environment(seed):
    q, v, a, rng = moving(seed)
    pressed = rng.uniform(-20.0, 20.0, 6)
    robot, measured = reading(q, v, a, pressed)
    sensor = osc.WristSensor("wrist", mass=MASS, com=COM)
    size = 1.0 / np.linalg.svd(robot.jacobian(robot.frame_id("wrist")), compute_uv=False)[-1]
    found = sensor.wrench(robot, measured, acceleration=a)
    np.testing.assert_allclose(found, pressed, rtol=0, atol=1e-10 * max(1.0, size) * 100.0)


@given(st.integers(0, 2**32 - 1))
def test_an_offset_is_tared_in_one_posture_and_gone_in_every_other(seed):
    rng = np.random.default_rng(seed)
    offset = rng.uniform(-5.0, 5.0, 6)
    sensor = osc.WristSensor("wrist", mass=MASS, com=COM)
    still = np.zeros(6)
    for k in range(2):
        robot = ROBOT.fresh()
        robot.update(ROBOT.q_reference + rng.uniform(-0.5, 0.5, 6), still)
        R = robot.rotation(robot.frame_id("wrist"))
        weight = R.T @ [0.0, 0.0, MASS * 9.81]
        measured = np.concatenate([weight, np.cross(COM, weight)]) + offset
        if k == 0:
            sensor.tare(robot, measured)
        np.testing.assert_allclose(sensor.wrench(robot, measured), 0.0, atol=1e-12)


def test_what_cannot_be_is_refused():
    with pytest.raises(InputError, match="mass"):
        osc.WristSensor("wrist", mass=-1.0)
    with pytest.raises(InputError, match="com"):
        osc.WristSensor("wrist", com=[0.0, 0.0])
    with pytest.raises(UnknownNameError, match="nowhere"):
        osc.WristSensor("nowhere").wrench(ROBOT, np.zeros(6))
    with pytest.raises(InputError, match="reading"):
        osc.WristSensor("wrist").wrench(ROBOT, np.full(6, np.nan))
