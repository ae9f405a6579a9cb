"""The recorder of ticks, while tasks come and go."""

import numpy as np
import pytest

from opspace.controller import Controller
from opspace.errors import InputError
from opspace.record import load
from opspace.record.observer import TickRecorder
from opspace.robots import load_robot
from opspace.stack import Stack
from opspace.tasks import JointTask, OrientationTask, PositionTask, PostureTask


@pytest.fixture
def controller():
    robot = load_robot("puma560")
    return Controller(robot, Stack([PositionTask(), PostureTask()]))


def record(controller, directory, tasks, requests):
    stack = controller.stack
    recorder = TickRecorder(directory, controller, {}, tasks=tasks)
    q, v = controller.robot.q_reference, np.zeros(controller.robot.nv)
    commands = []
    for tick in range(40):
        requests.get(tick, lambda _: None)(stack)
        command = controller.step(tick * 0.01, q, v)
        recorder.observe(q, v, command)
        commands.append(command)
    recorder.close()
    return load(directory), commands


def test_tasks_that_come_and_go_are_recorded_while_they_are_there(controller, tmp_path):
    declared = [OrientationTask(), PostureTask(joints=["joint2", "joint3"], name="pair")]
    requests = {
        5: lambda stack: stack.insert(declared[0], 0, 0.1),
        10: lambda stack: stack.insert(JointTask("joint4"), 0.5, 0.1),  # declared by nobody
        15: lambda stack: stack.insert(declared[1], 7, 0.1),
        20: lambda stack: stack.remove("position", 0.1),
        22: lambda stack: stack.move("posture", 3, 0.1),
    }
    run, commands = record(controller, tmp_path, declared, requests)
    assert len(run) == 40
    for name in ("position", "orientation", "pair"):
        status = [command.tasks.get(name) for command in commands]
        assert {s is None for s in status} == {True, False}
        expected = [np.nan if s is None else s.activation for s in status]
        assert np.array_equal(run[f"tasks/{name}/activation"], expected, equal_nan=True)
        for i in range(2):
            expected = [np.nan if s is None else s.error[i] for s in status]
            assert np.array_equal(run[f"tasks/{name}/error/{i}"], expected, equal_nan=True)
    assert not any("joint4" in name for name in run.names if name.startswith("tasks/"))
    # Level 0 grew from three rows to six; the three strongest directions are there. 1 is left.
    for k in range(3):
        expected = [command.levels[0].sigma[k] for command in commands]
        assert np.array_equal(run[f"levels/0/sigma/{k}"], expected)
    assert np.isnan(run["levels/1/sigma/0"][-1])
    assert np.isfinite(run["levels/1/sigma/0"][0])


def test_names_of_columns_are_unique(controller, tmp_path):
    with pytest.raises(InputError, match="two tasks to record are named 'position'"):
        TickRecorder(tmp_path, controller, {}, tasks=[PositionTask()])
