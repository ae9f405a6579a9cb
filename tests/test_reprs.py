"""What objects say about themselves at a prompt: what a person wants to know, on a few lines."""

import numpy as np
import pytest

import opspace as osc
from opspace.controller.reference import ReferenceController

ROBOT = osc.load_robot("puma560")
Q = ROBOT.q_reference


def scene():
    hand = osc.PositionTask(target=[0.5, 0.1, 0.6], max_speed=0.5, name="hand")
    rest = osc.PostureTask(kp=25.0)
    turn = osc.OrientationTask()
    return osc.Stack([osc.JointLimits(), hand, [turn, rest]]), hand, rest


def test_a_task_tells_its_name_target_and_gains():
    _, hand, rest = scene()
    assert (
        repr(hand) == "PositionTask('hand', target=[0.5, 0.1, 0.6], kp=100, kv=20, max_speed=[0.5])"
    )
    assert repr(rest) == "PostureTask('posture', target=what it finds, kp=25, kv=10)"
    pose = osc.PoseTask(target=[0.1, 0.2, 0.3, 1, 0, 0, 0])
    assert "target=[0.1, 0.2, 0.3, 1, 0, 0, 0]" in repr(pose)
    hand.target = osc.MinimumJerk(np.zeros(3), np.ones(3), 1.0)
    assert "target=MinimumJerk" in repr(hand)


def test_a_stack_tells_levels_tasks_and_presence():
    stack, hand, _ = scene()
    assert repr(stack).splitlines()[1:] == [
        "  above all: JointLimits(mode='admissible', clearance=0, 0 sides)",
        "  level 0: hand",
        "  level 1: orientation, posture",
    ]
    controller = osc.Controller(ROBOT, stack)
    controller.step(0.0, Q, np.zeros(6))
    stack.remove(hand, duration=1.0)
    for t in (0.1, 0.6):
        controller.step(t, Q, np.zeros(6))
    assert repr(stack).startswith("Stack of 3 tasks at t = 0.6 s\n")
    assert "  level 0: hand (0.5 present)\n" in repr(stack)
    assert repr(ROBOT) in repr(controller)
    assert repr(stack) in repr(controller)


def test_a_robot_tells_its_joints_and_tool():
    joints = ", ".join(ROBOT.joint_names)
    assert f"('puma560', 6 joints: {joints}; tool {ROBOT.tool!r})" in repr(ROBOT)


@pytest.mark.parametrize("kind", [osc.Controller, ReferenceController])
def test_a_command_tells_time_status_and_torque(kind):
    command = kind(ROBOT, scene()[0]).step(0.25, Q, np.zeros(6))
    size = np.linalg.norm(command.tau)
    assert repr(command) == (
        f"Command(t=0.25 s, Status.OK, |tau|={size:.4g} N·m, tasks: hand 1, orientation 1, posture 1)"
    )


def test_a_plant_tells_its_robot_and_time():
    plant = osc.Plant(ROBOT, Q, dt=0.002)
    plant.advance(np.zeros(6))
    assert repr(plant).startswith("Plant('puma560', t=0.002 s, dt=0.002 s, fastest joint ")


def test_nothing_says_more_than_a_few_lines():
    stack, hand, _ = scene()
    controller = osc.Controller(ROBOT, stack)
    command = controller.step(0.0, Q, np.zeros(6))
    for thing in (stack, hand, controller, command, ROBOT, osc.JointLimits()):
        text = repr(thing)
        assert text.count("\n") <= 6
        assert max(map(len, text.splitlines())) <= 160


def test_a_stack_is_asked_by_name():
    stack, hand, rest = scene()
    assert stack["hand"] is hand
    assert stack["posture"] is rest
    assert (len(stack), [task.name for task in stack]) == (3, ["hand", "orientation", "posture"])
    assert "hand" in stack
    assert hand in stack
    assert "foot" not in stack
    assert osc.PositionTask(name="hand") not in stack
    with pytest.raises(osc.UnknownNameError, match="'hnad'; did you mean 'hand'") as caught:
        stack["hnad"]
    assert caught.value.choices == ("hand", "orientation", "posture")
