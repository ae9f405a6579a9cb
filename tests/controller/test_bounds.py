"""What no joint may exceed, whatever the tasks ask: positions, speeds and torques together."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from opspace import Status
from opspace.controller import ReferenceController
from opspace.controller.bounds import Bounds
from opspace.controller.limit_task_sets import braking, limit_terms
from opspace.loop import simulate
from opspace.sim import Plant

PANDA = osc.load_robot("panda")


def wild(limits, kind=osc.Controller, **options):
    """A stack that cares for no limit: stiff, fast and out of reach."""
    tool = osc.PositionTask(target=[0.9, 0.8, -0.4], kp=2000.0)
    posture = osc.PostureTask(PANDA.q_upper + 1.0, kp=1500.0)
    return kind(PANDA, osc.Stack([tool, posture], limits=limits), **options)


def near_limits(seed):
    rng = np.random.default_rng(seed)
    away = rng.exponential(0.05, 7)
    q = np.where(rng.random(7) < 0.5, PANDA.q_lower + away, PANDA.q_upper - away)
    return q, rng.normal(0.0, 0.3, 7)


@pytest.mark.parametrize("motors", ["report", "priority"])
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=40)
def test_no_joint_accelerates_more_than_it_may(motors, seed):
    limits = osc.JointLimits()
    controller = wild(limits, torque_limits=motors)
    q, v = near_limits(seed)
    command = controller.step(0.0, q, v)
    if motors == "priority":
        assert np.all(np.abs(command.tau) <= PANDA.torque_limit)
    PANDA.update(q, v)
    acceleration = np.linalg.solve(PANDA.M, command.tau - PANDA.bias)
    most = braking(PANDA.M, PANDA.bias, PANDA.torque_limit)
    terms = limit_terms(limits, q, v, most, 0.0)
    if Status.LIMIT_LOST in command.status and motors == "priority":
        return
    assert (Status.LIMIT_LOST in command.status) == any(
        term.side.sign * acceleration[term.side.index] > term.last for term in terms
    )
    bounds = Bounds(terms, PANDA.M, PANDA.bias, np.full(7, np.inf))
    slack = 2e-3 * np.maximum(1.0, np.abs([bounds.lower, bounds.upper]))
    assert np.all(bounds.lower - slack[0] <= acceleration)
    assert np.all(acceleration <= bounds.upper + slack[1])


@given(seed=st.integers(0, 2**32 - 1), period=st.sampled_from([None, 1e-3, 4e-3]))
@settings(max_examples=20)
def test_compiled_is_readable_where_limits_push_each_other(seed, period):
    q, v = near_limits(seed)
    options = {"torque_limits": "priority", "period": period}
    ours = wild(osc.JointLimits(), **options).step(0.0, q, v)
    theirs = wild(osc.JointLimits(), ReferenceController, **options).step(0.0, q, v)
    assert ours.status == theirs.status
    assert np.allclose(ours.tau, theirs.tau, rtol=1e-6, atol=1e-4)


def test_limits_that_are_far_change_nothing():
    wide = dict.fromkeys(PANDA.joint_names, (-100.0, 100.0))
    fast = dict.fromkeys(PANDA.joint_names, 1e4)
    answers = []
    for limits in (None, osc.JointLimits(joints=wide, speeds=fast)):
        stack = osc.Stack(
            [osc.PositionTask(target=[0.5, 0.3, 0.4]), osc.PostureTask()], limits=limits
        )
        answers.append(
            osc.Controller(PANDA, stack, period=1e-3).step(0.0, PANDA.q_reference, np.zeros(7))
        )
    assert answers[0].status == answers[1].status == Status.OK
    assert np.array_equal(answers[0].tau, answers[1].tau)


@pytest.mark.parametrize("name", ["panda", "ur5", "so101"])
def test_a_joint_that_comes_too_fast_is_stopped_or_told_lost(name):
    """With more speed than the limits count on, by what its motors give; nothing passes silently."""
    robot, fast = osc.load_robot(name), 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        joint = int(rng.integers(robot.nv))
        distance, speed = 10.0 ** rng.uniform(-3, -1), rng.uniform(0.2, 3.0)
        q, v = robot.q_reference.copy(), np.zeros(robot.nv)
        q[joint], v[joint] = robot.q_upper[joint] - distance, speed
        limits = osc.JointLimits(speeds=None)
        stack = osc.Stack([osc.PostureTask(q, kp=100.0)], limits=limits)
        controller = osc.Controller(robot, stack, torque_limits="priority", period=1e-3)
        plant = Plant(robot, q, dt=1e-3 / 20, torque_limits=True)
        plant.data.qvel[:] = v
        passed, lost = -np.inf, False
        for tick in range(200):
            command = controller.step(1e-3 * tick, plant.q, plant.v)
            lost = lost or Status.LIMIT_LOST in command.status
            for _ in range(20):
                plant.advance(command.tau)
            passed = max(passed, plant.q[joint] - robot.q_upper[joint])
        allowed = limits.allowed_speed(limits.sides[2 * joint + 1], distance)
        fast += speed > allowed and not lost
        assert lost or passed <= 1e-4
    assert fast >= 2


def test_a_joint_does_not_become_faster_than_it_may():
    speeds = dict.fromkeys(PANDA.joint_names, 0.5)
    fastest = {}
    for name, given_ in (("none", None), ("own", {}), ("given", speeds)):
        posture = osc.PostureTask(PANDA.q_reference + 0.8, kp=400.0)
        stack = osc.Stack([posture], limits=osc.JointLimits(speeds=given_))
        controller = osc.Controller(PANDA, stack)
        seen = []

        class Watch:
            def observe(self, q, v, command):
                seen.append((np.max(np.abs(v)), np.max(np.abs(np.asarray(command.tau)))))  # noqa: B023

        simulate(Plant(PANDA, PANDA.q_reference), controller, 1.5, [Watch()])
        fastest[name] = max(speed for speed, _ in seen)
    fast = float(PANDA.velocity_limit.max())
    assert fastest["none"] > 2.0 * fast
    assert fastest["own"] <= fast * (1.0 + 1e-3)
    assert 0.49 < fastest["given"] <= 0.5 * (1.0 + 1e-3)


def test_unknown_joints_and_speeds_that_are_none_are_named():
    with pytest.raises(osc.UnknownNameError, match="elbow"):
        osc.Controller(
            PANDA, osc.Stack([osc.PostureTask()], limits=osc.JointLimits(speeds={"elbow": 1.0}))
        )
    with pytest.raises(osc.InputError, match="panda_joint1"):
        osc.JointLimits(speeds={"panda_joint1": 0.0})
