"""The experiments ask of every arm what the paper asks of one."""

import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opspace.errors import InputError, MissingExtraError
from opspace.robots import load_robot
from opspace.runs import experiments
from opspace.runs.geometry import first_axis, reach
from opspace.runs.run import first_return
from opspace.scenario import to_dict
from opspace.scenario.build import build

ARMS = ("puma560", "ur5", "panda")


@functools.cache
def arm(name):
    try:
        return load_robot(name)
    except MissingExtraError as error:
        pytest.skip(str(error))


@functools.cache
def known_reach(name):
    return reach(arm(name))


def distance(robot):
    return float(np.linalg.norm(first_axis(robot).arm))


@pytest.mark.parametrize("name", ARMS)
@settings(max_examples=50)
@given(data=st.data())
def test_no_posture_reaches_farther_than_the_reach(name, data):
    robot = arm(name)
    bounds = zip(robot.q_lower, robot.q_upper, strict=True)
    q = np.array([data.draw(st.floats(low, high)) for low, high in bounds])
    robot.update(q, np.zeros(robot.nv))
    assert distance(robot) <= known_reach(name) + 1e-6


@pytest.mark.parametrize("name", ARMS)
def test_the_first_joint_turns_the_tool_about_the_axis(name):
    robot = arm(name)
    q = robot.q_reference.copy()
    robot.update(q, np.zeros(robot.nv))
    before = first_axis(robot)
    q[0] += 0.3
    robot.update(q, np.zeros(robot.nv))
    after = first_axis(robot)
    np.testing.assert_allclose(after.center, before.center, atol=1e-9)
    np.testing.assert_allclose(after.direction, before.direction, atol=1e-9)
    angle = np.arccos(before.arm @ after.arm / distance(robot) ** 2)
    assert np.isclose(angle, 0.3)


@pytest.mark.parametrize("name", ARMS)
def test_the_target_is_out_of_reach_in_every_variant(name):
    robot = arm(name)
    for scenario in experiments.singularity(name).runs.values():
        built = build(scenario)
        far = built.stack.levels[1][0].target(first_return(scenario)).x
        robot.update(robot.q_reference, np.zeros(robot.nv))
        axis = first_axis(robot)
        across = far - axis.center - (far - axis.center) @ axis.direction * axis.direction
        assert np.linalg.norm(across) >= known_reach(name) + 0.2


@pytest.mark.parametrize("name", ARMS[1:])
def test_the_swing_asks_for_the_first_joint_alone(name):
    """Where it leads, the tool is where turning that joint would put it."""
    robot = arm(name)
    scenario = experiments.joint_limit(name).runs["transition"]
    ((lower, upper),) = scenario.joint_limits.joints.values()
    swing = scenario.tasks["position"].target
    assert np.isclose(upper - lower, 1.5)
    assert swing.angle > upper - robot.q_reference[0] + 0.3
    built = build(scenario)
    q = robot.q_reference.copy()
    q[0] += swing.angle
    robot.update(q, np.zeros(robot.nv))
    built.robot.update(q, np.zeros(robot.nv))
    for level in built.stack.levels:
        error = level[0].evaluate(built.robot, first_return(scenario)).error
        np.testing.assert_allclose(error, 0.0, atol=1e-9)


@pytest.mark.parametrize("name", ["puma560", "ur5"])
def test_variants_differ_in_their_method_only(name):
    arm(name)
    for experiment in (experiments.singularity(name), experiments.joint_limit(name)):
        assert set(experiment.runs) == {"without", "switch", "transition"}
        data = [to_dict(scenario) for scenario in experiment.runs.values()]
        methods = [found.pop("method") for found in data]
        assert methods == ["none", "switch", "transition"]
        assert data[0] == data[1] == data[2]


@pytest.mark.parametrize("factor", experiments.SPEEDS)
def test_a_faster_approach_is_the_same_path_in_less_time(factor):
    base = experiments.joint_limit("puma560").runs["transition"]
    fast = experiments.fast_approaches("puma560").runs[f"x{factor:g}"]
    assert fast.joint_limits.mode == "admissible"
    assert fast.joint_limits.joints == base.joint_limits.joints
    assert np.isclose(first_return(fast), first_return(base))
    slow, quick = (build(s).stack.levels[1][0].target for s in (base, fast))
    begin = base.tasks["position"].target.start_time
    for t in np.linspace(0.0, base.tasks["position"].target.out_duration, 7):
        np.testing.assert_allclose(quick(begin + t / factor).x, slow(begin + t).x, atol=1e-12)


def test_an_arm_that_slides_first_is_refused(tmp_path):
    path = tmp_path / "slider.xml"
    path.write_text(
        """<mujoco><worldbody><body name="cart"><joint name="rail" type="slide" axis="1 0 0"/>
        <geom size="0.1"/><body pos="0.5 0 0" name="arm"><joint name="hinge" axis="0 0 1"/>
        <geom size="0.1" pos="0.3 0 0"/></body></body></worldbody></mujoco>"""
    )
    with pytest.raises(InputError, match="joint 'rail' of 'slider' is not a hinge"):
        experiments.singularity(str(path))
