"""Somebody drags a ball to and fro through the arm for a minute, as on the page of the viewer."""

import numpy as np
import pytest

import opspace as osc
from tests.controller.collision_scenes import model_step, tool_of

pytestmark = pytest.mark.slow
SECONDS = 60.0


def drags(rng):
    """Times and places, each on the other side of the arm; some before the last one is reached."""
    t, side = 0.0, 1.0
    while True:
        goal = rng.uniform((0.2, 0.3, 0.35), (0.6, 0.5, 0.8))
        yield t, goal * [1.0, side, 1.0]
        t, side = t + rng.uniform(0.5, 4.0), -side


def test_nothing_touches_and_the_torque_does_not_step():
    robot = osc.load_robot("panda")
    ball = osc.Ball(0.08, (0.45, -0.5, 0.5))
    guard = osc.CollisionAvoidance(ball, pairs="none")
    tasks = [osc.OrientationTask(), osc.PositionTask(target=tool_of(robot)), osc.PostureTask()]
    stack = osc.Stack([osc.JointLimits(), *tasks])
    options = {"torque_limits": "priority", "period": 1e-3}
    controller = osc.Controller(robot, stack, collisions=guard, **options)
    model, asked = robot.fresh(), drags(np.random.default_rng(0))
    q, v = np.array(robot.q_reference), np.zeros(7)
    due, goal = next(asked)
    least, step, before, happened = np.inf, 0.0, None, osc.Status.OK
    for k in range(round(1e3 * SECONDS)):
        t = 1e-3 * k
        if t >= due:
            ball.lead(goal, t)
            due, goal = next(asked)
        command = controller.step(t, q, v)
        least = min(least, *(d.distance for d in command.distances.values()))
        if before is not None:
            step = max(step, np.max(np.abs(command.tau - before)))
        before, happened = command.tau, happened | command.status
        q, v = model_step(model, command.tau, q, v)
    assert least > 0.0  # its acceleration costs something of the margin
    assert step <= 3.0
    assert osc.Status.COLLISION in happened
    assert osc.Status.COLLISION_LOST not in happened
