"""A target at which a direction is nearly lost is reached where there is a posture that reaches it."""

import numpy as np
import pytest

import opspace as osc
from opspace.controller import ReferenceController

TARGETS = {
    "one": ([0.4873, -0.2001, 0.5032], [0.0129, 0.9181, -0.0948, -0.3847]),
    "other": ([0.5067, -0.2474, 0.6257], [-0.1611, 0.9754, -0.0249, 0.1484]),
}


def xarm(target, option, kind=osc.Controller):
    robot = osc.load_robot("xarm7")
    position, orientation = TARGETS[target]
    tasks = [
        osc.JointLimits(),
        osc.OrientationTask(target=orientation, max_speed=1.0),
        osc.PositionTask(target=position, max_speed=0.5),
        osc.PostureTask(robot.q_reference),
    ]
    return robot, kind(robot, osc.Stack(tasks), singularity=option)


@pytest.mark.parametrize("target", TARGETS)
def test_an_arm_rests_without_an_error_beside_a_singularity(target):
    """With the same buffers at rest as in motion the posture pulls it away."""
    errors = []
    for near in (0.0, 0.3):
        robot, controller = xarm(target, osc.Singularity(near=near))
        plant = osc.Plant(robot, robot.q_reference)
        assert osc.simulate(plant, controller, 6.0).completed
        errors.append(controller.step(plant.t, plant.q, plant.v).tasks["position"].error_norm)
    assert errors[0] > 1e-2
    assert errors[1] < 1e-4


@pytest.mark.parametrize("seed", range(4))
def test_both_forms_fade_alike_near_rest(seed):
    """At a posture with a weak direction, some centimetres from the target, moving slowly."""
    rng = np.random.default_rng(seed)
    found = []
    for kind in (osc.Controller, ReferenceController):
        robot, controller = xarm("one", osc.Singularity(near=0.3), kind)
        if not found:
            q = robot.q_reference + rng.uniform(-0.5, 0.5, robot.nv)
            q[3] = np.clip(0.0, robot.q_lower[3] + 0.1, robot.q_upper[3]) + rng.uniform(0.0, 0.4)
            v = 0.02 * rng.normal(size=robot.nv)
            robot.update(q, v)
            frame = robot.frame_id(robot.tool)
            position = robot.position(frame) + 0.05 * rng.normal(size=3)
            rotation = robot.rotation(frame).copy()
        controller.stack["position"].target = position
        controller.stack["orientation"].target = rotation
        found.append(controller.step(0.0, q, v))
    compiled, readable = found
    size = 1.0 + np.max(np.abs(readable.tau))
    np.testing.assert_allclose(compiled.tau, readable.tau, atol=1e-8 * size)
    for here, there in zip(compiled.levels, readable.levels, strict=True):
        np.testing.assert_allclose(here.activation, there.activation, atol=1e-8)
        np.testing.assert_allclose(here.response, there.response, atol=1e-8)
    hand = compiled.levels[1]
    assert np.any(hand.sigma < 0.7)
    assert np.any(hand.response > osc.Singularity().buffer.response(hand.sigma[-1]))


@pytest.mark.parametrize(
    "options", [{"near": -0.1}, {"near": 0.1, "release": 1.0}, {"near": 0.1, "scale": "absolute"}]
)
def test_only_two_relative_buffers_know_rest(options):
    with pytest.raises(osc.InputError, match="near"):
        osc.Singularity(**options)
