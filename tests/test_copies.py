"""What people send to other processes or keep for later can be copied and pickled."""

import copy
import pickle

import numpy as np
import pytest

import opspace as osc
from opspace.controller import ReferenceController
from opspace.scenario import load_scenario, scenario_from

COPIES = {"pickle": lambda x: pickle.loads(pickle.dumps(x)), "deepcopy": copy.deepcopy}


@pytest.fixture(params=COPIES)
def copied(request):
    return COPIES[request.param]


def commands():
    robot = osc.load_robot("puma560")
    for kind in (osc.Controller, ReferenceController):
        stack = osc.Stack([osc.JointLimits(), osc.PositionTask(), osc.PostureTask()])
        controller = kind(robot, stack)
        yield controller.step(0.0, robot.q_reference, np.zeros(6))
        stack.insert(osc.JointTask("joint3"), level=0.5, duration=0.1)
        q = np.array(robot.q_reference)
        q[0] = robot.q_upper[0] - 1e-3
        controller.step(0.01, q, np.zeros(6))
        yield controller.step(0.06, q, np.zeros(6))


def test_a_command_keeps_what_it_tells(copied):
    for command in commands():
        found = copied(command)
        assert repr(found) == repr(command)
        assert found.tau.tobytes() == command.tau.tobytes()
        assert found.limits == command.limits
        assert found.tasks.keys() == command.tasks.keys()
        for name, task in command.tasks.items():
            assert found.tasks[name].levels == task.levels
            assert found.tasks[name].error.tobytes() == task.error.tobytes()
        for mine, theirs in zip(found.levels, command.levels, strict=True):
            assert mine.tasks == theirs.tasks
            assert mine.directions.tobytes() == theirs.directions.tobytes()


@pytest.mark.parametrize("backend", ["pinocchio", "mujoco"])
@pytest.mark.parametrize("name", ["puma560", "ur5", "panda", "solo12"])
def test_a_robot_keeps_its_model_and_its_state(copied, name, backend):
    if not {robot.name: robot.installed for robot in osc.available_robots()}[name]:
        pytest.skip("example-robot-data is not installed")
    robot = osc.load_robot(name, backend=backend)
    v = np.linspace(-1.0, 1.0, robot.nv)
    robot.update(robot.q_reference, v)
    found = copied(robot)
    for what in ("q", "v", "M", "bias", "gravity"):
        np.testing.assert_array_equal(getattr(found, what), getattr(robot, what))
    tool = robot.frame_id(robot.tool)
    np.testing.assert_array_equal(found.jacobian(tool), robot.jacobian(tool))
    assert found.frame_names == robot.frame_names
    found.update(found.q_reference, 0.0 * v)  # each has a state of its own
    np.testing.assert_array_equal(robot.v, v)


@pytest.mark.parametrize("name", ["singularity", "showpiece", "outside-limits"])
def test_a_scenario_is_equal_and_still_knows_its_file(copied, name):
    scenario = load_scenario(name)
    found = copied(scenario)
    assert found == scenario
    assert str(found.error(("duration",), "x")) == str(scenario.error(("duration",), "x"))


def test_a_scenario_from_values_is_equal(copied):
    tasks = {"p": {"type": "pose", "level": 0}, "q": {"type": "posture", "level": 1}}
    scenario = scenario_from({"robot": "ur5", "duration": 1.0, "tasks": tasks})
    assert copied(scenario) == scenario


@pytest.mark.parametrize("options", [{}, {"dt": 0.002, "friction": True}, {"torque_limits": False}])
def test_a_plant_goes_on_by_itself(copied, options):
    robot = osc.load_robot("puma560")
    plant = osc.Plant(robot, robot.q_reference, **options)
    plant.advance(np.ones(6))
    found = copied(plant)
    for one in (plant, found):
        one.advance(np.full(6, 2.0))
    np.testing.assert_array_equal(found.q, plant.q)
    assert found.t == plant.t
