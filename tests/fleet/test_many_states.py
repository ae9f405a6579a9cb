"""Every state of a fleet has a torque, in single precision nearly that of double; large robots, too."""

from pathlib import Path

import numpy as np
import pytest

import opspace as osc
from opspace.bench import SCENES
from opspace.fleet.layout import LANES
from opspace.fleet.program import FleetProgram
from opspace.robots import available_robots

pytest.importorskip("warp", reason="fleets run in Warp: pip install 'opspace[gpu]'")

EVIDENCE = Path(__file__).parents[2] / "docs" / "evidence"


@pytest.mark.slow
def test_singular_states_and_states_at_limits_have_a_torque(monkeypatch):
    monkeypatch.syspath_prepend(EVIDENCE)
    import fleet_states  # pyright: ignore[reportMissingImports]

    errors, gone, seen = [], [], 0
    for _, error, status, wrong in fleet_states.measured("puma560", 200_000, seed=1):
        assert wrong == 0
        errors.append(error)
        gone.append(status & int(osc.Status.LIMIT_LOST) != 0)
        seen |= int(np.bitwise_or.reduce(status))
    wanted = osc.Status.DIRECTION_OFF | osc.Status.JOINT_LIMIT | osc.Status.LIMIT_LOST
    assert wanted in osc.Status(seen)
    error, lost = np.concatenate(errors), np.concatenate(gone)
    assert np.median(error) < 1e-6
    assert np.quantile(error[~lost], 0.99) < 1e-5
    assert error.max() < 1e-3


@pytest.mark.slow
def test_robots_of_thirty_joints_do_what_their_controllers_do():
    if "talos" not in {info.name for info in available_robots() if info.installed}:
        pytest.skip("needs opspace[robots]")
    scene, count = SCENES["humanoid"], 6
    robot = scene.robot()
    rng = np.random.default_rng(2)
    Q = robot.q_reference + rng.uniform(-0.3, 0.3, (count, robot.nv))
    V = rng.uniform(-0.5, 0.5, Q.shape)

    def stack():
        return osc.Stack([list(level) for level in scene.levels()], limits=osc.JointLimits())

    fleet = osc.Fleet(robot, stack(), count, device="cpu", torque_limits="priority")
    tau = fleet.step(0.0, Q, V).numpy().copy()
    fleet.reset()
    plan = fleet._controller.plan_apart(fleet._roster.present)
    told = list(fleet), fleet.dtype, fleet.device
    fleet._program = FleetProgram(plan, *told, "cpu", ended=fleet._ended, lanes=LANES)
    np.testing.assert_array_equal(fleet.step(0.0, Q, V).numpy(), tau)  # as a card does it
    for i in range(count):
        controller = osc.Controller(scene.robot(), stack(), torque_limits="priority")
        command = controller.step(0.0, Q[i], V[i])
        part = 1e-7 if osc.Status.LIMIT_LOST in command.status else 1e-9
        np.testing.assert_allclose(
            tau[i], command.tau, rtol=0, atol=part * np.abs(command.tau).max()
        )
