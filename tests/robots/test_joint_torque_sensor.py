"""What is felt in the joints is told as a wrench, as far as the arm can feel it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import opspace as osc
from opspace.drivers import franka
from opspace.errors import InputError, UnknownNameError

ROBOT = osc.load_robot("puma560")
NOTHING = 1e-9, 2e-9
"""Fades nothing that is not singular to the last digit."""
DT = 1e-3


def felt(q, pressed):
    """Torque of the environment on the joints when the tool presses."""
    ROBOT.update(q, np.zeros(6))
    return -ROBOT.jacobian(ROBOT.frame_id(ROBOT.tool)).T @ pressed


def posture(seed):
    rng = np.random.default_rng(seed)
    return ROBOT.q_reference + rng.uniform(-0.5, 0.5, 6), rng.uniform(-20.0, 20.0, 6)


@given(st.integers(0, 2**32 - 1))
def test_a_wrench_that_is_felt_in_all_directions_is_told(seed):
    q, pressed = posture(seed)
    sensor = osc.JointTorqueSensor(ROBOT, fade=NOTHING)
    external = felt(q, pressed)
    size = np.linalg.cond(ROBOT.jacobian(ROBOT.frame_id(ROBOT.tool))) ** 2
    np.testing.assert_allclose(
        sensor.wrench(q, external), pressed, rtol=0, atol=1e-12 * size * np.abs(pressed).max()
    )
    point = osc.JointTorqueSensor(ROBOT, moments=False, fade=NOTHING)
    found = point.wrench(q, felt(q, np.concatenate([pressed[:3], np.zeros(3)])))
    np.testing.assert_allclose(found[:3], pressed[:3], rtol=0, atol=1e-12 * size * 20.0)
    assert not found[3:].any()


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 2.0))
def test_never_more_is_told_than_is_there_and_it_changes_continuously(seed, half):
    """Also where the arm straightens: a faded estimate is the shorter, and no error is blown up."""
    q, pressed = posture(seed)
    q[2] = np.pi / 2 + 0.2 * (half - 1.0)
    external = felt(q, pressed)
    sensor = osc.JointTorqueSensor(ROBOT)
    levers = np.array([1.0, 1.0, 1.0, 0.1, 0.1, 0.1])
    told = sensor.wrench(q, external)
    assert np.linalg.norm(told / levers) <= np.linalg.norm(pressed / levers) * (1.0 + 1e-6)
    near = sensor.wrench(q + 1e-7, external)
    assert np.linalg.norm((near - told) / levers) <= 1e-3 * np.linalg.norm(pressed / levers)


def test_in_a_direction_that_cannot_move_nothing_is_told():
    """The wrist of an outstretched arm feels nothing along it, whatever the noise."""
    q, wrist = ROBOT.q_reference.copy(), ROBOT.frame_id("link4")
    q[2] = np.pi / 2 - np.arctan2(0.0203, 0.4318)
    ROBOT.update(q, np.zeros(6))
    J = ROBOT.jacobian(wrist)[:3]
    _, axes = np.linalg.eigh(J @ np.linalg.solve(ROBOT.M, J.T))
    pressed = axes @ [1000.0, 50.0, -50.0]
    sensor = osc.JointTorqueSensor(ROBOT, "link4", moments=False)
    noise = 0.1 * np.random.default_rng(0).normal(size=6)
    found = axes.T @ sensor.wrench(q, -J.T @ pressed + noise)[:3]
    assert abs(found[0]) < 1e-9
    np.testing.assert_allclose(found[1:], [50.0, -50.0], atol=1.0)


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_an_arm_presses_by_what_its_joints_feel(noise):
    robot = ROBOT.fresh()
    robot.update(robot.q_reference, np.zeros(6))
    start = robot.position(robot.frame_id(robot.tool)).copy()
    press = osc.ForceTask(force=-10.0, axes_frame="world", contact=(1.0, 4.0))
    hold = osc.PositionTask(axes="xy", kp=400.0)
    stack = osc.Stack([press, osc.OrientationTask(kp=400.0), hold, osc.PostureTask(kp=20.0)])
    controller = osc.Controller(robot, stack, period=DT)
    table = osc.Surface(start - [0.0, 0.0, 0.005], stiffness=1e4, friction=0.0)
    plant = osc.Plant(robot, robot.q_reference, surfaces=[table])
    sensor = osc.JointTorqueSensor(robot, moments=False)
    rng = np.random.default_rng(1)
    force = []
    for i in range(900):
        external = felt(plant.q, plant.exerted) + noise * rng.normal(size=6)
        wrenches = sensor.wrenches(plant.q, external)
        command = controller.step(i * DT, plant.q, plant.v, wrenches=wrenches)
        plant.advance(command.tau)
        force.append(-plant.exerted[2])
    late = np.array(force[-200:])
    assert np.sqrt(np.mean((late - 10.0) ** 2)) <= 0.1


def test_what_cannot_be_is_refused():
    with pytest.raises(InputError, match="fade"):
        osc.JointTorqueSensor(ROBOT, fade=(0.1, 0.1))
    with pytest.raises(InputError, match="lever"):
        osc.JointTorqueSensor(ROBOT, lever=0.0)
    with pytest.raises(UnknownNameError, match="nowhere"):
        osc.JointTorqueSensor(ROBOT, "nowhere")
    with pytest.raises(InputError, match="6 finite"):
        osc.JointTorqueSensor(ROBOT).wrench(ROBOT.q_reference, [0.0] * 5)


def test_the_driver_of_a_franka_hands_on_what_its_joints_feel(monkeypatch):
    state = SimpleNamespace(
        time=SimpleNamespace(to_sec=lambda: 0.5),
        q=[0.1] * 7, dq=[0.0] * 7, tau_J_d=[0.0] * 7, tau_ext_hat_filtered=[1.0] * 7,
    )  # fmt: skip
    arm = SimpleNamespace(
        FrankaException=RuntimeError,
        RealtimeConfig=SimpleNamespace(kEnforce=0, kIgnore=1),
        Robot=lambda host, config: SimpleNamespace(
            start_torque_control=lambda: SimpleNamespace(readOnce=lambda: (state, None))
        ),
    )
    monkeypatch.setattr(franka, "_import_pylibfranka", lambda: arm)
    for feel, told in (
        (None, None),
        (lambda q, external: {"tool": q + external}, {"tool": np.full(7, 1.1)}),
    ):
        driver = franka.FrankaDriver("arm", felt=feel)
        driver.start()
        found = driver.read(0.1).wrenches
        assert (found is None) == (told is None)
        if told is not None:
            np.testing.assert_array_equal(found["tool"], told["tool"])
