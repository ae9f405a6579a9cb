"""What the world balances is bias: limits, distances and the observer see the arm that it leaves."""

from __future__ import annotations

import numpy as np
import pytest

import opspace as osc
from opspace import Status
from opspace.controller import ReferenceController
from opspace.tasks.task import TaskTerms

DT = 1e-3
ROBOT = osc.load_robot("puma560")
ACTS = Status.JOINT_LIMIT | Status.FILTERED | Status.COLLISION


class Leaning(osc.PositionTask):
    """A position task that leans on the world with a force."""

    force = np.zeros(3)

    def evaluate(self, robot, t):
        terms = super().evaluate(robot, t)
        torque = terms.J.T @ self.force
        return TaskTerms(terms.J, terms.drift, terms.acceleration, terms.error, torque)


def limits_near(**options):
    """Joint limits that the way of the hand runs into."""
    ends = {
        name: (q - 0.15, q + 0.15)
        for name, q in zip(ROBOT.joint_names, ROBOT.q_reference.tolist(), strict=True)
    }
    return osc.JointLimits(joints=ends, **options)


def ball():
    ROBOT.update(ROBOT.q_reference, np.zeros(6))
    x = ROBOT.position(ROBOT.frame_id(ROBOT.tool)) + [-0.05, 0.3, -0.1]
    return osc.CollisionAvoidance(osc.Ball(0.08, name="ball", position=x))


WAYS = {
    "limits": lambda: (limits_near(), {}),
    "buffer": lambda: (limits_near(mode="buffer", buffer=0.1), {}),
    "observer": lambda: (limits_near(observer_time=0.005), {"torque_limits": "priority"}),
    "distance": lambda: (osc.JointLimits(), {"collisions": ball(), "torque_limits": "priority"}),
}


def leaning(kind, way, force):
    limits, options = WAYS[way]()
    ROBOT.update(ROBOT.q_reference, np.zeros(6))
    hand = Leaning(kp=200.0, max_speed=0.6, name="hand")
    hand.force = np.array(force)
    hand.target = ROBOT.position(ROBOT.frame_id(ROBOT.tool)) + [-0.1, 0.45, -0.2]
    stack = osc.Stack([hand, osc.PostureTask(ROBOT.q_reference)], limits=limits)
    return kind(ROBOT.fresh(), stack, period=DT, **options)


def lean_on(controllers, t, q, v, reaction):
    """Check one tick of an arm that leans on nothing and of one that does; what the first one got."""
    free, leans = (one.step(t, q, v) for one in controllers)
    size = np.max(np.abs(free.tau)) + np.max(np.abs(reaction))
    np.testing.assert_allclose(leans.tau - reaction, free.tau, rtol=0, atol=1e-9 * size)
    assert free.status == leans.status
    return free


@pytest.mark.parametrize("way", WAYS)
def test_what_the_world_balances_is_all_that_differs(way):
    """Both see the arm of the one that does not lean, as they do where the world pushes back."""
    force = np.array([5.0, -10.0, 20.0])
    compiled, readable = (
        [leaning(kind, way, f) for f in (np.zeros(3), force)]
        for kind in (osc.Controller, ReferenceController)
    )
    q, v, seen = ROBOT.q_reference.copy(), np.zeros(6), Status.OK
    for i in range(450):
        ROBOT.update(q, v)
        reaction = ROBOT.jacobian(ROBOT.frame_id(ROBOT.tool))[:3].T @ force
        # The observer is the only one that remembers the tick before.
        if i % 30 == 0 and way != "observer":
            lean_on(readable, i * DT, q, v, reaction)
        command = lean_on(compiled, i * DT, q, v, reaction)
        seen |= command.status
        ROBOT.update(q, v)
        v = v + DT * np.linalg.solve(ROBOT.M, command.tau - ROBOT.bias)
        q = q + DT * v
    assert seen & ACTS
