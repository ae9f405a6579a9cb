"""Limits hold for what a real arm does between two ticks: its mean acceleration, not the first one."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import opspace as osc
from opspace import Status
from opspace.controller import ReferenceController
from opspace.controller.bounds import change_within_tick
from opspace.controller.limit_task_sets import braking, limit_terms
from opspace.law.scalars import LOST
from tests.budget import examples

PERIOD = 1e-3
SUBSTEPS = 20
FAST = 9.0
"""Largest speed of a joint where no limit forbids it, rad/s."""
ROBOTS = {name: osc.load_robot(name) for name in ("so101", "panda")}


def controlled(robot, order, kind=osc.Controller, motors="priority"):
    """Tasks that care for no limit, in one of two orders."""
    tool, turn = osc.PositionTask(target=np.zeros(3)), osc.OrientationTask(target=np.eye(3))
    posture = osc.PostureTask()
    levels = [tool, turn, posture] if order == 0 else [posture, turn, tool]
    stack = osc.Stack(levels, limits=osc.JointLimits())
    controller = kind(robot, stack, torque_limits=motors, period=PERIOD)
    return controller, tool, turn, posture


kept = cache(controlled)


def admissible_state(robot, limits, rng):
    """Most joints near a limit, each with a part of the speed that it may have there."""
    n = robot.nv
    away, up = rng.exponential(0.05, n), rng.random(n) < 0.5
    near = np.where(up, robot.q_upper - away, robot.q_lower + away)
    q = np.where(rng.random(n) < 0.6, near, rng.uniform(robot.q_lower, robot.q_upper))
    q = np.clip(q, robot.q_lower, robot.q_upper)
    fastest = {1.0: np.full(n, FAST), -1.0: np.full(n, FAST)}
    for side in limits.sides:
        allowed = limits.allowed_speed(side, side.sign * (side.limit - q[side.index]))
        row = fastest[side.sign]
        row[side.index] = min(row[side.index], allowed, side.speed)
    part = rng.uniform(-1.0, 1.0, n)
    return q, np.where(part > 0.0, part * fastest[1.0], part * fastest[-1.0])


@pytest.mark.parametrize("kind", [osc.Controller, ReferenceController])
@pytest.mark.parametrize("motors", ["priority", "report"])
@pytest.mark.parametrize("name", ROBOTS)
@given(seed=st.integers(0, 2**32 - 1))
@examples(25)
def test_in_the_middle_of_a_tick_no_joint_does_more_than_it_may(name, motors, kind, seed):
    robot, rng = ROBOTS[name], np.random.default_rng(seed)
    controller, *tasks = kept(robot, int(rng.integers(2)), kind, motors)
    for task in tasks:
        task.kp = 10.0 ** rng.uniform(2.0, 5.0)
    posture = tasks[-1]
    posture.target = rng.uniform(-5.0, 5.0, robot.nv)
    limits = controller.stack.limits
    q, v = admissible_state(robot, limits, rng)
    command = controller.step(0.0, q, v)
    if Status.LIMIT_LOST in command.status:
        assert motors == "priority"  # without limits of the motors some torque always does it
        return
    robot.update(q, v)
    first = np.linalg.solve(robot.M, command.tau - robot.bias)
    mean = first + change_within_tick(robot, command.tau, first, PERIOD)
    most = braking(robot.M, robot.bias, robot.torque_limit)
    for term in limit_terms(limits, q, v, most, PERIOD):
        may = term.command + term.haste
        assert term.side.sign * mean[term.side.index] <= may + 2.0 * LOST * max(1.0, abs(may))


# What a search over states, targets and gains found worst where limits know only how a tick begins.
STARTS = {
    "so101": (
        [-4.311, 0.789, -1.77, -3.229, 4.324],
        [-2.038, -1.874, 1.948, -2.812, 2.01],
        [3.107, -2.132, -0.063, 1.097, 1.103],
        [-3.28, 0.082, 1.591],
        [-3.461, 0.802, 4.771, -3.154],
        [0.986, -0.438, -1.047],
    ),
    "panda": (
        [-5.977, -0.019, 1.159, 0.577, -0.14, 0.263, -0.938],
        [-1.005, 1.39, 1.762, 0.809, -0.48, 1.212, -1.042],
        [-0.445, 1.418, -0.15, -2.13, -0.549, -0.177, 1.625],
        [-1.106, -2.54, -0.27],
        [-0.463, 0.603, -0.199, 0.355],
        [0.7, 3.533, -0.09],
    ),
}


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("name", STARTS)
def test_the_worst_starts_found_pass_no_limit_under_exact_integration(name, order):
    where, how_fast, beyond, point, way, stiffness = map(np.array, STARTS[name])
    robot, real = ROBOTS[name], osc.load_robot(name)
    controller, tool, turn, posture = controlled(robot, order)
    for task, logit in zip((tool, turn, posture), stiffness, strict=True):
        task.kp = 10.0 ** (2.0 + 2.0 / (1.0 + np.exp(-logit)))
    q = robot.q_lower + (robot.q_upper - robot.q_lower) / (1.0 + np.exp(-2.0 * where))
    part, limits = np.tanh(1.5 * how_fast), controller.stack.limits
    v = np.zeros(robot.nv)
    for side in limits.sides:
        if side.sign * part[side.index] > 0.0:
            allowed = limits.allowed_speed(side, side.sign * (side.limit - q[side.index]))
            v[side.index] = part[side.index] * min(allowed, side.speed, 5.0)
    posture.target, tool.target = q + 8.0 * np.tanh(beyond), point
    turn.target = way / np.linalg.norm(way)
    for k in range(300):
        if k == 50:
            controller.stack.swap(tool, posture, duration=0.1)
        for side in limits.sides:
            assert side.sign * (q[side.index] - side.limit) <= 5e-6
        command = controller.step(k * PERIOD, q, v)
        assert Status.LIMIT_LOST not in command.status
        q, v = integrated(real, q, v, command.tau)


def integrated(robot, q, v, torque):
    """Let a tick pass at constant torque: Runge-Kutta of fourth order in many steps."""

    def slope(state):
        robot.update(*state)
        return np.array([state[1], np.linalg.solve(robot.M, torque - robot.bias)])

    x, h = np.array([q, v]), PERIOD / SUBSTEPS
    for _ in range(SUBSTEPS):
        a = slope(x)
        b = slope(x + h / 2.0 * a)
        c = slope(x + h / 2.0 * b)
        x = x + h / 6.0 * (a + 2.0 * b + 2.0 * c + slope(x + h * c))
    return x
