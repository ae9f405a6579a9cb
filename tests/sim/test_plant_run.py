"""The plant is the robot of the file, with nothing added but what is asked for."""

import numpy as np
import pytest

from opspace.controller import Controller
from opspace.errors import InputError
from opspace.loop import StopRule, simulate
from opspace.robots import load_robot
from opspace.sim import Plant
from opspace.stack import Stack
from opspace.tasks import OrientationTask, PositionTask, PostureTask

mujoco = pytest.importorskip("mujoco")
ROBOT = load_robot("puma560")
HOME = ROBOT.configurations["home"]
BENT = np.array([0.3, 0.8, -2.6, 0.4, -0.9, 0.2])
STRONG = {"torque_limits": False}


def run(plant, seconds, tau):
    """Advance with a torque that may depend on the state."""
    for _ in range(round(seconds / plant.dt)):
        plant.advance(tau(plant.q, plant.v))
    return plant


def bias(q, v):
    ROBOT.update(q, v)
    return ROBOT.bias


def energy(plant):
    mujoco.mj_energyPos(plant.model, plant.data)
    mujoco.mj_energyVel(plant.model, plant.data)
    return plant.data.energy.sum()


def test_it_starts_where_it_was_told_and_keeps_time():
    v = np.linspace(-0.5, 0.5, 6)
    plant = Plant(ROBOT, BENT, v, dt=0.002)
    np.testing.assert_array_equal(plant.q, BENT)
    np.testing.assert_array_equal(plant.v, v)
    run(plant, 0.1, bias)
    assert np.isclose(plant.t, 0.1)


def test_its_gravity_is_that_of_the_robot():
    """What holds the arm by the robot's own model holds it in the simulator."""
    plant = run(Plant(ROBOT, BENT), 1.0, bias)
    np.testing.assert_allclose(plant.q, BENT, atol=1e-9)


def test_a_torque_causes_the_acceleration_of_the_robots_model():
    tau, v = np.array([20.0, -10.0, 15.0, 5.0, -5.0, 2.0]), np.linspace(-1.0, 1.0, 6)
    plant = Plant(ROBOT, BENT, v, dt=1e-5)
    plant.advance(tau)
    ROBOT.update(BENT, v)
    expected = np.linalg.solve(ROBOT.M, tau - ROBOT.bias)
    np.testing.assert_allclose((plant.v - v) / 1e-5, expected, rtol=1e-3, atol=1e-2)


def test_without_friction_an_arm_that_falls_keeps_its_energy():
    plant = Plant(ROBOT, BENT, dt=1e-4, **STRONG)
    before = energy(plant)
    run(plant, 0.3, lambda q, v: np.zeros(6))
    assert np.abs(plant.v).max() > 1.0
    assert abs(energy(plant) - before) < 0.02 * plant.data.energy[1]


def test_friction_is_there_when_asked_for():
    v = np.full(6, 0.5)
    free, rough = (run(Plant(ROBOT, BENT, v, friction=f), 0.3, bias) for f in (False, True))
    assert np.abs(free.v).max() > 0.3
    assert np.abs(rough.v).max() < 0.5 * np.abs(free.v).max()


def test_torque_is_saturated_at_the_limits_of_the_robot_unless_told_otherwise():
    def after_one_tick(tau, **options):
        return run(Plant(ROBOT, BENT, **options), 0.001, lambda q, v: tau).v

    limit = ROBOT.torque_limit
    np.testing.assert_array_equal(after_one_tick(10.0 * limit), after_one_tick(limit))
    assert np.abs(after_one_tick(10.0 * limit, **STRONG) - after_one_tick(limit)).max() > 0.1


def test_joint_ranges_do_not_hold_the_arm():
    """A stop would hide a controller that runs into it."""
    past = np.where(np.arange(6) == 0, ROBOT.q_upper[0] + 0.1, BENT)
    plant = run(Plant(ROBOT, past), 0.2, bias)
    np.testing.assert_allclose(plant.q, past, atol=1e-9)


@pytest.mark.parametrize("q", [HOME[:5], np.full(6, np.nan), np.append(HOME[:5], np.inf)])
def test_a_start_that_does_not_fit_is_refused(q):
    with pytest.raises(InputError, match="must be 6 finite numbers"):
        Plant(ROBOT, q)


def controlled(seconds=0.3):
    position = PositionTask()
    controller = Controller(ROBOT, Stack([OrientationTask(), position, PostureTask()]))
    ROBOT.update(HOME, np.zeros(6))
    position.target = ROBOT.position(ROBOT.frame_id("tool")) + [0.02, 0.0, 0.02]
    plant = Plant(ROBOT, HOME)
    outcome = simulate(plant, controller, seconds, stop=StopRule(20.0, 500.0))
    assert outcome.completed
    return plant


def test_a_controlled_run_repeats_bit_for_bit():
    one, two = controlled(0.1), controlled(0.1)
    assert one.q.tobytes() == two.q.tobytes()
    assert one.v.tobytes() == two.v.tobytes()


def test_the_controller_moves_the_tool_where_it_was_asked():
    ROBOT.update(HOME, np.zeros(6))
    goal = ROBOT.position(ROBOT.frame_id("tool")) + [0.02, 0.0, 0.02]
    plant = controlled(1.5)
    ROBOT.update(plant.q, plant.v)
    np.testing.assert_allclose(ROBOT.position(ROBOT.frame_id("tool")), goal, atol=1e-5)
