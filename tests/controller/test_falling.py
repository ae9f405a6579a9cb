"""A robot that cannot be saved is damped: by a stated rule, without a step, until a restart."""

import pickle

import numpy as np
import pytest

import opspace as osc
from opspace.controller.falling import SLACKENING
from opspace.controller.reference import ReferenceController
from opspace.errors import InputError

TICK = 0.005
TURNED = np.array([np.cos(0.45), np.sin(0.45), 0.0, 0.0])
"""Quaternion of a base that has turned by 0.9 rad."""


def hovering(rule, **options):
    """G1 on nothing at all: what its centre of mass wants is given up from the first tick on."""
    robot = osc.load_robot("g1")
    stack = osc.Stack([osc.ComTask(robot.q_reference[:3]), osc.PostureTask(kp=25.0)])
    return osc.Controller(robot, stack, falling=rule, **options)


def ticks(controller, count, start=0, q=None):
    robot = controller.robot
    q = robot.q_reference if q is None else q
    v = np.linspace(-1.0, 1.0, robot.nv)
    return [controller.step((start + k) * TICK, q, v) for k in range(count)]


def test_not_balanced_for_too_long_is_falling_and_the_torque_goes_over_into_damping():
    controller, plain = hovering(osc.FallRule(after=0.02)), hovering(None)
    count = 4 + round(SLACKENING / TICK) + 2
    found, without = ticks(controller, count), ticks(plain, 5)
    assert all(osc.Status.NOT_BALANCED in command.status for command in without)
    for ours, theirs in zip(found[:4], without, strict=False):
        assert np.array_equal(ours.tau, theirs.tau)
        assert osc.Status.FALLING not in ours.status
    assert all(osc.Status.FALLING in command.status for command in found[4:])
    robot = controller.robot
    damping = -controller.damping * robot.M.diagonal() * robot.v
    damping[:6] = 0.0
    damping = np.clip(damping, -robot.torque_limit, robot.torque_limit)
    inside = np.clip(found[3].tau + damping, -robot.torque_limit, robot.torque_limit)
    assert np.allclose(found[4].tau, inside)
    np.testing.assert_allclose(found[-1].tau, damping, rtol=1e-12)
    assert np.all(found[-1].tau[:6] == 0.0)


def test_what_is_not_balanced_for_a_moment_stands():
    controller = hovering(osc.FallRule(after=0.02))
    stack = controller.stack
    ticks(controller, 3)
    feet = [
        osc.SoleContact(f"{side}_ankle_roll_link", (0.08, 0.02), offset=(0.03, 0.0, -0.035))
        for side in ("left", "right")
    ]
    for foot in feet:
        stack.insert(foot, 0.0)
    stack["com"].target = None
    still = np.zeros(controller.robot.nv)
    controller.step(3 * TICK, controller.robot.q_reference, still)
    found = [controller.step(k * TICK, controller.robot.q_reference, still) for k in range(4, 10)]
    assert all(osc.Status.FALLING not in command.status for command in found)


@pytest.mark.parametrize("kind", [osc.Controller, ReferenceController])
@pytest.mark.parametrize(
    ("slows", "nears", "falls"), [(0.01, 0.0, False), (0.0, 0.04, False), (-0.01, -0.04, True)]
)
def test_whoever_slows_down_or_comes_back_is_not_given_up(kind, slows, nears, falls):
    robot = osc.load_robot("g1")
    com = osc.ComTask()
    stack = osc.Stack([com, osc.PostureTask(kp=25.0)])
    controller = kind(robot, stack, falling=osc.FallRule(after=0.02))
    v, found = np.zeros(robot.nv), []
    robot.update(robot.q_reference, v)
    here = robot.com_position().copy()
    for k in range(10):
        v[0] = 0.5 - slows * k
        com.target = here + (1.0 - nears * k, 0.0, 0.0)
        found.append(controller.step(k * TICK, robot.q_reference, v).status)
    assert all(osc.Status.NOT_BALANCED in one for one in found)
    assert [osc.Status.FALLING in one for one in found] == [falls and k >= 4 for k in range(10)]


def test_a_base_that_has_turned_is_falling_until_a_restart():
    controller = hovering(osc.FallRule(after=100.0, tilt=0.8))
    q = controller.robot.q_reference.copy()
    q[3:7] = TURNED
    assert osc.Status.FALLING not in ticks(controller, 1)[0].status
    assert osc.Status.FALLING in ticks(controller, 1, 1, q)[0].status
    assert osc.Status.FALLING in ticks(controller, 1, 2)[0].status
    controller.restart()
    assert osc.Status.FALLING not in ticks(controller, 1, 3)[0].status
    # Turning about the vertical is no tilt.
    q[3:7] = [0.0, 0.0, 0.0, 1.0]
    assert osc.Status.FALLING not in ticks(controller, 1, 4, q)[0].status


def test_rules_are_plain_values_and_wrong_ones_are_refused():
    rule = osc.FallRule(after=0.1, tilt=0.5)
    assert pickle.loads(pickle.dumps(rule)) == rule
    for wrong in ({"after": 0.0}, {"tilt": np.nan}, {"after": np.inf}):
        with pytest.raises(InputError, match="must be above 0"):
            osc.FallRule(**wrong)
    with pytest.raises(InputError, match="takes a FallRule, not float"):
        hovering(0.2)
    arm = osc.load_robot("ur5")
    with pytest.raises(InputError, match="bolted down and does not fall"):
        osc.Controller(arm, osc.Stack([osc.PostureTask()]), falling=rule)
