"""Motors that give more one way than the other: what they give is used, and never more."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from opspace import Controller, Status
from opspace.controller import ReferenceController
from opspace.robots.motor_range import motor_range
from opspace.runs.check import check_robot

BOTH = pytest.mark.parametrize("form", [Controller, ReferenceController])
OPTIONS = [
    {"torque_limits": "priority", "period": 1e-3},
    {"torque_limits": "priority", "bias": "task"},
    {"torque_limits": "priority", "gravity": "robot"},
    {},
    {"bias": "task"},
]
PENDULUM = """<mujoco><worldbody><body pos="0 0 1"><joint name="j1" axis="0 1 0" range="-90 90"/>
<geom type="capsule" fromto="0 0 0 .4 0 0" size=".03" mass="2"/><site name="tip" pos=".4 0 0"/></body>
</worldbody><actuator><motor joint="j1" ctrlrange="{}"/></actuator></mujoco>"""


def uneven(least, most):
    """The Panda with other motors."""
    robot = osc.load_robot("panda")
    robot.torque_range = np.outer([least, most], robot.torque_limit)
    robot.torque_limit = np.minimum(-robot.torque_range[0], robot.torque_range[1])
    return robot


def stack():
    tool = osc.PositionTask(target=[0.9, 0.8, -0.4], kp=2000.0)
    return osc.Stack([osc.JointLimits(), tool, osc.PostureTask(kp=900.0)])


ends = st.tuples(st.floats(-1.5, -0.3), st.floats(0.3, 1.5))


@settings(max_examples=15)
@given(ends=ends, option=st.sampled_from(OPTIONS), seed=st.integers(0, 2**32 - 1))
def test_nothing_leaves_what_they_give_and_both_forms_agree(ends, option, seed):
    rng = np.random.default_rng(seed)
    robots = [uneven(*ends) for _ in range(2)]
    kinds = Controller, ReferenceController
    ours, readable = (f(r, stack(), **option) for f, r in zip(kinds, robots, strict=True))
    least, most = robots[0].torque_range
    for k in range(4):
        q = robots[0].q_reference + rng.uniform(-1.0, 1.0, 7)
        v = rng.uniform(-1.0, 1.0, 7)
        a, b = ours.step(k * 1e-3, q, v), readable.step(k * 1e-3, q, v)
        np.testing.assert_allclose(a.tau, b.tau, rtol=0, atol=1e-8 * (1.0 + abs(b.tau).max()))
        assert a.status == b.status
        total = b.tau + (robots[0].gravity if "gravity" in option else 0.0)
        outside = np.any((total < least - 1e-9) | (total > most + 1e-9))
        if "torque_limits" in option:
            assert not outside
        else:
            assert outside == (Status.ABOVE_TORQUE_LIMIT in a.status)
        braked = ours.braking(q, 20.0 * v)
        np.testing.assert_allclose(braked, readable.braking(q, 20.0 * v), rtol=0, atol=1e-8)
        braked += robots[0].gravity if "gravity" in option else 0.0
        assert np.all((least - 1e-9 <= braked) & (braked <= most + 1e-9))


@BOTH
def test_the_stronger_direction_is_used(form):
    """The weaker end is reached, and on the other side far more than it would allow."""
    robot, reached = uneven(-0.4, 1.2), np.zeros(2)
    controller = form(robot, stack(), torque_limits="priority")
    rng = np.random.default_rng(0)
    for k in range(30):
        q = robot.q_reference + rng.uniform(-0.6, 0.6, 7)
        tau = controller.step(k * 1e-3, q, rng.uniform(-1.0, 1.0, 7)).tau
        reached = np.maximum(reached, [np.max(tau / robot.torque_range[i]) for i in range(2)])
    assert reached[0] == pytest.approx(1.0, rel=1e-3)
    assert 1.5 * 0.4 / 1.2 < reached[1] <= 1.0 + 1e-9


@BOTH
@pytest.mark.parametrize("bias", ["joint", "task"])
def test_no_more_room_than_is_used_changes_nothing(form, bias):
    """Where no motor is at an end, what lies beyond does not count."""
    q = osc.load_robot("panda").q_reference
    calm = lambda: osc.Stack([osc.PositionTask(), osc.PostureTask()])  # noqa: E731
    found = [
        form(robot, calm(), torque_limits="priority", bias=bias).step(0.0, q, np.full(7, 0.1)).tau
        for robot in (osc.load_robot("panda"), uneven(-1.0, 1.4), uneven(-1.3, 1.0))
    ]
    np.testing.assert_allclose(found[1:], found[:1] * 2, rtol=0, atol=1e-9)


@BOTH
@pytest.mark.parametrize("ends", ["-1 9", "-9 1", "-3 5"])
def test_a_weight_is_held_by_the_side_that_carries_it(tmp_path, form, ends):
    """A weight that pulls one way: held where that side has as much, else said."""
    path = tmp_path / "pendulum.xml"
    path.write_text(PENDULUM.format(ends))
    robot = osc.load_robot(path)
    least, _ = map(float, ends.split())
    model = mujoco.MjModel.from_xml_path(str(path))
    assert tuple(robot.torque_range[:, 0]) == tuple(model.actuator_ctrlrange[0])
    weight = robot.gravity[0]
    assert -5.0 < weight < -3.0
    enough = least <= weight
    assert any("cannot be held" in text for text in check_robot(robot).warnings) != enough
    plant = osc.Plant(robot, robot.q_reference)
    limited = {"torque_limits": "priority", "period": plant.dt}
    osc.simulate(plant, form(robot, osc.Stack([osc.PostureTask()]), **limited), 0.2)
    assert (abs(plant.q[0] - robot.q_reference[0]) < 1e-3) == enough


def test_one_limit_where_that_is_all_that_is_known():
    """Assigned limits, own robots and floating bases have motors that are alike both ways."""
    robot = uneven(-0.5, 1.0)
    assert np.any(motor_range(robot).middle != 0.0)
    robot.torque_limit = 0.3 * np.ones(7)
    motors = motor_range(robot)
    assert np.all(motors.middle == 0.0)
    assert np.all(motors.most == 0.3)
    robot = uneven(-0.5, 1.0)
    robot.floating_base = True
    np.testing.assert_array_equal(motor_range(robot).most, robot.torque_limit)
    del robot.torque_range
    robot.floating_base = False
    np.testing.assert_array_equal(motor_range(robot).least, -robot.torque_limit)


@BOTH
def test_taking_over_and_handing_back_stay_inside(form):
    robot = uneven(-0.3, 1.2)
    controller = form(robot, stack(), torque_limits="priority")
    least, most = robot.torque_range
    q, v = robot.q_reference, np.zeros(7)
    controller.take_over(0.98 * most, duration=0.02)
    for k in range(40):
        tau = controller.step(k * 1e-3, q + 0.2 * np.sin(0.3 * k), v).tau
        assert np.all((least - 1e-9 <= tau) & (tau <= most + 1e-9)), k
