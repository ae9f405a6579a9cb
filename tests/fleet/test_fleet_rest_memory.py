"""Robots of a fleet remember how far their tasks were from rest, as controllers of their own do."""

import numpy as np
import pytest

import opspace as osc
from tests.fleet.fleets import Beside

pytest.importorskip("warp", reason="fleets run in Warp: pip install 'opspace[gpu]'")


def at_rest(robot):
    """A stack of an arm that is nearly stretched out, at its target."""
    q = robot.q_reference.copy()
    q[2] = -1.75
    robot.update(q, np.zeros(robot.nv))
    hand = osc.PositionTask(target=robot.position(robot.tool) + [0.01, 0.0, -0.01])
    turn = osc.OrientationTask(target=robot.rotation(robot.tool).copy())
    return [turn, hand, osc.PostureTask(robot.q_reference)], osc.JointTask("joint3", 0.3)


def test_every_robot_remembers_as_a_controller_of_its_own():
    both = Beside(count=4, make=at_rest, singularity=osc.Singularity(near=0.3))
    fleet, rng = both.fleet, np.random.default_rng(4)
    q = both.robot.q_reference.copy()
    q[2] = -1.75
    aside = 0.02 * rng.normal(size=(both.count, q.size))
    pace = np.linspace(0.0, 1.0, both.count)[:, None]
    always = osc.Singularity(near=0.0)
    plain = osc.Controller(both.robot, osc.Stack(at_rest(both.robot)[0]), singularity=always)
    apart = 0.0
    for k in range(90):
        if k in (20, 50):
            for stack in both.stacks[:2]:
                stack.remove("position", 0.02)
            fleet.remove("position", 0.02, robots=[0, 1])
        if k in (25, 80):  # on its way out, and after it has been away
            for stack, first in zip(both.stacks[:2], both.first, strict=False):
                stack.insert(first["position"], 1, 0.02)
            fleet.insert("position", 1, 0.02, robots=[0, 1])
        s = 2.0 * np.pi * pace * k / 40.0
        Q = q + aside * np.sin(s) ** 3
        commands = both.assert_same(5e-3 * k, Q, 2.0 * aside * np.sin(s) ** 2)
        usual = plain.step(5e-3 * k, Q[3], 2.0 * aside[3] * np.sin(s[3]) ** 2).tau
        apart = max(apart, np.abs(commands[3].tau - usual).max())
    assert apart > 0.1


def test_a_robot_that_is_reset_has_not_been_at_rest():
    both = Beside(count=2, alone=True, make=at_rest, singularity=osc.Singularity(near=0.3))
    q = both.robot.q_reference.copy()
    q[2] = -1.75
    Q, V = np.tile(q, (2, 1)), np.zeros((2, q.size))
    first = both.fleet.step(0.0, Q, V).numpy().copy()
    for k in range(1, 200):
        later = both.fleet.step(0.02 * k, Q, V).numpy().copy()
    both.fleet.reset([1])
    again = both.fleet.step(4.0, Q, V).numpy()
    np.testing.assert_array_equal(first[0], first[1])
    assert np.abs(later - first).max() > 0.1
    np.testing.assert_array_equal(again[1], first[1])
    np.testing.assert_allclose(again[0], later[0], atol=1e-3)
