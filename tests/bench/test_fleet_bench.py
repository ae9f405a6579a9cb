"""Fleets are timed beside a controller that is asked for the same."""

import json

import numpy as np
import pytest

import opspace as osc
from opspace.bench import FLEET_HEADS, fleet_steps
from opspace.bench.fleet_steps import KP, NEWTON, fleet_stack
from opspace.bench.newton_steps import NewtonSteps, newton_is_installed
from opspace.bench.scenes import SCENES

pytest.importorskip("warp", reason="fleets run in Warp: pip install 'opspace[gpu]'")


@pytest.mark.slow
def test_fleets_are_timed_in_turns():
    rows = fleet_steps([1, 3], ["float32"], turns=2)
    told = [dict(zip(FLEET_HEADS, row, strict=True)) for row in rows]
    who = {row["who"] for row in told}
    assert who >= {"opspace float32"}
    assert [row["robots"] for row in told if row["who"] == "opspace float32"] == ["1", "3"]
    for row in told:
        assert 1e6 / float(row["µs a robot"]) == pytest.approx(
            float(row["ticks/s"].replace(",", "")), rel=0.01
        )
        assert (row["of Newton's time"] != "") == (NEWTON in who)
    json.dumps(told)


def test_newtons_controller_moves_the_tool_alike_from_rest():
    """Nothing that it leaves out acts there; what a posture is weighed by is each one's own."""
    if not newton_is_installed():
        pytest.skip("newton is not installed")
    scene = SCENES["panda"]
    robot = scene.robot()
    Q, _ = scene.states(robot)
    Q = Q[:8] + np.random.default_rng(0).uniform(-0.2, 0.2, (8, 7))
    V, reference = np.zeros(Q.shape), Q[0]
    newton = NewtonSteps(robot, Q, V, reference, KP, "cpu")
    newton.step()
    stack = fleet_stack(robot, reference, limits=False)
    fleet = osc.Fleet(robot, stack, 8, device="cpu", singularity=None)
    difference = newton.torques() - fleet.step(0.0, Q, V).numpy()
    for q, tau in zip(Q, difference, strict=True):
        robot.update(q, np.zeros(7))
        moved = robot.jacobian(robot.frame_id(robot.tool)) @ np.linalg.solve(robot.M, tau)
        assert np.abs(moved).max() < 1e-3 * KP * 0.2
