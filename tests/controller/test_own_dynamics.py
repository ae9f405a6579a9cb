"""The tick computes the robot by itself; the robot's library follows when somebody asks."""

import numpy as np
import pytest

import opspace as osc
from tests.controller.test_batch import ROBOTS, started, states
from tests.controller.test_compiled import Spring


@pytest.mark.parametrize("robot", ROBOTS, ids="-".join)
def test_torques_are_those_with_the_library(robot, monkeypatch):
    own = started(robot)
    monkeypatch.setattr(type(own.robot), "rigid_model", lambda self: None)
    library = started(robot)
    assert own._bodies is not None
    assert library._bodies is None
    for k, (q, v) in enumerate(zip(*states(own.robot, 50), strict=True)):
        one, other = own.step(k * 1e-3, q, v), library.step(k * 1e-3, q, v)
        scale = max(1.0, np.max(np.abs(other.tau)))
        np.testing.assert_allclose(one.tau, other.tau, rtol=0, atol=1e-9 * scale)
        assert one.status == other.status
    with pytest.raises(osc.InputError, match="not one of load_robot"):
        library.torque_batch(q[None], v[None])


@pytest.mark.parametrize("robot", ROBOTS, ids="-".join)
def test_the_robot_answers_for_the_state_of_the_tick(robot):
    controller = started(robot)
    arm = controller.robot
    fresh = arm.fresh()
    frame = arm.frame_id(arm.tool)
    for k, (q, v) in enumerate(zip(*states(arm, 4), strict=True)):
        controller.step(k * 1e-3, q, v)
        fresh.update(q, v)
        np.testing.assert_array_equal(arm.q, q)
        for what in (("position", "jacobian", "drift"), ("drift", "rotation"))[k % 2]:
            np.testing.assert_array_equal(getattr(arm, what)(frame), getattr(fresh, what)(frame))
        np.testing.assert_array_equal(arm.gravity, fresh.gravity)
        np.testing.assert_array_equal(arm.com_drift(), fresh.com_drift())
        for what in ("M", "bias"):
            np.testing.assert_array_equal(getattr(arm, what), getattr(fresh, what))


def test_a_task_of_ones_own_sees_the_state_of_its_tick():
    seen = []

    class Watching(Spring):
        def evaluate(self, robot, t):
            seen.append((robot.M.copy(), robot.position(self.frame)))
            return super().evaluate(robot, t)

    controller = started(ROBOTS[0], [Watching(), osc.PostureTask()])
    fresh = controller.robot.fresh()
    for k, (q, v) in enumerate(zip(*states(fresh, 5), strict=True)):
        controller.step(k * 1e-3, q, v)
        fresh.update(q, v)
        np.testing.assert_array_equal(seen[-1][0], fresh.M)
        np.testing.assert_array_equal(seen[-1][1], fresh.position(fresh.frame_id(fresh.tool)))
