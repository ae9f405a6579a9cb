"""An arm that rests with a joint at its limit: no task above the last level pays for that."""

import numpy as np
import pytest

import opspace as osc
from opspace import Status
from opspace.controller import ReferenceController, bounds

# Of "close" the levels below the hand hardly move the joint.
TARGETS = {
    "low": ([-0.1603, -0.2279, 0.4097], [0.0684, 0.9887, 0.1007, 0.0871]),
    "close": ([-0.1771, -0.1125, 0.4632], [0.0621, 0.9974, 0.0162, 0.034]),
}


@pytest.mark.parametrize("kp", [25.0, 100.0])
@pytest.mark.parametrize("target", TARGETS)
def test_the_hand_of_a_panda_pays_next_to_nothing_for_its_posture(target, kp):
    """Its second joint is at its limit there, where the posture task pushes it."""
    robot = osc.load_robot("panda")
    position, orientation = TARGETS[target]
    tasks = [
        osc.JointLimits(),
        osc.OrientationTask(target=orientation, max_speed=1.0),
        osc.PositionTask(target=position, max_speed=0.5),
        osc.PostureTask(robot.q_reference, kp=kp),
    ]
    controller = osc.Controller(robot, osc.Stack(tasks))
    plant = osc.Plant(robot, robot.q_reference)
    assert osc.simulate(plant, controller, 5.0).completed
    command = controller.step(plant.t, plant.q, plant.v)
    assert Status.JOINT_LIMIT in command.status
    assert plant.q[1] > robot.q_upper[1] - 1e-3 or plant.q[1] < robot.q_lower[1] + 1e-3
    most = {"low": 1e-4, "close": 1e-3}[target]
    assert command.tasks["position"].error_norm < most
    assert command.tasks["orientation"].error_norm < most


@pytest.mark.parametrize("seed", range(6))
def test_both_forms_leave_the_same_room(seed):
    """Near limits, with a level on its way out and with damping or a posture below."""
    rng = np.random.default_rng(seed)
    robot = osc.load_robot(("panda", "ur5", "puma560")[seed % 3])
    lower = np.where(np.isfinite(robot.q_lower), robot.q_lower, -3.0)
    upper = np.where(np.isfinite(robot.q_upper), robot.q_upper, 3.0)
    away = rng.exponential(0.03, robot.nv)
    q = np.clip(np.where(rng.random(robot.nv) < 0.5, lower + away, upper - away), lower, upper)
    v = 0.2 * rng.normal(size=robot.nv)
    found = []
    for kind in (osc.Controller, ReferenceController):
        tasks = [osc.OrientationTask(target=np.eye(3)), osc.PositionTask(target=[0.3, 0.1, 0.4])]
        tasks += [osc.PostureTask(robot.q_reference, kp=25.0)] if seed % 2 else []
        stack = osc.Stack(tasks, limits=osc.JointLimits())
        controller = kind(robot, stack)
        controller.step(0.0, q, v)
        stack.remove("position", duration=1.0)
        found.append([controller.step(t, q, v) for t in (0.001, 0.5, 1.1)])
    assert any(Status.FILTERED in command.status for command in found[0])
    for compiled, readable in zip(*found, strict=True):
        size = max(1.0, np.abs(readable.tau).max())
        assert np.abs(compiled.tau - readable.tau).max() < 1e-8 * size
        assert compiled.status == readable.status
        assert compiled.limits == pytest.approx(readable.limits, abs=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_of_a_speed_nothing_is_left_to_levels_above(monkeypatch, seed):
    """Joints far from their limits that go as fast as they may are met by the projection alone."""
    rng = np.random.default_rng(seed)
    robot = osc.load_robot(("panda", "xarm7")[seed % 2])
    v = rng.choice([-1.0, 1.0], robot.nv) * robot.velocity_limit
    found = []
    for alone in (False, True):
        if alone:
            monkeypatch.setattr(bounds, "wants_more", lambda *_: False)
        for kind in (osc.Controller, ReferenceController):
            tasks = [
                osc.PositionTask(target=[0.3, 0.1, 0.4]),
                osc.PostureTask(robot.q_reference + 0.3 * v),
            ]
            limits = osc.JointLimits(joints=dict.fromkeys(robot.joint_names, (-1e3, 1e3)))
            controller = kind(robot, osc.Stack([limits, *tasks]))
            found.append(controller.step(0.0, robot.q_reference, v))
    assert Status.FILTERED in found[-1].status
    size = np.abs(found[-1].tau).max()
    for one in found[:-1]:
        np.testing.assert_allclose(one.tau, found[-1].tau, atol=1e-9 * size)
