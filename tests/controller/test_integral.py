"""Integral action: errors at rest go away, and nothing winds up."""

from __future__ import annotations

import numpy as np
import pytest

import opspace as osc
from opspace import Status
from opspace.controller import ReferenceController
from opspace.sim.disturbances import Disturbances

KINDS = pytest.mark.parametrize("kind", [osc.Controller, ReferenceController])
DT = 1e-3


def arm():
    robot = osc.load_robot("puma560")
    robot.update(robot.q_reference, np.zeros(6))
    return robot, robot.position(robot.frame_id(robot.tool)).copy()


def at_rest(disturbances, tasks, seconds):
    """Let a disturbed arm come to rest, and return the controller with its last command."""
    robot, _ = arm()
    controller = osc.Controller(robot, osc.Stack(tasks))
    plant = osc.Plant(robot, robot.q_reference, disturbances=disturbances)
    osc.simulate(plant, controller, seconds)
    return controller, controller.step(plant.t, plant.q, plant.v)


WRONG = {
    "friction": Disturbances(dry_friction=0.01),
    "masses": Disturbances(mass_error=0.2),
    "both": Disturbances(dry_friction=0.02, mass_error=0.2, seed=3),
}


@pytest.mark.parametrize("wrong", list(WRONG.values()), ids=list(WRONG))
def test_what_friction_and_wrong_masses_leave_goes_away(wrong):
    _, here = arm()
    errors = []
    for ki in (None, 1000.0):
        hand = osc.PositionTask(target=here + [0.05, 0.1, -0.1], kp=200.0, ki=ki)
        hand.target = osc.MinimumJerk(here, here + [0.05, 0.1, -0.1], 1.0)
        turn = osc.OrientationTask(kp=200.0, ki=ki)
        _, command = at_rest(wrong, [turn, hand, osc.PostureTask()], 4.0)
        errors.append(command.tasks["position"].error_norm)
    assert errors[0] > 1e-3
    assert errors[1] < 5e-4


@pytest.mark.parametrize(
    "task",
    [
        lambda here: osc.PoseTask(kp=200.0, ki=1000.0, name="held"),
        lambda here: osc.PositionTask(kp=200.0, ki=1000.0, axes_frame="tool", name="held"),
        lambda here: osc.PositionTask(kp=200.0, ki=1000.0, axes="zx", name="held"),
        lambda here: osc.PostureTask(kp=200.0, ki=1000.0, name="held"),
        lambda here: osc.JointTask("joint2", kp=200.0, ki=1000.0, name="held"),
    ],
)
def test_every_kind_of_task_carries_a_payload(task):
    _, here = arm()
    held = task(here)
    heavy = Disturbances(mass_error=0.3, seed=1)
    _, command = at_rest(heavy, [held, osc.PostureTask(kp=25.0)], 3.0)
    assert command.tasks["held"].error_norm < 1e-5
    assert np.abs(held.integral).max() > 1e-2


def ticks(kind, task, q, count, t=0.0, **options):
    """Tick at one state, where nothing follows: the integral goes as far as it may."""
    robot, _ = arm()
    controller = kind(robot, osc.Stack([task, osc.PostureTask()]), **options)
    return [controller.step(t + k * DT, q, np.zeros(6)) for k in range(count)], controller


@KINDS
def test_it_is_the_integral_of_the_error_within_its_bound(kind):
    robot, here = arm()
    hand = osc.PositionTask(target=here + [0.01, 0.0, -0.02], kp=100.0, ki=500.0, max_integral=0.02)
    found, _ = ticks(kind, hand, robot.q_reference, 11)
    np.testing.assert_allclose(
        hand.integral, 500.0 * 10 * DT * np.array([0.01, 0, -0.02]), atol=1e-9
    )
    taus = np.array([command.tau for command in found])
    steps = np.abs(np.diff(taus, axis=0)).max(axis=1)
    assert steps[1:].max() < 1.001 * steps[1:].min() + 1e-9  # no step but its slope
    ticks(kind, hand, robot.q_reference, 900)
    np.testing.assert_allclose(hand.integral, [2.0, 0.0, -2.0], atol=1e-6)


def test_both_forms_push_alike():
    robot, _ = arm()
    taus = []
    for kind in (osc.Controller, ReferenceController):
        hand = osc.PoseTask(kp=100.0, ki=500.0, axes_frame="tool", name="hand")
        joint = osc.JointTask("joint3", float(robot.q_reference[2]) + 0.1, ki=300.0)
        own = osc.load_robot("puma560")
        controller = kind(own, osc.Stack([joint, hand, osc.PostureTask()]))
        rng = np.random.default_rng(4)
        for k in range(60):
            q = robot.q_reference + 0.05 * rng.normal(size=6)
            taus.append(controller.step(k * DT, q, rng.normal(size=6)).tau)
    one, two = np.reshape(taus, (2, 60, 6))
    np.testing.assert_allclose(one, two, atol=1e-9 * np.abs(one).max())


def frozen(kind, task, *, change=lambda c: None, q=None, **options):
    """Whether the integral of a task stands still."""
    robot, _ = arm()
    q = robot.q_reference if q is None else q
    _, controller = ticks(kind, task, q, 3, **options)
    change(controller)
    controller.step(3 * DT, q, np.zeros(6))
    before = task.integral.copy()
    command = controller.step(4 * DT, q, np.zeros(6))
    return bool(np.array_equal(task.integral, before)), command.status


@KINDS
def test_it_is_frozen_while_anything_saturates(kind):
    robot, here = arm()

    def hand(**options):
        return osc.PositionTask(target=here + [0.02, 0, 0.02], ki=500.0, **options)

    assert not frozen(kind, hand())[0]
    assert not frozen(kind, hand(max_speed=1.0))[0]
    assert frozen(kind, hand(max_speed=0.05))[0]
    still, status = frozen(kind, hand(kp=1e4, kv=200.0))
    assert still
    assert Status.ABOVE_TORQUE_LIMIT in status
    still, status = frozen(kind, hand(kp=1e4, kv=200.0), torque_limits="priority")
    assert still
    assert Status.TORQUE_SCALED in status
    gravity = robot.gravity.copy()
    assert frozen(kind, hand(), change=lambda c: c.take_over(gravity))[0]
    assert frozen(kind, hand(), change=lambda c: c.stack.remove("position", 0.1))[0]
    assert frozen(kind, hand(), change=lambda c: c.stack.move("position", 5.0, 0.1))[0]


@KINDS
def test_only_directions_that_are_on_are_integrated(kind):
    """Stretched out, the tool has no way further out; sideways it has."""
    robot, _ = arm()
    q = robot.q_reference.copy()
    best = min(np.linspace(-np.pi, np.pi, 721), key=lambda x: _straightness(robot, q, x))
    q[2] = best
    robot.update(q, np.zeros(6))
    here = robot.position(robot.frame_id(robot.tool)).copy()
    hand = osc.PositionTask(target=here + [0.01, 0.02, 0.03], ki=500.0)
    stack = osc.Stack([osc.OrientationTask(), hand, osc.PostureTask()])
    controller = kind(robot, stack)
    found = [controller.step(k * DT, q, np.zeros(6)) for k in range(30)]
    assert Status.DIRECTION_OFF in found[-1].status
    level = found[-1].levels[1]
    off = level.directions[:, level.activation < 1.0 - 1e-9]
    assert 1 <= off.shape[1] < 3
    assert np.linalg.norm(hand.integral) > 1e-3
    assert np.abs(off.T @ hand.integral).max() < 1e-9


def _straightness(robot, q, elbow):
    moved = q.copy()
    moved[2] = elbow
    robot.update(moved, np.zeros(6))
    J = robot.jacobian(robot.frame_id(robot.tool))[:3, :3]
    return float(np.linalg.svd(J, compute_uv=False)[-1])


@KINDS
def test_it_goes_on_after_a_pause_and_begins_anew_with_a_task(kind):
    robot, here = arm()
    hand = osc.PositionTask(target=here + [0.01, 0.0, 0.0], ki=500.0)
    _, controller = ticks(kind, hand, robot.q_reference, 20)
    before = hand.integral.copy()
    controller.restart()
    controller.step(9.0, robot.q_reference, np.zeros(6))
    np.testing.assert_array_equal(hand.integral, before)
    controller.stack.remove(hand, 0.0)
    controller.step(9.001, robot.q_reference, np.zeros(6))
    controller.stack.insert(hand, 0.0, 0.1)
    controller.step(9.002, robot.q_reference, np.zeros(6))
    np.testing.assert_array_equal(hand.integral, 0.0)


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"ki": 0.0}, "ki must be above zero"),
        ({"ki": -1.0}, "ki must be above zero"),
        ({"ki": np.nan}, "ki must be finite"),
        ({"ki": 100.0, "max_integral": 0.0}, "max_integral must be above zero"),
        ({"ki": 2000.0}, r"ki = 2000 1/s³ diverges.* 2000 1/s³"),
        ({"ki": 50.0, "kp": [100.0, 1.0, 100.0]}, r"diverges.*kp kv = 2 1/s³"),
    ],
)
def test_gains_that_diverge_are_refused(options, reason):
    with pytest.raises(osc.InputError, match=f"'hand'.*{reason}"):
        osc.PositionTask(name="hand", **options).bind(arm()[0])


def test_without_it_nothing_is_integrated():
    robot, here = arm()
    hand = osc.PositionTask(target=here + 0.01)
    _, controller = ticks(osc.Controller, hand, robot.q_reference, 5)
    assert controller._integral is None
    np.testing.assert_array_equal(hand.integral, np.zeros(3))
